"""The motion program of a device: keyframes → pose and velocity at any time."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from simcore.compiled import compiled, inlined
from simcore.config.motion import MotionProgram


@dataclass(frozen=True, eq=False)
class DeviceState:
    """Pose and velocity of a rigid device or of a spreader bar.

    Attributes
    ----------
    rotation : (3, 3) float64
        Device frame to world.
    position : (3,) float64
        Device origin in the world [m].
    linear_velocity : (3,) float64
        Of the device origin, world axes [m/s].
    angular_velocity : (3,) float64
        World axes [rad/s].
    """

    rotation: np.ndarray
    position: np.ndarray
    linear_velocity: np.ndarray
    angular_velocity: np.ndarray


STILL = DeviceState(np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
"""Of what stands still in the world frame."""


class Motion:
    """A translation and a rotation interpolated between keyframes.

    Monotone cubic Hermite interpolation (Fritsch & Carlson 1980): continuous in velocity, at rest
    in the first and the last keyframe and wherever a coordinate turns round, never beyond a
    keyframe's value.

    Parameters
    ----------
    program : MotionProgram
    support_angle : float
        Inclination of the device about its lateral axis, front edge up [rad].
    """

    def __init__(self, program: MotionProgram, support_angle: float):
        times = np.array([frame.time_s for frame in program.keyframes])
        values = np.array(
            [[frame.translation_m, np.radians(frame.rotation_deg)] for frame in program.keyframes]
        )
        # A still keyframe a second before and after makes the program start and end at rest.
        padded = np.concatenate([[times[0] - 1], times, [times[-1] + 1]])
        spline = PchipInterpolator(padded, np.concatenate([values[:1], values, values[-1:]]))
        rotation_axis = _unit(program.rotation_axis)
        # Rodrigues: 1 + sin α K + (1 − cos α) K², with K x = axis × x.
        cross = np.cross(np.eye(3), rotation_axis)
        powers = np.eye(3), cross, cross @ cross
        inclination = Rotation.from_rotvec([0, -support_angle, 0]).as_matrix()
        pivot = inclination @ np.array(program.rotation_point_m)
        self._program = (
            spline.x,
            np.ascontiguousarray(np.moveaxis(spline.c, 0, -1)),  # piece, coordinate, power
            _unit(program.translation_axis),
            rotation_axis,
            np.array([power @ inclination for power in powers]),
            np.array([power @ pivot for power in powers]),
        )
        self._last: tuple[float, DeviceState] | None = None
        self.keyframe_times = tuple(times.tolist())
        self.duration = self.keyframe_times[-1]

    def __call__(self, time: float) -> DeviceState:
        """Return the state at a time [s] after settling; still before 0 and after the end."""
        time = min(max(time, 0.0), self.duration)
        if self._last is None or self._last[0] != time:  # Runge–Kutta asks twice in a row
            self._last = time, DeviceState(*_state(time, *self._program))
        return self._last[1]


@compiled
def _state(time, breaks, coefficients, translation_axis, rotation_axis, rotations, pivots):
    """Return what `DeviceState` holds, of the motion at a time [s].

    `rotations` (3, 3, 3) and `pivots` (3, 3) are inclination and turning point multiplied by
    1, K and K² of Rodrigues' formula.
    """
    piece = 0
    while piece < len(coefficients) - 1 and breaks[piece + 1] <= time:
        piece += 1
    elapsed = time - breaks[piece]
    translation, translation_rate = _horner(coefficients[piece, 0], elapsed)
    angle, angle_rate = _horner(coefficients[piece, 1], elapsed)
    sine, versine = np.sin(angle), 1 - np.cos(angle)
    position, rate, rotation, turn = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty(3)
    for a in range(3):
        # Of the turning point, were it not held; and of that, what turning does to it.
        moved = sine * pivots[1, a] + versine * pivots[2, a]
        position[a] = translation * translation_axis[a] - moved
        turned = np.cos(angle) * pivots[1, a] + sine * pivots[2, a]
        rate[a] = translation_rate * translation_axis[a] - angle_rate * turned
        turn[a] = angle_rate * rotation_axis[a]
        for b in range(3):
            linear = rotations[0, a, b] + sine * rotations[1, a, b]
            rotation[a, b] = linear + versine * rotations[2, a, b]
    return rotation, position, rate, turn


@inlined
def _horner(cubic, x):
    """Return a cubic and its derivative at x; highest power first."""
    a, b, c, d = cubic[0], cubic[1], cubic[2], cubic[3]
    return ((a * x + b) * x + c) * x + d, (3 * a * x + 2 * b) * x + c


def _unit(axis: tuple[float, float, float]) -> np.ndarray:
    return np.array(axis) / np.linalg.norm(axis)
