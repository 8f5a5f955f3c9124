"""A sheet on a bed, and between bed and body, against closed forms."""

from dataclasses import replace
from math import cos, sin

import numpy as np
import pytest

from simcore.sheet import (
    STILL_BAR,
    BedContact,
    ExplicitSolver,
    LiuSolver,
    PlaneContact,
    build_net,
    build_straps,
    lay_flat,
    make_sheet,
)
from simcore.validation.sheet_scenes import (
    FOUNDATION,
    NO_STRAPS,
    fabric,
    rectangular,
    untouched,
)

G = 9.80665
DENSITY, SIDE, CREEP = 10.0, 0.3, 0.02


def sheet_on_bed(friction=0.0, half_length=1.0, force=0.0, gravity=(0.0, 0.0, -G)):
    """0.3 m square of 10 kg/m²: heavy enough to need no added inertia."""
    net = build_net(rectangular(SIDE, SIDE, fabric(density=DENSITY), 225))
    bed = BedContact(
        half_length, 1.0, FOUNDATION * net.vertex_area, 2e3 * net.vertex_area, friction, force,
        CREEP,
    )
    sheet = make_sheet(net, build_straps(net, NO_STRAPS), bed=bed)
    return replace(sheet, gravity=np.array(gravity), drag_rate=0.0)


def press(sheet, depth):
    """Return a plane that lies `depth` under z = 0 and pushes the sheet down."""
    contact = PlaneContact.empty(len(sheet.net.mass))
    contact.active[:], contact.normal[:, 2] = True, -1.0
    contact.offset[:] = depth
    contact.stiffness[:] = FOUNDATION * sheet.net.vertex_area
    contact.damping[:] = 2e3 * sheet.net.vertex_area
    return contact


def solvers(sheet):
    return [ExplicitSolver(sheet), LiuSolver(sheet, step=2e-3, tolerance=1e-5)]


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


def test_held_below_the_friction_angle_it_creeps_as_a_viscosity():
    """γ = µ N / ε and m g sin α = γ v give v = ε tan α / µ."""
    angle, friction = 0.1, 0.3
    sheet = sheet_on_bed(friction, gravity=(G * sin(angle), 0.0, -G * cos(angle)))
    solver = ExplicitSolver(sheet)
    state = lay_flat(sheet.net, np.array([0, 0, -DENSITY * G / FOUNDATION]))
    for _ in range(300):
        reaction = solver.advance(state, 2e-3, untouched(sheet), STILL_BAR)
    assert state.velocity[:, 0].mean() == pytest.approx(CREEP * np.tan(angle) / friction, rel=0.01)
    down = sheet.net.mass.sum() * G * sin(angle)
    assert reaction.bed_force[0] == pytest.approx(-down, rel=0.01)


def test_friction_of_constant_force_is_that_of_the_paper():
    """F_c a vertex, whatever the load: deceleration n F_c / Σm.

    Light vertices of the edge are slowed more and swing, hence the tolerance.
    """
    sheet = sheet_on_bed(force=0.02)
    solver = ExplicitSolver(sheet)
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
    contact, solver = press(sheet, 2e-3), ExplicitSolver(sheet)
    contact.friction_coefficient = 0.2
    contact.tangential_stiffness[:] = contact.stiffness / 3
    state = lay_flat(sheet.net, np.array([0.0, 0.0, -1e-3]))
    contact.anchor[:] = state.position
    state.velocity[:] = np.random.default_rng(3).normal(scale=0.2, size=state.velocity.shape)
    before = solver.inertia @ state.velocity
    reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
    received = 2e-3 * (reaction.bed_force + reaction.contact.force.sum(axis=0))
    assert received == pytest.approx(solver.inertia @ state.velocity - before, rel=1e-10, abs=1e-13)
