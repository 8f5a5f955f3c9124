"""The mass matrix of a sheet against the same in full, and what it is for."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.sheet import STILL_BAR, ExplicitSolver, build_net, build_straps, lay_flat, make_sheet
from simcore.sheet.explicit import WHOLE_INERTIA
from simcore.sheet.inertia import Inertia, whole_modes
from simcore.validation.sheet_scenes import NO_STRAPS, fabric, rectangular, untouched


def dense(mass, added, modes, carried):
    """Eq. S14 as it stands."""
    inner = modes.T @ np.diag(added) @ modes
    of_whole = np.diag(added) @ modes @ np.linalg.inv(inner) @ modes.T @ np.diag(added)
    return np.diag(mass + added) - carried * of_whole


@given(seed=st.integers(0, 1000), carried=st.just(0.0) | st.floats(0.01, 0.99))
@settings(max_examples=30, deadline=None)
def test_the_matrix_and_its_inverse(seed, carried):
    rng = np.random.default_rng(seed)
    mass, added = rng.uniform(1e-4, 1e-3, 40), rng.uniform(0, 1e-2, 40)
    added[::7] = 0.0
    modes = whole_modes(rng.uniform(-1, 1, (40, 2)))
    matrix, inertia = dense(mass, added, modes, carried), Inertia(mass, added, modes, carried)
    v, impulse = rng.normal(size=(2, 40, 3))
    kicked = rng.permutation(40)[:25]
    impulse[np.setdiff1d(np.arange(40), kicked)] = 0.0
    assert inertia.momenta(v) == pytest.approx(matrix @ v)
    assert np.linalg.eigvalsh(matrix)[0] > 0
    before = inertia.kinetic_energy(v)
    assert before == pytest.approx((v * (matrix @ v)).sum() / 2)
    expected = v + np.linalg.solve(matrix, impulse)
    energy = inertia.kick(v, kicked, impulse[kicked])
    assert v == pytest.approx(expected)
    assert energy == pytest.approx(inertia.kinetic_energy(v) - before)


def test_the_whole_moves_with_its_mass_and_what_is_left():
    """1ᵀ M 1 = Σm + (1 − κ) ΣΔ, and any even motion of the flat sheet likewise."""
    rng = np.random.default_rng(1)
    mass, added, place = np.full(60, 1e-3), rng.uniform(0, 1e-2, 60), rng.uniform(0, 1, (60, 2))
    inertia = Inertia(mass, added, whole_modes(place), 0.9)
    assert inertia.momenta(np.ones((60, 3))).sum(axis=0) == pytest.approx(
        mass.sum() + 0.1 * added.sum()
    )
    turn = np.column_stack([-place[:, 1], place[:, 0], place[:, 0] * place[:, 1]])
    assert inertia.momenta(turn) == pytest.approx((mass + 0.1 * added)[:, None] * turn)


@pytest.mark.parametrize("precision", [np.float64, np.float32])
def test_a_light_sheet_falls_with_its_weight_over_its_mass_and_what_is_left(precision):
    """It would fall nine times slower with all that its sub-steps need."""
    net = build_net(rectangular(1.3, 0.8, fabric(), 4000))
    sheet = replace(make_sheet(net, build_straps(net, NO_STRAPS)), drag_rate=0.0)
    solver = ExplicitSolver(sheet, precision=precision)
    state = lay_flat(net, np.zeros(3))
    solver.advance(state, 0.02, untouched(sheet), STILL_BAR)
    weight, added = net.mass.sum() * 9.80665, (solver.inertia.local - net.mass).sum()
    momentum = solver.inertia.momenta(state.velocity).sum(axis=0)
    assert momentum == pytest.approx([0, 0, -0.02 * weight], rel=1e-5, abs=1e-5)
    assert added > 5 * WHOLE_INERTIA
    fallen = -state.velocity[:, 2].mean()
    assert fallen == pytest.approx(0.02 * weight / (net.mass.sum() + WHOLE_INERTIA), rel=0.05)
