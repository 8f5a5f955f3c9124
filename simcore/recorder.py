"""What a simulation leaves behind: frames at the recording rate, and what happened between them."""

from dataclasses import dataclass
from functools import lru_cache
from math import dist, floor

import numpy as np

from simcore.body.build import Body, posed_skin
from simcore.body.skin import vertex_normals
from simcore.contact.tangential import Impulses
from simcore.device.motion import DeviceState
from simcore.energy import TERMS
from simcore.interaction import Interaction
from simcore.pressure import SensorCells, SensorMat, told
from simcore.scene import Mat, Scene

FALL_DISPLACEMENT = 0.15
"""A body whose centre of mass has moved this far from its place on the device has fallen [m].

# ASSUME: half the depth of a seated trunk; a body that is held settles within 0.05 m and one that
falls passes 0.15 m within 0.2 s (docs/headline.md), so that the verdict hardly depends on it.
"""

ROUNDING = 1e-9
"""Times that differ by less are the same [s]."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A recorded run of T frames; n skin vertices, 18 segments.

    Time is 0 when the device starts to move: settling lies before. Frames are as long as the
    recording rate has it, each told with the first step that begins after its end; forces are means
    over it, as a sensor with that frame time would read them.

    Attributes
    ----------
    time : (T,) float64
        [s].
    q : (T, 60), v : (T, 47) float64
    device_rotation : (T, 3, 3), device_position : (T, 3) float64
        Frame in the world of what the motion program moves: rigid device or spreader bar [m].
    displacement : (T,) float64
        How far the body has moved on what carries it [m]: its centre of mass seen from the device,
        or the sheet's points that lay under pelvis and chest seen from there.
    support_force : (T, 3) float64
        Force from outside that carries the body, and the sheet if any, world axes [N].
    segment_force : (T, 18, 3) float64
        Contact force on each segment, world axes [N].
    normal_force : (T, n) float32
        Normal contact force on each skin vertex [N].
    shear : (T, n) float32
        Tangential force per area of skin, over the sensor cell around each vertex (Eq. P3) [Pa].
        The forces themselves would be three times as much to keep.
    slip_force : (T,) float64
        Normal force on skin whose friction has reached µN [N]; NaN with friction that knows no µ.
    mat_pressure : (T, rows, columns) float32
        Reading of the sensor mat on what carries the body [Pa].
    mat_x, mat_y : (rows,), (columns,) float64
        Centres of the mat's cells (`Scene.mat`) [m].
    sheet_position : (T, m, 3) float32 or None
        Vertices of the sheet, if there is one [m].
    strap_force : (T, s, 3) float64 or None
        On the sheet from each of its straps, world axes [N].
    contact_count : (T,) int64
        Points of device, skin or sheet in contact.
    depth_max : (T,) float64
        Deepest penetration within the frame, every step counted [m].
    energy : (T, 8) float64
        `simcore.energy.TERMS`: energies, and flows since the start, at the end of each frame's last
        step [J]. NaN under explicit steps.
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
    support_force: np.ndarray
    normal_force: np.ndarray
    shear: np.ndarray
    slip_force: np.ndarray
    mat_pressure: np.ndarray
    mat_x: np.ndarray
    mat_y: np.ndarray
    sheet_position: np.ndarray | None
    strap_force: np.ndarray | None
    contact_count: np.ndarray
    depth_max: np.ndarray
    energy: np.ndarray
    settled: bool
    cpu_time: float
    status: str
    reason: str


def sensor_cells(scene: Scene) -> SensorCells:
    """Return the cells of a scene's skin."""
    return _sensor_cells(scene.body, scene.method.sensor_pitch_m)


@lru_cache(maxsize=4)
def _sensor_cells(body: Body, pitch: float) -> SensorCells:
    rest = posed_skin(body, body.rest_configuration)
    return SensorCells(rest, vertex_normals(body.skin, rest), body.skin.vertex_area, pitch)


@lru_cache(maxsize=4)
def _sensor_mat(mat: Mat, pitch: float) -> SensorMat:
    return SensorMat(mat.points, mat.tile, pitch)


