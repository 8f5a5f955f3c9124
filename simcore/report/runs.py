"""Candidates' files → runs made ready for pictures."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from simcore.body.build import posed_skin
from simcore.device.motion import STILL, DeviceState
from simcore.errors import DesignError
from simcore.export.recording import Recording, open_recording


class Run(Recording):
    """A recording, and what the report shows of it; n skin vertices.

    All of it is in the summary, so that a run without frames has pictures, too. A moment is
    `start`, `fall`, of a body that fell the last that it was supported, or `end`, of one that fell
    shortly after that.
    """

    @property
    def fell(self) -> bool:
        """Whether the body fell."""
        return bool(np.isfinite(self.frames["fall_time"].item()))

    @property
    def pressure_at_end(self) -> np.ndarray:
        """Pressure on each skin vertex (n,) [Pa], mean over the last half second supported."""
        return self.on_skin("skin_pressure_end")

    @property
    def mat_at_end(self) -> np.ndarray:
        """Reading of the mat (rows, columns) [Pa], mean over the last half second supported."""
        return self.frames["mat_pressure_end"].values

    @property
    def mat_peak(self) -> np.ndarray:
        """Highest reading of each cell (rows, columns) [Pa] while the body was supported."""
        return self.frames["mat_pressure_peak"].values

    def at(self, moment: str, name: str) -> np.ndarray:
        """Return what a column was at a moment, as float64."""
        return self.frames[f"moment_{name}"].sel(moment=moment).values.astype(float)

    def skin(self, moment: str) -> np.ndarray:
        """Return the posed skin vertices (n, 3) [m]."""
        return posed_skin(self.body, self.at(moment, "q"))

    def moved(self, moment: str) -> DeviceState:
        """Return where the motion program had the rigid device, or the spreader bar."""
        turn = Rotation.from_quat(self.at(moment, "device_quaternion")).as_matrix()
        return DeviceState(turn, self.at(moment, "device_position"), np.zeros(3), np.zeros(3))

    def rigid(self, moment: str) -> np.ndarray:
        """Return the vertices of what is rigid, world frame [m]; a bed stands still."""
        state = STILL if self.net else self.moved(moment)
        return self.surface.vertices @ state.rotation.T + state.position

    def sheet(self, moment: str) -> np.ndarray:
        """Return the sheet's vertices (m, 3) [m]."""
        return self.at(moment, "sheet_position")


def read_run(path: Path, root: Path) -> Run | str:
    """Return a candidate's run, or in words why there is none to show."""
    name = f"candidates/{path.name}"
    if not path.is_file():
        return f"{name} is missing; run the sweep again."
    try:
        return Run(**vars(open_recording(path, root, need_frames=False)))
    except DesignError as error:  # the whole path is none of the reader's business
        return f"{error}.".replace(str(path), name)
