"""Explicit sub-steps of a sheet with contact implicit on the vertex: the default solver."""

import numpy as np

from simcore.compiled import fused
from simcore.errors import DesignError
from simcore.sheet.contact import PlaneContact
from simcore.sheet.hanging import BarState, bar_points
from simcore.sheet.net import SPRING_OFFSETS
from simcore.sheet.rows import gather_rows, scatter_rows
from simcore.sheet.solver import Reaction, Sheet, SheetState, check_finite, rows_of_bed
from simcore.sheet.spring_pass import add_spring_forces
from simcore.sheet.vertex_contact import (
    ANCHOR,
    WAS_OPEN,
    prepare_row,
    solve_planes,
)

STABILITY_MARGIN = 1.1
"""Vertex inertia over the least that a stable sub-step needs (Eq. S8)."""

SUBSTEP_MAX = 2.5e-4
"""Longest sub-step taken unasked [s]."""

# ASSUME: seams and friction between threads damp the stretch of a fabric; this much quiets the
# net's own frequencies and leaves the swing of the whole sheet alone.
SPRING_DAMPING_TIME = 2.0e-5
"""Damping over stiffness of every spring, β [s]."""

BED_ACCOUNT = 4
"""Sub-steps for which one tells what the bed spends: it would cost as much as the rest of
the bed's law."""

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

        self._grid = _Grid(sheet, self.inertia)

    def advance(
        self, state: SheetState, dt: float, contact: PlaneContact, bar: BarState
    ) -> Reaction:
        """Implement `simcore.sheet.solver.SheetSolver.advance` by dt / h sub-steps, rounded up."""
        straps, grid = self.sheet.straps, self._grid
        count = max(1, int(np.ceil(dt / self.substep * (1 - 1e-9))))
        points, velocities = bar_points(straps, bar)
        rows, bed = gather_rows(contact), rows_of_bed(self.sheet, state)
        strap_impulse, spent = np.zeros((len(straps.length), 3)), np.zeros(3)
        _substeps(
            state.position, state.velocity, grid.place, grid.position, grid.velocity,
            grid.velocity_single, grid.force, dt / count, count, grid.offsets, grid.stiffness,
            grid.rest_length, self.sheet.net.buckling_strain, grid.share, self.damping_time,
            grid.factor, grid.pad, grid.mobility, grid.weight, grid.drag,
            points, velocities, straps.length, straps.stiffness, straps.damping,
            straps.patch_start, grid.patch_place, straps.patch_weight, strap_impulse,
            rows.data, rows.vertex, rows.force, rows.impulse, grid.of_skin,
            bed.data, bed.vertex, bed.force, bed.impulse, grid.of_bed, grid.none, spent,
        )
        check_finite(state)
        of_bed = scatter_rows(bed, state.on_bed, dt).force.sum(axis=0)
        return Reaction(scatter_rows(rows, contact, dt), of_bed, strap_impulse / dt, count, spent)

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


