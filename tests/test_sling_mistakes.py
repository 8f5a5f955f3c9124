"""Every mistake in a sling is one line that names file or study, and key, before any simulation."""

import sys
from pathlib import Path

import pytest
from tiny_project import make_project, write_yaml

from simcore.cli import main
from simcore.config.yaml_file import read_yaml

STUDY = """\
title: Which sling?
devices: [tiny_sling]
bodies: [tiny]
posture: lying
method: tiny_sling
axes:
  stiffness_per_width_n_per_m: [10000, 20000]
"""
FILE = "config/sling.yaml"
DEVICE, METHOD = Path("designs/devices/tiny_sling.yaml"), Path("designs/methods/tiny_sling.yaml")
GONE = object()


@pytest.fixture
def study(tmp_path, monkeypatch) -> Path:
    """A project with a coarse sling; the current folder is its root."""
    make_project(tmp_path)
    monkeypatch.chdir(tmp_path)
    device = read_yaml(Path("designs/devices/sling_reclined.yaml"))
    device["sheet"]["vertex_count"] = 300
    write_yaml(DEVICE, device)
    write_yaml(METHOD, read_yaml(Path("designs/methods/production.yaml")))
    Path(FILE).write_text(STUDY, encoding="utf-8")
    return Path(FILE)


@pytest.fixture
def check(study, monkeypatch, capsys):
    """Return a function: run `simcore check`, return exit code, output and error output."""

    def run() -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["simcore", "check", FILE])
        with pytest.raises(SystemExit) as end:
            main()
        captured = capsys.readouterr()
        return end.value.code or 0, captured.out, captured.err

    return run


def told(check) -> str:
    """Return the one line of a mistake."""
    code, out, err = check()
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and err.startswith("error: ")
    assert "Traceback" not in err and "function-" not in err and "Input" not in err
    return err.removeprefix("error: ")


def change(file: Path, path: str, value: object) -> None:
    """Write a value at a path of a YAML file, or take it away."""
    tree = read_yaml(file)
    *parents, last = path.split(".")
    node = tree
    for key in parents:
        node = node[int(key) if isinstance(node, list) else key]
    last = int(last) if isinstance(node, list) else last
    if value is GONE:
        del node[last]
    else:
        node[last] = value
    write_yaml(file, tree)


def test_without_a_mistake_the_candidates_are_counted(check):
    code, out, err = check()
    assert (code, err) == (0, "")
    assert out == f"{FILE}: 2 candidates (1 body × 2 stiffness_per_width_n_per_m)\n"


