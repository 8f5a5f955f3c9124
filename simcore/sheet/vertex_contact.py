"""Contact and friction of a sheet vertex, implicit on the vertex (Eqs. S5 to S7)."""

import numpy as np
from numba import njit

# Columns of a contact row; vectors take three. What an open plane needs comes first and fits into
# one line of the cache.
OFFSET, STIFFNESS, DAMPING, SURFACE_NORMAL, WAS_OPEN = 3, 4, 5, 6, 7  # after the normal at 0
ANCHOR, SURFACE, K_T, C_T, COEFFICIENT, SOFTNESS, F_C, EPSILON = 8, 11, 14, 15, 16, 17, 18, 19
ROW_SIZE = 20

OPEN, STICK, SLIDE = 0, 1, 2

MOBILITY_MIN = 1e-12
"""Taken for pinned vertices between several planes [1/kg]."""

ACTIVE_SET_PASSES = 8
"""Of a vertex between several planes; in practice two or three do."""


@njit(cache=True, error_model="numpy")
def prepare_single(rows, r, inertia, h):
    """Divide the gains of row r by what they are divided by in every sub-step of Eqs. S5 and S6."""
    for stiffness, damping in ((STIFFNESS, DAMPING), (K_T, C_T)):
        gain = h * rows[r, stiffness] + rows[r, damping]
        share = 1.0 / (1.0 + h * gain / inertia)
        if stiffness == K_T:
            rows[r, SOFTNESS] = 1.0 / rows[r, K_T] if rows[r, K_T] > 0.0 else 0.0
        rows[r, stiffness] *= share
        rows[r, damping] = gain * share
    rows[r, SURFACE_NORMAL] = (
        rows[r, 0] * rows[r, SURFACE] + rows[r, 1] * rows[r, SURFACE + 1]
        + rows[r, 2] * rows[r, SURFACE + 2]
    )
    rows[r, WAS_OPEN] = 0.0


