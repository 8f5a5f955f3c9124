"""Dataset → the physics that was run: equations, constants and gains, as the designs state them."""

import json

import xarray as xr

from simcore.config.paths import leaf_paths
from simcore.pressure import CELL_EDGE
from simcore.recorder import FALL_DISPLACEMENT
from simcore.report.quantities import key_title, path_value

EQUATIONS = (
    ("Forward dynamics", "Eq. 1", "articulated-body algorithm, 47 degrees of freedom"),
    ("Joints", "Eq. 2", "proportional–derivative torques towards the starting posture"),
    ("Skin", "Eq. 3", "linear blend skinning of the surface by 18 segments"),
    ("Contact on to joints", "Eqs. 8–12", "transpose of the skin's Jacobian"),
    ("Normal contact", "Eq. 6", "penalty from each device vertex to its nearest skin vertex"),
    ("Friction", "Eq. 7", "regularised, opposite to the sliding velocity"),
    ("Pressure", "Eq. P1", f"force over area, averaged over cells of {1e3 * CELL_EDGE:g} mm"),
    ("Fall", "", f"the centre of mass is {FALL_DISPLACEMENT:g} m from its place on the device"),
)
"""What is computed, under the numbers of docs/physics.md."""

SECTIONS = (
    ("Method", ("method",), ("joints", "contact", "settling")),
    ("Settling", ("method", "settling"), ()),
    ("Contact", ("method", "contact"), ()),
    ("Device", ("device",), ("motion",)),
    ("Motion of the device", ("device", "motion"), ()),
    ("Posture", ("posture",), ()),
)
"""Title, place in the design, and parts that have a table of their own."""

VARIED = "varied in this study"


def constants_of(ds: xr.Dataset) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return tables of what every candidate shares: title, rows of key and value with unit."""
    design, varied = _design(ds), _varied_paths(ds)
    tables = []
    for title, place, left_out in SECTIONS:
        part = design
        for key in place:
            part = part.get(key, {})
        rows = [
            (_words(path), VARIED if full in varied else shown)
            for path, full, shown in _leaves(part, place)
            if path[0] not in left_out
        ]
        if rows:
            tables.append((title, rows))
    return tables


def gains_of(ds: xr.Dataset) -> list[tuple[str, str, str]]:
    """Return joint, stiffness and damping of every kind of joint, as shown."""
    varied = _varied_paths(ds)
    joints = _design(ds).get("method", {}).get("joints", {})
    return [
        (
            joint,
            *(
                VARIED if f"method.joints.{joint}.{key}" in varied
                else path_value((key,), gains[key])
                for key in ("stiffness_nm_per_rad", "damping_nms_per_rad")
            ),
        )
        for joint, gains in joints.items()
    ]


def _design(ds: xr.Dataset) -> dict:
    designs = json.loads(ds.attrs.get("designs", "{}"))
    return next(iter(designs.values()), {})


def _varied_paths(ds: xr.Dataset) -> set[str]:
    return {ds[dim].attrs.get("long_name") for dim in ds["candidate"].dims if dim != "body"}


def _leaves(part: dict, place: tuple[str, ...]):
    """Yield path below `place`, full path and shown value; a list of numbers is one value."""
    done = set()
    for path in leaf_paths(part):
        node, vector = part, None
        for depth, key in enumerate(path):
            node = node[int(key)] if isinstance(node, list) else node[key]
            if isinstance(node, list) and all(isinstance(each, int | float) for each in node):
                vector = path[: depth + 1], node
                break
        path, value = vector or (path, node)
        if path not in done:
            done.add(path)
            yield path, ".".join((*place, *path)), path_value(path, value)


def _words(path: tuple[str, ...]) -> str:
    """Return a path in words: list positions count from 1, plain groupings are left out."""
    words = [str(int(key) + 1) if key.isdigit() else key_title(key) for key in path]
    return " ".join(words[1:] if words[0] in ("surface", "angles", "placement") else words)
