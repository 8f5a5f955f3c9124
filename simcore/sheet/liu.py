"""Backward Euler in the fast mass–spring form of Liu et al. 2013: the paper's solver."""

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import SuperLU, splu

from simcore.errors import DesignError, SimulationError
from simcore.sheet.contact import PlaneContact
from simcore.sheet.hanging import BarState, bar_points
from simcore.sheet.implicit_forces import add_contact, add_springs, add_straps
from simcore.sheet.inertia import Inertia
from simcore.sheet.rows import (
    ANCHOR,
    C_T,
    DAMPING,
    EPSILON,
    F_C,
    K_T,
    OFFSET,
    STIFFNESS,
    SURFACE,
    Rows,
    gather_rows,
    scatter_rows,
)
from simcore.sheet.solver import Reaction, Sheet, SheetState, check_finite, planes_of_bed

STEP_MAX = 2.0e-3
"""Longest step taken unasked [s]."""

TOLERANCE = 1.0e-3
"""Move of an iteration over the way that the forces of the step make (Eq. S11)."""

ITERATIONS_MAX = 2000

ANDERSON_WINDOW = 6
"""Iterations that the acceleration combines."""

PATIENCE, RELAXATION = 200, 0.5
"""Iterations after which a step goes on without acceleration, and by half of each move: between a
plane that opens and one that closes whole moves may go to and fro."""

PINNED_STIFFNESS = 1.0e12
"""On the diagonal of a pinned vertex [N/m]; its residual is left out."""

REFACTOR_SHARE = 0.1
"""Contact stiffness that may be missing from, or left over in, the matrix before it is made new."""


class LiuSolver:
    """Local/global iteration with a matrix that is factored once for a set of planes.

    With all springs replaced by ones of length zero to the points that the local step finds, the
    global step solves (Eq. S10)

        (M (1 + h α) / h² + L + D) δ = residual,    x ← x + δ

    L is the Laplacian of the springs and straps, constant; D is the stiffness of the planes on the
    diagonal, as large as contact and friction can be. Springs in compression, slack straps, open
    and sliding planes only have less stiffness than that: the iteration descends. The matrix is
    made new when planes have come or gone. Anderson acceleration (Walker and Ni 2011) combines the
    last iterates. The numerical damping of backward Euler stands for that of the springs.

    Parameters
    ----------
    sheet : Sheet
    step : float
        Longest step [s]; it limits accuracy, not stability.
    tolerance : float
        Relative move of an iteration at which a step is accepted (Eq. S11).
    window : int
        Of the acceleration; 0 leaves it out.

    Raises
    ------
    DesignError
        A step or tolerance that is not positive.
    """

    def __init__(
        self,
        sheet: Sheet,
        step: float = STEP_MAX,
        tolerance: float = TOLERANCE,
        window: int = ANDERSON_WINDOW,
    ):
        for key, value in (("step_s", step), ("solver.tolerance", tolerance)):
            if not value > 0:
                raise DesignError(f"method.sheet.{key}: is {value:g}; accepted: above 0")
        self.sheet, self.step, self.tolerance, self.window = sheet, step, tolerance, window
        net = sheet.net
        self.inertia, self.damping_time = Inertia.plain(net.mass), 0.0
        self._share = np.where(net.spring_kind < 2, net.compression_share, 1.0)
        self._factored: tuple[float, np.ndarray, SuperLU] | None = None

    def advance(
        self, state: SheetState, dt: float, contact: PlaneContact, bar: BarState
    ) -> Reaction:
        """Implement `simcore.sheet.solver.SheetSolver.advance` by steps of at most `step`."""
        count = max(1, int(np.ceil(dt / self.step * (1 - 1e-9))))
        points, velocities = bar_points(self.sheet.straps, bar)
        rows, bed = gather_rows(contact), gather_rows(planes_of_bed(self.sheet, state))
        strap_force = np.zeros_like(points)
        iterations, h = 0, dt / count
        for step in range(count):
            after = points + (step + 1) * h * velocities
            passes, of_straps = self._take_step(state, h, (rows, bed), after, velocities)
            iterations += passes
            strap_force += of_straps / count
        check_finite(state)
        of_bed = scatter_rows(bed, state.on_bed, dt).force.sum(axis=0)
        return Reaction(
            scatter_rows(rows, contact, dt), of_bed, strap_force, iterations, np.full(3, np.nan)
        )

    def _take_step(
        self, state: SheetState, h: float, contacts: tuple[Rows, Rows], points: np.ndarray,
        velocities: np.ndarray,
    ) -> tuple[int, np.ndarray]:
        """Advance state, rows and impulses by h [s].

        Returns
        -------
        iterations : int
        strap_force : (s, 3) float64
            [N]
        """
        sheet, net, straps = self.sheet, self.sheet.net, self.sheet.straps
        start = state.position.copy()
        held = 1 + h * sheet.drag_rate
        inertia = (net.mass * held / h**2)[:, None]
        free = start + (h * state.velocity + h**2 * sheet.gravity) / held
        # Of each row: force with its normal part, and anchor.
        told = [
            (np.empty((len(rows.vertex), 4)), np.empty((len(rows.vertex), 3))) for rows in contacts
        ]
        strap_force = np.empty_like(points)
        fall = h**2 * float(np.linalg.norm(sheet.gravity)) * np.sqrt(len(net.mass))

        def residual(x: np.ndarray) -> tuple[np.ndarray, float]:
            """Return the residual force (n, 3) [N], Eq. S9, and the way x − y [m]."""
            force = np.zeros_like(x)
            add_straps(
                x, start, h, points, velocities, straps.length, straps.stiffness, straps.damping,
                straps.patch_start, straps.patch_vertex, straps.patch_weight, force, strap_force,
            )
            for rows, row_told in zip(contacts, told, strict=True):
                add_contact(x, start, h, rows.data, rows.vertex, force, *row_told)
            add_springs(
                x, net.spring_vertices, net.stiffness, net.rest_length, net.buckling_strain,
                self._share, force,
            )
            force += inertia * (free - x)
            force[sheet.pinned] = 0
            return force, max(float(np.linalg.norm(x - free)), fall)

        solve = self._matrix(h, contacts).solve
        # Pinned vertices start where they end: their velocity is given.
        position = start + h * state.velocity
        iterations, position = _iterate(position, residual, solve, self.tolerance, self.window)
        state.velocity[:] = (position - start) / h
        state.position[:] = position
        for rows, (row_force, row_anchor) in zip(contacts, told, strict=True):
            rows.data[:, ANCHOR : ANCHOR + 3] = row_anchor
            surface_velocity = rows.data[:, SURFACE : SURFACE + 3]
            rows.data[:, OFFSET] += h * (rows.data[:, :3] * surface_velocity).sum(axis=1)
            rows.impulse[:] += h * row_force
            rows.force[:] = row_force[:, :3]
        return iterations, strap_force

    def _matrix(self, h: float, contacts: tuple[Rows, Rows]) -> SuperLU:
        """Return the factored matrix of Eq. S10 for a step and sets of planes."""
        net = self.sheet.net
        planes = np.zeros(len(net.mass))
        for rows in contacts:
            data = rows.data
            normal = data[:, STIFFNESS] + data[:, DAMPING] / h
            tangential = data[:, K_T] + (data[:, C_T] + data[:, F_C] / data[:, EPSILON]) / h
            np.add.at(planes, rows.vertex, np.maximum(normal, tangential))
        if self._factored is not None and self._factored[0] == h:
            misfit = np.abs(self._factored[1] - planes).sum()
            if misfit <= REFACTOR_SHARE * planes.sum():
                return self._factored[2]
        held = 1 + h * self.sheet.drag_rate
        diagonal = net.mass * held / h**2 + planes + PINNED_STIFFNESS * self.sheet.pinned
        matrix = (_laplacian(self.sheet, h) + diags(diagonal)).tocsc()
        factor = splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        self._factored = h, planes, factor
        return factor


