"""What a simulation leaves behind: frames at the recording rate, and what happened between them."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numba import njit

from simcore.device.motion import DeviceState
from simcore.interaction import Interaction
from simcore.scene import Scene

FALL_DISPLACEMENT = 0.15
"""A body whose centre of mass has moved this far from its place on the device has fallen [m].

# ASSUME: half the depth of a seated trunk; a body that is held settles within 0.05 m and one that
falls passes 0.15 m within 0.2 s (docs/headline.md), so that the verdict hardly depends on it.
"""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A recorded run of T frames; n skin vertices, 18 segments.

    Time is 0 when the device starts to move: settling lies before. Forces are means over the
    frame that ends at each time, as a sensor with that frame time would read them.

    Attributes
    ----------
    time : (T,) float64
        [s].
    q : (T, 60), v : (T, 47) float64
    device_rotation : (T, 3, 3), device_position : (T, 3) float64
        Device frame in the world [m].
    displacement : (T,) float64
        Distance of the body's centre of mass from where it started, seen from the device [m].
    segment_force : (T, 18, 3) float64
        Contact force on each segment, world axes [N].
    normal_force : (T, n) float32
        Normal contact force on each skin vertex [N].
    contact_count : (T,) int64
        Device vertices in contact.
    depth_max : (T,) float64
        Deepest penetration within the frame, every step counted [m].
    settled : bool
        Whether the body came to rest before the device moved.
    cpu_time : float
        Of the whole run [s].
    status, reason : str
        "ok", or why the run ended early.
    """

    time: np.ndarray
    q: np.ndarray
    v: np.ndarray
    device_rotation: np.ndarray
    device_position: np.ndarray
    displacement: np.ndarray
    segment_force: np.ndarray
    normal_force: np.ndarray
    contact_count: np.ndarray
    depth_max: np.ndarray
    settled: bool
    cpu_time: float
    status: str
    reason: str


class Recorder:
    """Observes every step and keeps a frame at the recording rate.

    Attributes
    ----------
    fall_time : float
        First recorded time at which the body had fallen, infinite before [s].
    """

    def __init__(self, scene: Scene, interaction: Interaction):
        self._interaction = interaction
        self._steps_per_frame = max(
            1, round(1 / (scene.method.record_rate_hz * scene.method.time_step_s))
        )
        self._frames: list[dict] = []
        self._observed = 0
        self._in_frame = 0
        self._depth_max = 0.0
        self._segment_force = np.zeros_like(interaction.segment_wrench[:, :3])
        self._normal_force = np.zeros_like(interaction.normal_force)
        self._start = None
        self.fall_time = np.inf

    def observe(self, time: float, q: np.ndarray, v: np.ndarray, device: DeviceState) -> bool:
        """Take note of the interaction as last evaluated; return whether a frame is complete."""
        now = self._interaction
        _add_listed(now.listed, now.normal_force, self._normal_force)
        self._segment_force += now.segment_wrench[:, :3]
        self._depth_max = max(self._depth_max, now.depth_max)
        self._in_frame += 1
        self._observed += 1
        if (self._observed - 1) % self._steps_per_frame:
            return False

        centre = pin.centerOfMass(now.model, now.data, q, False)
        place = device.rotation.T @ (centre - device.position)
        if self._start is None:
            self._start = place
        displacement = float(np.linalg.norm(place - self._start))
        if displacement > FALL_DISPLACEMENT:
            self.fall_time = min(self.fall_time, time)
        self._frames.append(
            {
                "time": time,
                "q": q.copy(),
                "v": v.copy(),
                "device_rotation": device.rotation,
                "device_position": device.position,
                "displacement": displacement,
                "segment_force": self._segment_force / self._in_frame,
                "normal_force": (self._normal_force / self._in_frame).astype(np.float32),
                "contact_count": now.contact_count,
                "depth_max": self._depth_max,
            }
        )
        self._segment_force[:] = 0
        self._normal_force[:] = 0
        self._depth_max = 0.0
        self._in_frame = 0
        return True

    def trajectory(
        self, device_start: float, settled: bool, cpu_time: float, status: str, reason: str
    ) -> Trajectory:
        """Return the frames so far, with time counted from the start of the device's motion [s]."""
        columns = {
            name: np.array([frame[name] for frame in self._frames]) for name in self._frames[0]
        }
        columns["time"] = columns["time"] - device_start
        return Trajectory(
            **columns, settled=settled, cpu_time=cpu_time, status=status, reason=reason
        )


@njit(cache=True, error_model="numpy")
def _add_listed(listed, values, total):
    for i in listed:
        total[i] += values[i]