class _Grid:
    """The arrays of a net as `_substeps` wants them: flattened grid, padded by two rows."""

    def __init__(self, sheet: Sheet, inertia: np.ndarray):
        net = sheet.net
        rows, columns = net.grid_shape
        self.pad = 2 * columns
        count = rows * columns + 2 * self.pad
        self.place = net.grid_place.astype(np.int64) + self.pad
        self.patch_place = self.place[sheet.straps.patch_vertex]
        self.offsets = np.array([r * columns + c for r, c in SPRING_OFFSETS])

        self.stiffness, self.rest_length = np.zeros((2, len(self.offsets), count), np.float32)
        ends = self.place[net.spring_vertices]
        step = ends[:, 1] - ends[:, 0]
        for direction, offset in enumerate(self.offsets):
            mine = (step == offset) & (net.spring_kind == direction // 2)
            self.stiffness[direction, ends[mine, 0]] = net.stiffness[mine]
            self.rest_length[direction, ends[mine, 0]] = net.rest_length[mine]
        kept = net.compression_share
        self.share = np.array([kept, kept, kept, kept, 1, 1], np.float32)

        self.mobility, self.drag = np.zeros((2, count))
        self.mobility[self.place] = np.where(sheet.pinned, 0.0, 1 / inertia)
        self.drag[self.place] = sheet.drag_rate * net.mass
        self.weight = np.zeros((3, count))
        self.weight[:, self.place] = sheet.gravity[:, None] * net.mass
        self.position, self.velocity, self.force = np.zeros((3, 3, count))
        self.velocity_single = np.zeros((3, count), np.float32)
        self.factor = np.zeros((len(self.offsets), count), np.float32)
        self.of_skin, self.of_bed, self.none = np.zeros((3, 3, count))


@fused
def _substeps(
    vertex_position, vertex_velocity, place, position, velocity, velocity_single, force, h, count,
    offsets, stiffness, rest_length, buckling_strain, share, damping_time, factor, pad, mobility,
    weight, drag, bar_point, bar_velocity, strap_length, strap_stiffness, strap_damping,
    patch_start, patch_place, patch_weight, strap_impulse, rows, row_vertex, row_force,
    row_impulse, of_skin, bed_rows, bed_vertex, bed_force, bed_impulse, of_bed, none, spent,
):
    """Take `count` sub-steps of length h [s]; the vertex arrays (n, 3) are in and out.

    A vertex between bed and body meets the bed first, at the velocity that the body's force of the
    sub-step before would give, and then the body at the velocity that the bed has left. `none` is
    the force of nothing.
    """
    row_place = _prepare(rows, row_vertex, row_force, place, mobility, h, of_skin)
    bed_place = _prepare(bed_rows, bed_vertex, bed_force, place, mobility, h, of_bed)
    for i in range(place.size):
        for axis in range(3):
            position[axis, place[i]] = vertex_position[i, axis]
            velocity[axis, place[i]] = vertex_velocity[i, axis]
    for substep in range(count):
        force[:] = weight
        velocity_single[:] = velocity
        add_spring_forces(
            position, velocity_single, force, offsets, stiffness, rest_length, buckling_strain,
            share, damping_time, factor, pad,
        )
        for s in range(strap_length.size):
            _add_strap(
                s, position, velocity, force, substep * h, h, bar_point, bar_velocity,
                strap_length, strap_stiffness, strap_damping, patch_start, patch_place,
                patch_weight, strap_impulse,
            )
        for axis in range(3):
            _accelerate(velocity[axis], force[axis], mobility, drag, h)
        solve_planes(
            bed_rows, bed_place, position, velocity, velocity_single, mobility, h, of_skin,
            of_bed, bed_impulse, spent, _stands_for(substep, count),
        )
        solve_planes(
            rows, row_place, position, velocity, velocity_single, mobility, h, none, of_skin,
            row_impulse, spent, 1,
        )
        for axis in range(3):
            _move(position[axis], velocity[axis], h)
    for i in range(place.size):
        for axis in range(3):
            vertex_position[i, axis] = position[axis, place[i]]
            vertex_velocity[i, axis] = velocity[axis, place[i]]
    _conclude(rows, row_vertex, row_force, row_place, of_skin, vertex_position)
    _conclude(bed_rows, bed_vertex, bed_force, bed_place, of_bed, vertex_position)


@fused
def _stands_for(substep, count):
    """Return for how many sub-steps the account of the bed is taken in this one: every fourth."""
    if substep % BED_ACCOUNT == BED_ACCOUNT - 1:
        return BED_ACCOUNT
    return count % BED_ACCOUNT if substep == count - 1 else 0


@fused
def _prepare(rows, vertex, row_force, place, mobility, h, force):
    """Make rows ready for sub-steps; put their last forces on the grid and return their places."""
    row_place = place[vertex]
    force[:] = 0.0
    for r in range(row_place.size):
        prepare_row(rows, r, 1.0 / mobility[row_place[r]], h)
        for axis in range(3):
            force[axis, row_place[r]] = row_force[r, axis]
    return row_place


@fused
def _conclude(rows, vertex, row_force, row_place, force, vertex_position):
    """Note the last force of each row; tie what is open to where its vertex is."""
    for r in range(vertex.size):
        for axis in range(3):
            row_force[r, axis] = force[axis, row_place[r]]
            if rows[r, WAS_OPEN] > 0.0:
                rows[r, ANCHOR + axis] = vertex_position[vertex[r], axis]


@fused
def _accelerate(velocity, force, mobility, drag, h):
    for p in range(velocity.size):
        velocity[p] += h * mobility[p] * (force[p] - drag[p] * velocity[p])


@fused
def _move(position, velocity, h):
    for p in range(position.size):
        position[p] += h * velocity[p]


@fused
def _add_strap(
    s, position, velocity, force, time, h, bar_point, bar_velocity, length, stiffness, damping,
    patch_start, patch_place, patch_weight, impulse,
):
    """Add the tension of one strap to its patch: Eq. S4."""
    dx, dy, dz = 0.0, 0.0, 0.0
    ux, uy, uz = 0.0, 0.0, 0.0
    for e in range(patch_start[s], patch_start[s + 1]):
        p, w = patch_place[e], patch_weight[e]
        dx, dy, dz = dx - w * position[0, p], dy - w * position[1, p], dz - w * position[2, p]
        ux, uy, uz = ux - w * velocity[0, p], uy - w * velocity[1, p], uz - w * velocity[2, p]
    ux, uy, uz = ux + bar_velocity[s, 0], uy + bar_velocity[s, 1], uz + bar_velocity[s, 2]
    dx += bar_point[s, 0] + time * bar_velocity[s, 0]
    dy += bar_point[s, 1] + time * bar_velocity[s, 1]
    dz += bar_point[s, 2] + time * bar_velocity[s, 2]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    if distance <= length[s]:
        return
    rate = (dx * ux + dy * uy + dz * uz) / distance
    spring = stiffness[s] * (distance - length[s])
    pull = (spring + min(max(damping[s] * rate, -spring), spring)) / distance
    for e in range(patch_start[s], patch_start[s + 1]):
        p, w = patch_place[e], patch_weight[e] * pull
        force[0, p] += w * dx
        force[1, p] += w * dy
        force[2, p] += w * dz
    impulse[s, 0] += h * pull * dx
    impulse[s, 1] += h * pull * dy
    impulse[s, 2] += h * pull * dz
