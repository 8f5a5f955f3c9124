"""Pinocchio's per-joint results as numpy arrays that share its memory.

Reading `data.oMi` joint by joint costs more than computing it (docs/performance.md).
"""

import ctypes
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.lib.stride_tricks import as_strided

_SE3_DOUBLES = 12  # rotation by columns, then translation
_MOTION_DOUBLES = 6  # linear, angular


@dataclass(frozen=True, eq=False)
class SegmentViews:
    """What Pinocchio last computed, for the m moving joints; never written to.

    Attributes
    ----------
    rotations : (m, 3, 3), positions : (m, 3)
        Segment frames in the world, after forward kinematics [m].
    velocities : (m, 6)
        Linear and angular velocity in the segment's own axes [m/s, rad/s].
    jacobian : (6, nv)
        Joint motions in world axes about the world origin, after `computeJointJacobians`.
    """

    rotations: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    jacobian: np.ndarray
    _data: pin.Data  # keeps the memory alive


def view_segments(model: pin.Model, data: pin.Data) -> SegmentViews:
    """Return views of `data` without the universe joint."""
    count = model.njoints
    placements = _share(data.oMi[0].rotation, count, _SE3_DOUBLES)[1:]
    velocities = _share(data.v[0].linear, count, _MOTION_DOUBLES)[1:]
    stride = placements.strides[0]
    views = SegmentViews(
        rotations=as_strided(placements, (count - 1, 3, 3), (stride, 8, 24), writeable=False),
        positions=placements[:, 9:],
        velocities=velocities,
        jacobian=data.J,
        _data=data,
    )
    for view in (views.positions, views.velocities, views.jacobian):
        view.flags.writeable = False
    # The layout above is Pinocchio's, not its contract.
    v = np.linspace(-1, 1, model.nv)
    pin.forwardKinematics(model, data, pin.integrate(model, pin.neutral(model), v), v)
    last = count - 1
    if not (
        np.array_equal(views.rotations[-1], data.oMi[last].rotation)
        and np.array_equal(views.positions[-1], data.oMi[last].translation)
        and np.array_equal(views.velocities[-1], data.v[last].vector)
    ):
        raise RuntimeError("this version of Pinocchio lays its joint results out otherwise")
    return views


def _share(first: np.ndarray, count: int, doubles: int) -> np.ndarray:
    address = first.__array_interface__["data"][0]
    buffer = (ctypes.c_double * (count * doubles)).from_address(address)
    return np.frombuffer(buffer).reshape(count, doubles)
