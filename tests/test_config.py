"""Studies → candidates: values of axes, paths, ids."""

import json
import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tiny_project import ROOT, STUDY, make_project

from simcore.config import load_study
from simcore.config.designs import JOINT_ANGLES, PAIRED_JOINTS, BodyDesign
from simcore.config.paths import leaf_paths, resolve_path, set_value
from simcore.config.study import Linspace, Range
from simcore.config.units import units_of_key
from simcore.errors import DesignError

STUDIES = sorted((ROOT / "config").glob("*.yaml"))


@pytest.fixture
def study(tmp_path) -> Path:
    return make_project(tmp_path)


def ids(study, text=None, **options):
    if text is not None:
        study.write_text(text, encoding="utf-8")
    return [each.id for each in load_study(study, **options).candidates]


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_every_shipped_study_loads(path):
    study = load_study(path)
    assert study.root == ROOT
    assert len({each.id for each in study.candidates}) == len(study.candidates)
    assert len(study.candidates) == math.prod(map(len, study.axes.values()))


def test_default_study_is_two_bodies_at_thirteen_angles():
    study = load_study(ROOT / "config" / "lift_angle.yaml")
    assert study.axes["support_angle_deg"] == tuple(range(13))
    assert len(study.axes["body"]) == 2
    assert study.candidates[1].coordinates == {"body": "male_172_70", "support_angle_deg": 1}
    assert study.candidates[1].design.device.support_angle_deg == 1
    assert study.folder == ROOT / "results" / "lift_angle"


finite = st.floats(-1e3, 1e3).map(lambda x: round(x, 3))


@given(start=finite, steps=st.integers(0, 300), step=st.integers(1, 5000))
@example(start=-6.0, steps=120, step=100)
def test_range_holds_both_ends(start, steps, step):
    step /= 1000
    values = Range(start=start, stop=start + steps * step, step=step).values
    assert len(values) == steps + 1
    assert values[0] == start
    assert values[-1] == pytest.approx(start + steps * step, abs=1e-9)
    assert np.diff(values) == pytest.approx(step, abs=1e-9)
    assert not any(math.copysign(1, value) < 0 for value in values if value == 0)


@given(start=finite, length=st.floats(0, 100), step=st.floats(0.01, 10))
def test_range_never_passes_its_end(start, length, step):
    values = Range(start=start, stop=start + length, step=step).values
    assert values[-1] <= start + length + 1e-8
    assert values[-1] + step > start + length - 1e-8


@given(start=finite, stop=finite, count=st.integers(2, 200))
def test_linspace_is_even_and_holds_both_ends(start, stop, count):
    values = Linspace(start=start, stop=stop, count=count).values
    assert (len(values), values[0], values[-1]) == (count, start, stop)
    assert np.diff(values) == pytest.approx((stop - start) / (count - 1), abs=1e-9)


def test_steps_of_a_tenth_are_the_numbers_a_person_would_write():
    assert Range(start=0, stop=0.5, step=0.1).values == (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)


