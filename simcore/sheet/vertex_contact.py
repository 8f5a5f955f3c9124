"""Contact and friction of a sheet vertex, implicit on the vertex (Eqs. S5 to S7)."""

import numpy as np
from numba import njit

from simcore.compiled import fused

# Columns of a contact row; vectors take three. What an open plane needs comes first and fits into
# one line of the cache.
OFFSET, STIFFNESS, DAMPING, SURFACE_NORMAL, WAS_OPEN = 3, 4, 5, 6, 7  # after the normal at 0
ANCHOR, SURFACE, K_T, C_T, COEFFICIENT, SOFTNESS, F_C, EPSILON = 8, 11, 14, 15, 16, 17, 18, 19
ROW_SIZE = 20


@fused
def prepare_row(rows, r, inertia, h):
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


@njit(inline="always")
def _plane_force(rows, r, px, py, pz, vx, vy, vz, rate, h):
    """Return what plane r does to a vertex at p whose velocity would be v without it.

    Normal and tangential part of the backward Euler step separate and are solved exactly:

        N = max((k d + (h k + c_n) w) / (1 + h (h k + c_n) / m), 0)                 (Eq. S5)
        F = −(k_t e + (h k_t + c_t) u) / (1 + h (h k_t + c_t) / m), cut to ‖F‖ ≤ µ N  (Eq. S6)

    with the depth d, the approach speed w, the tangential elongation e from the anchor and the
    tangential velocity u. The paper's friction takes its viscosity from u (Eq. S7).

    Returns N [N], zero where the plane is open, F (3) [N], e (3) [m], u (3) [m/s], and whether it
    slides.
    """
    nx, ny, nz = rows[r, 0], rows[r, 1], rows[r, 2]
    approach = rows[r, SURFACE_NORMAL] - (nx * vx + ny * vy + nz * vz)
    depth = rows[r, OFFSET] - (nx * px + ny * py + nz * pz)
    normal = rows[r, STIFFNESS] * depth + rows[r, DAMPING] * approach
    fx = fy = fz = ex = ey = ez = ux = uy = uz = 0.0
    slides = False
    if normal <= 0.0 or depth + h * (approach - rate * normal) <= 0.0:
        normal = 0.0
    else:
        ux = vx - rows[r, SURFACE] + approach * nx
        uy = vy - rows[r, SURFACE + 1] + approach * ny
        uz = vz - rows[r, SURFACE + 2] + approach * nz
        if rows[r, COEFFICIENT] < 0.0:
            speed = np.sqrt(ux * ux + uy * uy + uz * uz)
            gain = rows[r, F_C] / max(speed, rows[r, EPSILON])
            scale = -gain / (1.0 + rate * gain)
            fx, fy, fz = scale * ux, scale * uy, scale * uz
        else:
            if rows[r, WAS_OPEN] == 0.0:
                ex = px - rows[r, ANCHOR]
                ey = py - rows[r, ANCHOR + 1]
                ez = pz - rows[r, ANCHOR + 2]
                out = ex * nx + ey * ny + ez * nz
                ex, ey, ez = ex - out * nx, ey - out * ny, ez - out * nz
            fx = -(rows[r, K_T] * ex + rows[r, C_T] * ux)
            fy = -(rows[r, K_T] * ey + rows[r, C_T] * uy)
            fz = -(rows[r, K_T] * ez + rows[r, C_T] * uz)
            limit = rows[r, COEFFICIENT] * normal
            square = fx * fx + fy * fy + fz * fz
            if square > limit * limit:
                slides = True
                cut = limit / np.sqrt(square)
                fx, fy, fz = cut * fx, cut * fy, cut * fz
    return normal, fx, fy, fz, ex, ey, ez, ux, uy, uz, slides


@njit(inline="always")
def _move_on(rows, r, px, py, pz, rate, h, plane):
    """Move the offset and the anchor of row r to the end of the sub-step.

    The anchor of an open plane is left behind; it is put on the vertex when the plane closes.
    """
    normal, fx, fy, fz, ex, ey, ez, ux, uy, uz, slides = plane
    rows[r, OFFSET] += h * rows[r, SURFACE_NORMAL]
    if normal == 0.0:
        rows[r, WAS_OPEN] = 1.0
    else:
        if rows[r, WAS_OPEN] > 0.0:
            rows[r, WAS_OPEN] = 0.0
            rows[r, ANCHOR], rows[r, ANCHOR + 1], rows[r, ANCHOR + 2] = px, py, pz
        rows[r, ANCHOR] += h * rows[r, SURFACE]
        rows[r, ANCHOR + 1] += h * rows[r, SURFACE + 1]
        rows[r, ANCHOR + 2] += h * rows[r, SURFACE + 2]
        if slides:
            softness = rows[r, SOFTNESS]
            rows[r, ANCHOR] += ex + h * (ux + rate * fx) + fx * softness
            rows[r, ANCHOR + 1] += ey + h * (uy + rate * fy) + fy * softness
            rows[r, ANCHOR + 2] += ez + h * (uz + rate * fz) + fz * softness


