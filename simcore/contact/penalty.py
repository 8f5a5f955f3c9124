"""Penalty contact and regularised friction at device vertices: Eqs. 6 and 7 with the errata."""

import numpy as np

from simcore.compiled import compiled, inlined
from simcore.contact.eight import EIGHT, nearest_of_eight
from simcore.contact.normals import write_normals

SIDEWAYS = 0.5
"""What a motion along the skin counts for in the length of steps (Eq. I4): it makes other vertices
the nearest, and those lie ten times as far apart as skin moves in a step."""


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
    # One thing after another for all points: in one loop, whether a normal is known and whether a
    # point touches would be guessed wrong by the machine as often as not.
    index, square = np.empty((patches.size, EIGHT), np.int64), np.empty((patches.size, EIGHT))
    for a in range(patches.size):
        nearest_of_eight(points, patches[a], skin, near, first[a], last[a], square[a], index[a])
    nearest = index.ravel()
    write_normals(_each_once(nearest, skin.shape[0]), skin, ring_offsets, ring_next, outward)
    inside = _depths(patches, points, skin, index, square, search_radius, outward).ravel()
    met = _where_positive(inside)
    point, vertex = np.empty((2, met.size), np.int64)
    depth = np.empty(met.size)
    for c in range(met.size):
        e = np.uint64(met[c])
        a, k = e // np.uint64(EIGHT), e % np.uint64(EIGHT)
        point[c], vertex[c], depth[c] = point_index[np.uint64(patches[a]), k], nearest[e], inside[e]
    return point, vertex, depth, _each_once(vertex, skin.shape[0])


@compiled
def _depths(patches, points, skin, index, square, search_radius, outward):
    """Return n·(v − p) of all points of the patches (a, 8), 0 without a neighbour [m]."""
    depth, farthest = np.empty(index.shape), search_radius * search_radius
    for a in range(patches.size):
        patch = np.uint64(patches[a])
        for k in range(EIGHT):
            i = np.uint64(max(index[a, k], 0))
            inside = (
                outward[i, 0] * (skin[i, 0] - points[patch, 0, k])
                + outward[i, 1] * (skin[i, 1] - points[patch, 1, k])
                + outward[i, 2] * (skin[i, 2] - points[patch, 2, k]))
            depth[a, k] = inside if square[a, k] <= farthest else 0.0
    return depth


@compiled
def _where_positive(numbers):
    """Return the places of what is positive."""
    found, count = np.empty(numbers.size, np.int64), 0
    for e in range(numbers.size):
        found[count] = e
        count += numbers[e] > 0.0
    return found[:count]


@compiled
def _each_once(vertices, vertex_count):
    """Return the vertices that are not −1 in their order, each once."""
    found, count = np.empty(vertices.size, np.int64), 0
    known, before = np.zeros(vertex_count, np.bool_), np.int64(-1)
    for i in vertices:
        if i != before and i >= 0:  # many follow their equals: these need not be looked up
            found[count] = i
            count += not known[np.uint64(i)]
            known[np.uint64(i)] = True
        before = i
    return found[:count]


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
        V of Eq. I4: the greatest speed of any contact, sideways counted as `SIDEWAYS` [m/s].
    """
    v, n, back = np.empty((3, 3, point.size))
    _write_motion(
        point, vertex, velocities, outward, device_points, _in_axes(rotation, linear_velocity),
        _in_axes(rotation, angular_velocity), v, n,
    )
    squared_pace, on_point = np.empty((2, point.size))
    _write_laws(
        depth, v[0], v[1], v[2], n[0], n[1], n[2], stiffness, damping, friction_force,
        friction_velocity, squared_pace, on_point, back[0], back[1], back[2],
    )
    for i in touched:
        force[i, 0] = force[i, 1] = force[i, 2] = normal_force[i] = 0.0
    deepest, fastest = -1, 0.0
    for c in range(point.size):
        i = np.uint64(vertex[c])
        for a in range(3):
            force[i, a] -= back[a, c]
        normal_force[i] += on_point[c]
        if deepest < 0 or depth[c] > depth[deepest]:
            deepest = c
        fastest = max(fastest, squared_pace[c])
    for i in touched:
        x, y, z = force[i, 0], force[i, 1], force[i, 2]
        nx, ny, nz = outward[i, 0], outward[i, 1], outward[i, 2]
        for a in range(3):
            force[i, a] = rotation[a, 0] * x + rotation[a, 1] * y + rotation[a, 2] * z
            normals[i, a] = -(rotation[a, 0] * nx + rotation[a, 1] * ny + rotation[a, 2] * nz)
    return on_point, deepest, np.sqrt(fastest)


@compiled
def _write_motion(
    point, vertex, velocities, outward, device_points, linear, turn, motion, normal
):
    """Write V and n of each contact, coordinate by coordinate (3, c), for laws to be vectorised."""
    for c in range(point.size):
        i, k = np.uint64(vertex[c]), np.uint64(point[c])
        x, y, z = device_points[k, 0], device_points[k, 1], device_points[k, 2]
        motion[0, c] = velocities[i, 0] - linear[0] - (turn[1] * z - turn[2] * y)
        motion[1, c] = velocities[i, 1] - linear[1] - (turn[2] * x - turn[0] * z)
        motion[2, c] = velocities[i, 2] - linear[2] - (turn[0] * y - turn[1] * x)
        normal[0, c], normal[1, c], normal[2, c] = outward[i, 0], outward[i, 1], outward[i, 2]


@compiled
def _write_laws(
    depth, vx, vy, vz, nx, ny, nz, stiffness, damping, friction_force, friction_velocity,
    squared_pace, pressed, back_x, back_y, back_z,
):
    """Write the square of V of Eq. I4, the size of Eq. 6, and −f of both, of each contact (c,)."""
    for c in range(depth.size):
        rate = nx[c] * vx[c] + ny[c] * vy[c] + nz[c] * vz[c]
        push = stiffness * depth[c] + damping * rate
        push = push if push > 0.0 else 0.0  # in one instruction, as `max` is not
        tx, ty, tz = vx[c] - rate * nx[c], vy[c] - rate * ny[c], vz[c] - rate * nz[c]
        squared = tx * tx + ty * ty + tz * tz
        speed = np.sqrt(squared)
        squared_pace[c] = rate * rate + SIDEWAYS * SIDEWAYS * squared
        friction = friction_force / (speed if speed > friction_velocity else friction_velocity)
        pressed[c] = push
        back_x[c] = push * nx[c] + friction * tx
        back_y[c] = push * ny[c] + friction * ty
        back_z[c] = push * nz[c] + friction * tz


@inlined
def _in_axes(rotation, vector):
    """Return a vector of the world in the axes of a frame."""
    x, y, z = vector[0], vector[1], vector[2]
    return (rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
            rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
            rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z)
