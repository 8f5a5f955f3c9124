"""Penalty contact and regularised friction at device vertices: Eqs. 6 and 7 with the errata."""

import numpy as np

from simcore.compiled import compiled, inlined
from simcore.contact.eight import EIGHT, nearest_of_eight
from simcore.contact.normals import vertex_normal


@compiled
def find_contacts(
    patches, first, last, near, points, point_index, skin, ring_offsets, ring_next, search_radius,
    outward,
):
    """Return where d_k = n·(v − p) > 0 for the nearest skin vertex (section V.A), device frame.

    Parameters
    ----------
    patches, first, last, near
        Of `simcore.contact.neighbours.Neighbours`.
    points, point_index
        Of `simcore.contact.device_patches.Patches`.
    skin : (n, 3) float64
        Valid where listed [m].
    search_radius : float
        Farther neighbours are no contact [m].
    outward : (n, 3) float64
        Normals, overwritten where nearest to a point.

    Returns
    -------
    point : (c,) int64, vertex : (c,) int64, depth : (c,) float64
        Contact points k, idx(k) and d_k [m].
    touched : (t,) int64
        Skin vertices of these, each once.
    """
    point, vertex = np.empty((2, EIGHT * patches.size), np.int64)
    depth, count = np.empty(EIGHT * patches.size), 0
    touched, touched_count = np.empty(EIGHT * patches.size, np.int64), 0
    square, index = np.empty(EIGHT), np.empty(EIGHT, np.int64)
    known, touches = np.zeros((2, skin.shape[0]), np.bool_)
    for a in range(patches.size):
        patch = patches[a]
        nearest_of_eight(points, patch, skin, near, first[a], last[a], square, index)
        for k in range(EIGHT):
            if index[k] < 0 or square[k] > search_radius * search_radius:
                continue
            i = np.uint64(index[k])
            if not known[i]:
                outward[i, 0], outward[i, 1], outward[i, 2] = vertex_normal(
                    skin, i, ring_offsets, ring_next)
                known[i] = True
            inside = (
                outward[i, 0] * (skin[i, 0] - points[patch, 0, k])
                + outward[i, 1] * (skin[i, 1] - points[patch, 1, k])
                + outward[i, 2] * (skin[i, 2] - points[patch, 2, k]))
            if inside <= 0.0:
                continue
            point[count], vertex[count], depth[count] = point_index[patch, k], i, inside
            count += 1
            touched[touched_count] = i
            touched_count += not touches[i]
            touches[i] = True
    return point[:count], vertex[:count], depth[:count], touched[:touched_count]


@compiled
def penalty_forces(
    point, vertex, depth, touched, velocities, outward, device_points, rotation, linear_velocity,
    angular_velocity, stiffness, damping, friction_force, friction_velocity, force, normal_force,
    normals,
):
    """Write the contact force on each skin vertex that is touched.

    For device point p_k and the nearest skin vertex v with outward normal n (section V.A):

        d = n·(v − p),  V = v̇ − ṗ
        f = −max(k d + c n·V, 0) n                                       (Eq. 6)
            − F_c V_t / max(‖V_t‖, ε),  V_t = V − (n·V) n                (Eq. 7)

    The penalty pushes and never pulls.

    Parameters
    ----------
    point, vertex, depth, touched, outward
        Of `find_contacts`.
    velocities : (n, 3) float64
        Of the skin against the world, in the axes of the device, where touched [m/s].
    device_points : (N, 3) float64
        Device frame [m].
    rotation, linear_velocity, angular_velocity
        Of the device frame in the world; world axes [m/s, rad/s].
    stiffness, damping : float
        k [N/m] and c [N·s/m] of one contact.
    friction_force, friction_velocity : float
        F_c [N] and ε [m/s].
    force : (n, 3) float64
        On the skin, world axes [N]; overwritten where touched.
    normal_force : (n,) float64
        Its normal part, as a pressure would have it [N]; overwritten where touched.
    normals : (n, 3) float64
        Direction −n in which that pushes, world axes; overwritten where touched.

    Returns
    -------
    on_point : (c,) float64
        The normal part of each contact [N].
    deepest : int
        Contact of the greatest depth, −1 without any.
    fastest : float
        Greatest ‖V‖ of any contact [m/s].
    """
    for i in touched:
        force[i, 0] = force[i, 1] = force[i, 2] = normal_force[i] = 0.0
    linear = _in_axes(rotation, linear_velocity)
    turn = _in_axes(rotation, angular_velocity)
    on_point, deepest, fastest = np.empty(point.size), -1, 0.0
    for c in range(point.size):
        i, k = np.uint64(vertex[c]), np.uint64(point[c])
        if deepest < 0 or depth[c] > depth[deepest]:
            deepest = c
        x, y, z = device_points[k, 0], device_points[k, 1], device_points[k, 2]
        v = (velocities[i, 0] - linear[0] - (turn[1] * z - turn[2] * y),
             velocities[i, 1] - linear[1] - (turn[2] * x - turn[0] * z),
             velocities[i, 2] - linear[2] - (turn[0] * y - turn[1] * x))
        fastest = max(fastest, v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        n = outward[i, 0], outward[i, 1], outward[i, 2]
        normal, back = _law(depth[c], n, v, stiffness, damping, friction_force, friction_velocity)
        for a in range(3):
            force[i, a] -= back[a]
        normal_force[i] += normal
        on_point[c] = normal
    for i in touched:
        x, y, z = force[i, 0], force[i, 1], force[i, 2]
        u, v, w = outward[i, 0], outward[i, 1], outward[i, 2]
        for a in range(3):
            force[i, a] = rotation[a, 0] * x + rotation[a, 1] * y + rotation[a, 2] * z
            normals[i, a] = -(rotation[a, 0] * u + rotation[a, 1] * v + rotation[a, 2] * w)
    return on_point, deepest, np.sqrt(fastest)


@inlined
def _in_axes(rotation, vector):
    """Return a vector of the world in the axes of a frame."""
    x, y, z = vector[0], vector[1], vector[2]
    return (rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
            rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
            rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z)


@inlined
def _law(depth, n, v, stiffness, damping, friction_force, friction_velocity):
    """Return the size of Eq. 6, and −f of both equations, for a relative velocity v."""
    rate = n[0] * v[0] + n[1] * v[1] + n[2] * v[2]
    normal = max(stiffness * depth + damping * rate, 0.0)
    tx, ty, tz = v[0] - rate * n[0], v[1] - rate * n[1], v[2] - rate * n[2]
    speed = np.sqrt(tx * tx + ty * ty + tz * tz)
    friction = friction_force / max(speed, friction_velocity)
    return normal, (
        normal * n[0] + friction * tx, normal * n[1] + friction * ty, normal * n[2] + friction * tz
    )
