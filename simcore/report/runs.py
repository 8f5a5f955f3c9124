"""Candidates' files → runs made ready for pictures."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from simcore.body.build import posed_skin
from simcore.device.motion import STILL, DeviceState
from simcore.errors import DesignError
from simcore.export.recording import Recording, open_recording
from simcore.metrics import REST_WINDOW

AFTER_FALL = 0.2
"""A body that fell is shown this long after it had fallen [s]: at the end it is often far away."""


class Run(Recording):
    """A recording, and what the report shows of it; n skin vertices."""

    @property
    def fell(self) -> bool:
        """Whether the body fell."""
        return bool(np.isfinite(self.frames["fall_time"].item()))

    @property
    def last(self) -> int:
        """Index of the last frame to show."""
        if not self.fell:
            return len(self.time) - 1
        shown = self.frames["fall_time"].item() + AFTER_FALL
        return int(np.searchsorted(self.time, shown, side="right")) - 1

    @property
    def at_end(self) -> np.ndarray:
        """Indices of the frames of the last half second supported."""
        frames = np.flatnonzero(self.supported)
        return frames[self.time[frames] >= self.time[frames[-1]] - REST_WINDOW]

    @property
    def pressure_at_end(self) -> np.ndarray:
        """Pressure on each skin vertex (n,) [Pa], mean over the last half second supported."""
        mean = np.zeros(self.body.skin.vertex_count)
        mean[self.frames["skin_vertex"].values] = self.column("skin_pressure")[self.at_end].mean(
            axis=0
        )
        return mean

    @property
    def mat_at_end(self) -> np.ndarray:
        """Reading of the mat (rows, columns) [Pa], mean over the last half second supported."""
        return self.frames["mat_pressure"].values[self.at_end].mean(axis=0)

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


def read_run(path: Path, root: Path) -> Run | str:
    """Return a candidate's run, or in words why there is none to show."""
    name = f"candidates/{path.name}"
    if not path.is_file():
        return f"{name} is missing; run the sweep again."
    try:
        return Run(**vars(open_recording(path, root)))
    except DesignError as error:  # the whole path is none of the reader's business
        return f"{error}.".replace(str(path), name)
