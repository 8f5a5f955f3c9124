"""Anatomical angles of the joints' configuration, their rates, and the ranges they have.

Names and signs are those of postures (`simcore.body.posture`), angles by Grood and Suntay (1983).
That coordinate system is singular where its second angle is ±90°, which is within the range of a
shoulder: a shoulder is told by two other angles (Eq. J4), which are singular nowhere near it.
"""

import csv
from dataclasses import dataclass
from functools import cache
from math import radians
from pathlib import Path

import numpy as np
import pinocchio as pin
from numba import njit

from simcore.compiled import compiled

TABLE = Path(__file__).with_name("joint_ranges.csv")

X, Y, Z = 0, 1, 2
HINGE, THREE_TURNS, CONE = 0, 1, 2  # how a joint is told

# Joint of the segment that it carries; then of each angle its axis, its sign on the left side,
# and whether that sign changes on the right side.
JOINT_OF_SEGMENT = {
    "lumbar": "lumbar", "thoracic": "thoracic", "head": "neck", "thigh": "hip", "shank": "knee",
    "foot": "ankle", "toe": "toe", "upper_arm": "shoulder", "forearm": "elbow", "hand": "wrist",
}
TRUNK_ANGLES = (
    ("flexion", Y, 1.0, False), ("lateral_bend", X, -1.0, False), ("rotation", Z, 1.0, False),
)
ANGLES = {
    "lumbar": TRUNK_ANGLES,
    "thoracic": TRUNK_ANGLES,
    "neck": (("flexion", Y, 1.0, False),),
    "hip": (("flexion", Y, -1.0, False), ("abduction", X, 1.0, True), ("rotation", Z, -1.0, True)),
    "knee": (("flexion", Y, 1.0, False),),
    "ankle": (
        ("dorsiflexion", Y, -1.0, False), ("inversion", X, -1.0, True), ("rotation", Z, -1.0, True),
    ),
    "toe": (("extension", Y, -1.0, False),),
    "shoulder": (("reach", Y, 1.0, False), ("rotation", Z, -1.0, True)),
    "elbow": (
        ("flexion", Y, -1.0, False), ("abduction", X, 1.0, True), ("pronation", Z, -1.0, True),
    ),
    "wrist": (
        ("flexion", X, -1.0, True), ("deviation", Y, 1.0, False), ("pronation", Z, -1.0, True),
    ),
}

# ASSUME: the arm's directions fill a cone about one that points forward and outward alike and 30°
# down. With the half-angle of joint_ranges.csv it takes in 164° of flexion and of abduction and
# 62° of extension; straight up is 12° outside.
CONE_AXIS = np.array([np.sqrt(3 / 8), np.sqrt(3 / 8), -0.5])  # of the left arm, in the trunk

# Where the cosine of the second angle, or of half the reach, falls below the first, the angles
# either side of it begin to lose their meaning (60° and 120°), and below the second they have none.
FADE_BEGINS, FADE_ENDS = 0.5, 0.17
TINY = 1e-9


@dataclass(frozen=True)
class JointRange:
    """Range of one angle [rad], where it is from, and how surely.

    `confidence` is R read, M from memory and unverified, or A assumed.
    """

    low: float
    high: float
    source: str
    confidence: str


@cache
def joint_ranges() -> dict[tuple[str, str], JointRange]:
    """Ranges of all angles, by joint (without its side) and angle."""
    with TABLE.open(encoding="ascii", newline="") as file:
        return {
            (row["joint"], row["angle"]): JointRange(
                radians(float(row["low_deg"])), radians(float(row["high_deg"])),
                row["source"], row["confidence"],
            )
            for row in csv.DictReader(file)
        }


def without_side(name: str) -> str:
    """Name of a joint or segment without its side."""
    return name.removesuffix("_left").removesuffix("_right")


@dataclass(frozen=True, eq=False)
class AngleLayout:
    """Where in q and v the angles of a model are, as `measure_angles` reads it.

    Attributes
    ----------
    names : tuple of (joint, angle)
        Of all n angles, joints with their side.
    joints : (j, 7) int64
        Kind, first index in q, in v and among the angles, and three axes.
    cones : (j, 4) float64
        Unit quaternion (x, y, z, w) that turns a hanging arm into the axis of its cone.
    signs : (n,) float64
    centres : (n,) float64
        Middle of the range [rad]: but for hinges, angles are told within π of it.
    """

    names: tuple[tuple[str, str], ...]
    joints: np.ndarray
    cones: np.ndarray
    signs: np.ndarray
    centres: np.ndarray


def lay_out_angles(model: pin.Model) -> AngleLayout:
    """Find all angles of a model whose joints are named as the segments they carry."""
    names, joints, cones, signs = [], [], [], []
    for segment, joint in zip(model.names, model.joints, strict=True):
        kind = without_side(segment)
        if kind not in JOINT_OF_SEGMENT:  # universe and root
            continue
        anatomy, right = JOINT_OF_SEGMENT[kind], segment.endswith("_right")
        turns = ANGLES[anatomy]
        told = {1: HINGE, 2: CONE, 3: THREE_TURNS}[len(turns)]
        axes = [turn[1] for turn in turns] + [0] * (3 - len(turns))
        joints.append([told, joint.idx_q, joint.idx_v, len(names), *axes])
        cones.append(_hanging_to_cone(right) if told == CONE else np.zeros(4))
        for name, _, sign, mirrored in turns:
            names.append((anatomy + segment.removeprefix(kind), name))
            # q of a hinge is the angle itself
            signs.append(1.0 if told == HINGE else -sign if mirrored and right else sign)
    ranges = [joint_ranges()[without_side(joint), angle] for joint, angle in names]
    return AngleLayout(
        names=tuple(names), joints=np.array(joints), cones=np.array(cones),
        signs=np.array(signs), centres=np.array([(each.low + each.high) / 2 for each in ranges]),
    )


