"""A run → tidy tables as CSV: a row an observation, a column a variable with its unit."""

import csv
import io

import numpy as np

from simcore.body.posture import joint_angles
from simcore.export.recording import Recording

SERIES = {
    "displacement": "displacement_m", "depth_max": "depth_max_m", "contact_count": "contact_count",
}
"""Columns of the dataset that are one number a frame → columns of the table."""


def tables_of(recording: Recording) -> dict[str, bytes]:
    """Return the CSV text of each table by its name: UTF-8, SI units and radians.

    `figures` has a row a figure (and region or joint), `series` a row a frame, `segments` a row a
    frame and segment, `joints` a row a frame and joint angle, and `straps`, of a sling, a row a
    frame and strap.
    """
    tables = {
        "figures": _figures(recording),
        "series": _series(recording),
        "segments": _segments(recording),
        "joints": _joints(recording),
    }
    if recording.straps is not None:
        tables["straps"] = _straps(recording)
    return {name: _csv(rows) for name, rows in tables.items()}


def _figures(recording: Recording):
    yield "figure", "of", "value", "unit", "meaning"
    frames = recording.frames
    for name, variable in frames.data_vars.items():
        told = variable.attrs.get("units", ""), variable.attrs.get("long_name", "")
        if variable.ndim == 0:
            yield name, "", variable.item(), *told
        elif variable.dims in (("region",), ("joint",)):
            of = frames[variable.dims[0]].values
            yield from ((name, *pair, *told) for pair in zip(of, variable.values, strict=True))


def _series(recording: Recording):
    axes = [f"support_force_{axis}_n" for axis in "xyz"]
    position = [f"device_{axis}_m" for axis in "xyz"]
    turn = [f"device_quaternion_{axis}" for axis in "xyzw"]
    yield "time_s", *SERIES.values(), "peak_pressure_pa", *axes, *position, *turn
    peak = recording.column("skin_pressure").max(axis=1, initial=0.0)
    yield from np.column_stack([
        recording.time, *(recording.column(name) for name in SERIES), peak,
        recording.column("support_force"), recording.column("device_position"),
        recording.column("device_quaternion"),
    ])


def _segments(recording: Recording):
    yield "time_s", "segment", *(f"force_{axis}_n" for axis in "xyz")
    names = recording.body.segment_names
    for time, forces in zip(recording.time, recording.column("segment_force"), strict=True):
        yield from ((time, name, *force) for name, force in zip(names, forces, strict=True))


def _joints(recording: Recording):
    yield "time_s", "joint", "angle", "value_rad"
    for time, q in zip(recording.time, recording.column("q"), strict=True):
        for joint, angles in joint_angles(recording.body, q).items():
            yield from ((time, joint, angle, value) for angle, value in angles.items())


def _straps(recording: Recording):
    yield "time_s", "strap", "number", *(f"force_{axis}_n" for axis in "xyz")
    names = recording.straps.names
    for time, forces in zip(recording.time, recording.column("strap_force"), strict=True):
        yield from (
            (time, name, number, *force)
            for number, (name, force) in enumerate(zip(names, forces, strict=True))
        )


def _csv(rows) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for row in rows:
        writer.writerow([f"{x:.7g}" if isinstance(x, float) else x for x in row])
    return text.getvalue().encode()
