"""A sheet on a bed, and between bed and body, against closed forms."""

from copy import deepcopy
from dataclasses import replace
from math import cos, sin

import numpy as np
import pytest

from simcore.config.designs import SheetPenalty
from simcore.sheet import (
    STILL_BAR,
    ExplicitSolver,
    LiuSolver,
    PlaneContact,
    build_net,
    build_straps,
    lay_flat,
    make_sheet,
)
from simcore.sheet.bed import springy_bed
from simcore.sheet.energy import planes_energy
from simcore.validation.incline import STUCK
from simcore.validation.sheet_scenes import (
    FOUNDATION,
    NO_STRAPS,
    SUBSTEP,
    fabric,
    rectangular,
    untouched,
)

G = 9.80665
DENSITY, SIDE = 10.0, 0.3
PAPER_LAW = SheetPenalty(
    law="penalty", stiffness_n_per_m=40.0, damping_ns_per_m=0.8, friction_force_n=0.02,
    friction_velocity_m_per_s=0.02,
)


def sheet_on_bed(friction=0.0, half_length=1.0, law=None, gravity=(0.0, 0.0, -G)):
    """0.3 m square of 10 kg/m²: heavy enough to need no added inertia."""
    net = build_net(rectangular(SIDE, SIDE, fabric(density=DENSITY), 225))
    stiffness = FOUNDATION * net.vertex_area
    bed = springy_bed(half_length, 1.0, stiffness, 2e3 / FOUNDATION, friction, stiffness / 3)
    if law:
        bed.law.set_penalty(law)
    sheet = make_sheet(net, build_straps(net, NO_STRAPS), bed=bed)
    return replace(sheet, gravity=np.array(gravity), drag_rate=0.0)


def sheet_start(sheet):
    return np.column_stack([sheet.net.rest_position, np.zeros(len(sheet.net.mass))])


def press(sheet, depth):
    """Return a plane that lies `depth` under z = 0 and pushes the sheet down."""
    contact = PlaneContact.empty(len(sheet.net.mass))
    contact.active[:], contact.normal[:, 2] = True, -1.0
    contact.offset[:] = depth
    contact.stiffness[:] = FOUNDATION * sheet.net.vertex_area
    contact.damping[:] = 2e3 * sheet.net.vertex_area
    return contact


def solvers(sheet):
    return [ExplicitSolver(sheet, SUBSTEP), LiuSolver(sheet, step=2e-3, tolerance=1e-5)]


@pytest.mark.parametrize("kind", [0, 1])
def test_the_bed_carries_the_weight_at_the_depth_of_its_pressure(kind):
    sheet = sheet_on_bed(friction=0.3)
    solver, state = solvers(sheet)[kind], lay_flat(sheet.net, np.zeros(3))
    for _ in range(300):
        reaction = solver.advance(state, 2e-3, untouched(sheet), STILL_BAR)
    weight = sheet.net.mass.sum() * G
    assert reaction.bed_force == pytest.approx([0, 0, weight], abs=1e-3 * weight)
    assert state.position[:, 2] == pytest.approx(-DENSITY * G / FOUNDATION, rel=0.1)


@pytest.mark.parametrize("kind", [0, 1])
def test_bed_and_body_share_the_load_of_what_is_between_them(kind):
    """Depths d₁ + d₂ = δ of equal stiffness, N₁ − N₂ = weight."""
    squeeze, sheet = 1e-3, sheet_on_bed(friction=0.4)
    solver, contact = solvers(sheet)[kind], press(sheet, squeeze)
    contact.friction_coefficient = 0.4
    contact.tangential_stiffness[:] = contact.stiffness / 3
    state = lay_flat(sheet.net, np.zeros(3))
    contact.anchor[:] = state.position
    for _ in range(200):
        reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
    weight, total = sheet.net.mass.sum() * G, squeeze * FOUNDATION * SIDE**2
    assert reaction.bed_force[2] == pytest.approx((total + weight) / 2, rel=2e-3)
    assert reaction.contact.normal_force.sum() == pytest.approx((total - weight) / 2, rel=2e-3)


