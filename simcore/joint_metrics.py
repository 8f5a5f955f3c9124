"""Trajectory → figures of joints, and of the program that moves them; called by `metrics`."""

import numpy as np

from simcore.body.segments import SEGMENTS
from simcore.joint_torque import JointTorque
from simcore.recorder import Trajectory
from simcore.scene import Scene

INSTANTS = 1000
"""Of a motion program, evenly spaced: between two keyframes at rest, the greatest speed is missed
by 1 part in 10⁶."""


def neck_moment(scene: Scene, trajectory: Trajectory, frames: np.ndarray) -> float:
    """Return the greatest torque of the neck's joint in frames (T,) bool [N·m].

    Of posture control and passive structures. The model's neck bends forward and backward alone:
    what it bears sideways and in torsion is not in it.
    """
    model, joints = scene.body.model, JointTorque(scene)
    neck = model.joints[model.getJointId("head")]
    stiffness = np.zeros((model.nv, model.nv))  # not used
    return max(
        abs(float(joints.torque(q, v, stiffness)[neck.idx_v]))
        for q, v in zip(trajectory.q[frames], trajectory.v[frames], strict=True)
    )


def joint_range_margin(scene: Scene, trajectory: Trajectory, frames: np.ndarray) -> np.ndarray:
    """Return the least margin of each joint's angles in frames (T,) bool: (17,).

    1 in the middle of the range, 0 at either end, negative beyond. NaN where the method gives the
    joints no ranges.
    """
    passive = JointTorque(scene).passive
    if passive is None:
        return np.full(len(SEGMENTS) - 1, np.nan)
    # A reach is the distance from the middle of a cone, and never negative: 0 is no end.
    low = np.where([angle == "reach" for _, angle in passive.names], -passive.high, passive.low)
    middle, half = (passive.high + low) / 2, (passive.high - low) / 2
    angles = np.array([passive.angles(q) for q in trajectory.q[frames]])
    margin = (1 - np.abs(angles - middle) / half).min(axis=0)
    joints = np.array([joint for joint, _ in passive.names])
    return np.array([margin[joints == segment.anatomy].min() for segment in SEGMENTS[1:]])


def lifting_speed(scene: Scene) -> float:
    """Return the greatest upward speed of what the program moves, under its load [m/s].

    Of the point of the support, or of the spreader bar, that coincides with the hips at the start:
    a program that tilts lifts other points faster or slower. The body counts as the load of the
    whole program.
    """
    start = scene.motion(0.0)
    load = start.rotation.T @ (scene.configuration[:3] - start.position)
    states = [scene.motion(time) for time in np.linspace(0, scene.motion.duration, INSTANTS)]
    turn = np.array([each.angular_velocity for each in states])
    arm = np.array([each.rotation for each in states]) @ load
    lift = np.array([each.linear_velocity[2] for each in states])
    return float((lift + turn[:, 0] * arm[:, 1] - turn[:, 1] * arm[:, 0]).max())
