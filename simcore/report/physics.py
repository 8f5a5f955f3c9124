"""Dataset → the physics that was run: equations, constants and gains, as the designs state them."""

import json
from dataclasses import dataclass

import xarray as xr

from simcore.config.paths import leaf_paths
from simcore.recorder import FALL_DISPLACEMENT
from simcore.report.quantities import path_title, path_value

BODY_EQUATIONS = (
    ("Forward dynamics", "Eq. 1", "articulated-body algorithm, 47 degrees of freedom"),
    ("Joints", "Eq. 2", "proportional–derivative torques towards the starting posture"),
    ("Skin", "Eq. 3", "linear blend skinning of the surface by 18 segments"),
    ("Contact on to joints", "Eqs. 8–12", "transpose of the skin's Jacobian"),
)

SELF_CONTACT_EQUATION = (
    "Contact of body parts", "Eq. 13", "penalty between capsules that stand for the segments",
)

LIFT_EQUATIONS = (
    ("Normal contact", "Eq. 6", "penalty from each device vertex to its nearest skin vertex"),
    ("Friction", "Eq. 7", "regularised, opposite to the sliding velocity"),
    ("Fall", "", f"the centre of mass is {FALL_DISPLACEMENT:g} m from its place on the device"),
)

BED_EQUATIONS = (
    ("Body on the bed", "Eq. 6",
     "penalty from each point of the bed, whose stiffness is the mattress's on its area"),
    ("Friction on the bed", "Eq. 7", "regularised, opposite to the sliding velocity"),
)

SHEET_EQUATIONS = (
    ("Motion of the sheet", "Eq. 4", "a mass at each vertex of a net; weight and drag"),
    ("Springs of the sheet", "Eqs. 5, S1",
     "along the sides and diagonals of the net's cells, and over two cells against bending"),
)

MATERIAL_EQUATIONS = {
    "fabric": (
        ("Fabric", "Eq. S2", "springs of an isotropic fabric, whatever the spacing of the net"),
        ("Buckling", "Eq. S3", "a spring that is compressed gives way"),
    ),
    "paper": (("Material", "Eq. S2", "not used: every spring has the one stiffness given"),),
}

HANGING_EQUATIONS = (
    ("Straps", "Eq. S4", "springs and dampers that only pull, from a patch of the sheet to a hook"),
)

SHEET_CONTACT_EQUATIONS = {
    "foundation": (
        ("Sheet on body and bed", "Eq. S5", "pressure over depth, implicit on each vertex"),
        ("Flesh", "Eq. S12", "stiffens with depth and gives no more at its thickness"),
        ("Friction of the sheet", "Eq. S6", "sticks by a spring to an anchor, slides at µ N"),
    ),
    "penalty": (
        ("Sheet on body and bed", "Eqs. 6, S5", "one spring a vertex, implicit on each vertex"),
        ("Friction of the sheet", "Eqs. 7, S7", "regularised, does not depend on the pressure"),
    ),
}

SOLVER_EQUATIONS = {
    "explicit": (
        ("Solver of the sheet", "Eq. S8",
         "semi-implicit sub-steps; inertia, not weight, is added where they need it"),
    ),
    "liu": (
        ("Solver of the sheet", "Eqs. S9–S11",
         "backward Euler by local and global steps, accelerated"),
    ),
}

SLING_FALL = (
    "Fall", "", f"pelvis or chest is {FALL_DISPLACEMENT:g} m from its place on the sheet",
)

PRESSURE_EQUATIONS = (
    ("Pressure on the skin", "Eq. P1", "force over area, averaged over the cells of a sensor"),
    ("Sensor mat", "Eq. P2", "force over area of square cells on what carries the body"),
)

METHOD_SECTIONS = (
    ("Method", ("method",), ("joints", "contact", "self_contact", "settling", "sheet")),
    ("Settling", ("method", "settling"), ()),
    ("Contact", ("method", "contact"), ()),
    ("Contact of body parts", ("method", "self_contact"), ()),
    ("Simulation of the sheet", ("method", "sheet"), ()),
    ("Posture", ("posture",), ()),
)
"""Title, place in the design, and parts that have a table of their own."""

DEVICE_SECTIONS = {
    "robotic_lift": (
        ("Device", ("device",), ("motion",)),
        ("Motion of the device", ("device", "motion"), ()),
    ),
    "sling_lift": (
        ("Bed", ("device", "bed"), ()),
        ("Sheet", ("device", "sheet"), ()),
        ("Hanging", ("device", "hanging"), ("attachments",)),
        ("Motion of the spreader bar", ("device", "motion"), ()),
    ),
}

KIND_TITLES = {"robotic_lift": "robotic lift", "sling_lift": "sling lift"}

BED_SECTION = ("Contact of skin and bed", ("method", "contact"), ("stiffness_n_per_m",))
"""In place of the contact's where every device has a bed, which brings its own stiffness."""

VARIED = "varied in this study"