class TestIds:
    """Equal content, equal id; any other content, another."""

    def test_order_comments_names_and_spelling_do_not_matter(self, study):
        wanted = ids(study)
        lines = STUDY.splitlines()
        reordered = "\n".join(["# a comment", *lines[5:], *reversed(lines[:5])])
        assert ids(study, reordered) == wanted
        assert ids(study, STUDY.replace("[0, 7]", "[0.0, 7.0]")) == wanted
        assert ids(study, STUDY.replace("[0, 7]", "{start: 0, stop: 7, step: 7}")) == wanted
        bodies = study.parents[1] / "designs" / "bodies"
        (bodies / "other.yaml").write_text((bodies / "tiny.yaml").read_text())
        assert ids(study, STUDY.replace("bodies: [tiny]", "bodies: [other]")) == wanted
        (bodies / "tiny.yaml").write_text(
            "\n".join(reversed((bodies / "tiny.yaml").read_text().splitlines()))
        )
        assert ids(study, STUDY) == wanted

    def test_a_default_written_out_is_the_default(self, study):
        body = study.parents[1] / "designs" / "bodies" / "tiny.yaml"
        body.write_text(body.read_text().replace("skin_vertices: 2000", ""))
        left_out = ids(study)
        body.write_text(body.read_text() + "skin_vertices: 14000\n")
        assert ids(study) == left_out

    def test_the_route_of_a_value_does_not_matter(self, study):
        _, wanted = ids(study)
        assert ids(study, replace={"support_angle_deg": 7}) == [wanted]
        fixed = STUDY.partition("axes:")[0] + "set: {device.support_angle_deg: 7}\n"
        assert ids(study, fixed) == [wanted]

    def test_every_value_matters(self, study):
        study.write_text(STUDY.partition("axes:")[0], encoding="utf-8")
        (candidate,) = load_study(study).candidates
        tree = candidate.design.model_dump()
        changed = 0
        for path in map(".".join, leaf_paths(tree)):
            value = tree
            for key in path.split("."):
                value = value[int(key)] if isinstance(value, list | tuple) else value[key]
            if value is None:
                continue  # the robotic lift has no sheet
            other = {"mesh": "de_leva", "de_leva": "mesh", "male": "female"}.get(value) if (
                isinstance(value, str)
            ) else value * 1.001 if isinstance(value, float) and value else value + 1
            if other is None or path.endswith("keyframes.0.time_s"):
                continue  # one value alone is accepted
            if "approach" in path:
                other = -0.5
            assert ids(study, replace={path: other}) != [candidate.id], path
            changed += 1
        assert changed > 50

    def test_the_bytes_of_a_mesh_matter(self, study):
        root = study.parents[1]
        (root / "designs" / "devices" / "tiny.yaml").write_text(
            "kind: robotic_lift\nsupport_angle_deg: 0\n"
            "surface: {shape: mesh, file: a.stl, unit: m, recline_deg: 0, vertex_count: 500}\n"
            "motion:\n  translation_axis: [0, 0, 1]\n  rotation_axis: [0, 0, 1]\n"
            "  rotation_point_m: [0, 0, 0]\n  keyframes:\n"
            "    - {time_s: 0, translation_m: 0, rotation_deg: 0}\n"
            "    - {time_s: 1, translation_m: 1, rotation_deg: 0}\n"
        )
        (root / "a.stl").write_bytes(b"one")
        first = ids(study)
        assert ids(study) == first
        (root / "a.stl").write_bytes(b"two")
        assert not set(ids(study)) & set(first)

    def test_id_names_a_file(self, study):
        assert all(len(each) == 12 and int(each, 16) >= 0 for each in ids(study))


trees = st.recursive(
    st.integers(),
    lambda inner: st.dictionaries(st.text("abcd", min_size=1, max_size=2), inner, min_size=1)
    | st.lists(inner, min_size=1, max_size=3),
    max_leaves=12,
).filter(lambda tree: isinstance(tree, dict))


@given(tree=trees)
def test_every_full_path_names_its_own_value(tree):
    before = json.dumps(tree)
    for path in leaf_paths(tree):
        assert resolve_path(tree, ".".join(path), "here") == ".".join(path)
    set_value(tree, ".".join(path), "new")
    assert (json.dumps(tree).count('"new"'), before.count('"new"')) == (1, 0)


@given(tree=trees, data=st.data())
def test_an_end_of_a_path_names_it_or_is_refused(tree, data):
    paths = list(leaf_paths(tree))
    path = data.draw(st.sampled_from(paths))
    end = path[data.draw(st.integers(0, len(path) - 1)) :]
    alike = [each for each in paths if each[-len(end) :] == end]
    if len(alike) == 1 or end in alike:
        expected = end if end in alike else path
        assert resolve_path(tree, ".".join(end), "here") == ".".join(expected)
    else:
        with pytest.raises(DesignError, match="several keys end so"):
            resolve_path(tree, ".".join(end), "here")


