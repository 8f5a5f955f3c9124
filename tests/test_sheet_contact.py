"""Contact and friction of the sheet against closed forms: weight, incline, capstan, press."""

from dataclasses import replace
from math import atan, cos, exp, pi, sin

import numpy as np
import pytest

from simcore.sheet import STILL_BAR, ExplicitSolver, LiuSolver, lay_flat
from simcore.validation.friction import CAPSTAN_FRICTION, pull_over_cylinder, slide
from simcore.validation.incline import INCLINE_FRICTION
from simcore.validation.sheet_scenes import FOUNDATION, SUBSTEP, heavy_square, plane

G = 9.80665
def solvers(sheet):
    return [ExplicitSolver(sheet, SUBSTEP), LiuSolver(sheet, step=2e-3, tolerance=1e-5)]


@pytest.mark.parametrize("kind", [0, 1])
def test_a_sheet_at_rest_is_carried_with_its_weight(kind):
    sheet = heavy_square()
    solver, contact = solvers(sheet)[kind], plane(sheet.net)
    state = lay_flat(sheet.net, np.zeros(3))
    for _ in range(300):
        reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
    weight = sheet.net.mass.sum() * G
    contact_force = reaction.contact
    assert contact_force.force.sum(axis=0) == pytest.approx([0, 0, weight], abs=1e-3 * weight)
    assert contact_force.normal_force.sum() == pytest.approx(weight, rel=1e-3)
    assert state.position[:, 2] == pytest.approx(-10 * G / FOUNDATION, rel=0.1)


def explicit(sheet):
    return solvers(sheet)[0]


def liu(sheet):
    return solvers(sheet)[1]


@pytest.mark.parametrize("make_solver", [explicit, liu])
def test_an_incline_holds_below_the_friction_angle_and_lets_go_above(make_solver):
    friction = INCLINE_FRICTION
    below = slide(0.9 * atan(friction), make_solver, duration=0.4)
    above = slide(1.2 * atan(friction), make_solver, duration=0.4)
    assert abs(below.way[-1]) < 5e-4
    assert abs(below.speed[-1] - below.speed[49]) < 1e-4
    angle = 1.2 * atan(friction)
    acceleration = G * (sin(angle) - friction * cos(angle))
    assert above.speed[-1] - above.speed[49] == pytest.approx(acceleration * 0.3, rel=0.02)


def test_a_sliding_surface_drags_the_sheet_along():
    """A belt at 0.1 m/s under a sheet: µ g first, then the speed of the belt."""
    sheet = replace(heavy_square(), drag_rate=0.0)
    solver, contact = ExplicitSolver(sheet, SUBSTEP), plane(sheet.net, friction=0.3)
    contact.surface_velocity[:, 0] = 0.1
    state = lay_flat(sheet.net, np.array([0, 0, -10 * G / FOUNDATION]))
    contact.anchor[:] = state.position
    for _ in range(250):
        solver.advance(state, 2e-3, contact, STILL_BAR)
    assert state.velocity[:, 0] == pytest.approx(0.1, abs=1e-3)
    assert state.position[:, 0].mean() - 0.15 == pytest.approx(0.1 * 0.5, abs=2e-3)


def test_regularised_friction_creeps_as_it_must():
    """Below ε the paper's friction is a viscosity F_c/ε: v = m g sin α ε / ΣF_c."""
    angle, sheet = 0.05, heavy_square()
    sheet = replace(sheet, gravity=np.array([G * sin(angle), 0, -G * cos(angle)]), drag_rate=0.0)
    contact = plane(sheet.net, friction=-1.0)
    contact.friction_force[:] = sheet.net.mass * G
    state = lay_flat(sheet.net, np.array([0, 0, -10 * G / FOUNDATION]))
    solver = ExplicitSolver(sheet, SUBSTEP)
    for _ in range(300):
        solver.advance(state, 2e-3, contact, STILL_BAR)
    assert state.velocity[:, 0].mean() == pytest.approx(sin(angle) * 0.1, rel=0.02)


def test_capstan():
    """A strip pulled over a fixed cylinder by half a turn: T2 / T1 = e^(µ π)."""
    strip = pull_over_cylinder()
    assert strip.slack > 5.0
    assert strip.taut / strip.slack == pytest.approx(exp(CAPSTAN_FRICTION * pi), rel=0.05)
    within = np.exp(CAPSTAN_FRICTION * strip.turn)
    assert strip.tension / strip.slack == pytest.approx(within, rel=0.05)


def test_what_the_surface_gets_is_what_the_sheet_gets():
    """Mean force × dt is the change of the sheet's momentum, to rounding."""
    sheet = replace(heavy_square(), gravity=np.zeros(3), drag_rate=0.0)
    contact = plane(sheet.net, (0.6, 0.0, 0.8), 0.05, friction=0.3)
    state = lay_flat(sheet.net, np.zeros(3))
    solver = ExplicitSolver(sheet, SUBSTEP, precision=float)
    state.velocity[:, 0] = -1.0
    before = solver.inertia.momenta(state.velocity).sum(axis=0)
    reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
    change = solver.inertia.momenta(state.velocity).sum(axis=0) - before
    assert reaction.contact.force.sum(axis=0) * 2e-3 == pytest.approx(change, rel=1e-10)
