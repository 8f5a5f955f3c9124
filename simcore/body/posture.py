"""Anatomical joint angles and configurations q.

Angles follow the joint coordinate system of Grood and Suntay (1983), J. Biomech. Eng. 105, 136: the
first about an axis of the parent segment, the second about the floating axis, the third about an
axis of the child.  Left and right are mirrored: equal angles are a symmetric posture.  All angles
are zero at anatomical zero (`simcore.body.skeleton`).

A joint of three angles is singular where its second angle is ±90°.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from simcore.body.build import Body
from simcore.body.segments import SEGMENTS, kind_of
from simcore.errors import DesignError

SIDES = ("left", "right")
X, Y, Z = 0, 1, 2


@dataclass(frozen=True)
class Turn:
    """One angle: its name, its axis (x forward, y left, z up) and its sign on the left side.

    `mirrored` angles change sign on the right side.
    """

    name: str
    axis: int
    sign: float
    mirrored: bool = True


# Positive senses: flexion bends forward (knee: backward, wrist: palmwards), abduction leads away
# from the midline, rotation of a limb is internal, trunk bending and rotation are to the left.
TRUNK_TURNS = (
    Turn("flexion", Y, 1.0, False), Turn("lateral_bend", X, -1.0, False),
    Turn("rotation", Z, 1.0, False),
)
LIMB_TURNS = (
    Turn("flexion", Y, -1.0, False), Turn("abduction", X, 1.0), Turn("rotation", Z, -1.0),
)
TURNS = {
    "lumbar": TRUNK_TURNS,
    "thoracic": TRUNK_TURNS,
    "neck": (Turn("flexion", Y, 1.0, False),),
    "hip": LIMB_TURNS,
    "knee": (Turn("flexion", Y, 1.0, False),),
    "ankle": (
        Turn("dorsiflexion", Y, -1.0, False), Turn("inversion", X, -1.0),
        Turn("rotation", Z, -1.0),
    ),
    "toe": (Turn("extension", Y, -1.0, False),),
    "shoulder": LIMB_TURNS,
    "elbow": (
        Turn("flexion", Y, -1.0, False), Turn("abduction", X, 1.0), Turn("pronation", Z, -1.0),
    ),
    # Palms face the thighs at zero, so the hand flexes about x and deviates about y.
    "wrist": (
        Turn("flexion", X, -1.0), Turn("deviation", Y, 1.0, False), Turn("pronation", Z, -1.0),
    ),
}
JOINTS = tuple(segment.anatomy for segment in SEGMENTS if segment.parent is not None)


def configuration(body: Body, angles: dict[str, dict[str, float]]) -> np.ndarray:
    """q (60,) of joint angles [rad]; joints and angles not named are zero, the root is at zero.

    Parameters
    ----------
    body : Body
    angles : dict
        By joint, `hip_left: {flexion: 1.2}`; a paired joint without its side means both sides.

    Raises
    ------
    DesignError
        If a joint or an angle has no such name, or a joint is named twice.
    """
    q = pin.neutral(body.model)
    for joint, named in _by_joint(angles).items():
        turns = TURNS[kind_of(joint)]
        unknown = set(named) - {turn.name for turn in turns}
        if unknown:
            accepted = ", ".join(turn.name for turn in turns)
            raise DesignError(
                f"{joint}: unknown angle {sorted(unknown)[0]!r}; accepted: {accepted}"
            )
        start = _start(body, joint)
        if len(turns) == 1:
            q[start] = named.get(turns[0].name, 0.0)
            continue
        rotation = np.eye(3)
        for turn in turns:
            angle = _sign(turn, joint) * named.get(turn.name, 0.0)
            rotation = rotation @ pin.utils.rotate("xyz"[turn.axis], angle)
        q[start : start + 4] = pin.Quaternion(rotation).coeffs()
    return q


def joint_angles(body: Body, q: np.ndarray) -> dict[str, dict[str, float]]:
    """Joint angles [rad] of a configuration, by joint with its side; inverse of `configuration`."""
    angles = {}
    for joint in JOINTS:
        turns, start = TURNS[kind_of(joint)], _start(body, joint)
        if len(turns) == 1:
            angles[joint] = {turns[0].name: float(q[start])}
            continue
        rotation = pin.Quaternion(q[start : start + 4]).toRotationMatrix()
        values = _three_angles(rotation, *(turn.axis for turn in turns))
        angles[joint] = {
            turn.name: _sign(turn, joint) * float(value)
            for turn, value in zip(turns, values, strict=True)
        }
    return angles


def _three_angles(rotation: np.ndarray, i: int, j: int, k: int) -> tuple[float, float, float]:
    """Angles (a, b, c) [rad] with rotation = R_i(a) R_j(b) R_k(c), for three different axes."""
    parity = 1.0 if (j - i) % 3 == 1 else -1.0
    first = np.arctan2(-parity * rotation[j, k], rotation[k, k])
    second = np.arcsin(np.clip(parity * rotation[i, k], -1.0, 1.0))
    third = np.arctan2(-parity * rotation[i, j], rotation[i, i])
    return first, second, third


def _by_joint(angles: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
    """The same with every paired joint written with its side."""
    sided = {}
    for name, named in angles.items():
        joints = [name] if name in JOINTS else [f"{name}_{side}" for side in SIDES]
        for joint in joints:
            if joint not in JOINTS:
                accepted = ", ".join((*TURNS, "and the paired ones with _left or _right"))
                raise DesignError(f"unknown joint {name!r}; accepted: {accepted}")
            if joint in sided:
                raise DesignError(f"{joint}: given twice, once without its side")
            sided[joint] = named
    return sided


def _sign(turn: Turn, joint: str) -> float:
    return -turn.sign if turn.mirrored and joint.endswith("_right") else turn.sign


def _start(body: Body, joint: str) -> int:
    segment = next(segment for segment in SEGMENTS if segment.anatomy == joint)
    return body.model.joints[body.model.getJointId(segment.name)].idx_q