def test_axes_are_named_by_the_end_of_their_path(study):
    study.write_text(
        STUDY + "  hip.stiffness_nm_per_rad: [1, 2]\n  knee.stiffness_nm_per_rad: [1, 2]\n"
        "  pelvis_m.2: [0.5, 0.6]\n"
    )
    loaded = load_study(study)
    assert list(loaded.axes) == [
        "body",
        "support_angle_deg",
        "method.joints.hip.stiffness_nm_per_rad",
        "method.joints.knee.stiffness_nm_per_rad",
        "posture.placement.pelvis_m.2",
    ]
    last = loaded.candidates[-1].design
    assert last.posture.placement.pelvis_m[2] == 0.6
    assert last.method.joints.knee.stiffness_nm_per_rad == 2


def test_candidates_share_nothing(study):
    study.write_text(STUDY.replace("support_angle_deg: [0, 7]", "hip.abduction: [1, 2, 3]"))
    angles = [each.design.posture.angles_deg["hip"]["abduction"]
              for each in load_study(study).candidates]
    assert angles == [1, 2, 3]


def test_values_that_are_only_valid_together(study):
    study.write_text(STUDY + "set: {duration_min_s: 4, duration_max_s: 5}\n")
    assert load_study(study).candidates[0].design.method.settling.duration_min_s == 4


def test_an_axis_may_change_the_body(study):
    study.write_text(STUDY + "  mass_kg: [65, 70]\n")
    assert [each.design.body.mass_kg for each in load_study(study).candidates] == [65, 70] * 2


def test_set_on_the_command_line_takes_precedence(study):
    study.write_text(STUDY + "set: {hold_s: 3}\n")
    loaded = load_study(study, {"hold_s": 1, "support_angle_deg": 5, "body": "male_187_110"})
    (candidate,) = loaded.candidates
    assert candidate.design.method.hold_s == 1
    assert candidate.design.device.support_angle_deg == 5
    assert candidate.coordinates == {"body": "male_187_110"}
    assert candidate.design.body.mass_kg == 110


def test_a_study_without_axes_is_one_candidate_a_body(study):
    study.write_text(STUDY.partition("axes:")[0])
    assert len(load_study(study).candidates) == 1


def test_ten_thousand_candidates_load_in_seconds(study):
    study.write_text(STUDY.replace("[0, 7]", "{start: 0, stop: 9.9, step: 0.1}")
                     + "  seat_depth_m: {start: 0.3, stop: 0.4, count: 100}\n")
    begin = time.process_time()
    assert len(load_study(study).candidates) == 10_000
    assert time.process_time() - begin < 5


def test_texts_of_all_languages_are_kept(study):
    text = STUDY.replace("Does the line hold?", "Hält die Straße – 保持できるか? ✓")
    study.write_text(text, encoding="utf-8")
    assert load_study(study).file.title == "Hält die Straße – 保持できるか? ✓"


def test_names_of_joints_and_angles_are_those_of_the_body():
    from simcore.body.posture import JOINTS, TURNS

    assert {
        joint: tuple(turn.name for turn in turns) for joint, turns in TURNS.items()
    } == JOINT_ANGLES
    assert {joint for joint in TURNS if f"{joint}_left" in JOINTS} == set(PAIRED_JOINTS)


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("device.support_angle_deg", "degree"), ("method.hold_s", "s"),
        ("method.contact.stiffness_n_per_m", "N m-1"), ("body.sex", "1"),
        ("posture.placement.pelvis_m.2", "m"), ("posture.angles_deg.hip.flexion", "degree"),
        ("method.joints.hip.damping_nms_per_rad", "N m s rad-1"), ("body.skin_vertices", "1"),
        ("method.settling.rest_speed_m_per_s", "m s-1"),
    ],
)
def test_a_key_carries_its_unit(key, unit):
    assert units_of_key(key) == unit


def test_designs_are_values():
    man = BodyDesign(sex="male", age_years=45, stature_m=1.72, mass_kg=70)
    assert man == man.model_copy() and len({man, man.model_copy()}) == 1
    with pytest.raises(ValueError, match="frozen"):
        man.mass_kg = 80
