"""Explicit sub-steps of a sheet with contact implicit on the vertex: the default solver."""

import itertools

import numpy as np
from scipy.linalg import eigh

from simcore.compiled import fused, inlined
from simcore.errors import DesignError
from simcore.sheet.contact import PlaneContact
from simcore.sheet.grid import SheetGrid, split, unite
from simcore.sheet.grid_bed import GridBed, meet_bed
from simcore.sheet.grid_planes import GridPlanes, meet_planes, put_on_grid
from simcore.sheet.hanging import BarState, bar_points
from simcore.sheet.inertia import Inertia, whole_modes
from simcore.sheet.solver import Reaction, Sheet, SheetState, check_finite, planes_of_bed
from simcore.sheet.spring_pass import accelerate, carry, move, pull_springs

STABILITY_MARGIN = 1.1
"""Vertex inertia over the least that a stable sub-step needs (Eq. S8)."""

SUBSTEP_MAX = 0.42e-3
"""Longest sub-step taken unasked [s]."""

# ASSUME: seams and friction between threads damp the stretch of a fabric; this much quiets the
# net's own frequencies and leaves the swing of the whole sheet alone.
SPRING_DAMPING_TIME = 2.0e-5
"""Damping over stiffness of every spring, β [s]."""

ADDED_INERTIA_MAX = 40.0
"""Most inertia, over the sheet's mass, that a sub-step may need to be stable [kg]."""

# ASSUME: dashpots of the flesh under 70 kg, some 2,600 N s/m, act on the sheet as a whole at the
# end of a sub-step, and are stable against more than half of what they take in one: 1.1 kg in
# 0.42 ms.
WHOLE_INERTIA = 1.5
"""Added inertia that is left on the motion of the sheet as a whole (Eq. S14) [kg]."""

WHOLE_MARGIN = 3.0
"""Inertia of that motion over the h² K that is stable by itself, times 4: single springs have
a tenth to spare only (Eq. S8), and what they share with it is bounded by Young's inequality."""


