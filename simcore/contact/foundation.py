"""Foundation contact: pressure as a function of depth on the skin, and friction that sticks."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.distance_lookup import distance_and_gradient

STRAIN_MAX = 0.8
"""Of the flesh, beyond which it is taken as linear: 25 times as stiff as at rest."""

SHEAR_SHARE = 1 / 3
"""Shear modulus over Young's modulus of what is incompressible, such as flesh."""


@compiled
def foundation_forces(
    listed, points, velocities, values, origin, spacing, rotation, position, linear_velocity,
    turn, area, modulus, thickness, stiffening, damping_time, friction, lag, anchor,
    closed, force, normal_force, normals, along, across, depths, steepness, sticks, stretch, slid,
):
    """Write the force of a rigid solid on each listed skin vertex.

    With φ the distance of the vertex from the solid, d = −φ, D the thickness of its flesh, E its
    modulus and ε = d/D (Eq. C1):

        N = A max(p(d) + τ p′(d) ḋ, 0),   p = E ε  or  E ε/(1 − ε)

    along the gradient of φ. A vertex that will touch within the lag has N = A p′(0) τ (ḋ + d/lag),
    so that an impact does not come as a surprise. Friction is that of a spring which shears with
    the flesh, tied to the solid, and slips at µ N (Eq. C2):

        F = −A E/3D (e + τ ė),   cut to ‖F‖ ≤ µ N, and e with it

    Parameters
    ----------
    listed : (l,) int64
    points, velocities : (n, 3) float64
        Of the skin, where listed, world [m, m/s].
    values, origin, spacing
        Distance φ in the frame of the solid (`simcore.contact.distance_lookup`).
    rotation, position, linear_velocity, turn
        Of that frame, and its angular velocity; world axes.
    area, modulus, thickness : (n,) float64
        A [m²], E [Pa] and D [m].
    stiffening : bool
        Which p.
    damping_time, friction, lag : float
        τ [s], µ, and the time after which an implicit step wants to know the force [s].
    anchor : (n, 3) float64
        Where the spring of each vertex is tied, frame of the solid [m]: e is the way from there
        along the surface. Put on the vertex when it touches, dragged along when it slips.
    closed : (n,) bool
        Whether the vertex touches; overwritten where listed.
    force : (n, 3), normal_force : (n,), normals : (n, 3) float64
        On the skin, its normal part [N] and the outward normal of the solid; world.
    along, across : (n,) float64
        Impedance lag² K + lag D of the contact, normal and tangential [kg].
    depths, steepness : (n,) float64
        d [m], overwritten where listed, and ‖∇φ‖, where pressed.
    sticks : (n,) bool
        Whether F is not cut; overwritten where listed.
    stretch : (n, 3) float64
        Along the surface, of the friction spring of what touches, frame of the solid [m].
    slid : (1,) float64
        Energy spent by friction springs, added to [J] (Eq. E5).

    Returns
    -------
    contact_count : int
    depth_max : float
    deepest : int
        Deepest vertex, −1 without contact.
    pressed : (p,) int64
        Vertices that bear force or are inside.
    """
    count, depth_max, deepest = 0, 0.0, -1
    pressed, pressed_count = np.empty(listed.size, np.int64), 0
    for i in listed:
        force[i, 0] = force[i, 1] = force[i, 2] = normal_force[i] = 0.0
        along[i] = across[i] = 0.0
        sticks[i] = False
        x, y, z = (points[i, 0] - position[0], points[i, 1] - position[1],
                   points[i, 2] - position[2])
        px = rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z
        py = rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z
        pz = rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z
        distance, gx, gy, gz = distance_and_gradient(values, origin, spacing, px, py, pz)
        nx = rotation[0, 0] * gx + rotation[0, 1] * gy + rotation[0, 2] * gz
        ny = rotation[1, 0] * gx + rotation[1, 1] * gy + rotation[1, 2] * gz
        nz = rotation[2, 0] * gx + rotation[2, 1] * gy + rotation[2, 2] * gz
        u = velocities[i, 0] - linear_velocity[0] - turn[1] * z + turn[2] * y
        v = velocities[i, 1] - linear_velocity[1] - turn[2] * x + turn[0] * z
        w = velocities[i, 2] - linear_velocity[2] - turn[0] * y + turn[1] * x
        rate = -(nx * u + ny * v + nz * w)
        depth = -distance
        depths[i] = depth
        soft = area[i] * modulus[i] / thickness[i]
        shear = SHEAR_SHARE * soft
        normal, stiffness = _press(
            depth, rate, soft, thickness[i], stiffening, damping_time, lag
        )
        length = np.sqrt(gx * gx + gy * gy + gz * gz)
        if normal > 0.0 or depth > 0.0:
            pressed[pressed_count] = i
            pressed_count += 1
            steepness[i] = length
            normals[i, 0], normals[i, 1], normals[i, 2] = nx / length, ny / length, nz / length
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
        along[i] = lag * stiffness * (lag + damping_time)
        normal_force[i] = normal * length
        force[i, 0], force[i, 1], force[i, 2] = normal * nx, normal * ny, normal * nz
        if not closed[i]:
            closed[i] = True
            anchor[i, 0], anchor[i, 1], anchor[i, 2] = px, py, pz
            stretch[i, 0] = stretch[i, 1] = stretch[i, 2] = 0.0
        # Friction, in the frame of the solid.
        a = rotation[0, 0] * u + rotation[1, 0] * v + rotation[2, 0] * w
        b = rotation[0, 1] * u + rotation[1, 1] * v + rotation[2, 1] * w
        c = rotation[0, 2] * u + rotation[1, 2] * v + rotation[2, 2] * w
        fx, fy, fz, cut = _hold(
            px - anchor[i, 0] + damping_time * a, py - anchor[i, 1] + damping_time * b,
            pz - anchor[i, 2] + damping_time * c, gx / length, gy / length, gz / length, shear,
            friction * normal_force[i],
        )
        across[i] = cut * lag * shear * (lag + damping_time)
        sticks[i] = cut == 1.0
        slid[0] += _stretch_on(
            i, px - anchor[i, 0], py - anchor[i, 1], pz - anchor[i, 2], gx / length, gy / length,
            gz / length, fx, fy, fz, shear, cut, stretch)
        if cut < 1.0:
            anchor[i, 0], anchor[i, 1], anchor[i, 2] = (
                px + fx / shear, py + fy / shear, pz + fz / shear)
        force[i, 0] += rotation[0, 0] * fx + rotation[0, 1] * fy + rotation[0, 2] * fz
        force[i, 1] += rotation[1, 0] * fx + rotation[1, 1] * fy + rotation[1, 2] * fz
        force[i, 2] += rotation[2, 0] * fx + rotation[2, 1] * fy + rotation[2, 2] * fz
    return count, depth_max, deepest, pressed[:pressed_count].copy()


