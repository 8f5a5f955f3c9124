"""What the flesh of a foundation contact stores and spends (Eqs. C1 and C2, E3 and E4)."""

from simcore.compiled import compiled
from simcore.contact.distance_lookup import distance_and_gradient, seen_from
from simcore.contact.layer import (
    SHEAR_SHARE,
    pressure_and_slope,
    work_of_pressing,
    work_of_strain,
)


@compiled
def foundation_energy(
    listed, points, values, origin, spacing, rotation, position, area, soft, modulus, thickness,
    give, stiffening, anchor, closed,
):
    """Return the energy of pressed and sheared flesh [J], parameters as in `foundation_forces`.

        A ∫ p dd + A p′(0)/3 ‖e‖² / 2                                                    (Eq. E3)
    """
    stored = 0.0
    for i in listed:
        px, py, pz = seen_from(rotation, position, points, i)
        distance, gx, gy, gz = distance_and_gradient(values, origin, spacing, px, py, pz)
        if distance < 0.0:
            stored += area[i] * work_of_pressing(
                -distance, modulus[i], thickness[i], give, stiffening)
        if closed[i]:
            ex, ey, ez = px - anchor[i, 0], py - anchor[i, 1], pz - anchor[i, 2]
            out = gx * ex + gy * ey + gz * ez
            square = ex * ex + ey * ey + ez * ez - out * out / max(
                gx * gx + gy * gy + gz * gz, 1e-12)
            stored += 0.5 * SHEAR_SHARE * soft[i] * square
    return stored


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
