"""Contact of the skin with a flat, springy mattress."""

import numpy as np

from simcore.compiled import compiled


@compiled
def near_bed(vertices, height, half_length, half_width):
    """Return the skin vertices (l,) over the bed and lower than a height [m]."""
    near = np.empty(vertices.shape[0], np.int64)
    count = 0
    for i in range(vertices.shape[0]):
        if (vertices[i, 2] < height and abs(vertices[i, 0]) < half_length
                and abs(vertices[i, 1]) < half_width):
            near[count] = i
            count += 1
    return near[:count].copy()


@compiled
def bed_forces(
    listed, vertices, velocities, area, stiffness, damping_time, friction, slip_speed, lag, force,
    normal_force, along, across,
):
    """Write the force of a mattress with its upper side at z = 0 on each listed skin vertex.

        N = A max(K d + K τ ḋ, 0),  d = −z > 0;   F = −µ N v_t / max(‖v_t‖, ε)           (Eq. 14)

    Parameters
    ----------
    vertices, velocities : (n, 3) float64
        Of the skin, where listed [m, m/s].
    area : (n,) float64
        A of each skin vertex [m²].
    stiffness, damping_time, friction, slip_speed : float
        K [Pa/m], τ [s], µ and ε [m/s].
    lag : float
        Time after which an implicit step wants to know the force [s].
    force : (n, 3), normal_force : (n,) float64
        On the skin, and its normal part [N]; overwritten where listed.
    along, across : (n,) float64
        Impedance lag² K + lag D, normal and tangential [kg]; overwritten where listed.

    Returns
    -------
    contact_count : int
    depth_max : float
        [m]
    deepest : int
        Its skin vertex, −1 without contact.
    """
    count, depth_max, deepest = 0, 0.0, -1
    for i in listed:
        force[i, 0] = force[i, 1] = force[i, 2] = normal_force[i] = along[i] = across[i] = 0.0
        depth = -vertices[i, 2]
        if depth <= 0.0:
            continue
        count += 1
        if depth > depth_max:
            depth_max, deepest = depth, i
        normal = area[i] * stiffness * max(depth - damping_time * velocities[i, 2], 0.0)
        u, v = velocities[i, 0], velocities[i, 1]
        hold = friction * normal / max(np.sqrt(u * u + v * v), slip_speed)
        force[i, 0], force[i, 1], force[i, 2] = -hold * u, -hold * v, normal
        normal_force[i] = normal
        if normal > 0.0:
            along[i] = lag * (lag + damping_time) * area[i] * stiffness
            across[i] = lag * hold
    return count, depth_max, deepest


@compiled
def bed_energy(listed, vertices, area, stiffness):
    """Return Σ A K d²/2 of the mattress under the listed skin vertices [J]; Eq. 14."""
    stored = 0.0
    for i in listed:
        depth = max(-vertices[i, 2], 0.0)
        stored += 0.5 * area[i] * stiffness * depth * depth
    return stored


@compiled
def bed_power(
    listed, vertices, before, mean, area, stiffness, damping_time, friction, slip_speed, step,
    normal_force,
):
    """Return heat and friction of a mattress [W], and their implicit part [W]: Eq. E4.

    As `simcore.contact.foundation_energy.foundation_power`, of the law of `bed_forces`: its
    friction is viscous, with the viscosity of the velocities before.
    """
    heat = rubbed = implicit = 0.0
    for i in listed:
        depth = -vertices[i, 2]
        if depth <= 0.0:
            continue
        k, rate = area[i] * stiffness, -mean[i, 2]
        change = 2.0 * (before[i, 2] - mean[i, 2])
        if normal_force[i] > 0.0:
            heat += k * damping_time * rate * rate
            implicit += k * (0.25 * step + 0.5 * damping_time) * change * rate
        else:
            heat -= k * (depth + 0.25 * step * change) * rate
        u, v = before[i, 0], before[i, 1]
        hold = friction * normal_force[i] / max(np.sqrt(u * u + v * v), slip_speed)
        x, y = mean[i, 0], mean[i, 1]
        rubbed += hold * (x * x + y * y)
        implicit += hold * ((x - u) * x + (y - v) * y)
    return heat, rubbed, implicit
