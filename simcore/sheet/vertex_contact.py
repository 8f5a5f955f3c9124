"""Contact and friction of all sheet vertices at once, implicit on each vertex (Eqs. S5 to S7).

All loops run without a branch, over arrays of one dimension and with unsigned indices, so that
compilers vectorise them: a vertex costs a seventh of what it cost by itself.
"""

import numpy as np

from simcore.compiled import fused, inlined

# Rows of the law of a contact; vectors take three.
NORMAL, SURFACE, DEPTH = 0, 3, 6
STIFFNESS, DAMPING, SHARE, K_T, C_T, SHARE_T, SOFTNESS, F_C = 7, 8, 9, 10, 11, 12, 13, 14
LAW_SIZE = 15
OPEN, TIE_SIZE = 3, 4  # after the anchor
HEAT, SUMS = 3, 6  # after the impulse: heat, work of friction, loss


@inlined
def solve_planes(
    law, tie, force, sums, position, velocity, before, mobility, coefficient, epsilon, time, h,
    last,
):
    """Move the vertices that have a plane of one contact through a sub-step.

    Normal and tangential part of the backward Euler step separate and are solved exactly:

        N = max((k d + (h k + c_n) w) / (1 + h (h k + c_n) / m), 0)                 (Eq. S5)
        F = −(k_t e + (h k_t + c_t) u) / (1 + h (h k_t + c_t) / m), cut to ‖F‖ ≤ µ N  (Eq. S6)

    with the depth d, the approach speed w, the tangential elongation e from the anchor and the
    tangential velocity u. The paper's friction takes its viscosity from u (Eq. S7).

    Parameters
    ----------
    law : (LAW_SIZE, N)
        The planes, where the surface is at the start of the step; all zero, but a depth of −1 m,
        where a vertex has none. `SHARE` and `SHARE_T` are what the sums in Eqs. S5 and S6 are
        multiplied by, `SOFTNESS` is 1/k_t.
    tie : (TIE_SIZE, N)
        Anchor, moved with the surface back to the start of the step, and 1 where the plane is
        open; overwritten [m].
    force : (3, N)
        N n + F; overwritten [N].
    sums : (SUMS, N)
        Has h (N n + F), heat of dashpots, work of sliding friction and what the sub-step
        itself took out (Eq. E5) added [N s, J].
    position, velocity : (3, N)
        Positions before the sub-step, and the velocities that all other forces give; velocities
        are overwritten [m, m/s].
    before : (3, N)
        Velocities at the start of the sub-step [m/s].
    mobility : (N,)
        1 / m [1/kg].
    coefficient, epsilon : float
        µ, negative for the paper's friction, and ε of the latter [m/s].
    time, h : float
        Since the start of the step, and length of the sub-step [s].
    last : uint64
        Columns before this one are those of vertices.
    """
    if coefficient < 0.0:
        _viscous(
            law, force, sums, position, velocity, before, mobility, epsilon, time, h, last,
        )
    else:
        _sticking(
            law, tie, force, sums, position, velocity, before, mobility, coefficient, time, h,
            last,
        )


@inlined
def press(depth, approach, k, c, share, rate, h):
    """Return N [N], 0 where open, and the approach speed after the sub-step [m/s]: Eq. S5."""
    normal = share * (k * depth + (h * k + c) * approach)
    after = approach - rate * normal
    closed = (normal > 0.0) & (depth + h * after > 0.0)
    return (normal if closed else normal - normal), after, closed


@inlined
def leaving(depth, approach, k, h, zero):
    """Return what a spring loses whose vertex leaves faster than it follows, over k/2 [J]."""
    now, then = max(depth, zero), max(depth + h * approach, zero)
    return k * (now * now - then * then)


