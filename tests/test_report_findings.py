"""Verdicts, thresholds, sentences and exemplars: pure functions of a dataset."""

import pytest
from report_studies import BODIES, make_dataset

from simcore.report.exemplars import choose_exemplars
from simcore.report.findings import body_findings, headline
from simcore.report.html import simulate_command
from simcore.report.physics import VARIED, constants_of, gains_of
from simcore.report.quantities import QUANTITIES, axes_of, path_value
from simcore.report.trust import trust_rows, trust_summary
from simcore.report.verdicts import (
    best_design,
    gentlest_candidate,
    threshold_axis,
    threshold_of,
    verdicts_of,
)

ANGLES = "{support_angle_deg: [0, 4, 7, 10]}"


def by_angle(**margins):
    """Return an outcome that depends on the support angle alone: a0=…, a4=…"""
    return lambda place: margins[f"a{place['support_angle_deg']:g}"]


@pytest.mark.parametrize(
    ("outcome", "text", "between"),
    [
        (by_angle(a0=-3, a4=-1, a7=0.5, a10=0.8), "falls at 4° and below, holds from 7°", (4, 7)),
        (by_angle(a0=0.5, a4=0.4, a7=-1, a10=-2), "holds up to 4°, falls from 7°", (4, 7)),
        (by_angle(a0=0.5, a4=0.4, a7=0.3, a10=0.2), "holds at every value from 0° to 10°", None),
        (by_angle(a0=-1, a4=-1, a7=-1, a10=-1), "falls at every value from 0° to 10°", None),
        (
            by_angle(a0=-1, a4=0.2, a7=-1, a10=0.3),
            "no single threshold: falls at 0°, holds at 4°, falls at 7°, holds at 10°",
            None,
        ),
        (
            by_angle(a0=-1, a4="blow_up", a7=0.2, a10=0.3),
            "falls at 0° and below, holds from 7° (1 failed, not counted)",
            (0, 7),
        ),
        (
            by_angle(a0="blow_up", a4="blow_up", a7="blow_up", a10="blow_up"),
            "no verdict: every simulation failed",
            None,
        ),
    ],
)
def test_threshold_in_words(tmp_path, outcome, text, between):
    ds = make_dataset(tmp_path, outcome, axes=ANGLES, bodies=BODIES[:1])
    threshold = threshold_of(ds, {"body": BODIES[0]})
    assert threshold.text == text
    assert threshold.between == between


def test_threshold_of_values_in_falling_order(tmp_path):
    outcome = by_angle(a0=-1, a4=-1, a7=0.2, a10=0.2)
    ds = make_dataset(tmp_path, outcome, axes="{support_angle_deg: [10, 0, 7, 4]}")
    assert threshold_of(ds, {"body": BODIES[0]}).between == (4, 7)


def test_a_run_that_ended_early_failed_even_if_it_had_not_fallen(tmp_path):
    ds = make_dataset(tmp_path, by_angle(a0=0.9, a4=0.9, a7=0.9, a10=-0.1), axes=ANGLES)
    ds["status"].loc[{"body": BODIES[0], "support_angle_deg": 0}] = "blow_up"
    verdicts = verdicts_of(ds)
    assert verdicts.sel(body=BODIES[0]).values.tolist() == ["failed", "held", "held", "fell"]


def test_best_design_serves_the_worst_off_body_and_avoids_failures(tmp_path):
    margins = {
        BODIES[0]: {0: 0.9, 4: 0.5, 7: 0.6, 10: 0.9},
        BODIES[1]: {0: 0.1, 4: 0.4, 7: 0.3, 10: "blow_up"},
    }
    ds = make_dataset(
        tmp_path, lambda place: margins[place["body"]][place["support_angle_deg"]], axes=ANGLES
    )
    assert best_design(ds) == {"support_angle_deg": 4}
    assert gentlest_candidate(ds, BODIES[0])["support_angle_deg"] == 0


@pytest.mark.parametrize(
    ("outcome", "sentence"),
    [
        (lambda place: "blow_up", "No verdict: all 8 candidates failed."),
        (lambda place: 0.5, "All 8 candidates held their body."),
        (lambda place: -0.5, "No design holds any body: 8 of 8 candidates fell."),
        (by_angle(a0=-1, a4=0.1, a7=0.2, a10=0.3), "Support angle 4° to 10° holds both bodies."),
        (by_angle(a0=0.1, a4=-1, a7=0.2, a10=1), "Support angle 0°, 7° to 10° holds both bodies."),
        (
            lambda place: 0.5 if place["body"] == BODIES[0] else -1,
            "No design holds both bodies: 4 of 8 candidates held.",
        ),
    ],
)
def test_headline(tmp_path, outcome, sentence):
    assert headline(make_dataset(tmp_path, outcome, axes=ANGLES)) == sentence


