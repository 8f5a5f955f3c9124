"""Foundation contact: pressure as a function of depth on the skin, and friction that sticks.

What its kernels take and write, for the n vertices of a skin, where listed; world axes unless told:

listed : (l,) int64, sorted
points, velocities : (n, 3) float64
    [m, m/s]
values, origin, spacing
    Distance φ in the frame of the solid (`simcore.contact.distance_lookup`).
rotation, position, linear_velocity, turn
    Of that frame, and its angular velocity [m, m/s, rad/s].
area, soft, modulus, thickness, damping_time : (n,) float64
    A [m²], A p′(0) [N/m], E [Pa], D [m] and τ [s].
give, stiffening
    Of `simcore.contact.layer.pressure_and_slope`.
friction, lag, motion : float
    µ; the time after which an implicit step wants to know the force [s]; how far skin that touches
    may move within a step [m].
anchor : (n, 3) float64
    Where the friction spring of each vertex is tied, frame of the solid [m]: put on the vertex when
    it touches, kept as deep as the vertex is, dragged along when it slips.
closed : (n,) bool
    Whether the vertex touches.
force : (n, 3), normal_force : (n,), normals : (n, 3) float64
    On the skin, its normal part [N], and where pressed the outward normal of the solid.
along, across : (n,) float64
    Impedance lag² K + lag D of the contact, normal and tangential [kg].
depths, steepness : (n,) float64
    d [m], and ‖∇φ‖ where pressed.
sticks : (n,) bool
    Whether friction is not cut.
stretch : (n, 3) float64
    Along the surface, of the friction spring of what touches, frame of the solid [m].
slid : (1,) float64
    Energy spent by friction springs, added to [J] (Eq. E5).
"""

import numpy as np

from simcore.compiled import compiled, inlined
from simcore.contact.distance_lookup import distance_and_gradient, seen_from
from simcore.contact.layer import SHEAR_SHARE, pressure_and_slope

FLAT = 1e-12
"""A gradient shorter than this, in the very middle of a slab, has no direction."""

LOOKED_AHEAD = 3.0
"""Skin that will touch within so many lags, as it moves now, is listed and counts for the length
of the next step: until the end of that, unless it is longer than this one."""


@compiled
def foundation_forces(
    listed, points, velocities, values, origin, spacing, rotation, position, linear_velocity,
    turn, area, soft, modulus, thickness, give, stiffening, damping_time, friction, lag, motion,
    anchor, closed, force, normal_force, normals, along, across, depths, steepness, sticks,
    stretch, slid,
):
    """Write the force of a solid on each listed skin vertex.

    With φ the distance of the vertex from the solid, d = −φ, and p the pressure of its flesh (and
    of the mattress, if that is the solid) at this depth (Eqs. C1 and C3):

        N = A max(p(d) + τ p′(d) ḋ, 0)

    along the gradient of φ. A vertex that will touch within the lag has N = A p′(0) τ (ḋ + d/lag),
    so that an impact does not come as a surprise. Friction is that of a spring which shears with
    the flesh, tied to the solid, and slips at µ N (Eq. C2):

        F = −A p′(0)/3 (e + τ ė),   cut to ‖F‖ ≤ µ N, and e with it

    Returns
    -------
    contact_count, depth_max, deepest
        Of what is inside; the deepest vertex is −1 without contact.
    pressed : (p,) int64, vertices that bear force or are inside
    pace : float
        Time within which none that touches, or will within `LOOKED_AHEAD` lags, moves farther than
        `motion`, or than it is away [s] (Eq. I3).
    """
    count, depth_max, deepest, fastest = 0, 0.0, -1, 0.0
    pressed, pressed_count = np.empty(listed.size, np.int64), 0
    for i in listed:
        force[i, 0] = force[i, 1] = force[i, 2] = normal_force[i] = 0.0
        along[i], across[i], sticks[i] = 0.0, 0.0, False
        px, py, pz = seen_from(rotation, position, points, i)
        distance, gx, gy, gz = distance_and_gradient(values, origin, spacing, px, py, pz)
        u, v, w = _relative_velocity(
            i, points, velocities, rotation, position, linear_velocity, turn)
        depth, rate = -distance, -(gx * u + gy * v + gz * w)
        if depth + LOOKED_AHEAD * lag * rate > 0.0:
            room = max(distance, motion)
            fastest = max(fastest, (u * u + v * v + w * w) / (room * room))
        depths[i] = depth
        normal, stiffness = _press(
            depth, rate, area[i], soft[i], modulus[i], thickness[i], give, stiffening,
            damping_time[i], lag,
        )
        length = np.sqrt(gx * gx + gy * gy + gz * gz)
        flat = max(length, FLAT)
        nx, ny, nz = gx / flat, gy / flat, gz / flat
        if normal > 0.0 or depth > 0.0:
            pressed[pressed_count] = i
            pressed_count += 1
            steepness[i] = length
            _turn(rotation, nx, ny, nz, i, normals)
        shear = SHEAR_SHARE * soft[i]
        if normal <= 0.0:
            if closed[i]:
                slid[0] += 0.5 * shear * (
                    stretch[i, 0] ** 2 + stretch[i, 1] ** 2 + stretch[i, 2] ** 2)
            closed[i] = False
            continue
        if depth > 0.0:
            count += 1
            if depth > depth_max:
                depth_max, deepest = depth, i
        along[i] = lag * stiffness * (lag + damping_time[i])
        normal_force[i] = normal * length
        if not closed[i]:
            closed[i] = True
            anchor[i, 0], anchor[i, 1], anchor[i, 2] = px, py, pz
            stretch[i, 0] = stretch[i, 1] = stretch[i, 2] = 0.0
        fx, fy, fz, cut, spent = _rub(
            i, px, py, pz, u, v, w, nx, ny, nz, shear, damping_time[i],
            friction * normal_force[i], anchor, stretch,
        )
        slid[0] += spent
        across[i] = cut * lag * shear * (lag + damping_time[i])
        sticks[i] = cut == 1.0
        _turn(rotation, normal * gx + fx, normal * gy + fy, normal * gz + fz, i, force)
    return count, depth_max, deepest, pressed[:pressed_count].copy(), 1.0 / np.sqrt(fastest)


