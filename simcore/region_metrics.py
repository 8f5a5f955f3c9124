"""Trajectory → pressure, shear, contact area and load by body region; called by `metrics`."""

import numpy as np

from simcore.body.build import Body
from simcore.recorder import Trajectory

# ASSUME: 10 mmHg, twice what pressure mats begin to read at. At less, cells count that cloth hardly
# touches, and their number goes with the mesh (docs/validation.md).
CONTACT_PRESSURE = 1333.0
"""Cells that read more than this carry load [Pa]."""


def peaks(body: Body, readings: np.ndarray, of: str) -> dict[str, float | np.ndarray]:
    """Return the highest reading of all skin, and by region.

    Parameters
    ----------
    readings : (t, n) float
        Of the sensor cell around each skin vertex, in the frames that count [Pa].
    of : str
        What is read: the figures are `peak_OF` and `region_peak_OF`.
    """
    highest = np.zeros(len(body.region_names))
    np.maximum.at(highest, body.vertex_region, readings.max(axis=0))
    return {f"peak_{of}": float(highest.max()), f"region_peak_{of}": highest}


def load_at_rest(
    body: Body, pressure: np.ndarray, normal_force: np.ndarray, rests: bool
) -> dict[str, float | np.ndarray]:
    """Return contact area [m²] and load [N], means over the frames at rest.

    The load of a region is the sum of the sizes of the normal forces on its vertices, as a sensor
    wrapped around it would read it: skin pressed from two sides counts both.

    Parameters
    ----------
    pressure, normal_force : (t, n) float
        Of the frames at rest [Pa, N].
    rests : bool
        Whether the body came to rest at all; if not, all figures are NaN.
    """
    if not rests:
        missing = np.full(len(body.region_names), np.nan)
        return {"contact_area": np.nan, "region_contact_area": missing, "region_load": missing}
    read = (pressure > CONTACT_PRESSURE).mean(axis=0) * body.skin.vertex_area
    area, load = (
        np.bincount(body.vertex_region, each, len(body.region_names))
        for each in (read, normal_force.mean(axis=0, dtype=float))
    )
    return {"contact_area": float(area.sum()), "region_contact_area": area, "region_load": load}


def slip_share(trajectory: Trajectory, frames: np.ndarray | slice) -> float:
    """Return which share of the normal force in some frames is on skin that slips: Eq. M3.

    NaN without load, and with friction that knows no µ.
    """
    load = float(trajectory.normal_force[frames].sum(dtype=float))
    return float(trajectory.slip_force[frames].sum() / load) if load else np.nan