@dataclass(frozen=True)
class Table:
    """Rows of texts under a title; without a head the first column names each row."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def device_kinds(ds: xr.Dataset) -> list[str]:
    """Return the kinds of device in a study, in its order."""
    return list(dict.fromkeys(device["kind"] for device in _devices(ds).values()))


def equations_of(ds: xr.Dataset) -> list[tuple[str, str, str]]:
    """Return part, equation and what is computed: those that the study's devices need."""
    design, kinds = _design(ds), device_kinds(ds)
    parts = list(BODY_EQUATIONS)
    if design.get("method", {}).get("self_contact"):
        parts.append(SELF_CONTACT_EQUATION)
    for kind in kinds:
        its = _sling_equations(ds, design) if kind == "sling_lift" else LIFT_EQUATIONS
        of = f" ({KIND_TITLES[kind]})" if len(kinds) > 1 else ""
        parts += [(part + of, equation, what) for part, equation, what in its]
    return [*parts, *PRESSURE_EQUATIONS]


def tables_of(ds: xr.Dataset) -> list[Table]:
    """Return tables of what every candidate shares: method, devices, posture, joint gains."""
    design, devices, varied = _design(ds), _devices(ds), _varied_paths(ds)
    only_beds = device_kinds(ds) == ["sling_lift"]
    tables = [
        _constants(
            design, BED_SECTION if only_beds and section[0] == "Contact" else section, varied
        )
        for section in METHOD_SECTIONS
    ]
    for name, device in devices.items():
        of = f" of {name}" if len(devices) > 1 else ""
        for title, *section in DEVICE_SECTIONS[device["kind"]]:
            tables.append(_constants({"device": device}, (title + of, *section), varied))
        if device["kind"] == "sling_lift":
            tables.append(_straps(f"Straps{of}", device, varied))
    tables.append(_gains(design, varied))
    return [table for table in tables if table.rows]


def _sling_equations(ds: xr.Dataset, design: dict) -> list[tuple[str, str, str]]:
    """Return the equations of a sling lift with the material, solver and contact law it has."""
    materials = dict.fromkeys(
        device["sheet"]["material"]["kind"]
        for device in _devices(ds).values() if device["kind"] == "sling_lift"
    )
    sheet = design["method"]["sheet"]
    return [
        *BED_EQUATIONS,
        *SHEET_EQUATIONS,
        *(part for material in materials for part in MATERIAL_EQUATIONS[material]),
        *HANGING_EQUATIONS,
        *SHEET_CONTACT_EQUATIONS[sheet["contact"]["law"]],
        *SOLVER_EQUATIONS[sheet["solver"]["kind"]],
        SLING_FALL,
    ]


def _constants(design: dict, section: tuple, varied: set[str]) -> Table:
    """Return key and value with unit of a part of a design; empty where it has none."""
    title, place, left_out = section
    part = design
    for key in place:
        part = part.get(key) or {}
    return Table(
        title, (),
        tuple(
            (path_title(path), VARIED if full in varied else shown)
            for path, full, shown in _leaves(part, place)
            if path[0] not in left_out
        ),
    )


def _straps(title: str, device: dict, varied: set[str]) -> Table:
    """Return name, place on sheet and bar, and length of every attachment."""

    def shown(number: int, *keys: str) -> str:
        texts = []
        for key in keys:
            value = device["hanging"]["attachments"][number][key]
            paths = [f"device.hanging.attachments.{number}.{key}"]
            paths += [f"{paths[0]}.{i}" for i in range(3)]
            texts.append(VARIED if varied & set(paths) else path_value((key,), value))
        return " to ".join(texts)

    rows = []
    for number, each in enumerate(device["hanging"]["attachments"]):
        tied = each["kind"] == "edge"
        rows.append(
            (
                each["name"].replace("_", " "),
                f"{each['edge']} edge" if tied else shown(number, "sheet_point_m"),
                shown(number, "bar_start_m", "bar_end_m") if tied else shown(number, "bar_point_m"),
                shown(number, "strap_length_m"),
            )
        )
    return Table(title, ("Strap", "On the sheet", "On the bar", "Length"), tuple(rows))


def _gains(design: dict, varied: set[str]) -> Table:
    """Return joint, stiffness and damping of every kind of joint, as shown."""
    joints = design.get("method", {}).get("joints", {})
    return Table(
        "Joint gains", ("Joint", "Stiffness", "Damping"),
        tuple(
            (
                joint,
                *(
                    VARIED if f"method.joints.{joint}.{key}" in varied
                    else path_value((key,), gains[key])
                    for key in ("stiffness_nm_per_rad", "damping_nms_per_rad")
                ),
            )
            for joint, gains in joints.items()
        ),
    )


def _design(ds: xr.Dataset) -> dict:
    designs = json.loads(ds.attrs.get("designs", "{}"))
    return next(iter(designs.values()), {})


def _devices(ds: xr.Dataset) -> dict[str, dict]:
    return json.loads(ds.attrs.get("devices", "{}"))


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
