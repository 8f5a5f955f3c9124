"""The validation table: its rows pass, a broken law fails, and the document lists what is run."""

import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simcore.cli import main
from simcore.drawing import nice_ticks
from simcore.dynamics.passive import PassiveJoints
from simcore.errors import SimulationError
from simcore.sheet import ExplicitSolver
from simcore.validation import friction, registry
from simcore.validation.document import replace_table
from simcore.validation.figures import as_svg
from simcore.validation.joints import riener_moments
from simcore.validation.pendulum import Leg, Swing, drop_leg
from simcore.validation.registry import all_criteria, run
from simcore.validation.table import Check, Criterion, Curve, Plot, Row, run_check

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def in_the_root(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.fixture(scope="module")
def outcomes():
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return list(run())


@pytest.fixture
def validate(monkeypatch, capsys):
    """Return a function: arguments → exit code, output, error output."""

    def call(*arguments) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["simcore", "validate", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        captured = capsys.readouterr()
        return end.value.code or 0, captured.out, captured.err

    return call


def without_moments(monkeypatch):
    monkeypatch.setattr(PassiveJoints, "add_torque", lambda *_: None)


def test_every_row_passes(outcomes):
    rows = [row for outcome in outcomes for row in outcome.rows]
    assert [row.key for row in rows if not row.passed] == []
    assert [row.key for row in rows] == [criterion.key for criterion in all_criteria()]
    assert len({row.key for row in rows}) == len(rows)


def test_intervals_are_told_with_a_source():
    for criterion in all_criteria():
        assert np.isfinite([criterion.low, criterion.high]).all(), criterion.key
        assert criterion.low < criterion.high, criterion.key
        assert criterion.source and "|" not in criterion.what + criterion.source


def test_the_document_lists_exactly_the_rows():
    text = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    cells = [line.strip("| ").split(" | ") for line in text.splitlines() if line[:3] == "| `"]
    told = [(key.strip("`"), what, interval, source)
            for key, what, _, interval, source, _ in cells]
    assert told == [
        (each.key, each.what, each.interval, each.source) for each in all_criteria()
    ], "python -m simcore.validation.document"


def test_the_document_shows_exactly_the_plots(outcomes):
    names = {plot.name for outcome in outcomes for plot in outcome.plots}
    images = ROOT / "docs" / "images"
    assert {path.stem for path in images.glob("validation_*")} == names
    text = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert all(f"(images/{name}.svg)" in text for name in names)


def test_only_the_table_of_a_document_is_replaced():
    assert replace_table("a\n\n| b |\n|---|\n| c |\n\nd\n", "| e |\n") == "a\n\n| e |\n\nd\n"


def test_rows_survive_json(validate):
    code, out, err = validate("--json", "--only", "capstan", "--only", "slip_onset")
    told = json.loads(out)
    assert (code, err, told["passed"]) == (0, "", True)
    (slip, capstan) = told["rows"]
    assert (slip["key"], capstan["key"]) == ("slip_onset", "capstan")
    assert capstan.pop("passed")
    (again,) = next(run(["capstan"])).rows
    assert Row(**capstan) == again


def test_friction_that_is_too_weak_fails_its_rows(validate, monkeypatch):
    """Nine tenths of µ: the capstan holds e^(−0.03π) of what it should."""

    class Weak(ExplicitSolver):
        def advance(self, state, dt, contact, bar):
            told = contact.friction_coefficient
            contact.friction_coefficient = 0.9 * told
            reaction = super().advance(state, dt, contact, bar)
            contact.friction_coefficient = told
            return reaction

    monkeypatch.setattr(friction, "ExplicitSolver", Weak)
    code, out, err = validate("--json", "--only", "capstan")
    assert (code, err) == (1, "")
    (row,) = json.loads(out)["rows"]
    assert not row["passed"]
    assert row["value"] == pytest.approx(np.exp(-0.03 * np.pi), rel=0.02)
    code, out, _ = validate("--only", "capstan")
    assert code == 1
    assert "FAIL" in out and "0 passed, 1 failed" in out


def test_a_leg_without_passive_moments_fails_its_rows(validate, monkeypatch):
    without_moments(monkeypatch)
    code, out, _ = validate("--json", "--only", "knee_period", "--only", "knee_second_speed")
    assert code == 1
    assert [row["passed"] for row in json.loads(out)["rows"]] == [False, False]


def test_an_unknown_row_is_one_line(validate):
    code, out, err = validate("--only", "capstam")
    assert (code, out) == (2, "")
    assert err.startswith("error: validate: no row capstam; accepted: catenary_sag, ")
    assert err.count("\n") == 1


def test_a_failed_simulation_is_a_row_that_fails(validate, monkeypatch):
    def blow_up():
        raise SimulationError("blow_up", "the sheet diverged at its vertex 3")

    criterion = Criterion("sag", "a sag", 0.0, 1.0, "m", "closed form")
    monkeypatch.setattr(registry, "CHECKS", (Check((criterion,), blow_up),))
    (row,) = run_check(registry.CHECKS[0]).rows
    assert np.isnan(row.value) and not row.passed
    code, out, _ = validate("--json")
    assert code == 1
    (told,) = json.loads(out)["rows"]
    assert told["value"] is None
    assert "vertex 3" in told["note"]
    assert "vertex 3" in " ".join(validate()[1].split())


@pytest.mark.parametrize(
    ("pose", "expected"),
    [((0, 0, 0), (8.6, 10.4, 6.4)), ((90, 90, 0), (0.3, -3.5, -0.1)),
     ((90, 0, 0), (-51.4, 47.0, 6.4))],
)
def test_the_formula_gives_the_published_moments(pose, expected):
    assert riener_moments(*pose) == pytest.approx(expected, abs=0.06)


def test_a_leg_without_moments_is_a_pendulum(monkeypatch):
    """It swings as far beyond where it rests, and there has the energy of its fall."""
    without_moments(monkeypatch)
    swing = drop_leg(damping=0.0)
    first = swing.turns()[1][0]
    assert first == pytest.approx(2 * swing.rest, abs=1e-4)
    angles = np.linspace(0, swing.rest, 201)
    leg = Leg()
    work = np.trapezoid([leg.moment(angle) for angle in angles], angles)
    peak = swing.figures()["knee_first_speed"]
    assert peak == pytest.approx(np.sqrt(2 * work / leg.inertia), rel=1e-4)


def test_figures_of_a_damped_vibration():
    """K = r (1 − e^(−at) (cos ωt + a/ω sin ωt)): K̇ = r (ω + a²/ω) e^(−at) sin ωt."""
    a, omega, rest = 0.4, 5.7, 1.07
    time = np.arange(0, 5, 2e-3)
    fade, phase = np.exp(-a * time), omega * time
    knee = rest * (1 - fade * (np.cos(phase) + a / omega * np.sin(phase)))
    rate = rest * (omega + a**2 / omega) * fade * np.sin(phase)
    figures = Swing(time, knee, rate, rest).figures()
    half = np.exp(-a * np.pi / omega)
    top = np.arctan2(omega, a) / omega
    peak = rest * (omega + a**2 / omega) * np.exp(-a * top) * np.sin(omega * top)
    assert figures["knee_period"] == pytest.approx(2 * np.pi / omega, rel=1e-5)
    assert figures["knee_relaxation"] == pytest.approx(1 + half, rel=1e-5)
    assert figures["knee_first_speed"] == pytest.approx(peak, rel=1e-4)
    assert figures["knee_second_speed"] == pytest.approx(peak * half, rel=1e-4)


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_ticks_enclose_all_values_evenly(low, extent):
    ticks = nice_ticks(np.array([low, low + extent]))
    steps = np.diff(ticks)
    assert ticks[0] <= low + 1e-6 * extent and ticks[-1] >= low + extent * (1 - 1e-6)
    assert 2 <= len(ticks) <= 9
    assert steps == pytest.approx(steps[0], rel=1e-3)


def test_a_plot_is_a_picture_with_every_point():
    x = np.array([0.0, 1.0, 2.0])
    curves = (Curve("a < b", x, x**2), Curve("c", x[:2], x[:2], marked=True))
    root = ElementTree.fromstring(as_svg(Plot("name", "title", "x & y", "y", curves)))
    names = [element.tag.split("}")[1] for element in root]
    assert names.count("circle") == 2 + 1  # the legend's
    (line,) = (each for each in root.iter() if len(each.get("points", "").split()) == 3
               and each.get("stroke") == "#0072B2")
    places = [tuple(map(float, pair.split(","))) for pair in line.get("points").split()]
    assert len(places) == 3
    assert places[0][0] < places[1][0] < places[2][0]
    assert places[0][1] > places[1][1] > places[2][1]
    texts = [element.text for element in root if element.tag.endswith("text")]
    assert "title" in texts and "x & y" in texts and "a < b" in texts
