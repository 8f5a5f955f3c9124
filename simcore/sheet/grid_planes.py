"""The planes of one contact on the grid of a sheet, for the sub-steps of a step."""

import numpy as np

from simcore.compiled import compiled
from simcore.sheet.contact import ContactForce, PlaneContact
from simcore.sheet.grid import SheetGrid
from simcore.sheet.vertex_contact import (
    C_T,
    DAMPING,
    DEPTH,
    F_C,
    HEAT,
    K_T,
    LAW_SIZE,
    NORMAL,
    OPEN,
    SHARE,
    SHARE_T,
    SOFTNESS,
    STIFFNESS,
    SUMS,
    SURFACE,
    TIE_SIZE,
)


class GridPlanes:
    """What `simcore.sheet.vertex_contact.solve_planes` reads and writes of a contact.

    Parameters
    ----------
    grid : SheetGrid
    fixed : bool
        Planes come and go, but never change, as those of a bed.

    Attributes
    ----------
    arrays : tuple of (·, N)
        Law, tie, force and sums.
    friction : tuple of two floats
        µ, and ε [m/s], as `PlaneContact` has them.
    met : bool
        Whether any vertex has a plane in this step.
    """

    def __init__(self, grid: SheetGrid, fixed: bool = False):
        self._grid = grid
        self._still = np.zeros(len(grid.place), bool)  # whose law is there, and stays as it is
        self._fixed, self._substep = fixed, 0.0
        self.arrays = tuple(grid.zeros(size) for size in (LAW_SIZE, TIE_SIZE, 3, SUMS))
        self.friction = (0.0, 0.0)
        self.met = False

    def lay(self, contact: PlaneContact, coarse: np.ndarray, h: float) -> None:
        """Put the planes on the grid, for sub-steps of h [s] from rounded positions (3, N) [m]."""
        grid, (law, tie, force, sums) = self._grid, self.arrays
        self.friction = (
            grid.precision(contact.friction_coefficient), grid.precision(contact.friction_velocity)
        )
        force[:] = sums[:] = 0.0
        self.met = bool(contact.active.any())
        if h != self._substep:
            self._still[:], self._substep = False, h
        if self.met:
            _lay(
                contact.active, contact.normal, contact.offset, contact.stiffness, contact.damping,
                contact.surface_velocity, contact.tangential_stiffness,
                contact.tangential_damping, contact.anchor, contact.force, contact.friction_force,
                grid.place, coarse, grid.mobility, h, self._still, law, tie, force,
            )
            if self._fixed:
                self._still[:] = contact.active

    def read(
        self, contact: PlaneContact, coarse: np.ndarray, position: np.ndarray, duration: float
    ) -> tuple[ContactForce, np.ndarray, np.ndarray]:
        """Return mean force, its sum, and energy spent over a step; write back the contact.

        Parameters
        ----------
        coarse : (3, N)
            As in `lay` [m].
        position : (n, 3) float64
            At the end of the step [m]: what is open is tied to where its vertex is.

        Returns
        -------
        force : ContactForce
        total : (3,) float64
            [N]
        spent : (3,) float64
            Heat of dashpots, work of sliding friction and numerical loss [J].
        """
        of_sheet = ContactForce(np.zeros(position.shape), np.zeros(len(position)))
        if not self.met:
            return of_sheet, np.zeros(3), np.zeros(3)
        _, tie, force, sums = self.arrays
        total, spent = _read(
            contact.active, contact.normal, contact.surface_velocity, self._grid.place, coarse,
            position, duration, tie, force, sums, of_sheet.force, of_sheet.normal_force,
            contact.anchor, contact.force,
        )
        return of_sheet, total, spent


@compiled
def _lay(
    active, normal, offset, stiffness, damping, surface_velocity, tangential_stiffness,
    tangential_damping, anchor, last_force, friction_force, place, coarse, mobility, h, still, law,
    tie, force,
):
    """Write the planes; a vertex without one has a law that gives no force."""
    for i in range(active.size):
        p = place[i]
        tie[OPEN, p] = 0.0 if active[i] else 1.0
        if not active[i]:
            law[STIFFNESS, p] = law[DAMPING, p] = law[SHARE, p] = law[K_T, p] = 0.0
            continue
        depth = offset[i]
        for axis in range(3):
            tie[axis, p] = anchor[i, axis] - coarse[axis, p]
            force[axis, p] = last_force[i, axis]
            depth -= normal[i, axis] * coarse[axis, p]
        law[DEPTH, p] = depth
        if still[i]:
            continue
        for axis in range(3):
            law[NORMAL + axis, p] = normal[i, axis]
            law[SURFACE + axis, p] = surface_velocity[i, axis]
        rate = h * mobility[p]
        k, k_t = stiffness[i], tangential_stiffness[i]
        law[STIFFNESS, p], law[DAMPING, p] = k, damping[i]
        law[SHARE, p] = 1.0 / (1.0 + rate * (h * k + damping[i]))
        law[K_T, p], law[C_T, p] = k_t, tangential_damping[i]
        law[SHARE_T, p] = 1.0 / (1.0 + rate * (h * k_t + tangential_damping[i]))
        law[SOFTNESS, p] = 1.0 / k_t if k_t > 0.0 else 0.0
        law[F_C, p] = friction_force[i]


@compiled
def _read(
    active, normal, surface_velocity, place, coarse, position, duration, tie, force, sums, mean,
    normal_force, anchor, last_force,
):
    """Write the means of a step and the state of the planes at its end.

    Returns the sums of the means and of what was spent.
    """
    total, spent = np.zeros(3), np.zeros(3)
    for i in range(active.size):
        if not active[i]:
            continue
        p = place[i]
        for axis in range(3):
            spent[axis] += sums[HEAT + axis, p]
            mean[i, axis] = sums[axis, p] / duration
            total[axis] += mean[i, axis]
            normal_force[i] += normal[i, axis] * mean[i, axis]
            last_force[i, axis] = force[axis, p]
            tied = np.float64(coarse[axis, p]) + tie[axis, p]
            tied += duration * surface_velocity[i, axis]
            anchor[i, axis] = position[i, axis] if tie[OPEN, p] > 0.0 else tied
    return total, spent
