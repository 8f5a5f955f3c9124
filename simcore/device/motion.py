"""The motion program of a device: keyframes → pose and velocity at any time."""

from bisect import bisect_right
from dataclasses import dataclass
from math import cos, sin

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

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
        self._breaks = spline.x.tolist()
        self._coefficients = np.moveaxis(spline.c, 0, -1).tolist()  # piece, coordinate, power
        self._translation_axis = _unit(program.translation_axis)
        self._rotation_axis = _unit(program.rotation_axis)
        # Rodrigues: 1 + sin α K + (1 − cos α) K², with K x = axis × x.
        self._cross = np.cross(np.eye(3), self._rotation_axis)
        square = self._cross @ self._cross
        inclination = Rotation.from_rotvec([0, -support_angle, 0]).as_matrix()
        pivot = inclination @ np.array(program.rotation_point_m)
        self._rotation = inclination, self._cross @ inclination, square @ inclination
        self._pivot = pivot, self._cross @ pivot, square @ pivot
        self._last: tuple[float, DeviceState] | None = None
        self.keyframe_times = tuple(times.tolist())
        self.duration = self.keyframe_times[-1]

    def __call__(self, time: float) -> DeviceState:
        """Return the state at a time [s] after settling; still before 0 and after the end."""
        time = min(max(time, 0.0), self.duration)
        if self._last is None or self._last[0] != time:  # Runge–Kutta asks twice in a row
            self._last = time, self._state(time)
        return self._last[1]

    def _state(self, time: float) -> DeviceState:
        piece = min(bisect_right(self._breaks, time) - 1, len(self._coefficients) - 1)
        elapsed = time - self._breaks[piece]
        (translation, translation_rate), (angle, angle_rate) = (
            _horner(cubic, elapsed) for cubic in self._coefficients[piece]
        )
        sine, versine = sin(angle), 1 - cos(angle)
        start, first, second = self._rotation
        pivot, across, back = self._pivot
        moved = sine * across + versine * back  # of the pivot, were it not held
        return DeviceState(
            rotation=start + sine * first + versine * second,
            position=translation * self._translation_axis - moved,
            linear_velocity=translation_rate * self._translation_axis
            - angle_rate * (self._cross @ (pivot + moved)),
            angular_velocity=angle_rate * self._rotation_axis,
        )


def _horner(cubic: list[float], x: float) -> tuple[float, float]:
    """Return a cubic and its derivative at x; highest power first."""
    a, b, c, d = cubic
    return ((a * x + b) * x + c) * x + d, (3 * a * x + 2 * b) * x + c


def _unit(axis: tuple[float, float, float]) -> np.ndarray:
    return np.array(axis) / np.linalg.norm(axis)
