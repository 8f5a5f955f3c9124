"""Limits: the table, the pressure–time curves, the margins."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simcore import provenance
from simcore.limits.margins import COMPARATIVE, bounds, margin
from simcore.limits.pressure_time import linder_ganz_pressure, reswick_rogers_pressure
from simcore.limits.table import CONFIDENCE, MMHG, TABLE, as_markdown, limits
from simcore.metrics import METRICS

DOCS = Path(__file__).parents[1] / "docs" / "limits.md"
MINUTE, HOUR, KPA = 60.0, 3600.0, 1e3


def test_every_row_has_a_source_a_confidence_and_a_note():
    with TABLE.open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == len(limits())  # no row hides another
    for limit in limits().values():
        assert limit.source and limit.note and limit.condition, limit
        assert limit.confidence in CONFIDENCE, limit
        assert limit.value > 0


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
    unread = {"pressure_time_product", "lifting_speed"}
    for limit in limits().values():
        assert not (limit.quantity in unread and limit.verified), limit
    assert limits()["neck_moment", "bending, any direction"].verified


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


@given(st.floats(1.0, 200.0), st.floats(0.1, 100.0))
def test_a_longer_time_allows_less(minutes, more):
    times = np.array([minutes, minutes + more]) * MINUTE
    for curve in (linder_ganz_pressure, reswick_rogers_pressure):
        first, second = curve(times)
        assert first > second


@given(st.floats(0, 1e6), st.floats(1e-3, 1e6))
def test_margin_is_one_without_load_and_falls_to_zero_at_the_limit(value, limit):
    assert margin(0.0, limit) == 1
    assert margin(limit, limit) == 0
    assert (margin(value, limit) < 0) == (value / limit > 1)


def by_name(exposure):
    return {bound.name: bound for bound in bounds(exposure)}


def test_every_bound_is_of_a_metric_in_its_unit():
    names = [bound.name for bound in bounds(5 * MINUTE)]
    assert len(names) == len(set(names)) == 10
    for bound in bounds(5 * MINUTE):
        assert bound.units.replace("m/s", "m s-1") == METRICS[bound.metric].units, bound.name
        by_region = METRICS[bound.metric].per == "region"
        assert bound.name.startswith("region_margin_" if by_region else "margin_")
        assert bound.source


def test_bounds_of_a_transfer_of_five_minutes():
    found = by_name(5 * MINUTE)
    rat = found["margin_linder_ganz"]
    assert rat.value == pytest.approx(32 * KPA, rel=1e-4)
    assert margin(16 * KPA, rat.value) == pytest.approx(0.5, abs=1e-4)
    assert rat.extrapolated and not rat.verified and rat.exposure == 300
    assert found["margin_reswick_rogers"].value == pytest.approx(480 * KPA, rel=1e-3)
    assert found["region_margin_capillary_closing_venous"].value == pytest.approx(12 * MMHG)
    neck, speed = found["margin_neck_moment"], found["margin_lifting_speed"]
    assert (neck.value, neck.verified, neck.exposure) == (10, True, None)
    assert (speed.value, speed.verified, speed.extrapolated) == (0.15, False, False)


def test_a_longer_exposure_allows_less_and_is_within_the_data():
    short, long = by_name(5 * MINUTE), by_name(2 * HOUR)
    for name in short:
        timed = short[name].exposure is not None
        assert timed == ("linder" in name or "reswick" in name)
        assert (long[name].value < short[name].value) == timed
        assert short[name].extrapolated == timed and not long[name].extrapolated


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


def test_another_limit_judges_anew_and_simulates_nothing(tmp_path, monkeypatch):
    (tmp_path / "limits").mkdir()
    (tmp_path / "certificate.py").write_text("", encoding="utf-8")
    table = tmp_path / "limits" / "limits.csv"
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path)
    digests = []
    for text in ("value\n1\n", "value\n2\n"):
        table.write_text(text, encoding="utf-8")
        digests.append(
            (provenance.simulation_digest.__wrapped__(), provenance.judgement_digest.__wrapped__())
        )
    (simulated, judged), (simulated_again, judged_again) = digests
    assert simulated == simulated_again
    assert judged != judged_again