@inlined
def _act(
    p, qx, qy, qz, ux, uy, uz, rate, h, half, fx, fy, fz, vx, vy, vz, bx, by, bz, ix, iy, iz, lost,
):
    """Let a force act on vertex p, and tell what the sub-step takes out of its motion (Eq. E5)."""
    lost[p] += half * h * (
        qx * (ux + rate * qx - bx[p]) + qy * (uy + rate * qy - by[p])
        + qz * (uz + rate * qz - bz[p]))
    fx[p], fy[p], fz[p] = qx, qy, qz
    vx[p] += rate * qx
    vy[p] += rate * qy
    vz[p] += rate * qz
    ix[p] += h * qx
    iy[p] += h * qy
    iz[p] += h * qz


@fused
def _sticking(
    law, tie, force, sums, position, velocity, before, mobility, coefficient, time, h, last,
):
    """As `solve_planes`, with friction that sticks."""
    nx, ny, nz, sx, sy, sz = law[0], law[1], law[2], law[3], law[4], law[5]
    deep, k, c, share = law[6], law[7], law[8], law[9]
    kt, ct, share_t, softness = law[10], law[11], law[12], law[13]
    ax, ay, az, opened = tie[0], tie[1], tie[2], tie[3]
    ix, iy, iz, heat, rubbed, lost = sums[0], sums[1], sums[2], sums[3], sums[4], sums[5]
    fx, fy, fz = force[0], force[1], force[2]
    px, py, pz, vx, vy, vz = (
        position[0], position[1], position[2], velocity[0], velocity[1], velocity[2])
    bx, by, bz = before[0], before[1], before[2]
    zero, half, one = law.dtype.type(0.0), law.dtype.type(0.5), law.dtype.type(1.0)
    for p in range(np.uint64(0), last):
        rate = h * mobility[p]
        x, y, z = px[p], py[p], pz[p]
        ux, uy, uz = vx[p], vy[p], vz[p]
        surface = nx[p] * sx[p] + ny[p] * sy[p] + nz[p] * sz[p]
        approach = surface - (nx[p] * ux + ny[p] * uy + nz[p] * uz)
        depth = deep[p] + time * surface - (nx[p] * x + ny[p] * y + nz[p] * z)
        normal, w, closed = press(depth, approach, k[p], c[p], share[p], rate, h)

        # Elongation of the tie, tangential: none if the plane was open.
        was_open = opened[p] > zero
        here_x, here_y, here_z = x - time * sx[p], y - time * sy[p], z - time * sz[p]
        tied_x, tied_y, tied_z = ax[p], ay[p], az[p]
        anchor_x = here_x if was_open else tied_x
        anchor_y = here_y if was_open else tied_y
        anchor_z = here_z if was_open else tied_z
        ex, ey, ez = here_x - anchor_x, here_y - anchor_y, here_z - anchor_z
        out = ex * nx[p] + ey * ny[p] + ez * nz[p]
        ex, ey, ez = ex - out * nx[p], ey - out * ny[p], ez - out * nz[p]
        tx, ty, tz = (
            ux - sx[p] + approach * nx[p], uy - sy[p] + approach * ny[p],
            uz - sz[p] + approach * nz[p])
        gain = h * kt[p] + ct[p]
        qx, qy, qz = (
            -share_t[p] * (kt[p] * ex + gain * tx), -share_t[p] * (kt[p] * ey + gain * ty),
            -share_t[p] * (kt[p] * ez + gain * tz))
        square, limit = qx * qx + qy * qy + qz * qz, coefficient * normal
        slides = square > limit * limit
        cut = limit / np.sqrt(square) if slides else one
        qx, qy, qz = cut * qx, cut * qy, cut * qz

        # At the end of the sub-step: slip of the anchor, and what the tie stretches beyond it.
        tx, ty, tz = h * (tx + rate * qx), h * (ty + rate * qy), h * (tz + rate * qz)
        slip_x, slip_y, slip_z = (
            ex + tx + softness[p] * qx, ey + ty + softness[p] * qy, ez + tz + softness[p] * qz)
        slip_x = slip_x if slides else zero
        slip_y = slip_y if slides else zero
        slip_z = slip_z if slides else zero
        rx, ry, rz = tx - slip_x, ty - slip_y, tz - slip_z
        held = ct[p] * (tx * tx + ty * ty + tz * tz) / h
        held = zero if slides else held
        warm = h * c[p] * w * w + held
        loss = half * (h * h * k[p] * w * w + kt[p] * (rx * rx + ry * ry + rz * rz))
        rub = -(qx * slip_x + qy * slip_y + qz * slip_z)
        let_go = half * kt[p] * (ex * ex + ey * ey + ez * ez)
        cold = half * leaving(depth, approach, k[p], h, zero)
        heat[p] += warm if closed else cold
        rubbed[p] += rub if closed else let_go

        qx, qy, qz = qx + normal * nx[p], qy + normal * ny[p], qz + normal * nz[p]
        qx = qx if closed else zero
        qy = qy if closed else zero
        qz = qz if closed else zero
        lost[p] += loss if closed else zero
        _act(
            p, qx, qy, qz, ux, uy, uz, rate, h, half, fx, fy, fz, vx, vy, vz, bx, by, bz, ix, iy,
            iz, lost,
        )
        anchor_x, anchor_y, anchor_z = anchor_x + slip_x, anchor_y + slip_y, anchor_z + slip_z
        ax[p] = anchor_x if closed else tied_x
        ay[p] = anchor_y if closed else tied_y
        az[p] = anchor_z if closed else tied_z
        opened[p] = zero if closed else one


