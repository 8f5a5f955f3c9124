"""Every mistake is one line that names file, key and what would be accepted."""

import re
from pathlib import Path

import pytest
from tiny_project import STUDY, make_project, write_yaml

from simcore.config import load_study
from simcore.config.yaml_file import parse_scalar, read_yaml
from simcore.errors import DesignError

GONE = object()


@pytest.fixture
def study(tmp_path, monkeypatch) -> Path:
    path = make_project(tmp_path)
    monkeypatch.chdir(tmp_path)
    return path


def told(study: Path, replace=None) -> str:
    """Return the one line that loading the study fails with."""
    with pytest.raises(DesignError) as error:
        load_study(study.relative_to(Path.cwd()), replace)
    line = str(error.value)
    assert "\n" not in line
    assert "function-" not in line and "Input" not in line  # words of the validation library
    return line


def axis(text: str) -> str:
    return STUDY.replace("[0, 7]", text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (STUDY + "colour: red\n", "colour: unknown key; accepted: title, devices, bodi"),
        (STUDY.replace("devices: [tiny]\n", ""), "devices: missing; accepted: list of at least 1"),
        (STUDY.replace("devices:", "divices:"), "divices: unknown key"),
        (STUDY.replace("bodies: [tiny]", "bodies: tiny"), "bodies: is 'tiny'; accepted: li"),
        (STUDY.replace("bodies: [tiny]", "bodies: []"), "bodies: is []; accepted: list of"),
        (STUDY.replace("bodies: [tiny]", "bodies:"), "bodies: is empty; accepted: list"),
        (STUDY.replace("bodies: [tiny]", "bodies: [tiny, tiny]"), "bodies: holds tiny twice"),
        (STUDY.replace("bodies: [tiny]", "bodies: [tiny, 3]"), "bodies.1: is 3; accepted: text"),
        (STUDY.replace("bodies: [tiny]", "bodies: [tinny]"), "bodies: no designs/bodies/tinny."),
        (STUDY.replace("devices: [tiny]", "devices: [tall]"), "devices: no designs/devices/tall."),
        (STUDY.replace("seated", "prone"), "posture: no designs/postures/prone.yaml; accepted: l"),
        (STUDY.replace("method: tiny", "method: x"), "method: no designs/methods/x.yaml"),
        (STUDY.replace("devices: [tiny]", "devices: tiny"), "devices: is 'tiny'; accepted: list"),
        (STUDY.replace("Does the line hold?", "''"), "title: is ''; accepted: text"),
        (STUDY + "candidates_per_job: 0\n", "candidates_per_job: is 0; accepted: whole number of"),
        (STUDY + "candidates_per_job: true\n", "candidates_per_job: is true; accepted: whole"),
        (STUDY + "title: again\n", "line 8: found duplicate key \"title\""),
        (STUDY.replace("Does", "[Does"), "line 2: expected ',' or ']'"),
        ("\tx: 1", "line 1: found character"),
        ("", "must hold keys and values"),
        ("# only a comment\n", "must hold keys and values"),
        ("- a\n", "must hold keys and values"),
        ("just text", "must hold keys and values"),
        ("a: 1\n---\nb: 2\n", "line 2: but found another document"),
        (STUDY + "größe: 1\n", "größe: unknown key"),
        (axis("5"), "axes.support_angle_deg: is 5; accepted: {start, stop, step}, {start, stop, c"),
        (axis(""), "axes.support_angle_deg: is empty; accepted: {start"),
        (axis("[]"), "axes.support_angle_deg: is []; accepted: list of at least 1"),
        (axis("{}"), "axes.support_angle_deg.start: missing; accepted: number"),
        (axis("[1, 1.0]"), "axes: support_angle_deg holds 1 twice; accepted: different values"),
        (axis("[[1]]"), "axes.support_angle_deg.0: is [1]; accepted: number, text or true/false"),
        (axis("[null]"), "axes.support_angle_deg.0: is empty; accepted: number"),
        (axis("[0, 99]"), "device.support_angle_deg: is 99; accepted: number from -30 to 60"),
        (axis("[0, flat]"), "device.support_angle_deg: is 'flat'; accepted: number from"),
        (axis("['7']"), "device.support_angle_deg: is '7'; accepted: number from"),
        (axis("[true]"), "device.support_angle_deg: is true; accepted: number from"),
        (axis("[.nan]"), "device.support_angle_deg: is nan; accepted: number from"),
        (axis("[-.inf]"), "device.support_angle_deg: is -inf; accepted: number from"),
        (axis("{start: 1, stop: 0, step: 1}"), "stop is 0; accepted: at least start, 1"),
        (axis("{start: 0, stop: 1, step: 0}"), "step: is 0; accepted: number above 0"),
        (axis("{start: 0, stop: 1, step: -1}"), "step: is -1; accepted: number above 0"),
        (axis("{start: 0, stop: 1, step: 1e-9}"), "step makes too many values; accepted: up to"),
        (axis("{start: 0, stop: .inf, step: 1}"), "stop: is inf; accepted: number"),
        (axis("{start: a, stop: 1, step: 1}"), "start: is 'a'; accepted: number"),
        (axis("{start: 0, stop: 1, stp: 1}"), "stp: unknown key; accepted: start, stop, step"),
        (axis("{start: 0, stop: 1}"), "step: missing; accepted: number above 0"),
        (axis("{start: 0, stop: 1, count: 1}"), "count: is 1; accepted: whole number from 2"),
        (axis("{start: 0, stop: 1, count: 2.5}"), "count: is 2.5; accepted: whole number"),
        (axis("{start: 0, stop: 1, step: 1, count: 3}"), "step: unknown key; accepted: start, st"),
        (STUDY.replace("support_angle_deg", "support_angle"),
         "axes: support_angle: no such key in the design; accepted: support_angle_deg"),
        (STUDY.replace("support_angle_deg", "stiffness_nm_per_rad"),
         "axes: stiffness_nm_per_rad: several keys end so; accepted: method.joints.lumbar.stiff"),
        (STUDY.replace("support_angle_deg", "pelvis_m"),
         "axes: pelvis_m: holds several values; accepted: posture.placement.pelvis_m.0"),
        (STUDY.replace("support_angle_deg", "body"), "axes: body: holds several values; accepted"),
        (STUDY + "  device.support_angle_deg: [1]\n",
         "axes.device.support_angle_deg: the same as support_angle_deg; accepted: one of them"),
        (STUDY + "set: {support_angle_deg: 1}\n",
         "set.support_angle_deg: is also an axis; accepted: one of the two"),
        (STUDY + "set: {nope: 1}\n", "set: nope: no such key in the design; accepted: "),
        (STUDY + "set: {mass_kg: -3}\n", "set.mass_kg: body.mass_kg: is -3; accepted: number from"),
        (STUDY + "set: {mass_kg: [70]}\n", "set.mass_kg: is [70]; accepted: number, text or"),
        (STUDY + "set: [1]\n", "set: is [1]; accepted: by key"),
        (STUDY + "set: {duration_min_s: 4}\n",
         "set.duration_min_s: method.settling: duration_min_s must not exceed duration_max_s"),
        (STUDY + "set: {keyframes.0.time_s: 1}\n", "keyframes must start at time_s 0"),
        (STUDY + "set: {shape: mesh}\n", "device.surface.seat_depth_m: unknown key; accepted: sha"),
        (STUDY + "  hold_s: {start: 0, stop: 1, step: 0.00002}\n",
         "axes: 100002 candidates; accepted: up to 100000"),
    ],
)
def test_in_a_study(study, text, expected):
    study.write_text(text, encoding="utf-8")
    line = told(study)
    assert line.startswith("config/tiny.yaml: ")
    assert expected in line


