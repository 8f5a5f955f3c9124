"""The law of a foundation contact for many skin vertices at once: Eqs. C1 to C3.

All loops run without a branch, over arrays of one dimension and with unsigned indices, so that
compilers vectorise them; and each reads all before it writes, for loads between stores make such
a loop three times as slow. What belongs to a vertex is brought together before and put back after
(`simcore.contact.foundation`). All is in the frame of the solid.
"""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.layer import SHEAR_SHARE, pressure_and_slope

FLAT = 1e-12
"""A gradient shorter than this, in the very middle of a slab, has no direction."""

LOOKED_AHEAD = 3.0
"""Skin that will touch within so many lags, as it moves now, is listed and counts for the length
of the next step: until the end of that, unless it is longer than this one."""

# Rows that the law takes; of vectors the first of three.
POINT, VELOCITY = 0, 3
AREA, SOFT, MODULUS, THICKNESS, DAMPING_TIME = 6, 7, 8, 9, 10
ANCHOR, STRETCH, CLOSED = 11, 14, 17
DISTANCE, GRADIENT = 18, 19
# And those that it writes.
NORMAL, LENGTH, FORCE, NORMAL_FORCE, ALONG, ACROSS, KEPT, SPENT, HASTE, PRESS = (
    22, 25, 26, 29, 30, 31, 32, 33, 34, 35)
ROWS = 36


@compiled
def see_from_solid(rows, last, rotation, position, linear_velocity, turn):
    """Turn points and velocities of the world into those seen from the solid [m, m/s]."""
    x, y, z = rows[POINT], rows[POINT + 1], rows[POINT + 2]
    u, v, w = rows[VELOCITY], rows[VELOCITY + 1], rows[VELOCITY + 2]
    r00, r01, r02 = rotation[0, 0], rotation[0, 1], rotation[0, 2]
    r10, r11, r12 = rotation[1, 0], rotation[1, 1], rotation[1, 2]
    r20, r21, r22 = rotation[2, 0], rotation[2, 1], rotation[2, 2]
    x0, y0, z0 = position[0], position[1], position[2]
    u0, v0, w0 = linear_velocity[0], linear_velocity[1], linear_velocity[2]
    p, q, r = turn[0], turn[1], turn[2]
    for k in range(np.uint64(0), last):
        a, b, c = x[k] - x0, y[k] - y0, z[k] - z0
        x[k] = r00 * a + r10 * b + r20 * c
        y[k] = r01 * a + r11 * b + r21 * c
        z[k] = r02 * a + r12 * b + r22 * c
        a, b, c = u[k] - u0 - q * c + r * b, v[k] - v0 - r * a + p * c, w[k] - w0 - p * b + q * a
        u[k] = r00 * a + r10 * b + r20 * c
        v[k] = r01 * a + r11 * b + r21 * c
        w[k] = r02 * a + r12 * b + r22 * c


@compiled
def press(rows, last, give, stiffening, lag, motion):
    """Write what presses and how hard.

    The force along ∇φ [N], not positive without contact, to `PRESS`, and its stiffness [N/m] to
    `ALONG`; the unit vector of ∇φ and its length; and how much of `motion` the vertex makes in a
    second, squared (Eq. I3).
    """
    u, v, w = rows[VELOCITY], rows[VELOCITY + 1], rows[VELOCITY + 2]
    area, soft, modulus, thickness, tau = (
        rows[AREA], rows[SOFT], rows[MODULUS], rows[THICKNESS], rows[DAMPING_TIME])
    phi, gx, gy, gz = rows[DISTANCE], rows[GRADIENT], rows[GRADIENT + 1], rows[GRADIENT + 2]
    nx, ny, nz, length = rows[NORMAL], rows[NORMAL + 1], rows[NORMAL + 2], rows[LENGTH]
    pressing, along, haste = rows[PRESS], rows[ALONG], rows[HASTE]
    zero = 0.0
    for k in range(np.uint64(0), last):
        x, y, z, distance, reply = gx[k], gy[k], gz[k], phi[k], tau[k]
        p, q, r, tile, yielding = u[k], v[k], w[k], area[k], soft[k]
        depth, rate = -distance, -(x * p + y * q + z * r)
        pressure, slope = pressure_and_slope(depth, modulus[k], thickness[k], give, stiffening)
        room = max(distance, motion)
        share = (p * p + q * q + r * r) / (room * room)
        stiffness = tile * slope
        inside = tile * pressure + reply * stiffness * rate
        coming = yielding * reply * (rate + depth / lag)
        coming = coming if lag > 0.0 else zero
        size = np.sqrt(x * x + y * y + z * z)
        steep = max(size, FLAT)
        haste[k] = share if depth + LOOKED_AHEAD * lag * rate > 0.0 else zero
        pressing[k] = inside if depth > 0.0 else coming
        along[k] = stiffness if depth > 0.0 else yielding
        length[k] = size
        nx[k], ny[k], nz[k] = x / steep, y / steep, z / steep