def test_body_sentence_names_place_pressure_and_unit(tmp_path):
    ds = make_dataset(tmp_path, by_angle(a0=-1, a4=0.1, a7=0.6, a10=0.3), axes=ANGLES)
    text = body_findings(ds)[0]["text"]
    assert "falls at 0° and below, holds from 4°" in text
    assert "0.60 at support angle 7°, with a peak pressure of 10.0 kPa" in text
    assert "the lowest of all that hold it." in text
    one = make_dataset(tmp_path, by_angle(a0=-1, a4=-1, a7=-1, a10=0.3), axes=ANGLES)
    assert body_findings(one)[0]["text"].endswith("no other design holds it.")
    assert body_findings(ds)[1]["person"] == "female, 80 years, 1.42 m, 40 kg"


def test_exemplars_are_the_threshold_the_best_and_the_ends(tmp_path):
    angles = "{support_angle_deg: {start: 0, stop: 12, step: 1}}"

    def outcome(place):
        angle = place["support_angle_deg"]
        threshold = 6 if place["body"] == BODIES[0] else 4
        return -1.0 if angle < threshold else 0.9 - 0.05 * abs(angle - 9)

    ds = make_dataset(tmp_path, outcome, axes=angles)
    chosen = [
        (each.coordinates["body"], each.coordinates["support_angle_deg"])
        for each in choose_exemplars(ds)
    ]
    male = [(BODIES[0], angle) for angle in (0, 5, 6, 9)]
    female = [(BODIES[1], angle) for angle in (0, 3, 4, 9)]
    assert chosen == male + female
    few = choose_exemplars(ds, at_most=4)
    assert [each.coordinates["support_angle_deg"] for each in few] == [5, 6, 3, 4]


def test_exemplars_leave_failures_out_and_no_body_behind(tmp_path):
    outcome = by_angle(a0="blow_up", a4=-1, a7=0.2, a10=0.5)
    ds = make_dataset(tmp_path, outcome, axes=ANGLES)
    chosen = choose_exemplars(ds, at_most=2)
    assert {each.coordinates["body"] for each in chosen} == set(BODIES)
    assert all(each.coordinates["support_angle_deg"] != 0 for each in choose_exemplars(ds))
    assert choose_exemplars(make_dataset(tmp_path, lambda place: "blow_up", axes=ANGLES)) == []


def test_units_as_a_designer_reads_them(tmp_path):
    ds = make_dataset(
        tmp_path, lambda place: 0.5,
        axes="{seat_depth_m: [0.3, 0.36], stature_m: [1.6, 1.7], sex: [male, female]}",
        bodies=BODIES[:1],
    )
    axes = {axis.name: axis for axis in axes_of(ds)}
    assert axes["seat_depth_m"].label == "Seat depth [mm]"
    assert axes["seat_depth_m"].text(0.36) == "360 mm"
    assert axes["stature_m"].text(1.7) == "1.7 m"
    assert not axes["sex"].numeric and axes["sex"].label == "Sex"
    assert threshold_axis(ds).name == "seat_depth_m"
    assert QUANTITIES["peak_pressure"].text(12_345.0) == "12.3 kPa"
    assert path_value(("angles_deg", "knee", "flexion"), 75.0) == "75°"
    assert path_value(("pelvis_m",), [0.2, 0, 0.5]) == "(200, 0, 500) mm"


def test_command_reproduces_a_candidate(tmp_path):
    ds = make_dataset(tmp_path, lambda place: 0.5, axes="{support_angle_deg: [0, 0.1]}")
    assert simulate_command(ds, {"body": "x y", "support_angle_deg": 0.1}) == (
        "simcore simulate config/made_up.yaml --set 'body=x y' --set support_angle_deg=0.1 "
        "--out run.nc"
    )


def test_trust_flags_what_is_out_of_bounds(tmp_path):
    ds = make_dataset(tmp_path, by_angle(a0=-1, a4=0.1, a7=0.2, a10="blow_up"), axes=ANGLES)
    place = {"body": BODIES[0], "support_angle_deg": 7}
    ds["support_force_ratio"].loc[place] = 0.97
    ds["settled"].loc[place] = 0.0
    rows = trust_rows(ds)
    assert [any(row.flags) for row in rows] == [False, False, True] + [False] * 5
    assert rows[3].note == "blow up: made up to fail" and rows[3].figures[0] == "–"
    tiles = {tile["title"]: tile for tile in trust_summary(ds)}
    assert tiles["Support force over weight, at rest"]["value"] == "0.970 to 1.001"
    assert not tiles["Support force over weight, at rest"]["good"]
    assert tiles["Failed simulations"]["value"] == "2 of 8"
    assert tiles["Real-time factor"]["value"] == "3.00"


def test_physics_tells_constants_with_units_and_what_is_varied(tmp_path):
    ds = make_dataset(tmp_path, lambda place: 0.5, axes=ANGLES)
    tables = {title: dict(rows) for title, rows in constants_of(ds)}
    assert tables["Contact"]["stiffness"] == "1000 N/m"
    assert tables["Device"]["support angle"] == VARIED
    assert tables["Posture"]["knee flexion"].endswith("°")
    assert ("hip", "1 N·m/rad", "1 N·m·s/rad") in gains_of(ds)
