"""What the flesh of a foundation contact stores and spends (Eqs. C1 and C2, E3 and E4)."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.distance_lookup import AT_ONCE, look_up, seen_from
from simcore.contact.layer import (
    SHEAR_SHARE,
    pressure_and_slope,
    work_of_pressing,
    work_of_strain,
)

# Rows of what the energy is made of; before them the point, of vectors the first of three.
ANCHOR, SPRING, PRESSURE, MODULUS, THICKNESS, DISTANCE, ENERGY_ROWS = 3, 6, 7, 8, 9, 10, 14


@compiled
def foundation_energy(
    listed, points, values, origin, spacing, rotation, position, area, soft, modulus, thickness,
    give, stiffening, anchor, closed,
):
    """Return the energy of pressed and sheared flesh [J], parameters as in `foundation_forces`.

        A ∫ p dd + A p′(0)/3 ‖e‖² / 2                                                    (Eq. E3)
    """
    stored = 0.0
    rows = np.empty((ENERGY_ROWS, AT_ONCE))
    for first in range(0, listed.size, AT_ONCE):
        block = listed[first : first + AT_ONCE]
        last = np.uint64(block.size)
        for p in range(block.size):
            i = block[p]
            rows[0, p], rows[1, p], rows[2, p] = seen_from(rotation, position, points, i)
            for a in range(3):
                rows[ANCHOR + a, p] = anchor[i, a]
            rows[SPRING, p] = 0.5 * SHEAR_SHARE * soft[i] if closed[i] else 0.0
            rows[MODULUS, p], rows[THICKNESS, p] = modulus[i], thickness[i]
        look_up(values, origin, spacing, rows[:ANCHOR], last, rows[DISTANCE:])
        _stretch_and_press(rows, last, give, stiffening)
        for p in range(block.size):
            depth = -rows[DISTANCE, p]
            if depth > 0.0:
                stored += area[block[p]] * work_of_pressing(
                    depth, rows[PRESSURE, p], rows[MODULUS, p], rows[THICKNESS, p], give,
                    stiffening)
            stored += rows[SPRING, p]
    return stored


@compiled
def _stretch_and_press(rows, last, give, stiffening):
    """Write the pressures, and energies of friction springs over their half stiffness."""
    x, y, z, ax, ay, az = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    phi, gx, gy, gz = (
        rows[DISTANCE], rows[DISTANCE + 1], rows[DISTANCE + 2], rows[DISTANCE + 3])
    spring, pressed, modulus, thickness = (
        rows[SPRING], rows[PRESSURE], rows[MODULUS], rows[THICKNESS])
    for p in range(np.uint64(0), last):
        ex, ey, ez, n0, n1, n2 = x[p] - ax[p], y[p] - ay[p], z[p] - az[p], gx[p], gy[p], gz[p]
        half, depth = spring[p], -phi[p]
        pressure, _ = pressure_and_slope(depth, modulus[p], thickness[p], give, stiffening)
        out = n0 * ex + n1 * ey + n2 * ez
        square = ex * ex + ey * ey + ez * ez - out * out / max(n0 * n0 + n1 * n1 + n2 * n2, 1e-12)
        pressed[p] = pressure
        spring[p] = half * square


@compiled
def foundation_power(
    pressed, points, before, mean, position, linear_velocity, turn, area, soft, modulus, thickness,
    give, stiffening, damping_time, lag, step, depths, steepness, normals, normal_force, along,
    sticks,
):
    """Return what flesh turns into heat [W], and the implicit part of its own laws [W].

    With the rates of a step's mean velocity (Eq. E4):

        A τ p′(d) ḋ²,   −A p ḋ where N is cut to zero,   A p′(0) τ/3 ‖ė‖² where friction sticks

    Parameters
    ----------
    pressed : (l,) int64
        Skin vertices that bear force or are inside.
    before, mean : (n, 3) float64
        Velocities of the skin, where pressed, that the forces were told and that the step took
        [m/s].
    step : float
        [s]
    depths, steepness, normals, normal_force, along, sticks
        As `foundation_forces` wrote them.
    Others
        As in `foundation_forces`.

    Returns
    -------
    heat, implicit : float
        The latter is (h/4 K + 1/2 D) Δv · v̄ of all vertices, by which the forces half-way fall
        short of their laws over the whole step.
    """
    heat = implicit = 0.0
    for i in pressed:
        x, y, z = (points[i, 0] - position[0], points[i, 1] - position[1],
                   points[i, 2] - position[2])
        u = mean[i, 0] - linear_velocity[0] - turn[1] * z + turn[2] * y
        v = mean[i, 1] - linear_velocity[1] - turn[2] * x + turn[0] * z
        w = mean[i, 2] - linear_velocity[2] - turn[0] * y + turn[1] * x
        # Twice the way from the velocity before to the mean one is the change over the step.
        du, dv, dw = (2.0 * (mean[i, 0] - before[i, 0]), 2.0 * (mean[i, 1] - before[i, 1]),
                      2.0 * (mean[i, 2] - before[i, 2]))
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        normal, normal_change = nx * u + ny * v + nz * w, nx * du + ny * dv + nz * dw
        # φ̇ and its change.
        out, change = steepness[i] * normal, steepness[i] * normal_change
        depth, tau = depths[i], damping_time[i]
        spring_part, damper_part = 0.25 * step, 0.5 * tau
        if depth > 0.0 and normal_force[i] > 0.0:
            stiffness = along[i] / (lag * (lag + tau))
            heat += tau * stiffness * out * out
            implicit += (spring_part + damper_part) * stiffness * change * out
        elif depth > 0.0:
            pressure, slope = pressure_and_slope(
                depth, modulus[i], thickness[i], give, stiffening)
            heat += area[i] * (pressure - spring_part * slope * change) * out
        elif normal_force[i] > 0.0:
            heat += soft[i] * tau * (out - depth / lag) * out
            implicit += damper_part * soft[i] * change * out
        if normal_force[i] > 0.0:
            shear = SHEAR_SHARE * soft[i]
            square = u * u + v * v + w * w - normal * normal
            aside = u * du + v * dv + w * dw - normal * normal_change
            implicit += spring_part * shear * aside
            if sticks[i]:
                heat += tau * shear * square
                implicit += damper_part * shear * aside
    return heat, implicit


@compiled
def energy_between(
    active, vertex, position, skin, normal, thickness, area, modulus, stiffening, stiffness,
    tangential_stiffness, anchor, sticks,
):
    """Return the energy of flesh between sheet vertices and their skin vertices [J]: Eq. E3.

    Without a modulus it is that of the planes' springs (Eqs. S5 and S6).

    Parameters
    ----------
    active : (m,) bool
        Sheet vertices that have a plane.
    vertex : (m,) int64
        Their skin vertices.
    position : (m, 3), skin : (n, 3) float64
        Of sheet and skin [m].
    normal : (m, 3) float64
    thickness, modulus : (n,) float64
        Of the flesh [m, Pa]; no modulus where there is none.
    area : (m,) float64
        Of the sheet vertices [m²].
    stiffness, tangential_stiffness : (m,) float64
        Of the planes [N/m].
    anchor : (m, 3) float64
        Where the tangential springs are tied [m].
    sticks : bool
        Whether there are any.
    """
    stored = 0.0
    for p in range(active.size):
        if not active[p]:
            continue
        i = vertex[p]
        depth = out = square = 0.0
        for a in range(3):
            depth -= normal[p, a] * (position[p, a] - skin[i, a])
            way = position[p, a] - anchor[p, a]
            out += normal[p, a] * way
            square += way * way
        if depth > 0.0:
            if modulus.size == 0:
                stored += 0.5 * stiffness[p] * depth * depth
            else:
                most = thickness[i]
                stored += area[p] * modulus[i] * most * work_of_strain(depth / most, stiffening)
        if sticks:
            stored += 0.5 * tangential_stiffness[p] * (square - out * out)
    return stored