class Recorder:
    """Observes every step and keeps a frame at the recording rate.

    Attributes
    ----------
    fall_time : float
        First recorded time at which the body had fallen, infinite before [s].
    """

    def __init__(self, scene: Scene, interaction: Interaction):
        self._interaction = interaction
        self._period = 1 / scene.method.record_rate_hz
        self._frames: list[dict] = []
        skin_count, point_count = scene.body.skin.vertex_count, len(scene.mat.points)
        # Impulses since the last frame; divided by its length they are mean forces.
        self._segments = np.zeros_like(interaction.segment_wrench[:, :3])
        self._support = np.zeros(3)
        self._on_skin, self._on_mat = Impulses.zero(skin_count), Impulses.zero(point_count)
        self._slipping = 0.0
        self._duration, self._frame_end = 0.0, self._period
        self._closed: dict | None = None  # forces of a frame that waits for its end
        self._depth_max = 0.0
        self._cells = sensor_cells(scene)
        self._mat = _sensor_mat(scene.mat, scene.method.sensor_pitch_m)
        # Of each frame: skin vertices that bear force, and how much; and points of the mat.
        self._borne: list[tuple[np.ndarray, ...]] = []
        self._start = None
        self.fall_time = np.inf

    @property
    def frame_count(self) -> int:
        """Number of frames so far."""
        return len(self._frames)

    def observe(
        self, time: float, step: float, q: np.ndarray, v: np.ndarray, moved: DeviceState
    ) -> bool:
        """Take note of the interaction as last evaluated; return whether a frame is complete.

        Parameters
        ----------
        time, step : float
            When a step began, and for how long its forces act [s].
        q : (60,), v : (47,) float64
            Then.
        moved : DeviceState
            Then.
        """
        if not self._frames:  # what acts at the start is all that the first frame has
            self._add(step)
            self._close()
        keeps = self._closed is not None
        if keeps:
            self._keep_frame(time, q, v, moved)
        end = time + step
        if end > self._frame_end - ROUNDING:
            self._add(self._frame_end - time)
            self._close()
            step = end - self._frame_end
            self._frame_end = self._period * (floor((end + ROUNDING) / self._period) + 1)
        self._add(step)
        return keeps

    def _add(self, duration: float) -> None:
        """Add to the present frame what the interaction does in a time [s]."""
        now = self._interaction
        self._slipping += now.add_skin_impulses(duration, self._on_skin)
        self._slipping += now.add_mat_impulses(duration, self._on_mat)
        self._support += duration * now.support_force
        self._segments += duration * now.segment_wrench[:, :3]
        self._depth_max = max(self._depth_max, now.depth_max)
        self._duration += duration

    def _close(self) -> None:
        """End the present frame, and begin another."""
        duration = self._duration
        self._interaction.share_impulses(self._on_mat, self._on_skin)
        on_mat = self._on_mat.take(duration)[:2]
        self._borne.append((*self._on_skin.take(duration), *on_mat))
        self._closed = {
            "segment_force": self._segments / duration,
            "slip_force": self._slipping / duration,
            "support_force": self._support / duration,
            "depth_max": self._depth_max,
        }
        self._segments[:] = self._support[:] = 0
        self._slipping = self._depth_max = self._duration = 0.0

    def _keep_frame(self, time: float, q: np.ndarray, v: np.ndarray, moved: DeviceState) -> None:
        now = self._interaction
        place = now.place(q, moved)
        if self._start is None:
            self._start = place
        displacement = max(map(dist, place, self._start))
        if displacement > FALL_DISPLACEMENT:
            self.fall_time = min(self.fall_time, time)
        self._frames.append(
            {
                "time": time,
                "q": q.copy(),
                "v": v.copy(),
                "device_rotation": moved.rotation,
                "device_position": moved.position,
                "displacement": displacement,
                **self._closed,
                **now.sheet_frame(),
                "contact_count": now.contact_count,
                "energy": np.full(len(TERMS), np.nan),
            }
        )
        self._closed = None

    def tell_energy(self, energy: np.ndarray) -> None:
        """Add to the last frame its energies and flows (8,) [J]."""
        self._frames[-1]["energy"] = energy

    def trajectory(
        self, device_start: float, settled: bool, cpu_time: float, status: str, reason: str
    ) -> Trajectory:
        """Return the frames so far, with time counted from the start of the device's motion [s]."""
        columns = {
            name: np.array([frame[name] for frame in self._frames]) for name in self._frames[0]
        }
        columns["time"] = columns["time"] - device_start
        columns |= self._forces()
        columns = {"sheet_position": None, "strap_force": None} | columns
        return Trajectory(
            **columns, mat_x=self._mat.x, mat_y=self._mat.y, settled=settled, cpu_time=cpu_time,
            status=status, reason=reason,
        )

    def _forces(self) -> dict[str, np.ndarray]:
        """Return what skin and mat bore in each frame, read for all frames at once."""
        frames = len(self._frames)  # one more may wait for its end
        skins, normals, tangentials, mats, on_mats = zip(*self._borne[:frames], strict=True)
        mat, place = told(mats, len(self._on_mat.normal))
        normal_force = np.zeros((frames, len(self._on_skin.normal)), np.float32)
        on_mat = np.zeros((frames, len(mat)), np.float32)
        for frame in range(frames):
            normal_force[frame, skins[frame]] = normals[frame]
            on_mat[frame, place[mats[frame]]] = on_mats[frame]
        return {
            "normal_force": normal_force,
            "shear": self._cells.shear(skins, tangentials),
            "mat_pressure": self._mat.pressure(on_mat, mat).astype(np.float32),
        }
