"""The equations and constants that a report tells, against the designs of its study."""

import json

import pytest
from report_studies import ANGLES, BODIES, SLING, make_dataset

from simcore.body.regions import REGION_NAMES
from simcore.body.tissue import region_tissue
from simcore.report.equations import equations_of
from simcore.report.physics import VARIED, tables_of


def test_physics_tells_constants_with_units_and_what_is_varied(tmp_path):
    ds = make_dataset(tmp_path, lambda place: 0.5, axes=ANGLES)
    tables = {table.title: dict(row[:2] for row in table.rows) for table in tables_of(ds)}
    assert tables["Contact"]["stiffness"] == "1,000 N/m"
    assert tables["Device"]["support angle"] == VARIED
    assert tables["Posture"]["knee flexion"].endswith("°")
    (gains,) = [table for table in tables_of(ds) if table.title == "Joint gains"]
    assert ("hip", "1 N·m/rad", "1 N·m·s/rad") in gains.rows
    assert numbers_of(ds) == [
        "Eq. 1", "Eq. 2", "Eq. 3", "Eqs. 8–12", "Eq. 6", "Eq. 7", "", "Eq. P1", "Eq. P3", "Eq. P2"
    ]
    assert "Runge–Kutta" in told_of(ds, "Forward dynamics")
    assert tables["Joints"] == {"passive": "none", "muscle tone": "1"}
    assert not any(title.startswith("Flesh") for title in tables)


PRODUCTION_ON_LIFT = [
    "Eq. 1", "Eqs. I1, I2", "Eq. 2", "Eqs. J1–J5", "Eq. 3", "Eqs. 8–12", "Eq. 13",
    "Eqs. D1–D3", "Eq. C1", "Eq. C2", "Eq. C1", "", "Eq. P1", "Eq. P3", "Eq. P2",
]


def numbers_of(ds):
    return [number for _, number, _ in equations_of(ds)]


def told_of(ds, part):
    (what,) = [what for name, _, what in equations_of(ds) if name == part]
    return what


def edited(ds, **changes):
    """Return the dataset with another method: dotted path below it → value."""
    designs = json.loads(ds.attrs["designs"])
    for design in designs.values():
        for path, value in changes.items():
            *parents, last = path.split(".")
            node = design["method"]
            for key in parents:
                node = node[key]
            node[last] = value
    return ds.assign_attrs(designs=json.dumps(designs))


def test_physics_of_the_lift_in_production(tmp_path):
    ds = make_dataset(tmp_path, lambda place: 0.5, axes=ANGLES, method="production")
    assert numbers_of(ds) == PRODUCTION_ON_LIFT
    assert "stiffens" in told_of(ds, "Flesh") and "by body region" in told_of(ds, "Flesh")
    tables = {table.title: table for table in tables_of(ds)}
    contact = dict(tables["Contact"].rows)
    assert contact["law"] == "foundation"
    assert contact["flesh"] == "by body region"
    assert contact["friction coefficient"] == "0.45"
    assert dict(tables["Joints"].rows) == {"passive": "anatomical", "muscle tone": "1"}
    assert {row[0] for row in tables["Joint gains"].rows} >= {"hip", "neck", "toe"}
    assert len(tables["Joint gains"].rows) == 10
    method = dict(tables["Method"].rows)
    assert method["integrator"] == "implicit"
    assert method["time step"] == "as the motion allows"
    assert method["adaptive step motion"] == "4 mm"
    assert "Simulation of the sheet" not in tables  # the method has one, the lift has not


def test_flesh_is_told_with_its_confidence(tmp_path):
    """As the bodies get it: one value for both sides; what is no number of a source says so."""
    ds = make_dataset(tmp_path, lambda place: 0.5, method="production")
    (table,) = [each for each in tables_of(ds) if each.title.startswith("Flesh of an adult of 23")]
    assert table.head == (
        "Region", "Thickness", "Goes with √BMI", "Confidence", "Modulus", "Confidence"
    )
    rows = {row[0]: row for row in table.rows}
    assert set(rows) == {
        name.removesuffix("_left").removesuffix("_right").replace("_", " ")
        for name in REGION_NAMES
    }
    reference, heavy = region_tissue(), region_tissue(4 * 23.0)
    for index, name in enumerate(REGION_NAMES):
        row = rows[name.removesuffix("_left").removesuffix("_right").replace("_", " ")]
        assert row[1] == f"{1e3 * reference.thickness[index]:g} mm"
        assert row[4] == f"{reference.modulus[index]:,g} Pa"
        grows = heavy.thickness[index] == pytest.approx(2 * reference.thickness[index])
        assert row[2] == ("yes" if grows else "no")
        words = {"read", "derived", "assumed", "from memory, to be confirmed"}
        assert {row[3], row[5]} <= words
    assert rows["abdomen"][3] == "assumed" and rows["chest"][3] == "read"
    assert rows["heel"][3] == "from memory, to be confirmed"