@njit(inline="always")
def _spent(rows, r, px, py, pz, vx, vy, vz, rate, h, plane):
    """Return heat, work of friction and numerical loss of plane r in a sub-step [J]: Eq. E5.

    With w and u those of the end of the sub-step, and e and e′ the elongations of its start and
    its end: heat h (c w² + c_t u²), the second where it sticks; friction −F·(the way of the
    anchor); and k (h w)²/2 + k_t ‖e′ − e‖²/2, by which backward Euler falls short of its springs.
    """
    normal, fx, fy, fz, ex, ey, ez, ux, uy, uz, slides = plane
    heat = rubbed = lost = 0.0
    if normal == 0.0:
        depth = rows[r, OFFSET] - (rows[r, 0] * px + rows[r, 1] * py + rows[r, 2] * pz)
        if depth > 0.0:  # leaves faster than the spring follows
            approach = rows[r, SURFACE_NORMAL] - (
                rows[r, 0] * vx + rows[r, 1] * vy + rows[r, 2] * vz)
            after = max(depth + h * approach, 0.0)
            k = rows[r, STIFFNESS] / (1.0 - rate * rows[r, DAMPING])
            heat = 0.5 * k * (depth * depth - after * after)
        if rows[r, WAS_OPEN] == 0.0 and rows[r, SOFTNESS] > 0.0:  # what the tie held is lost
            ex, ey, ez = px - rows[r, ANCHOR], py - rows[r, ANCHOR + 1], pz - rows[r, ANCHOR + 2]
            out = ex * rows[r, 0] + ey * rows[r, 1] + ez * rows[r, 2]
            rubbed = 0.5 / rows[r, SOFTNESS] * (ex * ex + ey * ey + ez * ez - out * out)
        return heat, rubbed, lost
    w = rows[r, SURFACE_NORMAL] - rate * normal - (
        rows[r, 0] * vx + rows[r, 1] * vy + rows[r, 2] * vz)
    part = w * w / (1.0 - rate * rows[r, DAMPING])
    heat = h * (rows[r, DAMPING] - h * rows[r, STIFFNESS]) * part
    lost = 0.5 * rows[r, STIFFNESS] * h * h * part
    ux, uy, uz = ux + rate * fx, uy + rate * fy, uz + rate * fz
    if rows[r, COEFFICIENT] < 0.0:
        return heat, -h * (fx * ux + fy * uy + fz * uz), lost
    softness = rows[r, SOFTNESS]
    if slides:
        gx, gy, gz = -fx * softness, -fy * softness, -fz * softness
        rubbed = -(fx * (ex + h * ux - gx) + fy * (ey + h * uy - gy)
                   + fz * (ez + h * uz - gz))
    else:
        gx, gy, gz = ex + h * ux, ey + h * uy, ez + h * uz
        heat += (h * (rows[r, C_T] - h * rows[r, K_T]) / (1.0 - rate * rows[r, C_T])
                 * (ux * ux + uy * uy + uz * uz))
    if softness > 0.0:
        lost += 0.5 / softness * ((gx - ex) ** 2 + (gy - ey) ** 2 + (gz - ez) ** 2)
    return heat, rubbed, lost


@fused
def solve_planes(
    rows, place, position, velocity, before, mobility, h, expected, force, impulse, spent,
    stands_for,
):
    """Move the vertices that have a plane through a sub-step.

    Parameters
    ----------
    rows : (m, ROW_SIZE) float64
        After `prepare_row`; offsets and anchors are moved on.
    place : (m,) int64
        Point of each row.
    position, velocity : (3, N) float64
        Positions before the sub-step and the velocities that all other forces give; velocities
        are overwritten [m, m/s].
    before : (3, N) float32
        Velocities at the start of the sub-step [m/s].
    mobility : (N,) float64
        1 / m [1/kg].
    expected : (3, N) float64
        Force that another contact is going to add to the velocities given [N].
    force : (3, N) float64
        N n + F, where there is a plane; overwritten [N].
    impulse : (m, 4) float64
        Has h N n + h F and h N added.
    spent : (3,) float64
        Has heat of the dashpots, work of sliding friction and what the sub-step itself took out
        added [J]: `_spent`.
    stands_for : int
        Sub-steps that this one's account is taken for; without an account 0.
    """
    # Sums of their own: in the array they would be stored, and the rows read again, each time.
    all_heat = all_rubbed = all_lost = 0.0
    for r in range(place.size):
        p = place[r]
        rate = h * mobility[p]
        px, py, pz = position[0, p], position[1, p], position[2, p]
        vx = velocity[0, p] + rate * expected[0, p]
        vy = velocity[1, p] + rate * expected[1, p]
        vz = velocity[2, p] + rate * expected[2, p]
        plane = _plane_force(rows, r, px, py, pz, vx, vy, vz, rate, h)
        normal, fx, fy, fz = plane[0], plane[1], plane[2], plane[3]
        if stands_for > 0:
            heat, rubbed, lost = _spent(rows, r, px, py, pz, vx, vy, vz, rate, h, plane)
            all_heat += heat
            all_rubbed += rubbed
            all_lost += lost
        _move_on(rows, r, px, py, pz, rate, h, plane)
        if normal > 0.0:
            fx, fy, fz = (fx + normal * rows[r, 0], fy + normal * rows[r, 1],
                          fz + normal * rows[r, 2])
            velocity[0, p] += rate * fx
            velocity[1, p] += rate * fy
            velocity[2, p] += rate * fz
            if stands_for > 0:
                all_lost += 0.5 * h * (fx * (vx + rate * fx - before[0, p])
                                       + fy * (vy + rate * fy - before[1, p])
                                       + fz * (vz + rate * fz - before[2, p]))
            impulse[r, 0] += h * fx
            impulse[r, 1] += h * fy
            impulse[r, 2] += h * fz
            impulse[r, 3] += h * normal
        force[0, p], force[1, p], force[2, p] = fx, fy, fz
    spent[0] += stands_for * all_heat
    spent[1] += stands_for * all_rubbed
    spent[2] += stands_for * all_lost
