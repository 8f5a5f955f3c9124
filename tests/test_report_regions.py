"""Body regions as the report tells them: left beside right, in the units of a designer."""

import numpy as np
import pytest
from report_studies import BODIES, make_dataset, make_study
from test_report_html import read

from simcore.report import build_report
from simcore.report.regions import region_table

ANGLES = "{support_angle_deg: [0, 7]}"


def by_angle(place) -> float:
    """Sacrum: 36 kPa at 0°, where it falls, and 12 kPa at 7°; the left heel always 10 kPa."""
    return -0.8 if place["support_angle_deg"] == 0 else 0.4


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return make_dataset(
        tmp_path_factory.mktemp("made"), by_angle, axes=ANGLES, bodies=BODIES[:1]
    ).squeeze("body")


def test_left_and_right_are_side_by_side_and_the_middle_spans_both(made):
    table = region_table(made.sel(support_angle_deg=7))
    assert table.head == (
        "Peak pressure [kPa]", "Peak shear [kPa]", "Contact area [cm²]", "Load [N]"
    )
    sacrum, heel, skin = table.lines
    assert (sacrum.title, heel.title, skin.title) == ("Sacrum", "Heel", "All skin")
    # 0.1 m² and 700 N shared as the pressures are, 12 to 10
    assert sacrum.cells == (("12.0",), ("3.6",), ("545",), ("382",))
    assert heel.cells == (("10.0", "0.0"), ("3.0", "0.0"), ("455", "0"), ("318", "0"))
    assert skin.cells == (("12.0",), ("3.6",), ("1,000",), ("700",))
    assert table.slipping == "12.0 % of the load slipped while supported, 3.4 % at rest"


def test_after_a_fall_nothing_is_told_of_rest(made):
    table = region_table(made.sel(support_angle_deg=0))
    sacrum, _, skin = table.lines
    assert sacrum.cells == (("36.0",), ("10.8",), ("–",), ("–",))
    assert skin.cells == (("36.0",), ("10.8",), ("–",), ("–",))
    assert table.slipping == "12.0 % of the load slipped while supported"


def test_nothing_is_told_of_slip_without_a_coefficient_nor_of_skin_never_pressed(made):
    held = made.sel(support_angle_deg=7)
    assert region_table(held.assign(slip_share=np.nan)).slipping == ""
    for factor in (0.05, np.nan):  # 600 Pa at the most, or a candidate that failed
        pressure = factor * held.region_peak_pressure
        assert region_table(held.assign(region_peak_pressure=pressure)) is None


def test_the_page_has_a_table_for_each_candidate_shown(tmp_path):
    _, dataset = make_study(tmp_path, by_angle, axes=ANGLES)
    page = read(build_report(dataset, tmp_path / "report.html"))
    assert page.text.count("By body region") == 4
    assert "Heel 10.0 0.0 3.0 0.0 455 0 318 0" in page.text
    assert page.text.count("3.4 % at rest") == 2