@pytest.mark.parametrize("data", [b"\xff\xfe\x00", b"title: \xe4\n"])
def test_not_text(study, data):
    study.write_bytes(data)
    assert told(study).startswith("config/tiny.yaml: not YAML (")


def test_no_file(study):
    study.unlink()
    assert told(study) == "config/tiny.yaml: cannot be read (No such file or directory)"


def test_a_folder(study):
    study.unlink()
    study.mkdir()
    assert told(study) == "config/tiny.yaml: cannot be read (Is a directory)"


def test_no_designs_above(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "alone.yaml").write_text(STUDY, encoding="utf-8")
    assert told(tmp_path / "alone.yaml") == "alone.yaml: no folder designs/ beside or above it"


DEVICE, BODY = "devices/tiny", "bodies/tiny"
POSTURE, METHOD = "postures/seated", "methods/tiny"


@pytest.mark.parametrize(
    ("design", "path", "value", "expected"),
    [
        (DEVICE, "surface.widht_m", 1, "surface.widht_m: unknown key; accepted: shape, seat_depth"),
        (DEVICE, "surface.width_m", GONE, "surface.width_m: missing; accepted: number above 0"),
        (DEVICE, "surface.width_m", -0.4, "surface.width_m: is -0.4; accepted: number above 0"),
        (DEVICE, "surface.width_m", "46 cm", "is '46 cm'; accepted: number above 0"),
        (DEVICE, "surface.width_m", "0.46", "is '0.46'; accepted: number above 0"),
        (DEVICE, "surface.width_m", [1], "surface.width_m: is [1]; accepted: number above 0"),
        (DEVICE, "surface.width_m", {"m": 1}, "surface.width_m: is {m}; accepted: number above 0"),
        (DEVICE, "surface.width_m", None, "surface.width_m: is empty; accepted: number above 0"),
        (DEVICE, "surface.width_m", True, "surface.width_m: is true; accepted: number above 0"),
        (DEVICE, "surface.vertex_count", 1000.5, "is 1000.5; accepted: whole number from 500"),
        (DEVICE, "surface.vertex_count", "1000", "is '1000'; accepted: whole number from 500"),
        (DEVICE, "surface.shape", "sofa", "surface: shape is 'sofa'; accepted: mesh, seat_and"),
        (DEVICE, "surface.shape", GONE, "surface: shape is empty; accepted: mesh, seat_and_back"),
        (DEVICE, "surface.fillet_radius_m", 0.4, "surface: seat_depth_m must exceed"),
        (DEVICE, "surface", 1, "surface: is 1; accepted: keys and values with shape: mesh or"),
        (DEVICE, "kind", "sling", "kind: is sling; accepted: robotic_lift, sling_lift"),
        (DEVICE, "support_angle_rad", 0.1, "support_angle_rad: unknown key; accepted: kind, supp"),
        (DEVICE, "motion.keyframes.0.tim_s", 0, "motion.keyframes.0.tim_s: unknown key; accepted"),
        (DEVICE, "motion.keyframes.0.time_s", 1, "motion: keyframes must start at time_s 0"),
        (DEVICE, "motion.rotation_axis", [0, 0, 0], "is [0, 0, 0]; accepted: a direction"),
        (DEVICE, "motion.rotation_axis", [0, 1], "motion.rotation_axis.2: missing"),
        (DEVICE, "motion.rotation_axis", 1, "motion.rotation_axis: is 1; accepted: list of 3"),
        (BODY, "sex", "man", "sex: is 'man'; accepted: female or male"),
        (BODY, "stature_m", 172, "stature_m: is 172; accepted: number from 1.2 to 2.2"),
        (BODY, "mass_lb", 150, "mass_lb: unknown key; accepted: sex, age_years"),
        (POSTURE, "angles_deg.hip.flexion", 900, "angles_deg.hip.flexion: is 900; accepted: numb"),
        (POSTURE, "angles_deg.hipp", {}, "angles_deg: unknown joint hipp; accepted: lumbar"),
        (POSTURE, "angles_deg.lumbar_left", {}, "angles_deg: unknown joint lumbar_left; accepted"),
        (POSTURE, "angles_deg.knee.bend", 5, "knee has no angle bend; accepted: flexion"),
        (POSTURE, "angles_deg.knee_left", {}, "knee is given with and without its side; accepted"),
        (POSTURE, "angles_deg.hip", 5, "angles_deg.hip: is 5; accepted: by key: number from"),
        (POSTURE, "placement.approach", [[0, 0, 0]], "placement.approach.0: is [0, 0, 0]; accept"),
        (METHOD, "joints.hipp", {}, "joints.hipp: unknown key; accepted: lumbar, thoracic"),
        (METHOD, "joints.hip", 1, "joints.hip: is 1; accepted: {stiffness_nm_per_rad, damping"),
        (METHOD, "time_step_s", 0, "time_step_s: is 0; accepted: number above 0, at most 0.02"),
        (METHOD, "integrator", "euler", "integrator: is 'euler'; accepted: rk4"),
        (METHOD, "contact.search_radius_m", 3, "contact.search_radius_m: is 3; accepted: number f"),
    ],
)
def test_in_a_design(study, design, path, value, expected):
    file = Path("designs", f"{design}.yaml")
    tree = read_yaml(file)
    *parents, last = path.split(".")
    node = tree
    for key in parents:
        node = node[int(key) if isinstance(node, list) else key]
    if value is GONE:
        del node[last]
    else:
        node[last] = value
    write_yaml(file, tree)
    line = told(study)
    assert line.startswith(f"{file}: ")
    assert expected in line