def test_physics_tells_uniform_and_linear_flesh_and_joints_without_limits(tmp_path):
    ds = edited(
        make_dataset(tmp_path, lambda place: 0.5, method="production"),
        **{"contact.flesh": {"modulus_pa": 6e4, "thickness_m": 0.03}, "contact.tissue": "linear",
           "joints.passive": "none", "joints.muscle_tone": 0.5, "self_contact": None},
    )
    gone = ("Eqs. J1–J5", "Eq. 13")
    assert numbers_of(ds) == [each for each in PRODUCTION_ON_LIFT if each not in gone]
    assert told_of(ds, "Flesh") == (
        "pressure in proportion to the strain; alike all over the body"
    )
    tables = {table.title: dict(row[:2] for row in table.rows) for table in tables_of(ds)}
    assert tables["Contact"]["flesh modulus"] == "60,000 Pa"
    assert tables["Contact"]["flesh thickness"] == "30 mm"
    assert tables["Joints"] == {"passive": "none", "muscle tone": "0.5"}
    assert not any(title.startswith("Flesh") for title in tables)


def test_physics_tells_both_of_what_is_varied(tmp_path):
    axes = "{tissue: [linear, stiffening], passive: [none, anatomical]}"
    ds = make_dataset(tmp_path, lambda place: 0.5, axes=axes, method="production")
    assert numbers_of(ds) == PRODUCTION_ON_LIFT
    for part in ("Flesh", "Passive joints"):
        assert VARIED in told_of(ds, part)
    tables = {table.title: dict(row[:2] for row in table.rows) for table in tables_of(ds)}
    assert tables["Contact"]["tissue"] == tables["Joints"]["passive"] == VARIED


def test_physics_of_a_sling(tmp_path):
    axes = "{stiffness_per_width_n_per_m: [5000, 20000], attachments.1.strap_length_m: [0.6, 0.7]}"
    ds = make_dataset(tmp_path, lambda place: 0.5, axes=axes, **SLING)
    design = json.loads(ds.attrs["designs"])[BODIES[0]]
    tables = {table.title: table for table in tables_of(ds)}
    sheet = dict(tables["Sheet"].rows)
    assert sheet["material stiffness per width"] == VARIED
    assert sheet["material areal density"].endswith(" kg/m²")
    bed = dict(tables["Bed"].rows)
    assert bed["pressure stiffness"].endswith(" Pa/m") and bed["damping time"] == "0.1 s"
    assert dict(tables["Contact of skin and sheet"].rows)["friction coefficient"] == "0.45"
    simulation = dict(tables["Simulation of the sheet"].rows)
    assert simulation["solver kind"] == design["method"]["sheet"]["solver"]["kind"]
    assert simulation["contact"] == "that of the skin, and the bed's"
    assert simulation["solver substep"] == "the longest that is safe"
    straps = tables["Straps"]
    assert straps.head == ("Strap", "On the sheet", "On the bar", "Length")
    attachments = design["device"]["hanging"]["attachments"]
    assert len(straps.rows) == len(attachments)
    assert straps.rows[0][3].endswith("m") and straps.rows[1][3] == VARIED
    numbers = numbers_of(ds)
    for needed in ("4", "C3", "S2", "S3", "S4", "S5", "S6", "S12"):
        assert f"Eq. {needed}" in numbers
    assert {"Eqs. S8, S14", "Eqs. S13, S15"} <= set(numbers)
    lift_only = {"Eq. 6", "Eq. 7", "Eqs. D1–D3", "Eq. C1", "Eq. C2"}
    assert not (lift_only | {"Eq. S7", "Eqs. S9–S11"}) & set(numbers)


def test_physics_of_lift_and_sling_tells_whose_contact_is_meant(tmp_path):
    devices = {"devices": ("sling_reclined", "robotic_lift")}
    ds = make_dataset(tmp_path, lambda place: 0.5, **(SLING | devices))
    flesh = {part: number for part, number, _ in equations_of(ds) if part.startswith("Flesh")}
    assert flesh == {"Flesh (sling lift)": "Eq. S12", "Flesh (robotic lift)": "Eq. C1"}
    titles = [table.title for table in tables_of(ds)]
    assert "Contact" in titles and "Simulation of the sheet" in titles


def test_physics_follows_solver_law_and_material(tmp_path):
    ds = edited(
        make_dataset(tmp_path, lambda place: 0.5, **SLING),
        **{"sheet.solver": {"kind": "liu", "tolerance": 1e-3},
           "sheet.contact": {"law": "penalty", "stiffness_n_per_m": 4000.0}},
    )
    devices = json.loads(ds.attrs["devices"])
    for device in devices.values():
        device["sheet"]["material"] = {"kind": "paper"}
    ds.attrs["devices"] = json.dumps(devices)
    numbers = set(numbers_of(ds))
    assert {"Eqs. S9–S11", "Eqs. 7, S7", "Eqs. S13, S15"} <= numbers
    assert not {"Eq. S3", "Eq. S5", "Eq. S6", "Eqs. S8, S14", "Eq. S12"} & numbers
    tables = {table.title: dict(row[:2] for row in table.rows) for table in tables_of(ds)}
    assert tables["Simulation of the sheet"]["contact stiffness"] == "4,000 N/m"
    # Friction and flesh of the method's contact touch nothing here.
    assert list(tables["Contact of skin and bed"]) == ["initial penetration limit"]
    assert not any(title.startswith("Flesh") for title in tables)
