"""Trajectory → xarray: the frames of a run, and what tells of it where they are not kept."""

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from simcore.body.segments import SEGMENT_NAMES
from simcore.energy import TERMS
from simcore.metrics import rest_frames, supported_frames
from simcore.recorder import Trajectory

AFTER_FALL = 0.2
"""A body that fell is shown this long after it had fallen [s]: at the end it is often far away."""

TRAJECTORY = {
    "q": (("time", "q_index"), "1", "configuration: root [m], quaternions x y z w, angles [rad]"),
    "device_position": (("time", "xyz"), "m", "origin of the frame of device or spreader bar"),
    "device_quaternion": (("time", "xyzw"), "1", "that frame to the world, x y z w"),
    "displacement": (("time",), "m", "how far the body has moved on what carries it"),
    "support_force": (("time", "xyz"), "N", "force that carries body and sheet, world axes"),
    "segment_force": (("time", "segment", "xyz"), "N", "contact force on each segment, world axes"),
    "contact_count": (("time",), "1", "points of device, skin or sheet in contact"),
    "depth_max": (("time",), "m", "deepest penetration within the frame"),
    "energy": (("time", "energy_term"), "J", "energies, and flows of energy since the start"),
    "mat_pressure": (
        ("time", "mat_x", "mat_y"), "Pa", "reading of a sensor mat on what carries the body"
    ),
    "sheet_position": (("time", "sheet_vertex", "xyz"), "m", "vertices of the sheet"),
    "strap_force": (("time", "strap", "xyz"), "N", "on the sheet from each strap, world axes"),
    "skin_pressure": (
        ("time", "skin_vertex"), "Pa",
        "pressure over a sensor cell around each vertex, mean over the frame",
    ),
}
"""Dimensions, unit and meaning of each recorded column."""

AT_MOMENTS = ("q", "device_position", "device_quaternion", "sheet_position")
"""Columns that are kept at each moment, as `moment_q` and so on."""

SUMMARY = {
    "skin_pressure_peak": (("skin_vertex",), "Pa", "highest pressure while supported"),
    "skin_pressure_end": (("skin_vertex",), "Pa", "mean over the last half second supported"),
    "mat_pressure_peak": (("mat_x", "mat_y"), "Pa", "highest reading while supported"),
    "mat_pressure_end": (("mat_x", "mat_y"), "Pa", "mean over the last half second supported"),
    "moment_time": (("moment",), "s", "time of each moment after settling"),
    **{
        f"moment_{name}": (("moment", *TRAJECTORY[name][0][1:]), *TRAJECTORY[name][1:])
        for name in AT_MOMENTS
    },
}
"""Likewise of each variable that tells of a run without its frames."""

PRESSURE_STEP, SHEET_STEP, FORCE_STEP = 50.0, 5e-4, 0.05
"""Of frames, pressures [Pa], the sheet's shape [m] and forces [N] are kept in whole steps.

50 Pa is 0.4 mmHg, finer than a sensor mat resolves; half a millimetre is what replays show.
"""

PACKED = {
    "skin_pressure": ("uint16", PRESSURE_STEP),
    "mat_pressure": ("uint16", PRESSURE_STEP),
    "sheet_position": ("int16", SHEET_STEP),
    "moment_sheet_position": ("int16", SHEET_STEP),
    "segment_force": ("int16", FORCE_STEP),
    "strap_force": ("int16", FORCE_STEP),
}
"""Variable → the integers that it is written as, and what one stands for (CF, section 8.1)."""


def trajectory_dataset(
    trajectory: Trajectory, pressure: np.ndarray, fall_time: float = np.nan
) -> xr.Dataset:
    """Return the frames of a run, and its summary.

    Parameters
    ----------
    trajectory : Trajectory
    pressure : (T, n) float64
        From `simcore.metrics.skin_pressure` [Pa]; only vertices that were touched are kept.
    fall_time : float
        The figure; NaN of a body that did not fall [s].
    """
    # Less than half a step would be written as nothing.
    touched = np.flatnonzero(pressure.max(axis=0) > PRESSURE_STEP / 2)
    columns = {name: getattr(trajectory, name, None) for name in TRAJECTORY}
    columns["device_quaternion"] = Rotation.from_matrix(trajectory.device_rotation).as_quat()
    columns["skin_pressure"] = pressure[:, touched]
    told, moments = _summary(trajectory.time, columns, fall_time)
    coords = {
        "time": ("time", trajectory.time, {"units": "s", "long_name": "time after settling"}),
        "segment": list(SEGMENT_NAMES),
        "xyz": list("xyz"),
        "energy_term": list(TERMS),
        "skin_vertex": touched.astype(np.int32),
        "moment": moments,
    }
    for axis, meaning in (("mat_x", "along the mat, towards the feet"), ("mat_y", "to the left")):
        coords[axis] = (axis, getattr(trajectory, axis), {"units": "m", "long_name": meaning})
    variables = {}
    for name, (dims, units, long_name) in (TRAJECTORY | SUMMARY).items():
        values = (columns | told)[name]
        if values is not None:  # a rigid device has no sheet
            single = np.float32 if values.dtype.kind == "f" else np.int32
            variables[name] = (
                dims, values.astype(single), {"units": units, "long_name": long_name}
            )
    return xr.Dataset(variables, coords)


def _summary(
    time: np.ndarray, columns: dict[str, np.ndarray | None], fall_time: float
) -> tuple[dict[str, np.ndarray | None], list[str]]:
    """Return the variables of `SUMMARY`, and the names of the moments.

    They are `start`, the first frame, `fall`, the last supported frame of a body that fell, and
    `end`, the last frame, or one shortly after the fall.
    """
    supported = np.flatnonzero(supported_frames(time, fall_time))
    rest = supported[rest_frames(time[supported])]
    frames = {"start": 0, "end": len(time) - 1}
    if np.isfinite(fall_time):
        after = np.searchsorted(time, fall_time + AFTER_FALL, side="right") - 1
        frames = {"start": 0, "fall": supported[-1], "end": after}
    chosen = list(frames.values())
    told = {"moment_time": time[chosen]}
    for name in AT_MOMENTS:
        told[f"moment_{name}"] = None if columns[name] is None else columns[name][chosen]
    for name in ("skin_pressure", "mat_pressure"):
        told[f"{name}_peak"] = columns[name][supported].max(axis=0)
        told[f"{name}_end"] = columns[name][rest].mean(axis=0, dtype=float)
    return told, list(frames)
