"""The planes of one contact of a sheet, side by side for the sub-steps of a step."""

import numpy as np

from simcore.compiled import compiled, inlined
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

# Rows of what planes know of their vertices; vectors take three.
POSITION, VELOCITY, BEFORE, MOBILITY, OWN_SIZE = 0, 3, 6, 9, 10


class GridPlanes:
    """What `meet_planes` reads and writes of a contact.

    A sheet touches with a part of its vertices. Pairs of points of the grid of which one or both
    touch have two columns each, and some that nothing touches fill the last vector.

    Parameters
    ----------
    grid : SheetGrid

    Attributes
    ----------
    arrays : tuple
        Rows (·, N) of law, tie, force, sums, and of what is known of the vertices.
    pairs : tuple
        Where on the grid the pairs are (N / 2,) uint32, counted in pairs, and the rows of force
        and of what is known, in pairs.
    last : uint64
        Columns before this one are in use.
    friction : tuple of two floats
        µ, and ε [m/s], as `PlaneContact` has them.
    met : bool
        Whether any vertex has a plane in this step.
    """

    def __init__(self, grid: SheetGrid):
        self._grid = grid
        self._chosen = self._column = np.empty(0, np.int64)  # vertices, and their columns
        sizes = LAW_SIZE, TIE_SIZE, 3, SUMS, OWN_SIZE
        self.arrays = tuple(grid.zeros(size) for size in sizes)
        _, _, force, _, own = self.arrays
        self._pairs = np.zeros(force.shape[1] // 2, np.uint32)
        self.pairs = self._pairs, force.view(grid.pair), own.view(grid.pair)
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
            self._chosen, self.last = chosen, np.uint64(0)
            return
        law, tie, force, sums, own = self.arrays
        self._chosen = chosen
        self._column, count = _pair_up(grid.place[chosen], self._pairs)
        self.last = np.uint64(-(-2 * count // LANES) * LANES)
        self._pairs[count : self.last // 2] = 0
        _lay_law(
            chosen, self._column, contact.normal, contact.stiffness, contact.damping,
            contact.surface_velocity, contact.tangential_stiffness, contact.tangential_damping,
            contact.friction_force, grid.place, grid.mobility, h, self.last, law, own,
        )
        _lay_state(
            chosen, self._column, contact.normal, contact.offset, contact.anchor, contact.force,
            grid.place, coarse, self.last, law, tie, force, sums,
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
        _, tie, force, sums, _ = self.arrays
        total, spent = _read(
            self._chosen, self._column, contact.normal, contact.surface_velocity,
            self._grid.place, coarse, position, duration, tie, force, sums, of_sheet.force,
            of_sheet.normal_force, contact.anchor, contact.force,
        )
        return of_sheet, total, spent


@inlined
def meet_planes(arrays, pairs, last, friction, position, velocity, before, time, h):
    """Move the vertices that have a plane through a sub-step: `solve_planes`.

    Parameters
    ----------
    arrays, pairs, last, friction
        Of `GridPlanes`.
    position, velocity, before : (3, N / 2)
        Of all points of the grid, as in `solve_planes`, in pairs.
    time, h : float
        [s]
    """
    law, tie, force, sums, own = arrays
    place, _, own_pairs = pairs
    coefficient, epsilon = friction
    for axis in range(3):
        take_from_grid(place, last, position[axis], own_pairs[POSITION + axis])
        take_from_grid(place, last, velocity[axis], own_pairs[VELOCITY + axis])
        take_from_grid(place, last, before[axis], own_pairs[BEFORE + axis])
    solve_planes(
        law, tie, force, sums, own[POSITION : POSITION + 3], own[VELOCITY : VELOCITY + 3],
        own[BEFORE : BEFORE + 3], own[MOBILITY], coefficient, epsilon, time, h, last,
    )
    for axis in range(3):
        put_on_grid(place, last, own_pairs[VELOCITY + axis], velocity[axis])


@inlined
def take_from_grid(place, last, of_grid, out):
    """Write what the grid has where the pairs of columns are; all of these in pairs."""
    for pair in range(np.uint64(0), last // np.uint64(2)):
        out[pair] = of_grid[place[pair]]


@inlined
def put_on_grid(place, last, values, of_grid):
    """Write the values of pairs of columns where they are; those that fill up are absent ones."""
    for pair in range(np.uint64(0), last // np.uint64(2)):
        of_grid[place[pair]] = values[pair]


@compiled
def _pair_up(points, pairs):
    """Write the pairs that these points of a grid (k,), in their order, belong to.

    Returns the column of each point, and the number of pairs.
    """
    column, count = np.empty(points.size, np.int64), 0
    for e in range(points.size):
        if count == 0 or pairs[count - 1] != points[e] // 2:
            pairs[count] = points[e] // 2
            count += 1
        column[e] = 2 * (count - 1) + points[e] % 2
    return column, count


@inlined
def _fill(rows, last, value):
    """Write a value into all columns in use; row by row, as they lie in memory."""
    for row in range(rows.shape[0]):
        rows[row, :last] = value


@compiled
def _lay_law(
    chosen, columns, normal, stiffness, damping, surface_velocity, tangential_stiffness,
    tangential_damping, friction_force, place, mobility, h, last, law, own,
):
    """Write the planes of the chosen vertices but for their depths; the rest give no force."""
    _fill(law, last, 0.0)
    law[DEPTH, :last] = -1.0
    own[MOBILITY, :last] = 0.0
    for e in range(chosen.size):
        i, column = np.uint64(chosen[e]), np.uint64(columns[e])
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
    chosen, columns, normal, offset, anchor, last_force, place, coarse, last, law, tie, force, sums
):
    """Write the depths, ties and forces from which a step starts."""
    _fill(sums, last, 0.0)
    _fill(force, last, 0.0)
    _fill(tie, last, 0.0)
    tie[OPEN, :last] = 1.0
    for e in range(chosen.size):
        i, column = np.uint64(chosen[e]), np.uint64(columns[e])
        p = np.uint64(place[i])
        tie[OPEN, column] = 0.0
        depth = offset[i]
        for axis in range(3):
            tie[axis, column] = anchor[i, axis] - coarse[axis, p]
            force[axis, column] = last_force[i, axis]
            depth -= normal[i, axis] * coarse[axis, p]
        law[DEPTH, column] = depth


@compiled
def _read(
    chosen, columns, normal, surface_velocity, place, coarse, position, duration, tie, force, sums,
    mean, normal_force, anchor, last_force,
):
    """Write the means of a step and the state of the planes at its end.

    Returns the sums of the means and of what was spent.
    """
    total, spent = np.zeros(3), np.zeros(3)
    for e in range(chosen.size):
        i, column = np.uint64(chosen[e]), np.uint64(columns[e])
        p = np.uint64(place[i])
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