@fused
def _viscous(
    law, force, sums, position, velocity, before, mobility, epsilon, time, h, last,
):
    """As `solve_planes`, with the paper's friction (Eq. S7); it has no ties."""
    nx, ny, nz, sx, sy, sz = law[0], law[1], law[2], law[3], law[4], law[5]
    deep, k, c, share, f_c = law[6], law[7], law[8], law[9], law[14]
    ix, iy, iz, heat, rubbed, lost = sums[0], sums[1], sums[2], sums[3], sums[4], sums[5]
    fx, fy, fz = force[0], force[1], force[2]
    px, py, pz, vx, vy, vz = (
        position[0], position[1], position[2], velocity[0], velocity[1], velocity[2])
    bx, by, bz = before[0], before[1], before[2]
    zero, half, one = law.dtype.type(0.0), law.dtype.type(0.5), law.dtype.type(1.0)
    for p in range(np.uint64(0), last):
        rate = h * mobility[p]
        ux, uy, uz = vx[p], vy[p], vz[p]
        surface = nx[p] * sx[p] + ny[p] * sy[p] + nz[p] * sz[p]
        approach = surface - (nx[p] * ux + ny[p] * uy + nz[p] * uz)
        depth = deep[p] + time * surface - (nx[p] * px[p] + ny[p] * py[p] + nz[p] * pz[p])
        normal, w, closed = press(depth, approach, k[p], c[p], share[p], rate, h)
        tx, ty, tz = (
            ux - sx[p] + approach * nx[p], uy - sy[p] + approach * ny[p],
            uz - sz[p] + approach * nz[p])
        gain = f_c[p] / max(np.sqrt(tx * tx + ty * ty + tz * tz), epsilon)
        scale = -gain / (one + rate * gain)
        qx, qy, qz = scale * tx, scale * ty, scale * tz
        rub = -h * (
            qx * (tx + rate * qx) + qy * (ty + rate * qy) + qz * (tz + rate * qz))
        warm, cold = h * c[p] * w * w, half * leaving(depth, approach, k[p], h, zero)
        heat[p] += warm if closed else cold
        rubbed[p] += rub if closed else zero

        qx, qy, qz = qx + normal * nx[p], qy + normal * ny[p], qz + normal * nz[p]
        qx = qx if closed else zero
        qy = qy if closed else zero
        qz = qz if closed else zero
        loss = half * h * h * k[p] * w * w
        lost[p] += loss if closed else zero
        _act(
            p, qx, qy, qz, ux, uy, uz, rate, h, half, fx, fy, fz, vx, vy, vz, bx, by, bz, ix, iy,
            iz, lost,
        )