def _laplacian(sheet: Sheet, h: float):
    """Return L (n, n) of springs and straps, these with their damping over h [N/m], sparse."""
    net, straps = sheet.net, sheet.straps
    i, j = net.spring_vertices.T
    k = net.stiffness
    rows, columns, values = [i, j, i, j], [i, j, j, i], [k, k, -k, -k]
    for s in range(len(straps.length)):
        patch = slice(straps.patch_start[s], straps.patch_start[s + 1])
        vertex, weight = straps.patch_vertex[patch], straps.patch_weight[patch]
        first, second = np.meshgrid(vertex, vertex, indexing="ij")
        rows.append(first.ravel())
        columns.append(second.ravel())
        stiffness = straps.stiffness[s] + straps.damping[s] / h
        values.append((stiffness * np.outer(weight, weight)).ravel())
    shape = (len(net.mass), len(net.mass))
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return coo_matrix(entries, shape=shape).tocsc()


def _iterate(position, residual, solve, tolerance: float, window: int):
    """Return iterations and position of the fixed point of local/global steps, accelerated.

    Anderson's method of type II on x → x + δ(x): the next iterate is the combination of the last
    ones whose combined δ is least. When combinations let the residual grow to twice the least
    so far, the memory is cleared. A step that does not end so goes on by plain half moves.

    Raises
    ------
    SimulationError
        No convergence in ITERATIONS_MAX.
    """
    # Differences of successive δ, and of successive x + δ.
    moves: list[np.ndarray] = []
    shifts: list[np.ndarray] = []
    last_move = last_target = None
    best = np.inf
    for iteration in range(ITERATIONS_MAX):
        force, way = residual(position)
        size = float(np.linalg.norm(force))
        if not np.isfinite(size):
            break
        move = solve(force)
        if np.linalg.norm(move) <= tolerance * way:
            return iteration + 1, position
        if size > 2 * best:
            moves, shifts, last_move, best = [], [], None, np.inf
        if iteration >= PATIENCE:
            position = position + RELAXATION * move
            continue
        target = position + move
        best = min(best, size)
        flat = move.ravel()
        if window and last_move is not None:
            moves = [*moves, flat - last_move][-window:]
            shifts = [*shifts, (target - last_target).ravel()][-window:]
        last_move, last_target = flat, target
        position = target
        if window and moves:
            columns = np.stack(moves, axis=1)
            # Normal equations, lightly regularised: six unknowns, columns of like size.
            gram = columns.T @ columns
            gram[np.diag_indices_from(gram)] *= 1 + 1e-10
            gamma = np.linalg.solve(gram, columns.T @ flat)
            position = target - (np.stack(shifts, axis=1) @ gamma).reshape(target.shape)
    raise SimulationError(
        "blow_up", f"the sheet's implicit step did not converge in {ITERATIONS_MAX} iterations"
    )