@pytest.mark.parametrize("part", [slice(None), slice(40, 140)], ids=["all", "part"])
def test_a_body_that_has_left_pushes_no_more(part):
    """The solver that knew it goes on as one that never did."""
    sheet = sheet_on_bed(friction=0.4)
    used, state = ExplicitSolver(sheet, SUBSTEP), lay_flat(sheet.net, np.zeros(3))
    contact = press(sheet, 1e-3)
    contact.active[:] = False
    contact.active[part] = True
    for _ in range(5):
        assert used.advance(state, 2e-3, contact, STILL_BAR).contact.normal_force.any()
    other = deepcopy(state)
    for solver, each in ((used, state), (ExplicitSolver(sheet, SUBSTEP), other)):
        reaction = solver.advance(each, 2e-3, untouched(sheet), STILL_BAR)
        assert not reaction.contact.force.any()
    assert np.array_equal(state.position, other.position)
    assert np.array_equal(state.velocity, other.velocity)


@pytest.mark.parametrize("kind", [0, 1])
def test_a_sheet_slides_to_a_stop_as_coulomb_says(kind):
    """From 0.5 m/s with µ = 0.3: v²/2µg, and v − µ g t while it slides."""
    friction, speed, time = 0.3, 0.5, 0.1
    sheet = sheet_on_bed(friction)
    solver = solvers(sheet)[kind]
    state = lay_flat(sheet.net, np.array([0, 0, -DENSITY * G / FOUNDATION]))
    state.velocity[:, 0] = speed
    for _ in range(round(time / 2e-3)):
        solver.advance(state, 2e-3, untouched(sheet), STILL_BAR)
    assert state.velocity[:, 0] == pytest.approx(speed - friction * G * time, rel=5e-3)
    for _ in range(150):
        solver.advance(state, 2e-3, untouched(sheet), STILL_BAR)
    way = speed**2 / (2 * friction * G)
    assert state.position[:, 0].mean() - SIDE / 2 == pytest.approx(way, rel=0.03)


@pytest.mark.parametrize("kind", [0, 1])
def test_held_below_the_friction_angle_it_sticks(kind):
    """It shears the bed by m g sin α over its stiffness along the surface, and stays there."""
    angle, friction = 0.1, 0.3
    sheet = sheet_on_bed(friction, gravity=(G * sin(angle), 0.0, -G * cos(angle)))
    solver = solvers(sheet)[kind]
    state = lay_flat(sheet.net, np.array([0, 0, -DENSITY * G / FOUNDATION]))
    for _ in range(1000):
        reaction = solver.advance(state, 2e-3, untouched(sheet), STILL_BAR)
    down = sheet.net.mass.sum() * G * sin(angle)
    assert reaction.bed_force[0] == pytest.approx(-down, rel=1e-3)
    way = (sheet.net.mass @ (state.position - sheet_start(sheet)))[0] / sheet.net.mass.sum()
    assert way == pytest.approx(DENSITY * G * sin(angle) / (FOUNDATION / 3), rel=0.02)
    assert np.abs(state.velocity).max() < STUCK
    assert abs(sheet.net.mass @ state.velocity[:, 0]) / sheet.net.mass.sum() < 1e-7  # no creep


def test_above_the_friction_angle_it_slides():
    """After the tie has stretched: g (sin α − µ cos α)."""
    angle, friction, time = 0.4, 0.3, 0.1
    sheet = sheet_on_bed(friction, gravity=(G * sin(angle), 0.0, -G * cos(angle)))
    solver = ExplicitSolver(sheet, SUBSTEP)
    state = lay_flat(sheet.net, np.array([0, 0, -DENSITY * G * cos(angle) / FOUNDATION]))
    speeds = []
    for _ in range(2):
        for _ in range(round(time / 2e-3)):
            solver.advance(state, 2e-3, untouched(sheet), STILL_BAR)
        speeds.append(sheet.net.mass @ state.velocity[:, 0] / sheet.net.mass.sum())
    expected = G * (sin(angle) - friction * cos(angle)) * time
    assert speeds[1] - speeds[0] == pytest.approx(expected, rel=0.01)


def test_what_it_shears_it_holds_as_energy():
    """One vertex in and along: k d²/2 + k_t e²/2."""
    sheet = sheet_on_bed(friction=10.0)
    planes, net = sheet.bed.untouched(), sheet.net
    flat = np.column_stack([net.rest_position, np.full(len(net.mass), -1e-3)])
    sheet.bed.find(flat, planes)
    sheared = flat + np.array([2e-3, 0.0, 0.0])
    area = net.vertex_area.sum()
    expected = FOUNDATION * area * (1e-3**2 + 2e-3**2 / 3) / 2
    assert planes_energy(planes, sheared) == pytest.approx(expected, rel=1e-9)


