"""The bed under a sheet on the sheet's grid, for the sub-steps of a step."""

import numpy as np

from simcore.compiled import compiled, inlined
from simcore.sheet.bed_contact import solve_bed
from simcore.sheet.contact import PlaneContact
from simcore.sheet.grid import LANES, SheetGrid

# Rows of the law of a bed.
STIFFNESS, DAMPING, SHARE, K_T, C_T, SHARE_T, SOFTNESS, F_C, LAW_SIZE = 0, 1, 2, 3, 4, 5, 6, 7, 8
# Rows of what a step begins with, and of what it sums up.
DEPTH, ANCHOR, OPEN, STATE_SIZE = 0, 1, 4, 5
HEAT, SUMS = 3, 6  # after the impulse: heat, work of friction, loss

FAR_BELOW = -1e3
"""Depth of the bed where a vertex has none, which no sub-step bridges [m]."""


class GridBed:
    """What `meet_bed` reads and writes.

    A sheet lies on a bed with most of its vertices, or is about to leave it: all points of the
    grid from the first to the last of them are solved, where they are. What the bed is to each
    vertex never changes, and is laid out once for a length of sub-steps.

    Parameters
    ----------
    grid : SheetGrid

    Attributes
    ----------
    arrays : tuple
        Rows (·, N) of law, state and sums.
    span : tuple of two uint64
        Points that sub-steps run over.
    friction : tuple of two floats
        µ, and ε [m/s], as `PlaneContact` has them.
    met : bool
        Whether any vertex is near the bed in this step.
    """

    def __init__(self, grid: SheetGrid):
        self._grid, self._substep = grid, 0.0
        self.arrays = tuple(grid.zeros(size) for size in (LAW_SIZE, STATE_SIZE, SUMS))
        self.span = np.uint64(0), np.uint64(0)
        self.friction = grid.precision(0.0), grid.precision(0.0)
        self.met = False

    def lay(self, bed: PlaneContact, coarse: np.ndarray, h: float) -> None:
        """Lay the bed for sub-steps of h [s] from rounded positions (3, N) [m]."""
        grid, (law, state, sums) = self._grid, self.arrays
        first, last = _span_of(bed.active, grid.place)
        self.met = first <= last
        if not self.met:
            return
        if h != self._substep:
            self._substep = h
            _lay_law(
                bed.stiffness, bed.damping, bed.tangential_stiffness, bed.tangential_damping,
                bed.friction_force, grid.place, grid.mobility, h, law,
            )
            self.friction = (
                grid.precision(bed.friction_coefficient), grid.precision(bed.friction_velocity)
            )
        first, last = first // LANES * LANES, (last // LANES + 1) * LANES
        self.span = np.uint64(first), np.uint64(last)
        _lay_state(bed.active, bed.anchor, grid.place, coarse, first, last, state, sums)

    def read(
        self, bed: PlaneContact, coarse: np.ndarray, position: np.ndarray, duration: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return mean force of the bed and energy spent over a step; write back the anchors.

        Parameters
        ----------
        coarse : (3, N)
            As in `lay` [m].
        position : (n, 3) float64
            At the end of the step [m]: what is open is tied to where its vertex is.

        Returns
        -------
        total : (3,) float64
            [N]
        spent : (3,) float64
            Heat of dashpots, work of sliding friction and numerical loss [J].
        """
        if not self.met:
            return np.zeros(3), np.zeros(3)
        _, state, sums = self.arrays
        return _read(
            bed.active, self._grid.place, coarse, position, duration, state, sums, bed.anchor
        )


@inlined
def meet_bed(arrays, span, friction, pushed, fine, velocity, before, mobility, h):
    """Move the vertices that are near the bed through a sub-step: `solve_bed`.

    Parameters
    ----------
    arrays, span, friction
        Of `GridBed`.
    pushed, fine, velocity, before : (3, N)
        Force of the skin, positions, velocities and those at the start of the sub-step.
    mobility : (N,)
    h : float
        [s]
    """
    law, state, sums = arrays
    coefficient, epsilon = friction
    first, last = span
    solve_bed(
        law, state, sums, pushed, fine, velocity, before, mobility, coefficient, epsilon, h, first,
        last,
    )


@compiled
def _span_of(active, place):
    """Return the first and the last point of the grid whose vertex is active; (1, 0) for none."""
    first, last = 1, 0
    for i in range(active.size):
        if active[i]:
            p = place[i]
            first, last = (min(first, p), max(last, p)) if last else (p, p)
    return first, last


@compiled
def _lay_law(
    stiffness, damping, tangential_stiffness, tangential_damping, friction_force, place, mobility,
    h, law,
):
    """Write what the bed is to each vertex."""
    for i in range(place.size):
        p = place[i]
        rate = h * mobility[p]
        k, k_t = stiffness[i], tangential_stiffness[i]
        law[STIFFNESS, p], law[DAMPING, p] = k, damping[i]
        law[SHARE, p] = 1.0 / (1.0 + rate * (h * k + damping[i]))
        law[K_T, p], law[C_T, p] = k_t, tangential_damping[i]
        law[SHARE_T, p] = 1.0 / (1.0 + rate * (h * k_t + tangential_damping[i]))
        law[SOFTNESS, p] = 1.0 / k_t if k_t > 0.0 else 0.0
        law[F_C, p] = friction_force[i]


@compiled
def _lay_state(active, anchor, place, coarse, first, last, state, sums):
    """Write the depths and ties from which a step starts."""
    for row in range(sums.shape[0]):
        sums[row, first:last] = 0.0
    state[DEPTH, first:last] = FAR_BELOW
    for axis in range(3):
        state[ANCHOR + axis, first:last] = 0.0
    state[OPEN, first:last] = 1.0
    for i in range(active.size):
        if active[i]:
            p = np.uint64(place[i])
            state[DEPTH, p], state[OPEN, p] = -coarse[2, p], 0.0
            for axis in range(3):
                state[ANCHOR + axis, p] = anchor[i, axis] - coarse[axis, p]


@compiled
def _read(active, place, coarse, position, duration, state, sums, anchor):
    """Write the anchors at the end of a step; return sums of mean forces and of what was spent."""
    total, spent = np.zeros(3), np.zeros(3)
    for i in range(active.size):
        if not active[i]:
            continue
        p = np.uint64(place[i])
        is_open = state[OPEN, p] > 0.0
        for axis in range(3):
            spent[axis] += sums[HEAT + axis, p]
            total[axis] += sums[axis, p] / duration
            tied = np.float64(coarse[axis, p]) + state[ANCHOR + axis, p]
            anchor[i, axis] = position[i, axis] if is_open else tied
    return total, spent