class ExplicitSolver:
    """Semi-implicit Euler sub-steps on the grid of the net.

    A sub-step of length h evaluates the springs at x, solves contact for the new velocity with
    the inertia of the vertex (Eqs. S5 to S7) and moves x by h v. That inertia is its mass, or
    what stability needs where that is more (Eq. S8); weight and drag go by the mass.

    Parameters
    ----------
    sheet : Sheet
    substep : float, optional
        h [s]; by default SUBSTEP_MAX, or the longest that the allowed inertia holds.
    damping_time : float
        β of the springs [s].
    added_inertia_max : float
        [kg]
    precision : type
        Of the sub-steps: single, or double as a reference for it.

    Attributes
    ----------
    inertia : Inertia
    substep, damping_time : float
        [s]

    Raises
    ------
    DesignError
        A sub-step that is not positive, or too long to be held by the inertia allowed.
    """

    def __init__(
        self,
        sheet: Sheet,
        substep: float | None = None,
        damping_time: float = SPRING_DAMPING_TIME,
        added_inertia_max: float = ADDED_INERTIA_MAX,
        precision: type = np.float32,
    ):
        self.sheet = sheet
        self._row_stiffness, self._row_damping = _vertex_sums(sheet, damping_time)
        longest = self._longest_substep(added_inertia_max)
        if substep is None:
            substep = min(SUBSTEP_MAX, longest)
        elif not 0 < substep <= longest * (1 + 1e-9):
            raise DesignError(
                f"method.sheet.solver.substep_s: {substep:g} cannot be held by this sheet without "
                f"more than {added_inertia_max:g} kg of added inertia; accepted: above 0 to "
                f"{longest:.3g}"
            )
        self.substep, self.damping_time = substep, damping_time
        mass, needed = sheet.net.mass, self._needed_inertia(substep)
        added = np.where(sheet.pinned, 0.0, np.maximum(needed - mass, 0.0))
        modes = whole_modes(sheet.net.rest_position)
        carried = _carried_share(sheet, added, modes, substep)
        self.inertia = Inertia(mass, added, modes, carried)

        self._grid = grid = SheetGrid(sheet, self.inertia.local, precision)
        self._skin, self._bed = GridPlanes(grid), GridBed(grid)
        self._coarse, self._fine, self._velocity, self._before = (grid.zeros(3) for _ in range(4))
        self._pull = grid.zeros(len(grid.offsets), 3)
        # Of what planes ask for, in pairs of points.
        self._pairs = tuple(
            rows.view(grid.pair) for rows in (self._fine, self._velocity, self._before)
        )
        pushed = grid.zeros(3)  # force of the skin, while there is a bed to meet it
        self._pushed = pushed, pushed.view(grid.pair)
        kept = sheet.net.compression_share
        self._springs = (
            grid.offsets, grid.stiffness, grid.rest_length, precision(sheet.net.buckling_strain),
            np.array([kept, kept, kept, kept, 1, 1], precision), precision(damping_time),
        )
        self._weight = (
            grid.mass, grid.mobility, sheet.gravity.astype(precision), precision(sheet.drag_rate)
        )
        straps = sheet.straps
        self._straps = (
            straps.length, straps.stiffness, straps.damping, straps.patch_start,
            grid.place[straps.patch_vertex], straps.patch_weight,
        )
        gathered, spread = grid.zeros(modes.shape[1]), grid.zeros(modes.shape[1])
        gathered[:, grid.place], spread[:, grid.place] = (
            self.inertia.gathered.T, self.inertia.spread.T
        )
        self._whole = gathered, spread, self.inertia.coupling.astype(precision)
        self._span = np.uint64(grid.first), np.uint64(grid.last)

    def advance(
        self, state: SheetState, dt: float, contact: PlaneContact, bar: BarState
    ) -> Reaction:
        """Implement `simcore.sheet.solver.SheetSolver.advance` by dt / h sub-steps, rounded up."""
        skin, bed, grid, coarse = self._skin, self._bed, self._grid, self._coarse
        count = max(1, int(np.ceil(dt / self.substep * (1 - 1e-9))))
        on_bed = planes_of_bed(self.sheet, state)
        split(state.position, state.velocity, grid.place, coarse, self._fine, self._before)
        skin.lay(contact, coarse, dt / count)
        bed.lay(on_bed, coarse, dt / count)
        hanging = bar_points(self.sheet.straps, bar)
        strap_impulse = np.zeros_like(hanging[0])
        _substeps(
            coarse, self._fine, self._velocity, self._before, grid.precision(dt / count), count,
            self._springs, self._weight, self._straps, hanging, strap_impulse,
            (bed.arrays, bed.span, bed.friction), bed.met,
            (skin.arrays, skin.pairs, skin.last, skin.friction), skin.met, self._pushed,
            self._pairs, self._whole, self._pull, self._span,
        )
        unite(state.position, state.velocity, grid.place, coarse, self._fine, self._before)
        check_finite(state)
        of_bed, by_bed = bed.read(on_bed, coarse, state.position, dt)
        of_skin, _, by_skin = skin.read(contact, coarse, state.position, dt)
        return Reaction(of_skin, of_bed, strap_impulse / dt, count, by_bed + by_skin)

    def _needed_inertia(self, substep: float) -> np.ndarray:
        """Return the inertia (n,) that keeps a sub-step stable [kg]: Eq. S8."""
        return STABILITY_MARGIN * (
            substep**2 / 2 * self._row_stiffness + substep * self._row_damping
        )

    def _longest_substep(self, added_inertia_max: float) -> float:
        """Return the longest sub-step [s] that stays within the added inertia, by bisection."""
        mass = self.sheet.net.mass
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = (low + high) / 2
            added = np.maximum(self._needed_inertia(middle) - mass, 0).sum()
            low, high = (middle, high) if added <= added_inertia_max else (low, middle)
        return low


def _carried_share(
    sheet: Sheet, added: np.ndarray, modes: np.ndarray, substep: float
) -> float:
    """Return κ of Eq. S14: what leaves `WHOLE_INERTIA`, or what springs need if that is more."""
    if not added.any():
        return 0.0
    net, straps = sheet.net, sheet.straps
    moving = np.where(sheet.pinned, 0.0, 1.0)[:, None] * modes
    stretch = moving[net.spring_vertices[:, 1]] - moving[net.spring_vertices[:, 0]]
    stiffness = stretch.T @ (net.stiffness[:, None] * stretch)
    for s, (first, last) in enumerate(itertools.pairwise(straps.patch_start)):
        pulled = straps.patch_weight[first:last] @ moving[straps.patch_vertex[first:last]]
        stiffness += straps.stiffness[s] * np.outer(pulled, pulled)
    inner = modes.T @ (added[:, None] * modes)
    needed = WHOLE_MARGIN * substep**2 * eigh(stiffness, inner, eigvals_only=True)[-1]
    return max(1.0 - max(WHOLE_INERTIA / added.sum(), needed), 0.0)