@njit(cache=True, error_model="numpy")
def solve_singles(rows, single, place, position, velocity, mobility, h, impulse):
    """Move the vertices that have one plane through a sub-step.

    Normal and tangential part of the backward Euler step separate and are solved exactly:

        N = max((k d + (h k + c_n) w) / (1 + h (h k + c_n) / m), 0)                 (Eq. S5)
        F = −(k_t e + (h k_t + c_t) u) / (1 + h (h k_t + c_t) / m), cut to ‖F‖ ≤ µ N  (Eq. S6)

    with the depth d, the approach speed w, the tangential elongation e from the anchor and the
    tangential velocity u, all before contact acts. The paper's friction takes its viscosity from u
    (Eq. S7).

    Parameters
    ----------
    rows : (m, ROW_SIZE) float64
        After `prepare_single`; offsets and anchors are moved on. The anchor of an open plane is
        left behind; it is put on the vertex when the plane closes.
    single : (t,) int64
        Rows to solve.
    place : (m,) int64
        Point of each row.
    position, velocity : (3, N) float64
        Positions before the sub-step and the velocities that all other forces give; velocities
        are overwritten [m, m/s].
    mobility : (N,) float64
        1 / m [1/kg].
    impulse : (m, 4) float64
        Has h N n + h F and h N added.
    """
    for t in range(single.size):
        r = single[t]
        p = place[r]
        rate = h * mobility[p]
        nx, ny, nz = rows[r, 0], rows[r, 1], rows[r, 2]
        px, py, pz = position[0, p], position[1, p], position[2, p]
        vx, vy, vz = velocity[0, p], velocity[1, p], velocity[2, p]
        surface = rows[r, SURFACE_NORMAL]
        approach = surface - (nx * vx + ny * vy + nz * vz)
        depth = rows[r, OFFSET] - (nx * px + ny * py + nz * pz)
        rows[r, OFFSET] += h * surface
        normal = rows[r, STIFFNESS] * depth + rows[r, DAMPING] * approach
        if normal <= 0.0 or depth + h * (approach - rate * normal) <= 0.0:
            rows[r, WAS_OPEN] = 1.0
            continue
        if rows[r, WAS_OPEN] > 0.0:
            rows[r, WAS_OPEN] = 0.0
            rows[r, ANCHOR], rows[r, ANCHOR + 1], rows[r, ANCHOR + 2] = px, py, pz
        sx, sy, sz = rows[r, SURFACE], rows[r, SURFACE + 1], rows[r, SURFACE + 2]
        ux, uy, uz = vx - sx + approach * nx, vy - sy + approach * ny, vz - sz + approach * nz
        if rows[r, COEFFICIENT] < 0.0:
            speed = np.sqrt(ux * ux + uy * uy + uz * uz)
            gain = rows[r, F_C] / max(speed, rows[r, EPSILON])
            scale = -gain / (1.0 + rate * gain)
            fx, fy, fz = scale * ux, scale * uy, scale * uz
        else:
            ex, ey, ez = px - rows[r, ANCHOR], py - rows[r, ANCHOR + 1], pz - rows[r, ANCHOR + 2]
            out = ex * nx + ey * ny + ez * nz
            ex, ey, ez = ex - out * nx, ey - out * ny, ez - out * nz
            stiffness, gain = rows[r, K_T], rows[r, C_T]
            fx = -(stiffness * ex + gain * ux)
            fy = -(stiffness * ey + gain * uy)
            fz = -(stiffness * ez + gain * uz)
            limit = rows[r, COEFFICIENT] * normal
            square = fx * fx + fy * fy + fz * fz
            rows[r, ANCHOR] += h * sx
            rows[r, ANCHOR + 1] += h * sy
            rows[r, ANCHOR + 2] += h * sz
            if square > limit * limit:
                cut = limit / np.sqrt(square)
                fx, fy, fz = cut * fx, cut * fy, cut * fz
                softness = rows[r, SOFTNESS]
                rows[r, ANCHOR] += ex + h * (ux + rate * fx) + fx * softness
                rows[r, ANCHOR + 1] += ey + h * (uy + rate * fy) + fy * softness
                rows[r, ANCHOR + 2] += ez + h * (uz + rate * fz) + fz * softness
        fx, fy, fz = fx + normal * nx, fy + normal * ny, fz + normal * nz
        velocity[0, p] = vx + rate * fx
        velocity[1, p] = vy + rate * fy
        velocity[2, p] = vz + rate * fz
        impulse[r, 0] += h * fx
        impulse[r, 1] += h * fy
        impulse[r, 2] += h * fz
        impulse[r, 3] += h * normal


@njit(cache=True, error_model="numpy")
def solve_severals(rows, several, place, position, velocity, mobility, h, impulse):
    """Move the vertices that have several planes through a sub-step.

    Parameters are those of `solve_singles`, but for

    several : (t, 2) int64
        First row of each vertex, and the row after its last.
    """
    widest = 0
    for t in range(several.shape[0]):
        widest = max(widest, several[t, 1] - several[t, 0])
    mode, sliding = np.empty(widest, np.int8), np.empty((widest, 3))
    x, v = np.empty(3), np.empty(3)
    for t in range(several.shape[0]):
        first, last = several[t, 0], several[t, 1]
        p = place[first]
        for axis in range(3):
            x[axis] = position[axis, p]
            v[axis] = velocity[axis, p]
        _solve_several(
            rows[first:last], x, v, 1.0 / max(mobility[p], MOBILITY_MIN), h, impulse[first:last],
            mode[: last - first], sliding[: last - first],
        )
        for axis in range(3):
            velocity[axis, p] = v[axis]


