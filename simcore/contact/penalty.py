"""Penalty contact and regularised friction at device vertices: Eqs. 6 and 7 with the errata."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.neighbours import to_world, vertex_normal


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
    """
    slot = np.empty(vertices.shape[0], np.int32)
    known = np.zeros(listed.size, np.bool_)
    for place in range(listed.size):
        i = listed[place]
        slot[i] = place
        force[i, 0] = force[i, 1] = force[i, 2] = 0.0
        normal_force[i] = 0.0
    contact_count = 0
    depth_max = 0.0
    deepest = -1
    for r in range(rows.size):
        point_force[rows[r]] = 0.0
        px, py, pz = to_world(device_vertices, rows[r], rotation, position)
        nearest = np.inf
        i = -1
        for e in range(offsets[r], offsets[r + 1]):
            s = candidates[e]
            square = ((vertices[s, 0] - px) ** 2 + (vertices[s, 1] - py) ** 2
                      + (vertices[s, 2] - pz) ** 2)
            if square < nearest:
                nearest = square
                i = s
        if nearest > search_radius * search_radius:
            continue
        place = slot[i]
        if not known[place]:
            nx, ny, nz = vertex_normal(vertices, i, ring_offsets, ring_next)
            normals[i, 0] = -nx
            normals[i, 1] = -ny
            normals[i, 2] = -nz
            known[place] = True
        nx, ny, nz = -normals[i, 0], -normals[i, 1], -normals[i, 2]
        depth = (nx * (vertices[i, 0] - px) + ny * (vertices[i, 1] - py)
                 + nz * (vertices[i, 2] - pz))
        if depth <= 0.0:
            continue
        contact_count += 1
        if depth > depth_max:
            depth_max = depth
            deepest = i
        ax, ay, az = px - position[0], py - position[1], pz - position[2]
        wx, wy, wz = angular_velocity[0], angular_velocity[1], angular_velocity[2]
        vx = velocities[i, 0] - linear_velocity[0] - (wy * az - wz * ay)
        vy = velocities[i, 1] - linear_velocity[1] - (wz * ax - wx * az)
        vz = velocities[i, 2] - linear_velocity[2] - (wx * ay - wy * ax)
        rate = nx * vx + ny * vy + nz * vz
        normal = max(stiffness * depth + damping * rate, 0.0)
        tx, ty, tz = vx - rate * nx, vy - rate * ny, vz - rate * nz
        speed = np.sqrt(tx * tx + ty * ty + tz * tz)
        friction = friction_force / max(speed, friction_velocity)
        force[i, 0] -= normal * nx + friction * tx
        force[i, 1] -= normal * ny + friction * ty
        force[i, 2] -= normal * nz + friction * tz
        normal_force[i] += normal
        point_force[rows[r]] = normal
    return contact_count, depth_max, deepest
