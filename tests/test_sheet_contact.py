"""Contact and friction of the sheet against closed forms: weight, incline, capstan, press."""

from dataclasses import replace
from math import atan, cos, exp, pi, sin

import numpy as np
import pytest
from sheets import NO_STRAPS, fabric, rectangular

from simcore.config.sling_lift import EdgeAttachment, HangingDesign
from simcore.sheet import (
    STILL_BAR,
    ExplicitSolver,
    LiuSolver,
    PlaneContact,
    SheetState,
    build_net,
    build_straps,
    lay_flat,
    make_sheet,
)

G = 9.80665
FOUNDATION = 1.0e6
"""Contact stiffness per area [N/m³]."""


def small_sheet():
    """0.3 m square of 10 kg/m²: heavy enough to need no added inertia."""
    net = build_net(rectangular(0.3, 0.3, fabric(density=10.0), 225))
    return make_sheet(net, build_straps(net, NO_STRAPS))


def plane(net, normal=(0.0, 0.0, 1.0), offset=0.0, friction=0.0, share=1.0):
    contact = PlaneContact.empty(len(net.mass))
    contact.active[:] = True
    contact.normal[:] = normal
    contact.offset[:] = offset
    contact.stiffness[:] = share * FOUNDATION * net.vertex_area
    contact.damping[:] = share * 2e3 * net.vertex_area
    contact.friction_coefficient = friction
    contact.tangential_stiffness[:] = contact.stiffness / 2
    contact.tangential_damping[:] = contact.damping / 2
    contact.anchor[:] = lay_flat(net, np.zeros(3)).position
    return contact


def solvers(sheet):
    return [ExplicitSolver(sheet), LiuSolver(sheet, step=2e-3, tolerance=1e-5)]


@pytest.mark.parametrize("kind", [0, 1])
def test_a_sheet_at_rest_is_carried_with_its_weight(kind):
    sheet = small_sheet()
    solver, contact = solvers(sheet)[kind], plane(sheet.net)
    state = lay_flat(sheet.net, np.zeros(3))
    for _ in range(300):
        reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
    weight = sheet.net.mass.sum() * G
    contact_force = reaction.contact
    assert contact_force.force.sum(axis=0) == pytest.approx([0, 0, weight], abs=1e-3 * weight)
    assert contact_force.normal_force.sum() == pytest.approx(weight, rel=1e-3)
    assert state.position[:, 2] == pytest.approx(-10 * G / FOUNDATION, rel=0.1)


@pytest.mark.parametrize("kind", [0, 1])
def test_an_incline_holds_below_the_friction_angle_and_lets_go_above(kind):
    friction, moved = 0.5, {}
    for name, angle in (("below", 0.9 * atan(friction)), ("above", 1.2 * atan(friction))):
        tilted = np.array([G * sin(angle), 0.0, -G * cos(angle)])
        sheet = replace(small_sheet(), gravity=tilted, drag_rate=0.0)
        solver, contact = solvers(sheet)[kind], plane(sheet.net, friction=friction)
        state = lay_flat(sheet.net, np.array([0, 0, -10 * G * cos(angle) / FOUNDATION]))
        contact.anchor[:] = state.position
        speeds = []
        for _ in range(200):
            solver.advance(state, 2e-3, contact, STILL_BAR)
            speeds.append(state.velocity[:, 0].mean())
        moved[name] = state.position[:, 0].mean() - 0.15, speeds[-1] - speeds[49]
    assert abs(moved["below"][0]) < 5e-4
    assert abs(moved["below"][1]) < 1e-4
    acceleration = G * (sin(angle) - friction * cos(angle))
    assert moved["above"][1] == pytest.approx(acceleration * 0.3, rel=0.02)


def test_a_sliding_surface_drags_the_sheet_along():
    """A belt at 0.1 m/s under a sheet: µ g first, then the speed of the belt."""
    sheet = replace(small_sheet(), drag_rate=0.0)
    solver, contact = ExplicitSolver(sheet), plane(sheet.net, friction=0.3)
    contact.surface_velocity[:, 0] = 0.1
    state = lay_flat(sheet.net, np.array([0, 0, -10 * G / FOUNDATION]))
    contact.anchor[:] = state.position
    for _ in range(250):
        solver.advance(state, 2e-3, contact, STILL_BAR)
    assert state.velocity[:, 0] == pytest.approx(0.1, abs=1e-3)
    assert state.position[:, 0].mean() - 0.15 == pytest.approx(0.1 * 0.5, abs=2e-3)