@njit(cache=True, error_model="numpy")
def _solve_several(rows, x, v, inertia, h, impulse, mode, sliding):
    """Move a vertex with several planes, as between a bed and a body, through a sub-step.

    The backward Euler step of all closed planes together is a 3 × 3 system; an active-set
    iteration opens planes that would pull and lets those slide whose friction exceeds µ N, the
    size of sliding friction being that of the pass before.

    Parameters
    ----------
    rows : (c, ROW_SIZE) float64
        Planes of the vertex; offsets and anchors are overwritten.
    x, v : (3,) float64
        Position before the sub-step and velocity that all other forces give; v is overwritten.
    impulse : (c, 4) float64
        Added to.
    mode : (c,) int8
        Scratch.
    sliding : (c, 3) float64
        Scratch: friction of the sliding planes [N].
    """
    count = rows.shape[0]
    free = (v[0], v[1], v[2])
    for r in range(count):
        row = rows[r]
        depth = row[OFFSET] - (row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
        gain = h * row[STIFFNESS] + row[DAMPING]
        approach = (
            row[0] * (row[SURFACE] - v[0]) + row[1] * (row[SURFACE + 1] - v[1])
            + row[2] * (row[SURFACE + 2] - v[2])
        )
        touches = row[STIFFNESS] * depth + gain * approach > 0.0 and depth + h * approach > 0.0
        mode[r] = STICK if touches else OPEN
        sliding[r] = 0.0
    for _ in range(ACTIVE_SET_PASSES):
        _solve_closed(rows, x, free, v, inertia, h, mode, sliding)
        if not _update_modes(rows, x, v, h, mode, sliding):
            break
    for r in range(count):
        row = rows[r]
        normal, friction, _, _ = _plane_force(row, x, v, h, mode[r], sliding[r])
        for axis in range(3):
            row[ANCHOR + axis] += h * row[SURFACE + axis]
        if mode[r] == OPEN or normal <= 0.0:
            row[WAS_OPEN] = 1.0
            for axis in range(3):
                row[ANCHOR + axis] = x[axis] + h * v[axis]
        else:
            row[WAS_OPEN] = 0.0
            if mode[r] == SLIDE and row[COEFFICIENT] >= 0.0 and row[K_T] > 0.0:
                for axis in range(3):
                    row[ANCHOR + axis] = x[axis] + h * v[axis] + friction[axis] / row[K_T]
            for axis in range(3):
                impulse[r, axis] += h * (normal * row[axis] + friction[axis])
            impulse[r, 3] += h * normal
        row[OFFSET] += h * (
            row[0] * row[SURFACE] + row[1] * row[SURFACE + 1] + row[2] * row[SURFACE + 2]
        )


@njit(cache=True, error_model="numpy")
def _plane_force(row, x, v, h, mode, sliding):
    """Return N, friction, unlimited friction and depth at the end of a sub-step with velocity v."""
    n = (row[0], row[1], row[2])
    rel = (v[0] - row[SURFACE], v[1] - row[SURFACE + 1], v[2] - row[SURFACE + 2])
    approach = -(n[0] * rel[0] + n[1] * rel[1] + n[2] * rel[2])
    depth = row[OFFSET] - (n[0] * x[0] + n[1] * x[1] + n[2] * x[2]) + h * approach
    normal = row[STIFFNESS] * depth + row[DAMPING] * approach
    ux, uy, uz = rel[0] + approach * n[0], rel[1] + approach * n[1], rel[2] + approach * n[2]
    if row[COEFFICIENT] < 0.0:
        gain = row[F_C] / max(np.sqrt(ux * ux + uy * uy + uz * uz), row[EPSILON])
        trial = (-gain * ux, -gain * uy, -gain * uz)
        return normal, trial, trial, depth
    ex, ey, ez = x[0] - row[ANCHOR], x[1] - row[ANCHOR + 1], x[2] - row[ANCHOR + 2]
    out = ex * n[0] + ey * n[1] + ez * n[2]
    stiffness, gain = row[K_T], h * row[K_T] + row[C_T]
    trial = (
        -(stiffness * (ex - out * n[0]) + gain * ux), -(stiffness * (ey - out * n[1]) + gain * uy),
        -(stiffness * (ez - out * n[2]) + gain * uz),
    )
    if mode == SLIDE:
        return normal, (sliding[0], sliding[1], sliding[2]), trial, depth
    return normal, trial, trial, depth


@njit(cache=True, error_model="numpy")
def _update_modes(rows, x, v, h, mode, sliding):
    """Open and close planes, set sliding friction; return whether anything changed."""
    changed = False
    for r in range(rows.shape[0]):
        row = rows[r]
        normal, _, trial, depth = _plane_force(row, x, v, h, mode[r], sliding[r])
        if normal <= 0.0 or depth <= 0.0:
            changed = changed or mode[r] != OPEN
            mode[r] = OPEN
            continue
        if mode[r] == OPEN:
            changed = True
            mode[r] = STICK
        if row[COEFFICIENT] < 0.0:
            continue
        size = np.sqrt(trial[0] ** 2 + trial[1] ** 2 + trial[2] ** 2)
        limit = row[COEFFICIENT] * normal
        if size <= limit:
            changed = changed or mode[r] != STICK
            mode[r] = STICK
            continue
        cut = limit / size
        for axis in range(3):
            new = cut * trial[axis]
            changed = changed or mode[r] != SLIDE or abs(new - sliding[r, axis]) > 1e-6 * limit
            sliding[r, axis] = new
        mode[r] = SLIDE
    return changed


@njit(cache=True, error_model="numpy")
def _solve_closed(rows, x, free, v, inertia, h, mode, sliding):
    """Write the velocity after the sub-step for given modes: a symmetric 3 × 3 system."""
    xx = yy = zz = inertia
    xy = xz = yz = 0.0
    bx, by, bz = inertia * free[0], inertia * free[1], inertia * free[2]
    for r in range(rows.shape[0]):
        if mode[r] == OPEN:
            continue
        row = rows[r]
        n = (row[0], row[1], row[2])
        s = (row[SURFACE], row[SURFACE + 1], row[SURFACE + 2])
        surface = n[0] * s[0] + n[1] * s[1] + n[2] * s[2]
        depth = row[OFFSET] - (n[0] * x[0] + n[1] * x[1] + n[2] * x[2])
        gain = h * (h * row[STIFFNESS] + row[DAMPING])
        push = h * row[STIFFNESS] * depth + gain * surface
        tangential = 0.0
        fx, fy, fz = push * n[0], push * n[1], push * n[2]
        ex = ey = ez = 0.0
        pull = 0.0
        if row[COEFFICIENT] < 0.0:
            ux, uy, uz = v[0] - s[0], v[1] - s[1], v[2] - s[2]
            out = ux * n[0] + uy * n[1] + uz * n[2]
            square = ux * ux + uy * uy + uz * uz - out * out
            tangential = h * row[F_C] / max(np.sqrt(max(square, 0.0)), row[EPSILON])
        elif mode[r] == STICK:
            tangential = h * (h * row[K_T] + row[C_T])
            pull = h * row[K_T]
            ex, ey, ez = x[0] - row[ANCHOR], x[1] - row[ANCHOR + 1], x[2] - row[ANCHOR + 2]
            out = ex * n[0] + ey * n[1] + ez * n[2]
            ex, ey, ez = ex - out * n[0], ey - out * n[1], ez - out * n[2]
        else:
            fx, fy, fz = fx + h * sliding[r, 0], fy + h * sliding[r, 1], fz + h * sliding[r, 2]
        bx += fx + tangential * (s[0] - surface * n[0]) - pull * ex
        by += fy + tangential * (s[1] - surface * n[1]) - pull * ey
        bz += fz + tangential * (s[2] - surface * n[2]) - pull * ez
        across = gain - tangential
        xx += tangential + across * n[0] * n[0]
        yy += tangential + across * n[1] * n[1]
        zz += tangential + across * n[2] * n[2]
        xy += across * n[0] * n[1]
        xz += across * n[0] * n[2]
        yz += across * n[1] * n[2]
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    determinant = xx * a + xy * b + xz * c
    v[0] = (a * bx + b * by + c * bz) / determinant
    v[1] = (b * bx + (xx * zz - xz * xz) * by + (xy * xz - xx * yz) * bz) / determinant
    v[2] = (c * bx + (xy * xz - xx * yz) * by + (xx * yy - xy * xy) * bz) / determinant