@compiled
def release(before, now, soft, normal_force, closed, stretch, slid):
    """Let go of the vertices that were listed and are no longer, and of what their ties hold."""
    at = 0
    for i in before:
        while at < now.size and now[at] < i:
            at += 1
        if at == now.size or now[at] != i:
            if closed[i]:
                slid[0] += 0.5 * SHEAR_SHARE * soft[i] * (
                    stretch[i, 0] ** 2 + stretch[i, 1] ** 2 + stretch[i, 2] ** 2)
            normal_force[i], closed[i] = 0.0, False


@inlined
def _press(depth, rate, area, soft, modulus, thickness, give, stiffening, damping_time, lag):
    """Return the force along ∇φ [N], not positive without contact, and its stiffness [N/m]."""
    if depth > 0.0:
        pressure, slope = pressure_and_slope(depth, modulus, thickness, give, stiffening)
        stiffness = area * slope
        normal = area * pressure + damping_time * stiffness * rate
    else:
        stiffness = soft
        normal = soft * damping_time * (rate + depth / lag) if lag > 0.0 else 0.0
    return normal, stiffness


@inlined
def _relative_velocity(i, points, velocities, rotation, position, linear_velocity, turn):
    """Return the velocity of a vertex as seen from the solid, in its frame [m/s]."""
    x, y, z = points[i, 0] - position[0], points[i, 1] - position[1], points[i, 2] - position[2]
    u = velocities[i, 0] - linear_velocity[0] - turn[1] * z + turn[2] * y
    v = velocities[i, 1] - linear_velocity[1] - turn[2] * x + turn[0] * z
    w = velocities[i, 2] - linear_velocity[2] - turn[0] * y + turn[1] * x
    return (rotation[0, 0] * u + rotation[1, 0] * v + rotation[2, 0] * w,
            rotation[0, 1] * u + rotation[1, 1] * v + rotation[2, 1] * w,
            rotation[0, 2] * u + rotation[1, 2] * v + rotation[2, 2] * w)


@inlined
def _turn(rotation, x, y, z, i, out):
    """Write a vector of the solid's frame in world axes."""
    for axis in range(3):
        out[i, axis] = rotation[axis, 0] * x + rotation[axis, 1] * y + rotation[axis, 2] * z


@inlined
def _rub(i, px, py, pz, u, v, w, nx, ny, nz, shear, damping_time, limit, anchor, stretch):
    """Return friction [N], the share of it that is kept, and what its slip spends [J]: Eq. C2.

    In the frame of the solid. Moves the anchor; writes the stretch.
    """
    ex, ey, ez = px - anchor[i, 0], py - anchor[i, 1], pz - anchor[i, 2]
    kx, ky, kz = ex + damping_time * u, ey + damping_time * v, ez + damping_time * w
    out = nx * kx + ny * ky + nz * kz
    fx, fy, fz = -shear * (kx - out * nx), -shear * (ky - out * ny), -shear * (kz - out * nz)
    size, cut = np.sqrt(fx * fx + fy * fy + fz * fz), 1.0
    # The surface may have turned since: what the spring holds out of it is spent.
    sx, sy, sz = stretch[i, 0], stretch[i, 1], stretch[i, 2]
    out = nx * sx + ny * sy + nz * sz
    spent = 0.5 * shear * out * out
    out = nx * ex + ny * ey + nz * ez
    ex, ey, ez = ex - out * nx, ey - out * ny, ez - out * nz
    if size > limit:
        cut = limit / size
        fx, fy, fz = cut * fx, cut * fy, cut * fz
        kx, ky, kz = -fx / shear, -fy / shear, -fz / shear
        spent += 0.5 * shear * (
            (ex - kx) * (sx + kx) + (ey - ky) * (sy + ky) + (ez - kz) * (sz + kz))
        ex, ey, ez = kx, ky, kz
    # Left where it was, part of the depth would be taken for shear as soon as the surface turns.
    anchor[i, 0], anchor[i, 1], anchor[i, 2] = px - ex, py - ey, pz - ez
    stretch[i, 0], stretch[i, 1], stretch[i, 2] = ex, ey, ez
    return fx, fy, fz, cut, spent
