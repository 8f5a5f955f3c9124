"""Contact and friction of a sheet with a flat bed, implicit on each vertex (Eqs. S5 to S7).

What `simcore.sheet.vertex_contact` does for planes that lie and move anyhow, for one that lies
still with its normal along z: half of the arithmetic, in the same order.
"""

import numpy as np

from simcore.compiled import fused, inlined
from simcore.sheet.vertex_contact import leaving, press


@inlined
def solve_bed(
    law, state, sums, pushed, position, velocity, before, mobility, coefficient, epsilon, h, first,
    last,
):
    """Move the vertices that are near a bed through a sub-step.

    Parameters
    ----------
    law, state, sums
        Of `simcore.sheet.grid_bed.GridBed`; what is far above has a depth that nothing bridges.
    pushed : (3, N)
        Force that another contact is going to add to the velocities given [N].
    position, velocity, before, mobility, coefficient, epsilon, h
        As in `simcore.sheet.vertex_contact.solve_planes`.
    first, last : uint64
        Points to run over.
    """
    if coefficient < 0.0:
        _viscous(
            law[0], law[1], law[2], law[7], state[0], sums[0], sums[1], sums[2], sums[3], sums[4],
            sums[5], pushed[0], pushed[1], pushed[2], position[2], velocity[0], velocity[1],
            velocity[2], before[0], before[1], before[2], mobility, epsilon, h, first, last,
        )
    else:
        _sticking(
            law[0], law[1], law[2], law[3], law[4], law[5], law[6], state[0], state[1], state[2],
            state[3], state[4], sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], pushed[0],
            pushed[1], pushed[2], position[0], position[1], position[2], velocity[0], velocity[1],
            velocity[2], before[0], before[1], before[2], mobility, coefficient, h, first, last,
        )


@fused
def _sticking(
    k, c, share, kt, ct, share_t, softness, deep, ax, ay, az, opened, ix, iy, iz, heat, rubbed,
    lost, gx, gy, gz, px, py, pz, vx, vy, vz, bx, by, bz, mobility, coefficient, h, first, last,
):
    """As `solve_bed`, with friction that sticks."""
    zero, half, one = deep.dtype.type(0.0), deep.dtype.type(0.5), deep.dtype.type(1.0)
    for p in range(first, last):
        rate = h * mobility[p]
        x, y, z = px[p], py[p], pz[p]
        ux, uy, uz = vx[p] + rate * gx[p], vy[p] + rate * gy[p], vz[p] + rate * gz[p]
        approach, depth = -uz, deep[p] - z
        normal, w, closed = press(depth, approach, k[p], c[p], share[p], rate, h)

        # Elongation of the tie: none if the vertex was off.
        was_open = opened[p] > zero
        tied_x, tied_y, tied_z = ax[p], ay[p], az[p]
        anchor_x = x if was_open else tied_x
        anchor_y = y if was_open else tied_y
        anchor_z = z if was_open else tied_z
        ex, ey = x - anchor_x, y - anchor_y
        gain = h * kt[p] + ct[p]
        qx, qy = -share_t[p] * (kt[p] * ex + gain * ux), -share_t[p] * (kt[p] * ey + gain * uy)
        square, limit = qx * qx + qy * qy, coefficient * normal
        slides = square > limit * limit
        cut = limit / np.sqrt(square) if slides else one
        qx, qy = cut * qx, cut * qy

        # At the end of the sub-step: slip of the anchor, and what the tie stretches beyond it.
        tx, ty = h * (ux + rate * qx), h * (uy + rate * qy)
        slip_x, slip_y = ex + tx + softness[p] * qx, ey + ty + softness[p] * qy
        slip_x = slip_x if slides else zero
        slip_y = slip_y if slides else zero
        rx, ry = tx - slip_x, ty - slip_y
        held = ct[p] * (tx * tx + ty * ty) / h
        held = zero if slides else held
        warm = h * c[p] * w * w + held
        loss = half * (h * h * k[p] * w * w + kt[p] * (rx * rx + ry * ry))
        rub = -(qx * slip_x + qy * slip_y)
        let_go = half * kt[p] * (ex * ex + ey * ey)
        cold = half * leaving(depth, approach, k[p], h, zero)
        heat[p] += warm if closed else cold
        rubbed[p] += rub if closed else let_go
        lost[p] += loss if closed else zero

        qx = qx if closed else zero
        qy = qy if closed else zero
        lost[p] += half * h * (
            qx * (ux + rate * qx - bx[p]) + qy * (uy + rate * qy - by[p])
            + normal * (uz + rate * normal - bz[p]))
        vx[p] += rate * qx
        vy[p] += rate * qy
        vz[p] += rate * normal
        ix[p] += h * qx
        iy[p] += h * qy
        iz[p] += h * normal
        anchor_x, anchor_y = anchor_x + slip_x, anchor_y + slip_y
        ax[p] = anchor_x if closed else tied_x
        ay[p] = anchor_y if closed else tied_y
        az[p] = anchor_z if closed else tied_z
        opened[p] = zero if closed else one


@fused
def _viscous(
    k, c, share, f_c, deep, ix, iy, iz, heat, rubbed, lost, gx, gy, gz, pz, vx, vy, vz, bx, by, bz,
    mobility, epsilon, h, first, last,
):
    """As `solve_bed`, with the paper's friction (Eq. S7); it has no ties."""
    zero, half, one = deep.dtype.type(0.0), deep.dtype.type(0.5), deep.dtype.type(1.0)
    for p in range(first, last):
        rate = h * mobility[p]
        ux, uy, uz = vx[p] + rate * gx[p], vy[p] + rate * gy[p], vz[p] + rate * gz[p]
        approach, depth = -uz, deep[p] - pz[p]
        normal, w, closed = press(depth, approach, k[p], c[p], share[p], rate, h)
        gain = f_c[p] / max(np.sqrt(ux * ux + uy * uy), epsilon)
        scale = -gain / (one + rate * gain)
        qx, qy = scale * ux, scale * uy
        rub = -h * (qx * (ux + rate * qx) + qy * (uy + rate * qy))
        warm, cold = h * c[p] * w * w, half * leaving(depth, approach, k[p], h, zero)
        loss = half * h * h * k[p] * w * w
        heat[p] += warm if closed else cold
        rubbed[p] += rub if closed else zero
        lost[p] += loss if closed else zero

        qx = qx if closed else zero
        qy = qy if closed else zero
        lost[p] += half * h * (
            qx * (ux + rate * qx - bx[p]) + qy * (uy + rate * qy - by[p])
            + normal * (uz + rate * normal - bz[p]))
        vx[p] += rate * qx
        vy[p] += rate * qy
        vz[p] += rate * normal
        ix[p] += h * qx
        iy[p] += h * qy
        iz[p] += h * normal
