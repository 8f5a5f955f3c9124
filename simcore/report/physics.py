"""Dataset → the physics that was run: constants, flesh and gains, as the designs state them."""

import json
from dataclasses import dataclass

import xarray as xr

from simcore.body.tissue import REFERENCE_BMI, rows_of_table
from simcore.config.designs import JOINT_ANGLES
from simcore.config.paths import leaf_paths
from simcore.report.quantities import path_title, path_value

CONTACT_SECTION = ("Contact", ("method", "contact"), ())
SHEET_SECTION = ("Simulation of the sheet", ("method", "sheet"), ())

METHOD_SECTIONS = (
    ("Method", ("method",), ("joints", "contact", "self_contact", "settling", "sheet")),
    ("Settling", ("method", "settling"), ()),
    ("Joints", ("method", "joints"), tuple(JOINT_ANGLES)),
    CONTACT_SECTION,
    ("Contact of body parts", ("method", "self_contact"), ()),
    SHEET_SECTION,
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

SKIN_AND_SHEET_SECTION = ("Contact of skin and sheet", ("method", "contact"), ())
"""In place of the contact's where every device has a bed, which brings a contact of its own."""

SKIN_AND_BED_SECTION = (
    "Contact of skin and bed", ("method", "contact"),
    ("law", "tissue", "flesh", "damping_time_s", "friction_coefficient"),
)
"""The same where the sheet too has a contact of its own: the start alone is left of it."""

WHERE_NONE = {
    "method.time_step_s": "as the motion allows",
    "method.adaptive_step": "all steps alike",
    "method.contact.flesh": "by body region",
    "method.sheet.contact": "that of the skin, and the bed's",
    "method.sheet.solver.substep_s": "the longest that is safe",
}
"""What stands in a table for a key that is not given."""

VARIED = "varied in this study"


@dataclass(frozen=True)
class Table:
    """Rows of texts under a title; without a head the first column names each row."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def device_kinds(ds: xr.Dataset) -> list[str]:
    """Return the kinds of device in a study, in its order."""
    return list(dict.fromkeys(device["kind"] for device in devices_of(ds).values()))


def first_design(ds: xr.Dataset) -> dict:
    """Return the design of the study's first body; all bodies share the method and the posture."""
    designs = json.loads(ds.attrs.get("designs", "{}"))
    return next(iter(designs.values()), {})


def devices_of(ds: xr.Dataset) -> dict[str, dict]:
    """Return the study's devices by name."""
    return json.loads(ds.attrs.get("devices", "{}"))


def varied_paths(ds: xr.Dataset) -> set[str]:
    """Return the full paths of what the study varies."""
    return {ds[dim].attrs.get("long_name") for dim in ds["candidate"].dims if dim != "body"}


def tables_of(ds: xr.Dataset) -> list[Table]:
    """Return tables of what every candidate shares: method, devices, posture, flesh, gains."""
    design, devices, varied = first_design(ds), devices_of(ds), varied_paths(ds)
    has_sheet = "sling_lift" in device_kinds(ds)
    contact = _contact_section(ds, design)
    tables = [
        _constants(design, contact if section == CONTACT_SECTION else section, varied)
        for section in METHOD_SECTIONS
        if has_sheet or section != SHEET_SECTION
    ]
    for name, device in devices.items():
        of = f" of {name}" if len(devices) > 1 else ""
        for title, *section in DEVICE_SECTIONS[device["kind"]]:
            tables.append(_constants({"device": device}, (title + of, *section), varied))
        if device["kind"] == "sling_lift":
            tables.append(_straps(f"Straps{of}", device, varied))
    if contact != SKIN_AND_BED_SECTION:
        tables.append(_flesh(design))
    tables.append(_gains(design, varied))
    return [table for table in tables if table.rows]


def _contact_section(ds: xr.Dataset, design: dict) -> tuple:
    """Return the section of the contact, by what the study's devices take of it."""
    if device_kinds(ds) != ["sling_lift"]:
        return CONTACT_SECTION
    own_law = design["method"]["sheet"].get("contact")
    return SKIN_AND_BED_SECTION if own_law else SKIN_AND_SHEET_SECTION


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


def _flesh(design: dict) -> Table:
    """Return thickness and modulus of each region's flesh, with what is known of both."""
    contact = design.get("method", {}).get("contact", {})
    by_region = contact.get("law") == "foundation" and not contact.get("flesh")
    return Table(
        f"Flesh of an adult of {REFERENCE_BMI:g} kg/m², by body region",
        ("Region", "Thickness", "Goes with √BMI", "Confidence", "Modulus", "Confidence"),
        tuple(
            (
                region.replace("_", " "),
                path_value(("thickness_m",), float(row["thickness_m"])),
                "no" if row["over_bone"] == "yes" else "yes",
                row["thickness_confidence"],
                path_value(("modulus_pa",), float(row["modulus_pa"])),
                row["modulus_confidence"],
            )
            for region, row in rows_of_table().items() if by_region
        ),
    )


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
            for joint, gains in joints.items() if joint in JOINT_ANGLES
        ),
    )


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
            full = ".".join((*place, *path))
            missing = WHERE_NONE.get(full) if value is None else None
            yield path, full, missing or path_value(path, value)
