"""Hangings: their mistakes, the catenary, and both solvers at the same rest."""

from dataclasses import replace
from math import cosh, sinh

import numpy as np
import pytest
from pydantic import ValidationError

from simcore.config.sling_lift import (
    EdgeAttachment,
    HangingDesign,
    LoopAttachment,
    PaperMaterial,
)
from simcore.errors import DesignError
from simcore.sheet import (
    STILL_BAR,
    BarState,
    ExplicitSolver,
    LiuSolver,
    build_net,
    build_straps,
    check_reach,
    lay_flat,
    make_sheet,
)
from simcore.validation.sheet_scenes import fabric, rectangular, untouched
from simcore.validation.sheets import LENGTH, SPAN, catenary_parameter, hang_strip

PAPER = PaperMaterial(kind="paper", stiffness_n_per_m=1000.0, mass_kg=10.0)


SHEET = rectangular(1.2, 0.8, PAPER, 300)


def loop(name="shoulder", at=(0.0, 0.4), bar=(0.2, 0.25, 0.4), length=0.5):
    return LoopAttachment(
        kind="loop", name=name, sheet_point_m=at, bar_point_m=bar, strap_length_m=length
    )


def hanging(*attachments):
    return HangingDesign(
        attachments=attachments, strap_stiffness_n_per_m=3e4, strap_damping_ns_per_m=30.0
    )


FOUR = (
    loop("a"),
    loop("b", (0.0, -0.4), (0.2, -0.25, 0.4)),
    loop("c", (1.2, 0.4), (1.0, 0.25, 0.4)),
    loop("d", (1.2, -0.4), (1.0, -0.25, 0.4)),
)


def test_an_attachment_outside_the_sheet_is_refused():
    words = r"^device\.hanging\.attachments\.shoulder\.sheet_point_m: .*smaller than its"
    with pytest.raises(DesignError, match=words) as error:
        build_straps(build_net(SHEET), hanging(loop(at=(0.0, 0.5))))
    assert "\n" not in str(error.value)


def test_two_attachments_of_one_name_are_refused():
    with pytest.raises(ValidationError, match="holds shoulder twice"):
        hanging(loop(), loop())


def test_straps_that_cannot_reach_are_refused_by_name():
    net = build_net(SHEET)
    straps = build_straps(net, hanging(*FOUR[:3], loop("short", length=0.3)))
    words = r"^device\.hanging\.attachments\.short\.strap_length_m: .*cannot reach.*0\.300 m"
    with pytest.raises(DesignError, match=words):
        check_reach(straps, lay_flat(net, np.zeros(3)).position, STILL_BAR)
    check_reach(build_straps(net, hanging(*FOUR)), lay_flat(net, np.zeros(3)).position, STILL_BAR)


def test_a_substep_that_cannot_be_held_is_refused():
    net = build_net(rectangular(1.2, 0.8, fabric(1e5), 4000))
    sheet = make_sheet(net, build_straps(net, hanging(*FOUR)))
    with pytest.raises(DesignError, match=r"^method\.sheet\.solver\.substep_s: 0\.001 cannot be"):
        ExplicitSolver(sheet, substep=1e-3)
    assert ExplicitSolver(sheet).substep < 2e-4


def test_patches_are_centred_on_their_points():
    net = build_net(rectangular(1.2, 0.8, PAPER, 4000))
    straps = build_straps(net, hanging(loop(at=(0.6, 0.0))))
    assert straps.patch_weight.sum() == pytest.approx(1)
    assert straps.patch_weight.max() < 0.3
    position = lay_flat(net, np.zeros(3)).position
    assert straps.patch_centres(position)[0] == pytest.approx([0.6, 0, 0], abs=3e-3)


def test_strip_hangs_in_a_catenary():
    """A strip of length L over a span l: sag a (cosh(l/2a) − 1) with 2 a sinh(l/2a) = L."""
    (state, _), a = hang_strip(), catenary_parameter()
    assert 2 * a * sinh(SPAN / 2 / a) == pytest.approx(LENGTH)
    assert np.abs(state.velocity).max() < 5e-3
    assert -state.position[:, 2].min() == pytest.approx(a * (cosh(SPAN / 2 / a) - 1), rel=0.02)


def test_edges_tie_to_poles_and_a_rising_bar_carries_the_weight():
    net = build_net(SHEET)
    poles = tuple(
        EdgeAttachment(
            kind="edge", name=side, edge=side, strap_length_m=0.05,
            bar_start_m=(0.0, y, 0.0), bar_end_m=(1.2, y, 0.0),
        )
        for side, y in (("left", 0.42), ("right", -0.42))
    )
    straps = build_straps(net, hanging(*poles))
    state, height = lay_flat(net, np.zeros(3)), np.array([0.0, 0.0, 0.0])
    check_reach(straps, state.position, STILL_BAR)
    sheet = replace(make_sheet(net, straps), drag_rate=10.0)
    solver = ExplicitSolver(sheet)
    rise = np.array([0.0, 0.0, 0.2])
    for _ in range(600):
        bar = BarState(np.eye(3), height.copy(), rise, np.zeros(3))
        solver.advance(state, 2e-3, untouched(sheet), bar)
        height += 2e-3 * rise
    force = np.zeros(3)
    for _ in range(1000):
        bar = BarState(np.eye(3), height, np.zeros(3), np.zeros(3))
        force = solver.advance(state, 2e-3, untouched(sheet), bar).strap_force.sum(axis=0)
    assert force == pytest.approx([0, 0, 10 * 9.80665], abs=0.05)
    assert 0.24 - 0.05 < state.position[:, 2].max() < 0.24


def test_explicit_and_liu_come_to_the_same_rest():
    net = build_net(SHEET)
    sheet = replace(make_sheet(net, build_straps(net, hanging(*FOUR))), drag_rate=6.0)
    rests = []
    for solver, dt in ((ExplicitSolver(sheet), 2e-3), (LiuSolver(sheet, 5e-3, 1e-4), 5e-3)):
        state = lay_flat(net, np.zeros(3))
        for _ in range(round(6.0 / dt)):
            reaction = solver.advance(state, dt, untouched(sheet), STILL_BAR)
        assert reaction.strap_force.sum(axis=0)[2] == pytest.approx(10 * 9.80665, rel=1e-2)
        rests.append(state.position)
    assert np.abs(rests[0] - rests[1]).max() < 1e-3