def _vertex_sums(sheet: Sheet, damping_time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return Σk and Σc (n,) of the springs and straps at each vertex [N/m, N s/m].

    A strap counts half its share: its other end does not move with the vertex.
    """
    net, straps = sheet.net, sheet.straps
    stiffness = np.zeros(len(net.mass))
    for end in (0, 1):
        np.add.at(stiffness, net.spring_vertices[:, end], net.stiffness)
    damping = damping_time * stiffness
    strap = np.repeat(np.arange(len(straps.length)), np.diff(straps.patch_start))
    half = straps.patch_weight / 2
    np.add.at(stiffness, straps.patch_vertex, half * straps.stiffness[strap])
    np.add.at(damping, straps.patch_vertex, half * straps.damping[strap])
    return stiffness, damping


@fused
def _substeps(
    coarse, fine, velocity, before, h, count, springs, weight, straps, hanging, strap_impulse,
    bed, on_bed, skin, on_skin, pushed, pairs, whole, pull, span,
):
    """Take `count` sub-steps of length h [s]; arrays are those of the grid.

    A vertex between bed and body meets the bed first, at the velocity that the body's force of the
    sub-step before would give, and then the body at the velocity that the bed has left.
    """
    offsets, stiffness, rest_length, buckling_strain, share, damping_time = springs
    mass, mobility, gravity, drag_rate = weight
    gathered, spread, coupling = whole
    first, last = span
    by_skin, by_skin_in_pairs = pushed
    bed_arrays, bed_span, bed_friction = bed
    skin_arrays, skin_pairs, skin_last, skin_friction = skin
    fine_pairs, velocity_pairs, before_pairs = pairs
    if on_bed:
        by_skin[:] = 0.0
    time = h - h
    for _ in range(count):
        pull_springs(
            coarse, fine, before, offsets, stiffness, rest_length, buckling_strain, share,
            damping_time, pull, first, last,
        )
        accelerate(
            before, pull, offsets, mass, mobility, gravity, drag_rate, h, velocity, first, last
        )
        for s in range(strap_impulse.shape[0]):
            _pull_strap(
                s, coarse, fine, before, velocity, mobility, time, h, hanging, straps,
                strap_impulse,
            )
        if on_bed:
            _push(skin_pairs, skin_last, by_skin_in_pairs)
            meet_bed(
                bed_arrays, bed_span, bed_friction, by_skin, fine, velocity, before, mobility, h
            )
        if on_skin:
            meet_planes(
                skin_arrays, skin_pairs, skin_last, skin_friction, fine_pairs, velocity_pairs,
                before_pairs, time, h,
            )
        carried = carry(velocity, before, gathered, coupling, first, last)
        move(fine, velocity, before, spread, carried, h, first, last)
        time += h


@inlined
def _push(pairs, last, on_grid):
    """Put the force of the skin in the sub-step before on the grid, in pairs of points."""
    place, force, _ = pairs
    for axis in range(3):
        put_on_grid(place, last, force[axis], on_grid[axis])


@fused
def _pull_strap(
    s, coarse, fine, before, velocity, mobility, time, h, hanging, straps, impulse
):
    """Let the tension of one strap accelerate its patch in a sub-step: Eq. S4."""
    bar_point, bar_velocity = hanging
    length, stiffness, damping, patch_start, patch_place, patch_weight = straps
    dx, dy, dz = bar_point[s, 0], bar_point[s, 1], bar_point[s, 2]
    ux, uy, uz = bar_velocity[s, 0], bar_velocity[s, 1], bar_velocity[s, 2]
    dx, dy, dz = dx + time * ux, dy + time * uy, dz + time * uz
    for e in range(patch_start[s], patch_start[s + 1]):
        p, w = patch_place[e], patch_weight[e]
        dx -= w * (np.float64(coarse[0, p]) + fine[0, p])
        dy -= w * (np.float64(coarse[1, p]) + fine[1, p])
        dz -= w * (np.float64(coarse[2, p]) + fine[2, p])
        ux, uy, uz = ux - w * before[0, p], uy - w * before[1, p], uz - w * before[2, p]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    if distance <= length[s]:
        return
    rate = (dx * ux + dy * uy + dz * uz) / distance
    spring = stiffness[s] * (distance - length[s])
    pull = h * (spring + min(max(damping[s] * rate, -spring), spring)) / distance
    for e in range(patch_start[s], patch_start[s + 1]):
        p = patch_place[e]
        share = patch_weight[e] * pull * mobility[p]
        velocity[0, p] += share * dx
        velocity[1, p] += share * dy
        velocity[2, p] += share * dz
    impulse[s, 0] += pull * dx
    impulse[s, 1] += pull * dy
    impulse[s, 2] += pull * dz
