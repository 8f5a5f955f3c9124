"""Verdicts, thresholds, sentences and exemplars: pure functions of a dataset."""

import pytest
from report_studies import BODIES, SLING, make_dataset

from simcore.dataset import simulate_command
from simcore.report.equations import equations_of
from simcore.report.exemplars import choose_exemplars
from simcore.report.findings import best_sentence, body_findings, headline
from simcore.report.physics import tables_of
from simcore.report.quantities import QUANTITIES, axes_of, number_text, path_value
from simcore.report.trust import columns_of, fill_missing, trust_rows, trust_summary
from simcore.report.verdicts import (
    best_design,
    gentlest_candidate,
    gentlest_design,
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
    assert gentlest_design(ds) == {"support_angle_deg": 4}  # 0 presses the other body more


@pytest.mark.parametrize(
    ("outcome", "sentence"),
    [
        (lambda place: "blow_up", "No verdict: all 8 candidates failed."),
        (lambda place: 0.5, "All 8 candidates held their body."),
        (
            by_angle(a0=0.1, a4=0.4, a7=0.3, a10=0.2),
            "All 8 candidates held their body; best is support angle 4°.",
        ),
        (lambda place: -0.5, "No design holds any body: 8 of 8 candidates fell."),
        (
            by_angle(a0=-1, a4=0.1, a7=0.2, a10=0.3),
            "Support angle 4° to 10° holds both bodies; best is support angle 10°.",
        ),
        (
            by_angle(a0=0.1, a4=-1, a7=0.2, a10=0.2),
            "Support angle 0°, 7° to 10° holds both bodies; best is support angle 7°.",
        ),
        (by_angle(a0=-1, a4=-1, a7=-1, a10=0.3), "Support angle 10° holds both bodies."),
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
    gentlest = "lowest peak pressure of this body"
    assert [gentlest in each.reasons for each in choose_exemplars(ds)] == 2 * [
        False, False, True, False
    ]
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


def test_command_reproduces_a_candidate():
    assert simulate_command("made_up", {"body": "x y", "support_angle_deg": 0.1}) == (
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


def test_numbers_are_written_as_they_are_read():
    shown = {0: "0", 0.25: "0.25", -0.5: "−0.5", 1000: "1,000", 20_000: "20,000", 4e5: "400,000",
             1e6: "10⁶", 2.5e7: "2.5·10⁷", 2e-5: "2·10⁻⁵", -3e8: "−3·10⁸", 1234.5: "1,234.5"}
    assert {value: number_text(value) for value in shown} == shown
    assert path_value(("pressure_stiffness_pa_per_m",), 4e5) == "400,000 Pa/m"
    assert path_value(("areal_density_kg_per_m2",), 0.3) == "0.3 kg/m²"
    assert path_value(("substep_s",), None) == "none given"


def test_an_axis_of_stiffness_is_readable_and_one_of_devices_is_told_by_name(tmp_path):
    axes = "{stiffness_per_width_n_per_m: [5.0e+3, 2.0e+4, 8.0e+4]}"
    ds = make_dataset(tmp_path, lambda place: 0.5, axes=axes, **SLING)
    (_, axis) = axes_of(ds)
    assert axis.label == "Stiffness per width [N/m]" and axis.geometric
    assert axis.ticks == ["5,000", "20,000", "80,000"] and axis.text(2e4) == "20,000 N/m"
    lengths = [f"hanging.attachments.{i}.strap_length_m" for i in (0, 2)]
    axes = f"{{{lengths[0]}: [0.5, 0.6], {lengths[1]}: [0.6, 0.7]}}"
    ds = make_dataset(tmp_path, lambda place: 0.5, axes=axes, **SLING)
    assert [axis.title for axis in axes_of(ds)] == [
        "body", "hanging 1 strap length", "hanging 3 strap length"
    ]


def test_devices_are_an_axis_of_names(tmp_path):
    pressed = {"sling_reclined": 0.1, "robotic_lift": 0.4}
    both = SLING | {"devices": tuple(pressed)}
    ds = make_dataset(tmp_path, lambda place: pressed[place["device"]], **both)
    assert best_design(ds) == gentlest_design(ds) == {"device": "robotic_lift"}
    assert headline(ds).endswith("held their body; best is robotic_lift.")
    assert best_sentence(ds).endswith("peak pressure is 12.0 kPa (male_172_70), the lowest of all "
                                      "that hold.")
    assert {each.coordinates["device"] for each in choose_exemplars(ds)} == set(pressed)
    assert len(choose_exemplars(ds)) == 4
    assert "--set device=robotic_lift" in simulate_command("made_up", best_design(ds))
    tables = {table.title: dict(row[:2] for row in table.rows) for table in tables_of(ds)}
    assert "Bed of sling_reclined" in tables and "Device of robotic_lift" in tables
    parts = [part for part, _, _ in equations_of(ds)]
    assert "Fall (robotic lift)" in parts and "Fall (sling lift)" in parts


def test_a_sling_is_compared_with_the_bed_it_left(tmp_path):
    ds = make_dataset(tmp_path, lambda place: 0.5, **SLING)
    assert body_findings(ds)[0]["text"].endswith("Lying on the bed before the lift, the peak was "
                                                 "8.0 kPa.")
    lift = make_dataset(tmp_path, lambda place: 0.5)
    assert "bed" not in body_findings(lift)[0]["text"]


def test_figures_that_no_device_of_the_study_has_are_left_out_and_not_missing(tmp_path):
    lift = make_dataset(tmp_path, lambda place: 0.5)
    sling = make_dataset(tmp_path, lambda place: 0.5, **SLING)
    both = make_dataset(tmp_path, lambda place: 0.5, **SLING | {
        "devices": ("sling_reclined", "robotic_lift")})
    strap = "Strap tension"
    assert [strap in columns_of(ds) for ds in (lift, sling, both)] == [False, True, True]
    for ds in (lift, sling, both):
        assert fill_missing(ds)[1] == []
        assert all(len(row.figures) == len(row.flags) == len(columns_of(ds))
                   for row in trust_rows(ds))
    tensions = [row.figures[columns_of(both).index(strap)] for row in trust_rows(both)]
    assert tensions == 2 * ["240 N", "–"]


def test_trust_tells_steadiness_and_that_a_sheet_counts(tmp_path):
    ds = make_dataset(tmp_path, lambda place: 0.5, **SLING)
    ds["support_force_spread"].loc[{"body": BODIES[1]}] = 0.03
    tiles = {tile["title"]: tile for tile in trust_summary(ds)}
    steady = tiles["Unsteadiness of the support force"]
    assert steady["value"] == "0.004 to 0.030" and not steady["good"]
    assert "sheet's weight counted" in tiles["Support force over weight, at rest"]["note"]
    at = columns_of(ds).index("Unsteady by")
    assert [row.flags[at] for row in trust_rows(ds)] == [False, True]
    lift = {tile["title"]: tile for tile in trust_summary(make_dataset(tmp_path, lambda _: 0.5))}
    assert lift["Unsteadiness of the support force"]["good"]
    assert "sheet" not in lift["Support force over weight, at rest"]["note"]


@pytest.mark.parametrize(
    ("outcome", "options", "told"),
    [
        (
            lambda place: {0: -0.5, 4: 0.2, 7: 0.6, 10: 0.3}[place["support_angle_deg"]]
            - 0.1 * (place["body"] == BODIES[1]),
            {"axes": ANGLES},
            "It leaves the largest margin to a fall: 0.50 (female_142_40), where 1 is unmoved and "
            "0 about to fall. Its peak pressure is 10.0 kPa (male_172_70), the lowest of all that "
            "hold.",
        ),
        (
            lambda place: {0: 0.5, 4: 0.5, 7: 0.5, 10: 0.2}[place["support_angle_deg"]],
            {"axes": ANGLES, "bodies": BODIES[:1]},
            "It leaves the largest margin to a fall: 0.50, where 1 is unmoved and 0 about to fall; "
            "2 other designs come within 0.05 of it. Its peak pressure is 10.0 kPa, the lowest of "
            "all that hold.",
        ),
        (
            lambda place: -1.1 + 0.1 * place["support_angle_deg"],
            {"axes": ANGLES, "bodies": BODIES[:1]},
            "Nearest to holding the body is support angle 10°: its fall margin is −0.10.",
        ),
        (lambda place: 0.5, {}, ""),  # there is no choice
        (lambda place: "blow_up", {"axes": ANGLES}, ""),
    ],
)
def test_the_best_design_is_named_with_its_reason(tmp_path, outcome, options, told):
    assert best_sentence(make_dataset(tmp_path, outcome, **options)) == told
