"""Sub-steps in single precision against the same in double, where everything happens at once."""

import numpy as np
import pytest

from simcore.config.designs import SheetPenalty
from simcore.sheet import STILL_BAR, ExplicitSolver, PlaneContact, lay_flat
from simcore.validation.sheet_scenes import SUBSTEP
from tests.test_sheet_bed import press, sheet_on_bed

PENALTY = SheetPenalty(
    law="penalty", stiffness_n_per_m=40.0, damping_ns_per_m=0.8, friction_force_n=0.02,
    friction_velocity_m_per_s=0.02,
)


def shove(precision: type, law: SheetPenalty | None):
    """Return state and sums of forces of a sheet on its bed, pressed, dragged and let go of.

    Part of it is pressed by a surface that moves and sinks; it lies 1.7 m from the origin.
    """
    sheet = sheet_on_bed(friction=0.3, half_length=2.0, law=law)
    solver, contact = ExplicitSolver(sheet, precision=precision), press(sheet, 1.5e-3)
    state = lay_flat(sheet.net, np.array([1.7, -0.1, -5e-4]))
    contact.active[:] = sheet.net.rest_position[:, 0] < 0.2
    contact.surface_velocity[:] = 0.3, -0.1, -0.05
    contact.friction_coefficient = -1.0 if law else 0.4
    contact.friction_force[:] = 0.02
    contact.tangential_stiffness[:] = contact.stiffness / 3
    contact.tangential_damping[:] = contact.damping / 3
    contact.anchor[:] = state.position
    state.velocity[:] = np.random.default_rng(3).normal(scale=0.1, size=state.velocity.shape)
    sums = []
    for step in range(10):
        contact.offset[contact.active] += 1e-4 if step < 5 else -3e-3
        reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
        sums.append([*reaction.contact.force.sum(axis=0), *reaction.bed_force, *reaction.spent])
    return state, contact, np.array(sums)


@pytest.mark.parametrize("law", [None, PENALTY])
def test_single_precision_is_as_good_as_double(law):
    (single, tied, sums), (double, tied_too, sums_too) = shove(np.float32, law), shove(float, law)
    moved = np.abs(double.position - lay_flat_again(double)).max()
    assert moved > 1e-3
    assert single.position == pytest.approx(double.position, abs=1e-5 * moved)
    # Strain is rounded to 6e-8: on 2 cm of fabric, at its highest frequency, that is 1e-5 m/s.
    assert single.velocity == pytest.approx(double.velocity, abs=5e-5)
    assert tied.anchor == pytest.approx(tied_too.anchor, abs=1e-5 * moved)
    assert sums == pytest.approx(sums_too, rel=1e-4, abs=1e-4 * np.abs(sums_too).max())


def lay_flat_again(state) -> np.ndarray:
    return lay_flat(sheet_on_bed().net, np.array([1.7, -0.1, -5e-4])).position


def test_a_vertex_without_a_plane_is_not_touched():
    """Whatever its plane was a step ago: it falls freely."""
    sheet = sheet_on_bed(half_length=0.0)
    solver, contact = ExplicitSolver(sheet, SUBSTEP), press(sheet, 1e-3)
    state = lay_flat(sheet.net, np.zeros(3))
    solver.advance(state, 2e-3, contact, STILL_BAR)
    contact.active[:] = False
    state = lay_flat(sheet.net, np.zeros(3))
    reaction = solver.advance(state, 2e-3, contact, STILL_BAR)
    assert not reaction.contact.force.any() and not reaction.spent.any()
    assert state.velocity[:, 2] == pytest.approx(-9.80665 * 2e-3, rel=1e-5)
    some = PlaneContact.empty(len(sheet.net.mass))
    some.active[0] = True
    solver.advance(state, 2e-3, some, STILL_BAR)
    assert state.velocity[:, 2] == pytest.approx(-9.80665 * 4e-3, rel=1e-5)