@compiled
def measure_angles(q, joints, cones, signs, centres, angles, rows, fades):
    """Tell all anatomical angles and what their rates are made of (Eqs. J3, J4).

    Parameters
    ----------
    q : (nq,) float64
    joints, cones, signs, centres
        As in `AngleLayout`.
    angles : (n,) float64
        Written: angles [rad].
    rows : (n, 3) float64
        Written: E, with θ̇ = E v of the joint's own one or three velocities.
    fades : (n,) float64
        Written: 1, and smoothly down to 0 where an angle loses its meaning.
    """
    for j in range(joints.shape[0]):
        kind, at, first = joints[j, 0], joints[j, 1], joints[j, 3]
        if kind == HINGE:
            angles[first] = signs[first] * q[at]
            rows[first, 0] = signs[first]
            fades[first] = 1.0
            continue
        if kind == THREE_TURNS:
            _three_turns(q, at, joints, j, signs, angles, rows, fades)
        else:
            _cone(q, at, cones, j, first, signs, angles, rows, fades)
        for n in range(first, first + 3 if kind == THREE_TURNS else first + 2):
            angles[n] -= 2 * np.pi * np.floor((angles[n] - centres[n]) / (2 * np.pi) + 0.5)


@compiled
def _three_turns(q, at, joints, j, signs, angles, rows, fades):
    """Eq. J3: R = R_i(a) R_j(b) R_k(c), with e_i fixed in the parent and e_k in the child."""
    x, y, z, w = q[at], q[at + 1], q[at + 2], q[at + 3]
    r = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    first, i, m, k = joints[j, 3], joints[j, 4], joints[j, 5], joints[j, 6]
    parity = 1.0 if (m - i) % 3 == 1 else -1.0
    sine, cosine = parity * r[i][k], np.sqrt(r[i][i] ** 2 + r[i][m] ** 2)
    angles[first] = signs[first] * np.arctan2(-parity * r[m][k], r[k][k])
    angles[first + 1] = signs[first + 1] * np.arctan2(sine, cosine)
    angles[first + 2] = signs[first + 2] * np.arctan2(-parity * r[i][m], r[i][i])
    # In the child's axes u is the part of the parent's e_i across e_k, and the floating axis is
    # normal to both. On the singularity any u will do: its angles have faded.
    scale = 1.0 / max(cosine, TINY)
    u_i, u_m = (r[i][i] * scale, r[i][m] * scale) if cosine > TINY else (1.0, 0.0)
    for n in range(first, first + 3):
        for axis in range(3):
            rows[n, axis] = 0.0
    rows[first, i] = signs[first] * u_i * scale
    rows[first, m] = signs[first] * u_m * scale
    rows[first + 1, i] = -signs[first + 1] * u_m
    rows[first + 1, m] = signs[first + 1] * u_i
    rows[first + 2, i] = -signs[first + 2] * parity * sine * scale * u_i
    rows[first + 2, m] = -signs[first + 2] * parity * sine * scale * u_m
    rows[first + 2, k] = signs[first + 2]
    fades[first] = _fade(cosine)
    fades[first + 1] = 1.0
    fades[first + 2] = fades[first]


@compiled
def _cone(q, at, cones, j, first, signs, angles, rows, fades):
    """Eq. J4: swing away from the axis of the cone, and twist about the bone."""
    a, b, c, d = -cones[j, 0], -cones[j, 1], -cones[j, 2], cones[j, 3]
    x, y, z, w = q[at], q[at + 1], q[at + 2], q[at + 3]
    x, y, z, w = (
        d * x + a * w + b * z - c * y,
        d * y + b * w + c * x - a * z,
        d * z + c * w + a * y - b * x,
        d * w - a * x - b * y - c * z,
    )
    sine, cosine = np.sqrt(x * x + y * y), np.sqrt(z * z + w * w)  # of half the reach
    angles[first] = 2 * np.arctan2(sine, cosine)
    angles[first + 1] = signs[first + 1] * 2 * np.arctan2(z, w)
    product = sine * cosine  # zero on the axis of the cone and opposite, where any way is outward
    outward = product > TINY
    rows[first, 0] = (w * x + y * z) / product if outward else 1.0
    rows[first, 1] = (w * y - x * z) / product if outward else 0.0
    rows[first, 2] = 0.0
    twist = signs[first + 1] / max(cosine * cosine, TINY)
    rows[first + 1, 0] = (x * z - w * y) * twist
    rows[first + 1, 1] = (w * x + y * z) * twist
    rows[first + 1, 2] = signs[first + 1]
    fades[first] = 1.0
    fades[first + 1] = _fade(cosine)


@njit(inline="always")
def _fade(cosine):
    share = min(max((cosine - FADE_ENDS) / (FADE_BEGINS - FADE_ENDS), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def _hanging_to_cone(right: bool) -> np.ndarray:
    """Shortest turn (quaternion x, y, z, w) from a hanging arm to the axis of its cone."""
    axis = CONE_AXIS * (1.0, -1.0 if right else 1.0, 1.0)
    down = np.array([0.0, 0.0, -1.0])
    turn = np.append(np.cross(down, axis), 1.0 + down @ axis)
    return turn / np.linalg.norm(turn)
