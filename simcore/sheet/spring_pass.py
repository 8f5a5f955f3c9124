"""Forces of the springs of a net on its grid, in a form that compilers vectorise (Eqs. 5, S3)."""

import numpy as np

from simcore.compiled import fused, inlined, reassociated

TINY = 1e-24
"""Added to squared lengths [m²]: no division by zero between absent grid points."""


@fused
def pull_springs(
    coarse, fine, velocity, offsets, stiffness, rest_length, buckling_strain, share, damping_time,
    pull, first, last,
):
    """Write the force of every spring on the vertex that it starts from.

    A spring from grid point a to b with d = x_b − x_a, l = ‖d‖ pulls a by s d and b by −s d:

        s = k (l − r)/l + β k (d · ḋ)/l²                                        (Eqs. 5, S3)

    where l − r below −(buckling strain) r counts by its share only.

    Positions are given in two parts, the coarse one rounded and the fine one what is left: the
    difference of the coarse ones is exact, so that d has the precision of its own size and not
    that of the place in the world.

    Parameters
    ----------
    coarse, fine, velocity : (3, N)
        On the grid [m, m/s].
    offsets : (6,) uint64
        Step of each direction in the flattened grid.
    stiffness : (6, N)
        Of the spring that starts at a grid point, 0 where there is none [N/m].
    rest_length : (6,)
        By direction [m].
    buckling_strain : float
        Compression over rest length at which a spring buckles.
    share : (6,)
        Share of the stiffness beyond it, by direction.
    damping_time : float
        β [s].
    pull : (6, 3, N)
        Overwritten [N].
    first, last : uint64
        Points to run over.
    """
    one, zero, tiny = share.dtype.type(1.0), share.dtype.type(0.0), share.dtype.type(TINY)
    for i in (0, 3):
        a, b, c = i, i + 1, i + 2
        _pull_three(
            coarse[0], coarse[1], coarse[2], fine[0], fine[1], fine[2], velocity[0], velocity[1],
            velocity[2], offsets[a], offsets[b], offsets[c], stiffness[a], stiffness[b],
            stiffness[c], rest_length[a], rest_length[b], rest_length[c], one - share[a],
            one - share[b], one - share[c], buckling_strain, damping_time, pull[a, 0], pull[a, 1],
            pull[a, 2], pull[b, 0], pull[b, 1], pull[b, 2], pull[c, 0], pull[c, 1], pull[c, 2],
            first, last, zero, one, tiny,
        )


@fused
def _pull_three(
    hx, hy, hz, lx, ly, lz, vx, vy, vz, a, b, c, ka, kb, kc, rest_a, rest_b, rest_c, yielding_a,
    yielding_b, yielding_c, buckling_strain, damping_time, ax, ay, az, bx, by, bz, cx, cy, cz,
    first, last, zero, one, tiny,
):
    """Write what the springs of three directions do to the vertices that they start from.

    What is read of these vertices serves all three; six at a time would take long to compile.
    """
    for p in range(first, last):
        h_x, h_y, h_z, l_x, l_y, l_z = hx[p], hy[p], hz[p], lx[p], ly[p], lz[p]
        v_x, v_y, v_z = vx[p], vy[p], vz[p]
        q = p + a
        ax[p], ay[p], az[p] = _pull(
            (hx[q] - h_x) + (lx[q] - l_x), (hy[q] - h_y) + (ly[q] - l_y),
            (hz[q] - h_z) + (lz[q] - l_z), vx[q] - v_x, vy[q] - v_y, vz[q] - v_z, ka[p], rest_a,
            yielding_a, buckling_strain, damping_time, zero, one, tiny,
        )
        q = p + b
        bx[p], by[p], bz[p] = _pull(
            (hx[q] - h_x) + (lx[q] - l_x), (hy[q] - h_y) + (ly[q] - l_y),
            (hz[q] - h_z) + (lz[q] - l_z), vx[q] - v_x, vy[q] - v_y, vz[q] - v_z, kb[p], rest_b,
            yielding_b, buckling_strain, damping_time, zero, one, tiny,
        )
        q = p + c
        cx[p], cy[p], cz[p] = _pull(
            (hx[q] - h_x) + (lx[q] - l_x), (hy[q] - h_y) + (ly[q] - l_y),
            (hz[q] - h_z) + (lz[q] - l_z), vx[q] - v_x, vy[q] - v_y, vz[q] - v_z, kc[p], rest_c,
            yielding_c, buckling_strain, damping_time, zero, one, tiny,
        )


