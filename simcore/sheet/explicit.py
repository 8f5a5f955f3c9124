"""Explicit sub-steps of a sheet with contact implicit on the vertex: the default solver."""

import numpy as np

from simcore.compiled import fused
from simcore.errors import DesignError
from simcore.sheet.contact import PlaneContact
from simcore.sheet.grid import SheetGrid, split, unite
from simcore.sheet.grid_planes import GridPlanes
from simcore.sheet.hanging import BarState, bar_points
from simcore.sheet.solver import Reaction, Sheet, SheetState, check_finite, planes_of_bed
from simcore.sheet.spring_pass import accelerate, move, pull_springs
from simcore.sheet.vertex_contact import solve_planes

STABILITY_MARGIN = 1.1
"""Vertex inertia over the least that a stable sub-step needs (Eq. S8)."""

SUBSTEP_MAX = 2.5e-4
"""Longest sub-step taken unasked [s]."""

# ASSUME: seams and friction between threads damp the stretch of a fabric; this much quiets the
# net's own frequencies and leaves the swing of the whole sheet alone.
SPRING_DAMPING_TIME = 2.0e-5
"""Damping over stiffness of every spring, β [s]."""

ADDED_INERTIA_MAX = 15.0
"""Most inertia, over the sheet's mass, that a sub-step may need to be stable [kg]."""


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
    inertia : (n,) float64
        Of the vertices [kg].
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
        mass = sheet.net.mass
        self.inertia = np.maximum(mass, self._needed_inertia(substep))

        self._grid = grid = SheetGrid(sheet, self.inertia, precision)
        self._skin, self._bed = GridPlanes(grid), GridPlanes(grid)
        self._coarse, self._fine, self._velocity, self._before = (grid.zeros(3) for _ in range(4))
        self._pull = grid.zeros(6, 3)
        kept = sheet.net.compression_share
        self._share = np.array([kept, kept, kept, kept, 1, 1], precision)
        self._patch_place = grid.place[sheet.straps.patch_vertex]

    def advance(
        self, state: SheetState, dt: float, contact: PlaneContact, bar: BarState
    ) -> Reaction:
        """Implement `simcore.sheet.solver.SheetSolver.advance` by dt / h sub-steps, rounded up."""
        straps, net, grid = self.sheet.straps, self.sheet.net, self._grid
        precise = grid.precision
        count = max(1, int(np.ceil(dt / self.substep * (1 - 1e-9))))
        h = dt / count
        points, velocities = bar_points(straps, bar)
        on_bed = planes_of_bed(self.sheet, state)
        split(state.position, state.velocity, grid.place, self._coarse, self._fine, self._before)
        skin, bed = self._skin, self._bed
        skin.lay(contact, self._coarse, h)
        bed.lay(on_bed, self._coarse, h)
        strap_impulse = np.zeros((len(straps.length), 3))
        _substeps(
            self._coarse, self._fine, self._velocity, self._before, self._pull,
            precise(h), count, grid.offsets, grid.stiffness, grid.rest_length,
            precise(net.buckling_strain), self._share, precise(self.damping_time),
            grid.mass, grid.mobility, self.sheet.gravity.astype(precise),
            precise(self.sheet.drag_rate), points, velocities, straps.length, straps.stiffness,
            straps.damping, straps.patch_start, self._patch_place, straps.patch_weight,
            strap_impulse, bed.arrays, bed.friction, bed.met, skin.arrays, skin.friction, skin.met,
            np.uint64(grid.first), np.uint64(grid.last),
        )
        unite(state.position, state.velocity, grid.place, self._coarse, self._fine, self._before)
        check_finite(state)
        of_bed, by_bed = bed.read(on_bed, self._coarse, state.position, dt)
        of_skin, by_skin = skin.read(contact, self._coarse, state.position, dt)
        return Reaction(
            of_skin, of_bed.force.sum(axis=0), strap_impulse / dt, count, by_bed + by_skin
        )

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
    coarse, fine, velocity, before, pull, h, count, offsets, stiffness, rest_length,
    buckling_strain, share, damping_time, mass, mobility, gravity, drag_rate, bar_point,
    bar_velocity, strap_length, strap_stiffness, strap_damping, patch_start, patch_place,
    patch_weight, strap_impulse, bed, bed_friction, on_bed, skin, skin_friction, on_skin, first,
    last,
):
    """Take `count` sub-steps of length h [s]; arrays are those of the grid.

    A vertex between bed and body meets the bed first, at the velocity that the body's force of the
    sub-step before would give, and then the body at the velocity that the bed has left.
    """
    time = h - h
    nothing = np.zeros_like(bed[2])
    for _ in range(count):
        pull_springs(
            coarse, fine, before, offsets, stiffness, rest_length, buckling_strain, share,
            damping_time, pull, first, last,
        )
        accelerate(
            before, pull, offsets, mass, mobility, gravity, drag_rate, h, velocity, first, last
        )
        for s in range(strap_length.size):
            _pull_strap(
                s, coarse, fine, before, velocity, mobility, time, h, bar_point, bar_velocity,
                strap_length, strap_stiffness, strap_damping, patch_start, patch_place,
                patch_weight, strap_impulse,
            )
        if on_bed:
            solve_planes(
                *bed, skin[2], fine, velocity, before, mobility, *bed_friction, time, h, first, last
            )
        if on_skin:
            solve_planes(
                *skin, nothing, fine, velocity, before, mobility, *skin_friction, time, h, first,
                last,
            )
        move(fine, velocity, before, h, first, last)
        time += h


@fused
def _pull_strap(
    s, coarse, fine, before, velocity, mobility, time, h, bar_point, bar_velocity, length,
    stiffness, damping, patch_start, patch_place, patch_weight, impulse,
):
    """Let the tension of one strap accelerate its patch in a sub-step: Eq. S4."""
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