@compiled
def _press(depth, rate, soft, thickness, stiffening, damping_time, lag):
    """Return normal force, not positive without contact, and stiffness of a vertex: Eq. C1."""
    if depth <= 0.0:
        return (soft * damping_time * (rate + depth / lag) if lag > 0.0 else 0.0), soft
    strain = depth / thickness
    pressure, slope = strain, 1.0
    if stiffening:
        bent = min(strain, STRAIN_MAX)
        slope = 1.0 / ((1.0 - bent) * (1.0 - bent))
        pressure = bent / (1.0 - bent) + (strain - bent) * slope
    return soft * (thickness * pressure + damping_time * slope * rate), soft * slope


@compiled
def _hold(ex, ey, ez, nx, ny, nz, shear, limit):
    """Return the friction of a shear e + τ ė along the surface, and the share kept: Eq. C2."""
    out = nx * ex + ny * ey + nz * ez
    fx, fy, fz = -shear * (ex - out * nx), -shear * (ey - out * ny), -shear * (ez - out * nz)
    size = np.sqrt(fx * fx + fy * fy + fz * fz)
    if size <= limit:
        return fx, fy, fz, 1.0
    cut = limit / size
    return cut * fx, cut * fy, cut * fz, cut


@compiled
def _stretch_on(i, ex, ey, ez, nx, ny, nz, fx, fy, fz, shear, cut, stretch):
    """Write the stretch of a friction spring; return what it spends as its tie slips [J]: Eq. E5.

    e is the way from the tie before it slips, F the friction.
    """
    out = nx * ex + ny * ey + nz * ez
    ex, ey, ez = ex - out * nx, ey - out * ny, ez - out * nz
    sx, sy, sz = stretch[i, 0], stretch[i, 1], stretch[i, 2]
    out = nx * sx + ny * sy + nz * sz
    spent = 0.5 * shear * out * out
    if cut < 1.0:
        kx, ky, kz = -fx / shear, -fy / shear, -fz / shear
        spent += 0.5 * shear * (
            (ex - kx) * (sx + kx) + (ey - ky) * (sy + ky) + (ez - kz) * (sz + kz))
        ex, ey, ez = kx, ky, kz
    stretch[i, 0], stretch[i, 1], stretch[i, 2] = ex, ey, ez
    return spent