def test_friction_of_constant_force_is_that_of_the_paper():
    """F_c a vertex, whatever the load: deceleration n F_c / Σm.

    Light vertices of the edge are slowed more and swing, hence the tolerance.
    """
    sheet = sheet_on_bed(law=PAPER_LAW)
    solver = ExplicitSolver(sheet, SUBSTEP)
    state = lay_flat(sheet.net, np.array([0, 0, -DENSITY * G / FOUNDATION]))
    state.velocity[:, 1] = 0.5
    for _ in range(20):
        reaction = solver.advance(state, 2e-3, untouched(sheet), STILL_BAR)
    count, mass = len(sheet.net.mass), sheet.net.mass.sum()
    assert reaction.bed_force[1] == pytest.approx(-0.02 * count, rel=1e-2)
    lost = 0.5 - (sheet.net.mass @ state.velocity[:, 1]) / mass
    assert lost == pytest.approx(0.04 * 0.02 * count / mass, rel=1e-2)


@pytest.mark.parametrize("kind", [0, 1])
def test_beyond_the_edge_nothing_carries(kind):
    """A sheet from x = 0 to 0.3 over a bed that ends at 0.1: its other end hangs down."""
    sheet = replace(sheet_on_bed(friction=0.5, half_length=0.1), drag_rate=5.0)
    solver, state = solvers(sheet)[kind], lay_flat(sheet.net, np.zeros(3))
    for _ in range(40):
        solver.advance(state, 2e-3, untouched(sheet), STILL_BAR)
    x = sheet.net.rest_position[:, 0]
    assert state.position[x < 0.05, 2].min() > -2e-3
    assert state.position[x > 0.25, 2].max() < -5e-3


def test_what_the_bed_gives_the_sheet_has():
    """Mean force × dt is the change of momentum, to rounding, body and bed together."""
    sheet = sheet_on_bed(friction=0.4, gravity=(0.0, 0.0, 0.0))
    contact, solver = press(sheet, 2e-3), ExplicitSolver(sheet, SUBSTEP, precision=float)
    contact.friction_coefficient = 0.2
    contact.tangential_stiffness[:] = contact.stiffness / 3
    state = lay_flat(sheet.net, np.array([0.0, 0.0, -1e-3]))
    contact.anchor[:] = state.position
    state.velocity[:] = np.random.default_rng(3).normal(scale=0.2, size=state.velocity.shape)
    before = solver.inertia.momenta(state.velocity).sum(axis=0)
    reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
    received = 2e-3 * (reaction.bed_force + reaction.contact.force.sum(axis=0))
    change = solver.inertia.momenta(state.velocity).sum(axis=0) - before
    assert received == pytest.approx(change, rel=1e-10, abs=1e-13)


@pytest.mark.parametrize("law", [None, PAPER_LAW], ids=["sticks", "paper"])
def test_the_bed_is_what_planes_are_that_lie_and_move_anyhow(law):
    """A sheet that bounces over the edge of its bed, in sub-steps of two lengths, and the same with
    the planes of the bed told as those of a body; its vertices come and go."""
    with_bed = sheet_on_bed(friction=0.4, half_length=0.15, law=law)
    without = replace(with_bed, bed=None)
    states, told, active, planes = [], [], [], with_bed.bed.untouched()
    for sheet in (with_bed, without):
        solver = ExplicitSolver(sheet, SUBSTEP, precision=float)
        state = lay_flat(sheet.net, np.array([0.1, 0.0, 0.009]))
        state.velocity[:] = np.random.default_rng(5).normal(scale=0.4, size=state.velocity.shape)
        for step in [2e-3] * 60 + [1.1e-3] * 60:
            if sheet.bed:
                reaction = solver.advance(state, step, untouched(sheet), STILL_BAR)
                force, active = reaction.bed_force, [*active, state.on_bed.active.copy()]
            else:
                with_bed.bed.find(state.position, planes)
                reaction = solver.advance(state, step, planes, STILL_BAR)
                force = reaction.contact.force.sum(axis=0)
            told.append(np.concatenate([force, reaction.spent]))
        states.append(state)
    assert states[0].position == pytest.approx(states[1].position, abs=1e-10)
    assert states[0].velocity == pytest.approx(states[1].velocity, abs=1e-8)
    of_bed, of_planes = np.array(told).reshape(2, 120, 6)
    assert np.abs(of_planes).max(axis=0).min() > 0
    assert of_bed == pytest.approx(of_planes, rel=1e-6, abs=1e-8)
    changes = np.diff(np.array(active).astype(int), axis=0)
    assert (changes == 1).any() and (changes == -1).any()
