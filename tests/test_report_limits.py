"""Limits as the report tells them: over or not, where, how sure; never a verdict."""

import numpy as np
import pytest
from report_studies import BODIES, make_dataset, make_study
from test_report_html import read

from simcore.dataset import open_dataset, write_dataset
from simcore.limits.margins import COMPARATIVE
from simcore.report import build_report
from simcore.report.limits import columns_of, limits_of, lines_of, over_counts, rows_of
from simcore.report.verdicts import verdicts_of

ANGLES = "{support_angle_deg: [0, 7]}"


def by_angle(place) -> float:
    """Sacrum: 36 kPa at 0°, where it falls, and 12 kPa at 7°."""
    return -0.8 if place["support_angle_deg"] == 0 else 0.4


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return make_dataset(tmp_path_factory.mktemp("made"), by_angle, axes=ANGLES)


def lines(ds):
    return {line.title: line for line in lines_of(ds)}


def test_each_limit_is_told_with_value_candidates_and_worst_place(made):
    told = lines(made)
    rat = told["Pressure in rat muscle, 5 min"]
    assert (rat.value, rat.known) == ("32.0 kPa", "unverified, extrapolated")
    assert (rat.over, rat.least) == ("2 of 4", "−0.13")
    assert rat.where == "male_172_70, support angle 0°: sacrum"
    assert "Linder-Ganz et al. 2006" in rat.source
    assert told["Capillary closing, arteriolar end"].over == "4 of 4"
    neck = told["Moment of the neck"]
    assert (neck.value, neck.known, neck.over, neck.least) == ("10.0 N·m", "read", "0 of 4", "0.80")
    assert neck.where == "all alike"
    assert told["Lifting speed"].known == "unverified"
    joints = told["Range of each joint"]
    assert (joints.least, joints.known) == ("0.30", "unverified in part")
    assert joints.where == "all alike: toe right"


def test_a_value_at_its_limit_is_not_over_it(made):
    speed = next(limit for limit in limits_of(made) if limit.title == "Lifting speed")
    for value, over in ((0.0, 0), (-1e-9, 0), (-1e-3, 4)):
        ds = made.assign(margin_lifting_speed=speed.margin * 0 + value)
        ds["margin_lifting_speed"].attrs = speed.margin.attrs
        assert lines(ds)["Lifting speed"].over == f"{over} of 4"


def test_limits_are_counted_by_candidate_and_leave_the_verdict(made):
    before = verdicts_of(made)
    assert over_counts(made).sel(support_angle_deg=0).values.tolist() == [3, 3]
    assert over_counts(made).sel(support_angle_deg=7).values.tolist() == [2, 2]
    assert (verdicts_of(made) == before).all()
    assert before.sel(support_angle_deg=7).values.tolist() == ["held", "held"]


def test_every_candidate_has_its_margins_with_region_and_joint(made):
    headings = [lines[0] for lines in columns_of(made)]
    assert headings.count("Region of the least") == headings.count("Joint of the least") == 1
    assert ("Lifting speed", "0.15 m/s", "unverified") in columns_of(made)
    first, second = rows_of(made)[:2]
    fell, held = (dict(zip(headings, row.figures, strict=True)) for row in (first, second))
    assert (first.verdict, second.verdict) == ("fell", "held")
    assert fell["Pressure in rat muscle, 5 min"] == "−0.13"
    assert held["Pressure in rat muscle, 5 min"] == "0.62"
    assert fell["Region of the least"] == "sacrum" and held["Joint of the least"] == "toe right"
    flagged = {heading for heading, flag in zip(headings, first.flags, strict=True) if flag}
    assert flagged == {
        "Pressure in rat muscle, 5 min", "Capillary closing, arteriolar end",
        "Capillary closing, venous end",
    }


def test_a_failed_candidate_has_no_margin(tmp_path):
    ds = make_dataset(
        tmp_path, lambda place: 0.4 if place["body"] == BODIES[0] else "blow_up", axes="{}"
    )
    assert lines(ds)["Moment of the neck"].over == "0 of 1"
    failed = rows_of(ds)[1]
    assert set(failed.figures) == {"–", ""} and not any(failed.flags)
    assert over_counts(ds).values.tolist() == [2, 0]


def test_the_page_shows_them_with_what_they_cannot_tell(tmp_path):
    _, dataset = make_study(tmp_path, by_angle, axes=ANGLES)
    page = read(build_report(dataset, tmp_path / "report.html"))
    assert COMPARATIVE in page.text
    assert "Margins of every candidate (4)" in page.text
    assert "✕ fell −0.80 over 3" in page.text and "✓ held 0.40 over 2" in page.text
    assert "Range of each joint" in page.text


def test_limits_without_figures_are_left_out(tmp_path):
    _, path = make_study(tmp_path, by_angle, axes=ANGLES)
    ds = open_dataset(path)
    no_ranges = ds.assign(joint_range_margin=ds.joint_range_margin * np.nan)
    assert "Range of each joint" not in lines(no_ranges)
    older = ds.drop_vars([name for name in ds if "margin_" in name] + ["joint_range_margin"])
    write_dataset(older, path)
    page = read(build_report(path, tmp_path / "report.html"))
    assert COMPARATIVE not in page.text
    assert "over 3" not in page.text
