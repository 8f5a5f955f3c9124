"""Penalty contact and regularised friction at device vertices: Eqs. 6 and 7 with the errata."""

import numpy as np
from numba import njit

from simcore.compiled import compiled
from simcore.contact.neighbour_rows import to_world, vertex_normal


@compiled
def penalty_forces(
    rows, offsets, candidates, listed, vertices, velocities, ring_offsets, ring_next,
    device_vertices, rotation, position, linear_velocity, angular_velocity, stiffness, damping,
    friction_force, friction_velocity, search_radius, force, normal_force, normals, point_force,
):
    """Write the contact force on each listed skin vertex.

    For device vertex p_k and the nearest skin vertex v with outward normal n (section V.A):

        d = n·(v − p),  V = v̇ − ṗ
        f = −max(k d + c n·V, 0) n                                       (Eq. 6)
            − F_c V_t / max(‖V_t‖, ε),  V_t = V − (n·V) n                (Eq. 7)

    where d > 0. The penalty pushes and never pulls.

    Parameters
    ----------
    rows, offsets, candidates, listed
        Inner list of `simcore.contact.neighbours.Neighbours`.
    vertices, velocities : (n, 3) float64
        Skin in the world [m, m/s]; valid where listed.
    device_vertices : (N, 3) float64
        Device frame [m].
    rotation, position, linear_velocity, angular_velocity
        Of the device frame in the world.
    stiffness, damping : float
        k [N/m] and c [N·s/m] of one contact.
    friction_force, friction_velocity : float
        F_c [N] and ε [m/s].
    search_radius : float
        Farther neighbours are no contact [m].
    force : (n, 3) float64
        On the skin, world axes [N]; overwritten where listed.
    normal_force : (n,) float64
        Its normal part, as a pressure would have it [N]; overwritten where listed.
    normals : (n, 3) float64
        Direction −n in which that pushes, world axes; overwritten where near a device vertex.
    point_force : (N,) float64
        The same on each device vertex [N]; overwritten where in `rows`.

    Returns
    -------
    contact_count : int
    depth_max : float
        Deepest d [m].
    deepest : int
        Skin vertex of the deepest contact, −1 without contact.
    fastest : float
        Greatest ‖V‖ of any contact [m/s].
    """
    known = np.zeros(vertices.shape[0], np.bool_)
    for i in listed:
        force[i, 0] = force[i, 1] = force[i, 2] = 0.0
        normal_force[i] = 0.0
    contact_count, depth_max, deepest, fastest = 0, 0.0, -1, 0.0
    for r in range(rows.size):
        point_force[rows[r]] = 0.0
        p = to_world(device_vertices, rows[r], rotation, position)
        i, square = _nearest(candidates, offsets[r], offsets[r + 1], vertices, p)
        if square > search_radius * search_radius:
            continue
        if not known[i]:
            nx, ny, nz = vertex_normal(vertices, i, ring_offsets, ring_next)
            normals[i, 0], normals[i, 1], normals[i, 2] = -nx, -ny, -nz
            known[i] = True
        n = (-normals[i, 0], -normals[i, 1], -normals[i, 2])
        depth = (n[0] * (vertices[i, 0] - p[0]) + n[1] * (vertices[i, 1] - p[1])
                 + n[2] * (vertices[i, 2] - p[2]))
        if depth <= 0.0:
            continue
        contact_count += 1
        if depth > depth_max:
            depth_max, deepest = depth, i
        v = _relative_velocity(velocities, i, p, position, linear_velocity, angular_velocity)
        fastest = max(fastest, v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        normal, back = _law(depth, n, v, stiffness, damping, friction_force, friction_velocity)
        for a in range(3):
            force[i, a] -= back[a]
        normal_force[i] += normal
        point_force[rows[r]] = normal
    return contact_count, depth_max, deepest, np.sqrt(fastest)


@njit(inline="always")
def _nearest(candidates, start, end, vertices, point):
    """Return which candidate is nearest to a point (x, y, z), and its squared distance."""
    nearest, square = -1, np.inf
    for e in range(start, end):
        s = candidates[e]
        here = ((vertices[s, 0] - point[0]) ** 2 + (vertices[s, 1] - point[1]) ** 2
                + (vertices[s, 2] - point[2]) ** 2)
        nearest = s if here < square else nearest
        square = min(here, square)
    return nearest, square


@njit(inline="always")
def _relative_velocity(velocities, i, point, position, linear, angular):
    """Return the velocity of skin vertex i seen from a point that moves with the device."""
    ax, ay, az = point[0] - position[0], point[1] - position[1], point[2] - position[2]
    return (
        velocities[i, 0] - linear[0] - (angular[1] * az - angular[2] * ay),
        velocities[i, 1] - linear[1] - (angular[2] * ax - angular[0] * az),
        velocities[i, 2] - linear[2] - (angular[0] * ay - angular[1] * ax),
    )


@njit(inline="always")
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