BOW_TIE = {"shape": "polygon", "corners_m": [[0, -0.5], [0.9, 0.5], [0.9, -0.5], [0, 0.5]]}
LINE = {"shape": "polygon", "corners_m": [[0, 0], [0.5, 0], [0.9, 0]]}
FIRST = "hanging.attachments.0."
SECOND = "hanging.attachments.1."


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        ("sheet.outline", BOW_TIE, "device.sheet.outline: crosses itself"),
        ("sheet.outline", LINE, "device.sheet.outline: "),
        ("sheet.outline.length_m", 0.8, "attachments.leg_left.sheet_point_m: [0.92, 0.45] lies"),
        ("sheet.outline.width_m", 0.6, "attachments.shoulder_left.sheet_point_m: [0.02, 0.45] l"),
        ("sheet.outline.head_width_m", 1.2, "device.sheet.outline.head_length_m, head_width_m: "),
        ("sheet.outline.head_width_m", 0, "device.sheet.outline.head_length_m, head_width_m: acc"),
        (FIRST + "strap_length_m", 0.1, "attachments.shoulder_left.strap_length_m: the strap cann"),
        (FIRST + "bar_point_m", [0, 0, 2], "attachments.shoulder_left.strap_length_m: the strap"),
        ("sheet.pelvis_x_m", 0.95, "device.sheet.pelvis_x_m: 0.95 lies outside the sheet; acce"),
        ("sheet.pelvis_x_m", -0.3, "device.sheet.pelvis_x_m: -0.3 lies outside the sheet; acc"),
    ],
)
def test_in_what_only_building_the_sling_tells(check, path, value, expected):
    """The study and the key, with the study's own path."""
    change(DEVICE, path, value)
    line = told(check)
    assert line.startswith(f"{FILE}: device.")
    assert expected in line


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        ("kind", "hammock", "kind: is hammock; accepted: robotic_lift, sling_lift"),
        ("kind", GONE, "kind: missing; accepted: robotic_lift, sling_lift"),
        ("sheet.outline.shape", "circle", "sheet.outline: shape is 'circle'; accepted: "),
        ("sheet.material.kind", "wool", "sheet.material: kind is 'wool'; accepted: "),
        ("sheet.material.stiffness_per_width_n_per_m", 0, "stiffness_per_width_n_per_m: is 0; acc"),
        ("sheet.material.stiffness_per_width_n_per_m", -1, "is -1; accepted: number above 0"),
        ("sheet.material.areal_density_kg_per_m2", 0, "areal_density_kg_per_m2: is 0; accepted: "),
        ("sheet.vertex_count", 4, "sheet.vertex_count: is 4; accepted: whole number from 9"),
        ("sheet.pelvis_x_m", GONE, "sheet.pelvis_x_m: missing; accepted: number"),
        ("sheet.colour", "blue", "sheet.colour: unknown key; accepted: outline, material"),
        ("hanging.strap_stiffness_n_per_m", 0, "strap_stiffness_n_per_m: is 0; accepted: number"),
        ("hanging.strap_stiffness_n_per_m", -5, "strap_stiffness_n_per_m: is -5; accepted: numb"),
        ("hanging.strap_damping_ns_per_m", -5, "strap_damping_ns_per_m: is -5; accepted: number"),
        ("hanging.attachments", [], "hanging.attachments: is []; accepted: list of at least 1"),
        (SECOND + "name", "shoulder_left", "hanging: attachments holds shoulder_left twice; acc"),
        (FIRST + "kind", "hook", "attachments.0: kind is 'hook'; accepted: "),
        (FIRST + "strap_length_m", -0.1, "attachments.0.strap_length_m: is -0.1; accepted: numb"),
        ("bed.pressure_stiffness_pa_per_m", 0, "pressure_stiffness_pa_per_m: is 0; accepted: nu"),
        ("bed.friction_coefficient", -1, "bed.friction_coefficient: is -1; accepted: number of"),
        ("bed.length_m", 0, "bed.length_m: is 0; accepted: number above 0"),
        ("bed", GONE, "bed: missing; accepted: "),
        ("motion.keyframes.0.time_s", 1, "motion: keyframes must start at time_s 0"),
    ],
)
def test_in_the_file_of_a_sling(check, path, value, expected):
    change(DEVICE, path, value)
    line = told(check)
    assert line.startswith(f"{DEVICE}: ")
    assert expected in line


FIXED = {"adaptive_step": GONE, "time_step_s": 0.002}


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"sheet.step_s": 0.0105}, "sheet.step_s is 0.0105; accepted: a whole number of adaptive_"),
        ({"sheet.step_s": 0.0004}, "sheet.step_s is 0.0004; accepted: a whole number of adaptive_"),
        (FIXED | {"sheet.step_s": 0.005}, "sheet.step_s is 0.005; accepted: a whole number of tim"),
        ({"time_step_s": 0.002}, "time_step_s, adaptive_step: both are given; accepted: one of"),
        ({"adaptive_step": GONE}, "time_step_s, adaptive_step: neither is given; accepted: one"),
        ({"sheet.solver": {"kind": "liu", "tolerance": 0.001}},
         "sheet.solver.kind is liu; accepted: explicit, or time_step_s instead of adaptive_step"),
    ],
)  # fmt: skip
def test_in_the_steps_of_a_method(check, changes, expected):
    for path, value in changes.items():
        change(METHOD, path, value)
    line = told(check)
    assert line.startswith(f"{METHOD}: ")
    assert expected in line


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        ("sheet.step_s", 0.03, "sheet.step_s: is 0.03; accepted: number above 0, at most 0.02"),
        ("sheet.solver.kind", "euler", "sheet.solver: kind is 'euler'; accepted: "),
        ("sheet.solver", {"kind": "liu", "tolerance": 0}, "tolerance: is 0; accepted: number abo"),
        ("contact.law", "glue", "contact: law is 'glue'; accepted: "),
        ("contact.flesh", {"modulus_pa": 0, "thickness_m": 1}, "modulus_pa: is 0; accepted: numbe"),
        ("contact.flesh", {"modulus_pa": 1, "thickness_m": -1}, "thickness_m: is -1; accepted: nu"),
        ("contact.friction_coefficient", -0.1, "friction_coefficient: is -0.1; accepted: n"),
        ("self_contact.damping_time_s", -1, "self_contact.damping_time_s: is -1; accepted: numbe"),
    ],
)
def test_in_what_a_method_may_leave_out(check, path, value, expected):
    change(METHOD, path, value)
    line = told(check)
    assert line.startswith(f"{METHOD}: ")
    assert expected in line


