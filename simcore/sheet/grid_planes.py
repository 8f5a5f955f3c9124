"""The planes of one contact of a sheet, side by side for the sub-steps of a step."""

import numpy as np

from simcore.compiled import compiled, fused
from simcore.sheet.contact import ContactForce, PlaneContact
from simcore.sheet.grid import LANES, SheetGrid
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
    solve_planes,
)

# Rows of what planes know of their vertices; vectors take three. PUSHED is the force that another
# contact is going to add: zero unless it is written.
PUSHED, POSITION, VELOCITY, BEFORE, MOBILITY, OWN_SIZE = 0, 3, 6, 9, 12, 13


class GridPlanes:
    """What `meet_planes` reads and writes of a contact.

    A sheet touches with a part of its vertices: these have a column each, in their order, and some
    that nothing touches fill the last vector.

    Parameters
    ----------
    grid : SheetGrid
    fixed : bool
        Planes come and go, but never change, as those of a bed.

    Attributes
    ----------
    arrays : tuple
        Points of the grid (N,) uint32, and the rows (·, N) of law, tie, force, sums, and of what
        is known of the vertices.
    last : uint64
        Columns before this one are in use.
    friction : tuple of two floats
        µ, and ε [m/s], as `PlaneContact` has them.
    met : bool
        Whether any vertex has a plane in this step.
    """

    def __init__(self, grid: SheetGrid, fixed: bool = False):
        self._grid = grid
        self._chosen = np.empty(0, np.int64)  # vertices of the columns
        self._fixed, self._substep = fixed, 0.0
        sizes = LAW_SIZE, TIE_SIZE, 3, SUMS, OWN_SIZE
        self.arrays = (
            np.zeros(grid.last + grid.first, np.uint32), *(grid.zeros(size) for size in sizes)
        )
        self.last = np.uint64(0)
        self.friction = (0.0, 0.0)
        self.met = False

    def lay(self, contact: PlaneContact, coarse: np.ndarray, h: float) -> None:
        """Put the planes side by side, for sub-steps of h [s] from rounded positions (3, N) [m]."""
        grid = self._grid
        self.friction = (
            grid.precision(contact.friction_coefficient), grid.precision(contact.friction_velocity)
        )
        chosen = np.flatnonzero(contact.active)
        self.met = bool(len(chosen))
        if not self.met:
            return
        as_it_is = self._fixed and h == self._substep and np.array_equal(chosen, self._chosen)
        self._chosen, self._substep = chosen, h
        self.last = np.uint64(-(-len(chosen) // LANES) * LANES)
        points, law, tie, force, sums, own = self.arrays
        if not as_it_is:
            _lay_law(
                chosen, contact.normal, contact.stiffness, contact.damping,
                contact.surface_velocity, contact.tangential_stiffness,
                contact.tangential_damping, contact.friction_force, grid.place, grid.mobility, h,
                self.last, points, law, own,
            )
        _lay_state(
            chosen, contact.normal, contact.offset, contact.anchor, contact.force, points, coarse,
            self.last, law, tie, force, sums,
        )

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
        points, _, tie, force, sums, _ = self.arrays
        total, spent = _read(
            self._chosen, contact.normal, contact.surface_velocity, points, coarse, position,
            duration, tie, force, sums, of_sheet.force, of_sheet.normal_force, contact.anchor,
            contact.force,
        )
        return of_sheet, total, spent


@fused
def meet_planes(arrays, last, friction, position, velocity, before, time, h):
    """Move the vertices that have a plane through a sub-step: `solve_planes`.

    Parameters
    ----------
    arrays, last, friction
        Of `GridPlanes`.
    position, velocity, before : (3, N)
        Of all points of the grid, as in `solve_planes`.
    time, h : float
        [s]
    """
    points, law, tie, force, sums, own = arrays
    for axis in range(3):
        take_from_grid(points, last, position[axis], own[POSITION + axis])
        take_from_grid(points, last, velocity[axis], own[VELOCITY + axis])
        take_from_grid(points, last, before[axis], own[BEFORE + axis])
    solve_planes(
        law, tie, force, sums, own[PUSHED], own[PUSHED + 1], own[PUSHED + 2],
        own[POSITION : POSITION + 3], own[VELOCITY : VELOCITY + 3], own[BEFORE : BEFORE + 3],
        own[MOBILITY], *friction, time, h, last,
    )
    for axis in range(3):
        put_on_grid(points, last, own[VELOCITY + axis], velocity[axis])


@fused
def take_from_grid(points, last, of_grid, out):
    """Write what the grid (N,) has at the points of all columns."""
    for column in range(np.uint64(0), last):
        out[column] = of_grid[points[column]]


@fused
def put_on_grid(points, last, values, of_grid):
    """Write the values of all columns at their points; those that fill up are absent ones."""
    for column in range(np.uint64(0), last):
        of_grid[points[column]] = values[column]


@compiled
def _lay_law(
    chosen, normal, stiffness, damping, surface_velocity, tangential_stiffness,
    tangential_damping, friction_force, place, mobility, h, last, points, law, own,
):
    """Write the planes of the chosen vertices but for their depths; the rest give no force."""
    for column in range(chosen.size, last):
        points[column] = 0
        law[:, column] = 0.0
        own[MOBILITY, column] = 0.0
    for column in range(chosen.size):
        i = chosen[column]
        points[column] = place[i]
        own[MOBILITY, column] = mobility[place[i]]
        for axis in range(3):
            law[NORMAL + axis, column] = normal[i, axis]
            law[SURFACE + axis, column] = surface_velocity[i, axis]
        rate = h * mobility[place[i]]
        k, k_t = stiffness[i], tangential_stiffness[i]
        law[STIFFNESS, column], law[DAMPING, column] = k, damping[i]
        law[SHARE, column] = 1.0 / (1.0 + rate * (h * k + damping[i]))
        law[K_T, column], law[C_T, column] = k_t, tangential_damping[i]
        law[SHARE_T, column] = 1.0 / (1.0 + rate * (h * k_t + tangential_damping[i]))
        law[SOFTNESS, column] = 1.0 / k_t if k_t > 0.0 else 0.0
        law[F_C, column] = friction_force[i]


@compiled
def _lay_state(
    chosen, normal, offset, anchor, last_force, points, coarse, last, law, tie, force, sums
):
    """Write the depths, ties and forces from which a step starts."""
    for row in range(sums.shape[0]):
        for column in range(last):
            sums[row, column] = 0.0
    for column in range(chosen.size, last):
        law[DEPTH, column], tie[OPEN, column] = -1.0, 1.0
        for axis in range(3):
            tie[axis, column] = force[axis, column] = 0.0
    for column in range(chosen.size):
        i, p = chosen[column], points[column]
        tie[OPEN, column] = 0.0
        depth = offset[i]
        for axis in range(3):
            tie[axis, column] = anchor[i, axis] - coarse[axis, p]
            force[axis, column] = last_force[i, axis]
            depth -= normal[i, axis] * coarse[axis, p]
        law[DEPTH, column] = depth


@compiled
def _read(
    chosen, normal, surface_velocity, points, coarse, position, duration, tie, force, sums, mean,
    normal_force, anchor, last_force,
):
    """Write the means of a step and the state of the planes at its end.

    Returns the sums of the means and of what was spent.
    """
    total, spent = np.zeros(3), np.zeros(3)
    for column in range(chosen.size):
        i, p = chosen[column], points[column]
        for axis in range(3):
            spent[axis] += sums[HEAT + axis, column]
            mean[i, axis] = sums[axis, column] / duration
            total[axis] += mean[i, axis]
            normal_force[i] += normal[i, axis] * mean[i, axis]
            last_force[i, axis] = force[axis, column]
            tied = np.float64(coarse[axis, p]) + tie[axis, column]
            tied += duration * surface_velocity[i, axis]
            anchor[i, axis] = position[i, axis] if tie[OPEN, column] > 0.0 else tied
    return total, spent