def test_regularised_friction_creeps_as_it_must():
    """Below ε the paper's friction is a viscosity F_c/ε: v = m g sin α ε / ΣF_c."""
    angle, sheet = 0.05, small_sheet()
    sheet = replace(sheet, gravity=np.array([G * sin(angle), 0, -G * cos(angle)]), drag_rate=0.0)
    contact = plane(sheet.net, friction=-1.0)
    contact.friction_force[:] = sheet.net.mass * G
    state = lay_flat(sheet.net, np.array([0, 0, -10 * G / FOUNDATION]))
    solver = ExplicitSolver(sheet)
    for _ in range(300):
        solver.advance(state, 2e-3, contact, STILL_BAR)
    assert state.velocity[:, 0].mean() == pytest.approx(sin(angle) * 0.1, rel=0.02)


def test_capstan():
    """A strip pulled over a fixed cylinder by half a turn: T2 / T1 = e^(µ π)."""
    friction, radius, straight, width = 0.3, 0.15, 0.2, 0.06
    length = 2 * straight + pi * radius
    net = build_net(rectangular(length, width, fabric(), 300))
    half = width / 2
    ends = tuple(
        EdgeAttachment(
            kind="edge", name=edge, edge=edge, strap_length_m=0.1,
            bar_start_m=(x, -half, -0.3), bar_end_m=(x, half, -0.3),
        )
        for edge, x in (("head", -radius), ("foot", radius))
    )
    hanging = HangingDesign(
        attachments=ends, strap_stiffness_n_per_m=500.0, strap_damping_ns_per_m=1.0
    )
    straps = build_straps(net, hanging)
    sheet = replace(make_sheet(net, straps), gravity=np.zeros(3))
    s, y = net.rest_position.T
    turn = np.clip((s - straight) / radius, 0, pi)
    below = np.minimum(s - straight, 0) - np.maximum(s - straight - pi * radius, 0)
    position = np.column_stack([-radius * np.cos(turn), y, radius * np.sin(turn) + below])
    state = SheetState(position, np.zeros_like(position))
    solver, contact = ExplicitSolver(sheet), plane(net, friction=friction)
    contact.anchor[:] = position
    # The head strap hangs from the still bar; the foot strap's part of the bar is pulled down.
    pulled = np.array([name == "foot" for name in straps.names])
    fall, speed = 0.0, 0.1
    for _ in range(1500):
        radial = state.position * (1, 0, 1)
        distance = np.linalg.norm(radial, axis=1)
        contact.normal[:] = radial / distance[:, None]
        contact.offset[:] = radius
        contact.active[:] = state.position[:, 2] > 0
        straps.bar_point[pulled, 2] = -0.3 - fall
        reaction = solver.advance(state, 1e-3, contact, STILL_BAR)
        fall += speed * 1e-3
    tension = [np.linalg.norm(reaction.strap_force[end].sum(axis=0)) for end in (~pulled, pulled)]
    assert tension[0] > 5.0
    assert tension[1] / tension[0] == pytest.approx(exp(friction * pi), rel=0.05)


def test_what_the_surface_gets_is_what_the_sheet_gets():
    """Mean force × dt is the change of the sheet's momentum, to rounding."""
    sheet = replace(small_sheet(), gravity=np.zeros(3), drag_rate=0.0)
    contact = plane(sheet.net, (0.6, 0.0, 0.8), 0.05, friction=0.3)
    state, solver = lay_flat(sheet.net, np.zeros(3)), ExplicitSolver(sheet)
    state.velocity[:, 0] = -1.0
    before = (solver.inertia[:, None] * state.velocity).sum(axis=0)
    reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
    change = (solver.inertia[:, None] * state.velocity).sum(axis=0) - before
    assert reaction.contact.force.sum(axis=0) * 2e-3 == pytest.approx(change, rel=1e-10)