def test_a_sling_needs_a_method_with_a_sheet(check):
    change(METHOD, "sheet", GONE)
    assert told(check).startswith(f"{FILE}: method.sheet is missing; accepted: ")


def test_a_substep_that_the_sheet_cannot_hold(check):
    """It depends on method and device: the line names the study."""
    change(METHOD, "sheet.solver", {"kind": "explicit", "substep_s": 0.004})
    line = told(check)
    assert line.startswith(f"{FILE}: method.sheet.solver.substep_s: 0.004 cannot be held")
    assert "accepted: above 0 to" in line


def test_a_mistake_at_one_point_of_an_axis_is_found(study, check):
    """Here the straps are too short for the second of three values."""
    study.write_text(
        STUDY.replace("stiffness_per_width_n_per_m: [10000, 20000]",
                      "device.sheet.pelvis_x_m: [0.62, 0.3, 0.62001]"), encoding="utf-8",
    )
    assert "strap_length_m: the strap cannot reach" in told(check)


def test_a_mistake_at_one_place_of_the_pelvis_is_found(study, check):
    """The sheet is laid under the pelvis, and moves away from the bar with it."""
    change(Path("designs/postures/lying.yaml"), "placement.pelvis_m", [0.0, 0, 0.5])
    study.write_text(
        STUDY.replace("stiffness_per_width_n_per_m: [10000, 20000]",
                      "posture.placement.pelvis_m.0: [0.6, 0.0]"), encoding="utf-8",
    )
    assert "strap_length_m: the strap cannot reach" in told(check)


@pytest.mark.parametrize("value", ["3", "true", "[sling_lift]", "{a: 1}"])
def test_a_kind_that_is_no_word(check, value):
    tree = DEVICE.read_text(encoding="utf-8")
    assert '"kind": "sling_lift"' in tree
    DEVICE.write_text(tree.replace('"kind": "sling_lift"', f'"kind": {value}'), encoding="utf-8")
    line = told(check)
    assert line.startswith(f"{DEVICE}: kind: is ")
    assert "accepted: robotic_lift, sling_lift" in line


@pytest.mark.parametrize(
    ("devices", "text"),
    [
        ("[tiny_sling, tiny]", "set: {leg_length_m: 0.3}"),
        ("[tiny_sling, tiny]", "set: {strap_stiffness_n_per_m: 20000}"),
        ("[tiny, tiny_sling]", "set: {strap_stiffness_n_per_m: 20000}"),
        ("[tiny_sling, sling_u_shape]", "set: {gap_width_m: 0.2}"),
        ("[sling_u_shape, tiny_sling]", "set: {gap_width_m: 0.2}"),
        ("[sling_u_shape, tiny_sling]", "axes: {gap_width_m: [0.2, 0.1]}"),
        ("[tiny_sling, sling_u_shape]", "axes: {gap_width_m: [0.2, 0.1]}"),
    ],
)
def test_a_key_that_only_one_of_two_devices_has(study, check, devices, text):
    kept = STUDY.split("axes:")[0].replace("[tiny_sling]", devices)
    study.write_text(kept + text + "\n", encoding="utf-8")
    line = told(check)
    assert line.startswith(f"{FILE}: {text.split(':')[0]}")
    key = text.split("{")[1].split(":")[0]
    assert key in line and "accepted: " in line


def test_a_key_that_both_devices_have_is_set_in_both(study, check):
    kept = STUDY.replace("[tiny_sling]", "[tiny_sling, sling_u_shape]")
    study.write_text(kept + "set: {strap_stiffness_n_per_m: 20000}\n", encoding="utf-8")
    code, out, err = check()
    assert (code, err) == (0, "")
    assert "4 candidates" in out
    study.write_text(kept + "set: {strap_stiffness_n_per_m: -1}\n", encoding="utf-8")
    assert "strap_stiffness_n_per_m: is -1; accepted: number above 0" in told(check)
