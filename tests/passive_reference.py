"""Passive joints the slow way: rotations by scipy, moments as printed, differences for rates."""

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from simcore.body import configuration
from simcore.body.posture import TURNS
from simcore.body.segments import SEGMENTS, kind_of
from simcore.dynamics.joint_angles import CONE_AXIS, joint_ranges
from simcore.dynamics.passive_moments import LARGEST, limit_of
from simcore.validation.joints import riener_moments

SEGMENT_OF = {segment.anatomy: segment for segment in SEGMENTS}
DOWN = np.array([0.0, 0.0, -1.0])


def pose(body, degrees):
    return configuration(
        body, {joint: {name: np.radians(value) for name, value in named.items()}
               for joint, named in degrees.items()},
    )


def dofs(body, joint):
    found = body.model.joints[body.model.getJointId(SEGMENT_OF[joint].name)]
    return slice(found.idx_q, found.idx_q + found.nq), slice(found.idx_v, found.idx_v + found.nv)


def shortest_turn(start, end):
    """Least rotation of one unit vector into another."""
    axis = np.cross(start, end)
    size = np.linalg.norm(axis)
    if size < 1e-12:
        return Rotation.identity()
    return Rotation.from_rotvec(axis / size * np.arctan2(size, start @ end))


def slow_angles(body, q):
    """All angles [rad], by joint and angle."""
    angles = {}
    for joint, segment in SEGMENT_OF.items():
        if segment.parent is None:
            continue
        at, kind, right = dofs(body, joint)[0], kind_of(joint), joint.endswith("_right")
        if segment.joint != "spherical":
            angles[joint, TURNS[kind][0].name] = q[at][0]
            continue
        turn = Rotation.from_quat(q[at])
        if kind == "shoulder":
            axis = CONE_AXIS * (1, -1 if right else 1, 1)
            arm = turn.apply(DOWN)
            untwisted = shortest_turn(axis, arm) * shortest_turn(DOWN, axis)
            twist = (untwisted.inv() * turn).as_rotvec()[2]
            angles[joint, "reach"] = np.arccos(np.clip(axis @ arm, -1, 1))
            angles[joint, "rotation"] = twist if right else -twist
            continue
        values = turn.as_euler("".join("XYZ"[each.axis] for each in TURNS[kind]))
        for each, value in zip(TURNS[kind], values, strict=True):
            sign = -each.sign if each.mirrored and right else each.sign
            angles[joint, each.name] = sign * value
    return angles


def slow_exponential(x):
    return np.where(x < np.log(LARGEST), np.exp(np.minimum(x, 50)),
                    LARGEST * (1 + x - np.log(LARGEST)))


def slow_moments(angles):
    """Moment of each angle [N·m], by joint and angle."""
    moments = {}
    for (joint, angle), value in angles.items():
        low, low_rate, low_at, high, high_rate, high_at = limit_of(kind_of(joint), angle)
        moments[joint, angle] = -slow_exponential(np.log(high) + high_rate * (value - high_at))
        if low > 0:
            moments[joint, angle] += slow_exponential(np.log(low) - low_rate * (value - low_at))
    for side in ("left", "right"):
        leg = (f"hip_{side}", "flexion"), (f"knee_{side}", "flexion")
        ankle = (f"ankle_{side}", "dorsiflexion")
        hip, knee, plantar = riener_moments(
            *(np.degrees(angles[each]) for each in leg), -np.degrees(angles[ankle]),
            exp=slow_exponential,
        )
        moments[leg[0]] += hip
        moments[leg[1]] += knee
        moments[ankle] -= plantar
    return moments


def slow_torque(body, q, step=1e-6):
    """Each angle's moment times how the angle answers to each velocity, by central differences."""
    moments = slow_moments(slow_angles(body, q))
    torque = np.zeros(47)
    for i, way in enumerate(np.eye(47)):
        ahead, behind = (slow_angles(body, pin.integrate(body.model, q, sign * step * way))
                         for sign in (1, -1))
        torque[i] = sum(
            moments[each] * (ahead[each] - behind[each]) / (2 * step) for each in moments
        )
    return torque


def any_pose(body, seed, beyond=10.0):
    """A pose up to `beyond` [deg] outside the ranges of all its joints."""
    rng, ranges, angles = np.random.default_rng(seed), joint_ranges(), {}
    for joint in SEGMENT_OF:
        kind = kind_of(joint)
        if kind in ("root", "shoulder"):
            continue
        angles[joint] = {
            turn.name: rng.uniform(np.degrees(ranges[kind, turn.name].low) - beyond,
                                   np.degrees(ranges[kind, turn.name].high) + beyond)
            for turn in TURNS[kind]
        }
    q = pose(body, angles)
    q[:3], q[3:7] = rng.normal(size=3), Rotation.random(random_state=rng).as_quat()
    for side, sign in (("left", 1), ("right", -1)):
        axis = CONE_AXIS * (1, sign, 1)
        across = np.cross(axis, rng.normal(size=3))
        swing = Rotation.from_rotvec(across / np.linalg.norm(across) * rng.uniform(0.1, 2.0))
        twist = Rotation.from_rotvec([0, 0, rng.uniform(-1.8, 1.8)])
        arm = swing * shortest_turn(DOWN, axis) * twist
        q[dofs(body, f"shoulder_{side}")[0]] = arm.as_quat()
    return q


def wild_pose(body, seed):
    """Any pose of a state gone wrong: nothing is respected."""
    rng = np.random.default_rng(seed)
    q = pin.neutral(body.model)
    for segment in SEGMENTS[1:]:
        at = dofs(body, segment.anatomy)[0]
        if segment.joint == "spherical":
            q[at] = Rotation.random(random_state=rng).as_quat()
        else:
            q[at] = rng.uniform(-20, 20)
    return q
