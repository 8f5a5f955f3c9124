"""Candidates' files → runs made ready for pictures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from simcore.body.build import Body, build_body, posed_skin
from simcore.config import Design
from simcore.dataset import design_of, open_dataset
from simcore.device.build import build_surface
from simcore.device.motion import STILL, DeviceState
from simcore.device.surface import Surface
from simcore.errors import DesignError
from simcore.metrics import REST_WINDOW
from simcore.sheet.hanging import Straps, build_straps
from simcore.sheet.net import Net, build_net

AFTER_FALL = 0.2
"""A body that fell is shown this long after it had fallen [s]: at the end it is often far away."""


@dataclass(frozen=True, eq=False)
class Run:
    """What a candidate's file holds; n skin vertices.

    Attributes
    ----------
    design : Design
    body : Body
    surface : Surface
        What is rigid: the lift's support, or the bed of a sling lift.
    net, straps : Net, Straps or None
        The sheet and what it hangs by, if there is one.
    frames : xr.Dataset
        Trajectory.
    pressure_peak : (n,) float64
        Highest pressure on each vertex while the body was supported [Pa].
    """

    design: Design
    body: Body
    surface: Surface
    net: Net | None
    straps: Straps | None
    frames: xr.Dataset
    pressure_peak: np.ndarray

    @property
    def supported(self) -> np.ndarray:
        """Indices of the frames over which simcore.metrics takes the peak pressure."""
        return supported_frames(self.frames)

    @property
    def last(self) -> int:
        """Index of the last frame to show."""
        time, fall = self.frames["time"].values, self.frames["fall_time"].item()
        if np.isnan(fall):
            return len(time) - 1
        return int(np.searchsorted(time, fall + AFTER_FALL, side="right")) - 1

    @property
    def mat_at_rest(self) -> np.ndarray:
        """Reading of the mat (rows, columns) [Pa], mean over the last half second supported."""
        time, frames = self.frames["time"].values, self.supported
        last = frames[time[frames] >= time[frames[-1]] - REST_WINDOW]
        return self.frames["mat_pressure"].values[last].mean(axis=0)

    @property
    def mat_peak(self) -> np.ndarray:
        """Highest reading of each cell (rows, columns) [Pa] while the body was supported."""
        return self.frames["mat_pressure"].values[self.supported].max(axis=0)

    def skin(self, frame: int) -> np.ndarray:
        """Return the posed skin vertices (n, 3) of a frame [m]."""
        return posed_skin(self.body, self.frames["q"].values[frame])

    def moved(self, frame: int) -> DeviceState:
        """Return where the motion program had the rigid device, or the spreader bar."""
        turn = Rotation.from_quat(self.frames["device_quaternion"].values[frame]).as_matrix()
        return DeviceState(
            turn, self.frames["device_position"].values[frame], np.zeros(3), np.zeros(3)
        )

    def rigid(self, frame: int) -> np.ndarray:
        """Return the vertices of what is rigid, world frame [m]; a bed stands still."""
        state = STILL if self.net else self.moved(frame)
        return self.surface.vertices @ state.rotation.T + state.position

    def sheet(self, frame: int) -> np.ndarray:
        """Return the sheet's vertices (m, 3) of a frame [m]."""
        return self.frames["sheet_position"].values[frame].astype(float)


def supported_frames(frames: xr.Dataset) -> np.ndarray:
    """Return the indices of the frames over which simcore.metrics takes the peak pressure."""
    time, fall = frames["time"].values, frames["fall_time"].item()
    end = fall if np.isfinite(fall) else time[-1]
    supported = time <= end
    if end >= 0:  # a fall before the device moved leaves only the settling
        supported &= time >= 0
    return np.flatnonzero(supported)


def read_run(path: Path, body_name: str, root: Path) -> Run | str:
    """Return a candidate's run, or in words why there is none to show."""
    name = f"candidates/{path.name}"
    if not path.is_file():
        return f"No picture: {name} is missing; run the sweep again."
    try:
        frames = open_dataset(path)
    except DesignError:  # its message names the whole path, which is none of the reader's business
        return f"No picture: {name} cannot be read by this version; run the sweep again."
    if "q" not in frames:
        return f"No picture: {name} holds no trajectory."
    try:
        design = design_of(frames)
        body = build_body(design.body, body_name)
        surface = build_surface(design.device.rigid_part, root)
        net = straps = None
        if design.device.kind == "sling_lift":
            net = build_net(design.device.sheet)
            straps = build_straps(net, design.device.hanging)
    except ValidationError:
        return f"No picture: {name} has a design that this version does not know."
    except DesignError as error:
        return f"No picture: {error}."
    if not _fits(frames, body, net):
        return f"No picture: {name} was simulated by another version; run the sweep again."
    peak = np.zeros(body.skin.vertex_count)
    supported = frames["skin_pressure"].values[supported_frames(frames)]
    peak[frames["skin_vertex"].values] = supported.max(axis=0, initial=0.0)
    return Run(design, body, surface, net, straps, frames, peak)


def _fits(frames: xr.Dataset, body: Body, net: Net | None) -> bool:
    """Return whether frames belong to the body and the net that their design now leads to."""
    touched = frames["skin_vertex"].values
    return touched.max(initial=0) < body.skin.vertex_count and (
        net is None or frames.sizes["sheet_vertex"] == len(net.rest_position)
    )
