"""Limits: the table, the pressure–time curves, the margins."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simcore import provenance
from simcore.body.regions import REGION_NAMES
from simcore.limits.margins import (
    COMPARATIVE,
    EXPOSURE,
    limit_margins,
    margin,
    minutes_to_curve,
    range_margin,
)
from simcore.limits.pressure_time import (
    linder_ganz_pressure,
    linder_ganz_time,
    reswick_rogers_pressure,
    reswick_rogers_time,
)
from simcore.limits.table import CONFIDENCE, MMHG, TABLE, as_markdown, limits, limits_of

DOCS = Path(__file__).parents[1] / "docs" / "limits.md"
MINUTE, HOUR, KPA = 60.0, 3600.0, 1e3
BASES = {name.removesuffix("_left").removesuffix("_right") for name in REGION_NAMES}


def by_limit(metrics, *arguments):
    return {(each.metric, each.limit): each for each in limit_margins(metrics, *arguments)}


def test_every_row_has_a_source_a_confidence_and_a_note():
    with TABLE.open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == len(limits())  # no row hides another
    for limit in limits().values():
        assert limit.source and limit.note and limit.condition, limit
        assert limit.confidence in CONFIDENCE, limit
        assert limit.value > 0
        assert set(limit.regions) <= BASES, limit


@pytest.mark.parametrize(
    ("quantity", "condition", "value", "units"),
    [
        ("capillary_closing", "arteriolar end", 4266.3, "Pa"),
        ("pressure_time_floor", "rat muscle", 9000, "Pa"),
        ("pressure_time_midpoint", "rat muscle", 5400, "s"),
        ("pressure_time_rate", "rat muscle", 0.0025, "1/s"),
        ("pressure_time_product", "bony prominences", 1.43988e8, "Pa s"),
        ("neck_moment", "bending, any direction", 10, "N m"),
        ("lifting_speed", "loaded", 0.15, "m/s"),
    ],
)
def test_values_are_read_in_si(quantity, condition, value, units):
    limit = limits()[quantity, condition]
    assert limit.value == pytest.approx(value, rel=1e-5)
    assert limit.units == units


def test_what_was_not_read_is_not_called_verified():
    unread = {"pressure_time_product", "lifting_speed", "quasi_static_force"}
    for limit in limits().values():
        assert not (limit.quantity in unread and limit.verified), limit
    assert limits()["neck_moment", "bending, any direction"].verified


def test_each_region_has_at_most_one_force():
    regions = [region for limit in limits_of("quasi_static_force") for region in limit.regions]
    assert len(regions) == len(set(regions))
    assert BASES - set(regions) == {"heel", "foot"}


@pytest.mark.parametrize(
    ("minutes", "kpa"),
    [
        (90, 9 + 23 / 2),
        (90 + math.log(3) / 0.15, 9 + 23 / 4),
        (90 - math.log(3) / 0.15, 9 + 23 * 3 / 4),
        (60, 31.747),
        (120, 9.253),
        (1e6, 9),
    ],
)
def test_linder_ganz_at_known_points(minutes, kpa):
    assert linder_ganz_pressure(minutes * MINUTE) == pytest.approx(kpa * KPA, rel=1e-4)


def test_linder_ganz_keeps_the_levels_of_its_abstract():
    """32 kPa up to an hour and 9 kPa from two hours on, to 0.3 kPa."""
    short, long = np.linspace(15, 60, 10) * MINUTE, np.linspace(2, 12, 10) * HOUR
    assert linder_ganz_pressure(short) == pytest.approx(32 * KPA, abs=300)
    assert linder_ganz_pressure(long) == pytest.approx(9 * KPA, abs=300)


def test_reswick_rogers_at_known_points():
    assert reswick_rogers_pressure(HOUR) == pytest.approx(300 * MMHG)
    assert reswick_rogers_pressure(10 * HOUR) == pytest.approx(30 * MMHG)
    assert reswick_rogers_time(150 * MMHG) == pytest.approx(2 * HOUR)
    assert reswick_rogers_time(0.0) == math.inf


@given(st.floats(1.0, 200.0), st.floats(0.1, 100.0))
def test_a_longer_time_allows_less(minutes, more):
    times = np.array([minutes, minutes + more]) * MINUTE
    for curve in (linder_ganz_pressure, reswick_rogers_pressure):
        first, second = curve(times)
        assert first > second


@given(st.floats(1.0, 170.0))
def test_time_of_pressure_inverts_pressure_of_time(minutes):
    time = minutes * MINUTE
    assert linder_ganz_time(linder_ganz_pressure(time)) == pytest.approx(time, rel=1e-4)
    assert reswick_rogers_time(reswick_rogers_pressure(time)) == pytest.approx(time, rel=1e-12)


def test_pressures_off_the_curve_last_for_ever_or_not_at_all():
    found = linder_ganz_time(np.array([0, 9 * KPA, 32 * KPA, 100 * KPA, np.nan]))
    assert found[:4].tolist() == [math.inf, math.inf, 0, 0]
    assert np.isnan(found[4])
    assert minutes_to_curve(20.5 * KPA) == pytest.approx(90)


@given(st.floats(0, 1e6), st.floats(1e-3, 1e6))
def test_margin_is_one_without_load_and_falls_to_zero_at_the_limit(value, limit):
    assert margin(0.0, limit) == 1
    assert margin(limit, limit) == 0
    assert (margin(value, limit) < 0) == (value / limit > 1)


@given(st.floats(-3, 2.9), st.floats(0.05, 3))
def test_range_margin_is_zero_at_both_ends_and_one_between(low, width):
    at = np.array([low, low + width / 2, low + width, low - width / 2])
    assert range_margin(at, low, low + width) == pytest.approx([0, 1, 0, -1], abs=1e-9)


def test_margins_of_a_candidate():
    found = by_limit({"peak_pressure": 16 * KPA, "neck_moment": 12.0, "lifting_speed": 0.03})
    assert {limit for _, limit in found} == {
        "linder_ganz", "reswick_rogers", "capillary_closing_arteriolar",
        "capillary_closing_venous", "neck_moment", "lifting_speed",
    }
    rat = found["peak_pressure", "linder_ganz"]
    assert rat.margin == pytest.approx(0.5, abs=1e-4)
    assert rat.extrapolated and not rat.verified
    assert "5 min" in rat.label
    assert rat.minutes_to_curve == pytest.approx(90 + math.log(16 / 7) / 0.15)
    assert found["peak_pressure", "capillary_closing_arteriolar"].margin == pytest.approx(
        1 - 16 / (32 * 0.133322), rel=1e-4
    )
    assert found["neck_moment", "neck_moment"].margin == pytest.approx(-0.2)
    assert found["neck_moment", "neck_moment"].verified
    assert found["lifting_speed", "lifting_speed"].margin == pytest.approx(0.8)
    assert not found["lifting_speed", "lifting_speed"].verified


def test_a_longer_exposure_leaves_less_and_is_within_the_data():
    pressure = {"peak_pressure": 16 * KPA}
    short = by_limit(pressure, EXPOSURE)["peak_pressure", "linder_ganz"]
    long = by_limit(pressure, 2 * HOUR)["peak_pressure", "linder_ganz"]
    assert long.margin < 0 < short.margin
    assert short.extrapolated and not long.extrapolated


def test_margins_keep_the_axes_of_a_study_and_what_is_missing():
    pressure = np.array([[8e3, 16e3, np.nan], [4e3, 0.0, 64e3]])
    for each in limit_margins({"region_peak_pressure": pressure}):
        assert each.margin.shape == pressure.shape
        assert np.array_equal(np.isnan(each.margin), np.isnan(pressure))
    assert limit_margins({"contact_area": 0.1}) == ()


def test_forces_go_by_region_and_are_missing_where_the_standard_has_none():
    force = np.full(len(REGION_NAMES), 110.0)
    (found,) = limit_margins({"region_squeeze_force": force}, EXPOSURE, REGION_NAMES)
    left = dict(zip(REGION_NAMES, found.margin, strict=True))
    assert left["abdomen"] == 0
    assert left["upper_thigh_left"] == left["knee_right"] == pytest.approx(0.5)
    assert np.isnan([left["heel_left"], left["foot_right"]]).all()
    assert not found.verified


def test_joint_angles_are_held_to_the_ranges_given():
    (found,) = limit_margins(
        {
            "joint_angle": np.array([[0.5, 0.0], [1.0, -2.0]]),
            "joint_angle_min": np.array([0.0, -1.0]), "joint_angle_max": np.array([1.0, 1.0]),
        }
    )
    assert found.margin == pytest.approx(np.array([[1, 1], [0, -1]]))


def test_verdicts_are_comparative():
    assert "never tell whether a patient comes to harm" in COMPARATIVE
    assert "Boyle et al. 2020" in COMPARATIVE


def test_docs_have_the_table():
    assert as_markdown() in DOCS.read_text(encoding="utf-8"), "python -m simcore.limits.table"


def test_a_changed_data_table_changes_the_digest_of_the_sources(tmp_path, monkeypatch):
    (tmp_path / "a.py").write_text("", encoding="utf-8")
    table = tmp_path / "a.csv"
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path)
    digests = []
    for text in ("thickness\n1\n", "thickness\n2\n"):
        table.write_text(text, encoding="utf-8")
        digests.append(provenance.simulation_digest.__wrapped__())
    assert digests[0] != digests[1]