@inlined
def _pull(
    dx, dy, dz, ux, uy, uz, k, rest, yielding, buckling_strain, damping_time, zero, one, tiny
):
    """Return the force of a spring along d whose ends part with u."""
    rate = dx * ux + dy * uy + dz * uz
    inverse = one / np.sqrt(dx * dx + dy * dy + dz * dz + tiny)
    ratio = rest * inverse
    stretch = one - ratio
    stretch -= yielding * min(stretch + buckling_strain * ratio, zero)
    s = k * (stretch + damping_time * rate * inverse * inverse)
    return s * dx, s * dy, s * dz


@fused
def accelerate(
    before, pull, offsets, mass, mobility, gravity, drag_rate, h, velocity, first, last
):
    """Write the velocities (3, N) that springs, weight and drag give in a sub-step h [s].

    What pulls the start of a spring pulls its end the other way.
    """
    a, b, c, d, e, f = offsets[0], offsets[1], offsets[2], offsets[3], offsets[4], offsets[5]
    for axis in range(3):
        was, now, g = before[axis], velocity[axis], gravity[axis]
        pa, pb, pc = pull[0, axis], pull[1, axis], pull[2, axis]
        pd, pe, pf = pull[3, axis], pull[4, axis], pull[5, axis]
        for p in range(first, last):
            mine = ((pa[p] + pb[p]) + (pc[p] + pd[p])) + (pe[p] + pf[p])
            others = ((pa[p - a] + pb[p - b]) + (pc[p - c] + pd[p - d])) + (pe[p - e] + pf[p - f])
            force = mass[p] * (g - drag_rate * was[p]) + (mine - others)
            now[p] = was[p] + h * mobility[p] * force


@reassociated
def carry(velocity, before, gathered, coupling, first, last):
    """Return A Pᵀ Δ (v − v_before) (4, 3): what Eq. S14 adds to the velocities of a sub-step."""
    vx, vy, vz, bx, by, bz = (
        velocity[0], velocity[1], velocity[2], before[0], before[1], before[2])
    ga, gb, gc, gd = gathered[0], gathered[1], gathered[2], gathered[3]
    total = np.zeros((4, 3), velocity.dtype)
    ax = ay = az = bbx = bby = bbz = cx = cy = cz = dx = dy = dz = total[0, 0]
    for p in range(first, last):
        x, y, z = vx[p] - bx[p], vy[p] - by[p], vz[p] - bz[p]
        ax, ay, az = ax + ga[p] * x, ay + ga[p] * y, az + ga[p] * z
        bbx, bby, bbz = bbx + gb[p] * x, bby + gb[p] * y, bbz + gb[p] * z
        cx, cy, cz = cx + gc[p] * x, cy + gc[p] * y, cz + gc[p] * z
        dx, dy, dz = dx + gd[p] * x, dy + gd[p] * y, dz + gd[p] * z
    sums = ((ax, ay, az), (bbx, bby, bbz), (cx, cy, cz), (dx, dy, dz))
    for i in range(4):
        for j in range(4):
            for axis in range(3):
                total[i, axis] += coupling[i, j] * sums[j][axis]
    return total


@fused
def move(fine, velocity, before, spread, carried, h, first, last):
    """Complete the velocities (3, N) by `spread` of what is carried; move the fine positions.

    By a sub-step h [s]; the velocities become those before.
    """
    sa, sb, sc, sd = spread[0], spread[1], spread[2], spread[3]
    for axis in range(3):
        x, now, was = fine[axis], velocity[axis], before[axis]
        a, b, c, d = carried[0, axis], carried[1, axis], carried[2, axis], carried[3, axis]
        for p in range(first, last):
            v = now[p] + ((a * sa[p] + b * sb[p]) + (c * sc[p] + d * sd[p]))
            x[p] += h * v
            was[p] = v
