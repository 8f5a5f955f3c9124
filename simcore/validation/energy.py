"""Does energy go where the laws send it (Eq. E1)? The rows for it, and a sheet's own accounts."""

import numpy as np

from simcore.energy import energy_residual
from simcore.sheet import PlaneContact, SheetSolver, SheetState
from simcore.sheet.energy import dashpot_power, planes_energy, stored_energy
from simcore.sheet.hanging import BarState, bar_points
from simcore.sheet.solver import Reaction
from simcore.validation.table import Criterion

RESIDUAL_MAX = 0.01
"""Energy that no account explains, over the energy exchanged."""


class Accounts:
    """Advances a sheet as its solver does, and keeps what `simcore.energy.TERMS` names.

    Parameters
    ----------
    solver : SheetSolver
    state : SheetState
    contact : PlaneContact
        Still within a step; to set planes anew between steps is work of the device.
    bar : BarState
    """

    def __init__(
        self, solver: SheetSolver, state: SheetState, contact: PlaneContact, bar: BarState
    ):
        self._solver, self._flows = solver, np.zeros(5)
        self._points, _ = bar_points(solver.sheet.straps, bar)
        self._strap_force = np.zeros_like(self._points)
        self._power = self._power_now(state, bar)
        self._in_planes = planes_energy(contact, state.position)
        self._rows = [self._row(state, bar)]

    def advance(
        self, state: SheetState, dt: float, contact: PlaneContact, bar: BarState
    ) -> Reaction:
        """Implement `simcore.sheet.solver.SheetSolver.advance`."""
        self._flows[0] += planes_energy(contact, state.position) - self._in_planes
        reaction = self._solver.advance(state, dt, contact, bar)
        points, _ = bar_points(self._solver.sheet.straps, bar)
        pull, power = reaction.strap_force, self._power_now(state, bar)
        # The bar has moved before the step, under the forces of this one and the last alike.
        self._flows[0] += ((pull + self._strap_force) * (points - self._points)).sum() / 2
        self._flows[2] += dt / 2 * (self._power + power)
        self._flows[2:] += reaction.spent
        self._points, self._strap_force, self._power = points, pull, power
        self._in_planes = planes_energy(contact, state.position)
        self._rows.append(self._row(state, bar))
        return reaction

    @property
    def residual(self) -> float:
        """What no account explains, over the energy exchanged: Eq. E6."""
        return energy_residual(np.array(self._rows))

    def _power_now(self, state: SheetState, bar: BarState) -> float:
        """Return the heat at this moment [W], but that of planes and bed."""
        return dashpot_power(self._solver.sheet, self._solver.damping_time, state, bar)

    def _row(self, state: SheetState, bar: BarState) -> np.ndarray:
        stored = stored_energy(self._solver.sheet, self._solver.inertia, state, bar)
        stored[2] += self._in_planes
        return np.concatenate([stored, self._flows])


def energy_criterion(key: str, what: str) -> Criterion:
    """Return what is accepted of a scene's residual: 1 % of the energy exchanged."""
    return Criterion(
        f"{key}_energy", f"{what}: energy that no account explains over the energy exchanged",
        0.0, RESIDUAL_MAX, "", "conservation of energy",
    )