@pytest.mark.parametrize("value", [".nan", ".inf", "-.inf"])
def test_numbers_must_be_finite(study, value):
    file = Path("designs/devices/tiny.yaml")
    file.write_text(re.sub('"width_m": [0-9.]+', f'"width_m": {value}', file.read_text()))
    assert re.search(r"surface.width_m: is -?(nan|inf); accepted: number above 0", told(study))


def test_missing_mesh(study):
    file = Path("designs/devices/tiny.yaml")
    tree = read_yaml(file)
    tree["surface"] = {
        "shape": "mesh", "file": "seat.stl", "unit": "m", "recline_deg": 0, "vertex_count": 900
    }
    write_yaml(file, tree)
    assert "device.surface.file: no such mesh: seat.stl; accepted: a path from" in told(study)


def test_long_values_are_cut(study):
    study.write_text(STUDY.replace("devices: [tiny]", f"devices: {'x' * 500}"))
    assert len(told(study)) < 200


@pytest.mark.parametrize(
    ("replace", "expected"),
    [
        ({"nope": 1}, "--set: nope: no such key in the design; accepted: "),
        ({"mass_kg": "x"}, "--set mass_kg: body.mass_kg: is 'x'; accepted: number from 25 to 250"),
        ({"body": "x"}, "config/tiny.yaml: bodies: no designs/bodies/x.yaml; accepted: "),
        ({"time_s": 1}, "--set: time_s: several keys end so; accepted: device.motion.keyframes.0"),
        ({"mass_kg": 70, "body.mass_kg": 70}, "--set body.mass_kg: the same as mass_kg; accepted"),
    ],
)
def test_on_the_command_line(study, replace, expected):
    assert told(study, replace).startswith(expected)


@pytest.mark.parametrize(
    ("text", "value"),
    [("7", 7), ("7.5", 7.5), ("1e-3", 1e-3), ("true", True), ("yes", "yes"), ("mesh", "mesh"),
     ("[1, 2]", "[1, 2]"), ("[1", "[1"), ("2020-01-01", "2020-01-01"), ("'7'", "'7'")],
)
def test_values_on_the_command_line(text, value):
    parsed = parse_scalar(text)
    assert parsed == value and type(parsed) is type(value)