@compiled
def rub(rows, last, friction, lag):
    """Write friction and both impedances, move the anchors, and tell what slip spends: Eq. C2.

    `FORCE` is the whole force, `KEPT` the share of friction that is not cut. What does not press
    has none of them; what had and no longer does has spent all that its spring held [J].
    """
    x, y, z = rows[POINT], rows[POINT + 1], rows[POINT + 2]
    u, v, w = rows[VELOCITY], rows[VELOCITY + 1], rows[VELOCITY + 2]
    gx, gy, gz = rows[GRADIENT], rows[GRADIENT + 1], rows[GRADIENT + 2]
    nx, ny, nz = rows[NORMAL], rows[NORMAL + 1], rows[NORMAL + 2]
    ax, ay, az = rows[ANCHOR], rows[ANCHOR + 1], rows[ANCHOR + 2]
    stretch_x, stretch_y, stretch_z = rows[STRETCH], rows[STRETCH + 1], rows[STRETCH + 2]
    fx, fy, fz = rows[FORCE], rows[FORCE + 1], rows[FORCE + 2]
    soft, tau, closed, length, pressing = (
        rows[SOFT], rows[DAMPING_TIME], rows[CLOSED], rows[LENGTH], rows[PRESS])
    normal_force, along, across, kept, spent = (
        rows[NORMAL_FORCE], rows[ALONG], rows[ACROSS], rows[KEPT], rows[SPENT])
    zero, one = 0.0, 1.0
    for k in range(np.uint64(0), last):
        at_x, at_y, at_z, pressed, reply = x[k], y[k], z[k], pressing[k], tau[k]
        n0, n1, n2, g0, g1, g2 = nx[k], ny[k], nz[k], gx[k], gy[k], gz[k]
        shear, tied, stiffness = SHEAR_SHARE * soft[k], closed[k], along[k]
        # What did not touch is not tied yet.
        ex, ey, ez = tied * (at_x - ax[k]), tied * (at_y - ay[k]), tied * (at_z - az[k])
        sx, sy, sz = tied * stretch_x[k], tied * stretch_y[k], tied * stretch_z[k]
        let_go = 0.5 * shear * (sx * sx + sy * sy + sz * sz)
        kx, ky, kz = ex + reply * u[k], ey + reply * v[k], ez + reply * w[k]
        out = n0 * kx + n1 * ky + n2 * kz
        qx, qy, qz = -shear * (kx - out * n0), -shear * (ky - out * n1), -shear * (kz - out * n2)
        size, normal = np.sqrt(qx * qx + qy * qy + qz * qz), pressed * length[k]
        limit = friction * normal
        # The surface may have turned since: what the spring holds out of it is spent.
        out = n0 * sx + n1 * sy + n2 * sz
        turned = 0.5 * shear * out * out
        out = n0 * ex + n1 * ey + n2 * ez
        ex, ey, ez = ex - out * n0, ey - out * n1, ez - out * n2
        cut = limit / size
        cx, cy, cz = cut * qx, cut * qy, cut * qz
        kx, ky, kz = -cx / shear, -cy / shear, -cz / shear
        slipped = turned + 0.5 * shear * (
            (ex - kx) * (sx + kx) + (ey - ky) * (sy + ky) + (ez - kz) * (sz + kz))
        slides, touches = size > limit, not pressed <= 0.0
        cut = cut if slides else one
        qx = cx if slides else qx
        qy = cy if slides else qy
        qz = cz if slides else qz
        ex = kx if slides else ex
        ey = ky if slides else ey
        ez = kz if slides else ez
        rubbed = slipped if slides else turned
        push, hold = lag * stiffness * (lag + reply), cut * lag * shear * (lag + reply)
        qx, qy, qz = pressed * g0 + qx, pressed * g1 + qy, pressed * g2 + qz
        # Left where it was, part of the depth would be taken for shear once the surface turns.
        ax[k], ay[k], az[k] = at_x - ex, at_y - ey, at_z - ez
        stretch_x[k], stretch_y[k], stretch_z[k] = ex, ey, ez
        spent[k] = rubbed if touches else let_go
        along[k] = push if touches else zero
        across[k] = hold if touches else zero
        kept[k] = cut if touches else zero
        normal_force[k] = normal if touches else zero
        fx[k] = qx if touches else zero
        fy[k] = qy if touches else zero
        fz[k] = qz if touches else zero


@compiled
def turn_to_world(rows, last, first, rotation):
    """Turn the vectors of three rows, the first one told, into world axes."""
    x, y, z = rows[first], rows[first + 1], rows[first + 2]
    r00, r01, r02 = rotation[0, 0], rotation[0, 1], rotation[0, 2]
    r10, r11, r12 = rotation[1, 0], rotation[1, 1], rotation[1, 2]
    r20, r21, r22 = rotation[2, 0], rotation[2, 1], rotation[2, 2]
    for k in range(np.uint64(0), last):
        a, b, c = x[k], y[k], z[k]
        x[k] = r00 * a + r01 * b + r02 * c
        y[k] = r10 * a + r11 * b + r12 * c
        z[k] = r20 * a + r21 * b + r22 * c
