"""Skinning of listed vertices only, and its transpose: the fast path of `simcore.body.skin`."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array, eye_array

from simcore.body.skin import Skin
from simcore.compiled import compiled


@lru_cache(maxsize=4)
def segment_balls(skin: Skin, segment_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return centre (m, 3) and radius (m,) of a ball around each segment's skin [m]."""
    centre, radius = np.zeros((segment_count, 3)), np.zeros(segment_count)
    for j in range(segment_count):
        points = skin.influence_point[skin.influence_segment == j]
        centre[j] = (points.min(axis=0) + points.max(axis=0)) / 2
        radius[j] = np.linalg.norm(points - centre[j], axis=1).max()
    return centre, radius


@dataclass(frozen=True, eq=False)
class SkinParts:
    """The skin of each segment in slices across its length.

    What turns about a joint moves less near it: bounds of the motion are closer slice by slice.

    Attributes
    ----------
    offsets : (m + 1,) int64
        Parts of each segment.
    of_influence : (e,) int64
        Part of each entry of `Skin.influence_segment`.
    centre : (p, 3), radius : (p,) float64
        Ball around each part, segment frame [m].
    """

    offsets: np.ndarray
    of_influence: np.ndarray
    centre: np.ndarray
    radius: np.ndarray


def skin_parts(skin: Skin, segment_count: int, length: float) -> SkinParts:
    """Return parts no longer than a length [m]."""
    offsets, of_influence = [0], np.empty(len(skin.influence_segment), np.int64)
    centre, radius = [], []
    for j in range(segment_count):
        entries = np.flatnonzero(skin.influence_segment == j)
        points = skin.influence_point[entries]
        low, size = points.min(axis=0), np.ptp(points, axis=0)
        axis = int(size.argmax())
        slices = int(np.ceil(size[axis] / length))
        place = np.minimum(
            ((points[:, axis] - low[axis]) / size[axis] * slices).astype(np.int64), slices - 1
        )
        for each in np.unique(place):
            inside = points[place == each]
            centre.append((inside.min(axis=0) + inside.max(axis=0)) / 2)
            radius.append(np.linalg.norm(inside - centre[-1], axis=1).max())
            of_influence[entries[place == each]] = len(radius) - 1
        offsets.append(len(radius))
    return SkinParts(np.array(offsets), of_influence, np.array(centre), np.array(radius))


def edge_change_rate(
    skin: Skin, rest_vertices: np.ndarray, of_influence: np.ndarray, radius: np.ndarray
) -> np.ndarray:
    """Return how much the edges at each vertex can change per motion of the skin around it (n,).

    Where no skin of a part moves by more than m, its segment's frame turns by at most m/r, r being
    the radius of the part. So by Eq. 3 an edge from i to b, of length e at rest, changes by at most
    m (e/r + w (1 + e/r)), with w = Σ_j |α_bj − α_ij| over the segments j.

    Parameters
    ----------
    skin : Skin
    rest_vertices : (n, 3)
        Skin in any pose it was blended from [m].
    of_influence : (e,), radius : (p,)
        As of `SkinParts`; or whole segments and the radius of their skin [m].
    """
    count = skin.vertex_count
    owner = np.repeat(np.arange(count), np.diff(skin.influence_offsets))
    centre = np.repeat(np.arange(count), np.diff(skin.ring_offsets))
    weights = np.zeros((count, int(skin.influence_segment.max()) + 1))
    weights[owner, skin.influence_segment] = skin.influence_weight
    turning = np.zeros(count)
    np.maximum.at(turning, owner, 1 / radius[of_influence])
    rate = np.zeros(count)
    for near in skin.ring_next.T:
        edge = np.linalg.norm(rest_vertices[near] - rest_vertices[centre], axis=1)
        turn = edge * np.maximum(turning[near], turning[centre])
        change = np.abs(weights[near] - weights[centre]).sum(axis=1)
        np.maximum.at(rate, centre, turn + change * (1 + turn))
    return rate


@lru_cache(maxsize=4)
def two_rings(skin: Skin) -> tuple[np.ndarray, np.ndarray]:
    """Return offsets (n + 1,), and the vertices within two edges of each, itself among them."""
    near = csr_array(
        (np.ones(len(skin.ring_next), bool), skin.ring_next[:, 0], skin.ring_offsets),
        shape=(skin.vertex_count, skin.vertex_count),
    ) + eye_array(skin.vertex_count, dtype=bool, format="csr")
    twice = near @ near
    return twice.indptr, twice.indices


@compiled
def blend_listed(listed, offsets, segments, weights, points, rotations, positions, vertices):
    """Write the positions of the listed vertices into `vertices` (n, 3): Eq. 3.

    Of indices that are unsigned it need not be asked whether they count from the end, which took
    a third of the time.
    """
    frames = np.empty((rotations.shape[0], 12))
    for j in range(frames.shape[0]):
        for a in range(3):
            for b in range(3):
                frames[j, 3 * a + b] = rotations[j, a, b]
            frames[j, 9 + a] = positions[j, a]
    for i in listed:
        x = y = z = 0.0
        for k in range(np.uint64(offsets[i]), np.uint64(offsets[i + 1])):
            j = np.uint64(segments[k])
            p, q, r, w = points[k, 0], points[k, 1], points[k, 2], weights[k]
            x += w * (frames[j, 0] * p + frames[j, 1] * q + frames[j, 2] * r + frames[j, 9])
            y += w * (frames[j, 3] * p + frames[j, 4] * q + frames[j, 5] * r + frames[j, 10])
            z += w * (frames[j, 6] * p + frames[j, 7] * q + frames[j, 8] * r + frames[j, 11])
        vertices[i, 0] = x
        vertices[i, 1] = y
        vertices[i, 2] = z


@compiled
def blend_motion_listed(
    listed, offsets, segments, weights, points, rotations, positions, local_velocities, vertices,
    velocities,
):
    """Write positions (Eq. 3) and velocities (Eq. 8) of the listed vertices.

    `local_velocities` (m, 6) are each segment's linear and angular velocity in its own axes, so
    that v̇_i = Σ_j α_ij R_j (ẋ_j + ω_j × p_ij).
    """
    frames = np.empty((rotations.shape[0], 18))
    for j in range(frames.shape[0]):
        for a in range(3):
            for b in range(3):
                frames[j, 3 * a + b] = rotations[j, a, b]
            frames[j, 9 + a] = positions[j, a]
        for a in range(6):
            frames[j, 12 + a] = local_velocities[j, a]
    for i in listed:
        x = y = z = 0.0
        u = v = w = 0.0
        for k in range(np.uint64(offsets[i]), np.uint64(offsets[i + 1])):
            j = np.uint64(segments[k])
            p, q, r, weight = points[k, 0], points[k, 1], points[k, 2], weights[k]
            lx = frames[j, 12] + frames[j, 16] * r - frames[j, 17] * q
            ly = frames[j, 13] + frames[j, 17] * p - frames[j, 15] * r
            lz = frames[j, 14] + frames[j, 15] * q - frames[j, 16] * p
            x += weight * (frames[j, 0] * p + frames[j, 1] * q + frames[j, 2] * r + frames[j, 9])
            y += weight * (frames[j, 3] * p + frames[j, 4] * q + frames[j, 5] * r + frames[j, 10])
            z += weight * (frames[j, 6] * p + frames[j, 7] * q + frames[j, 8] * r + frames[j, 11])
            u += weight * (frames[j, 0] * lx + frames[j, 1] * ly + frames[j, 2] * lz)
            v += weight * (frames[j, 3] * lx + frames[j, 4] * ly + frames[j, 5] * lz)
            w += weight * (frames[j, 6] * lx + frames[j, 7] * ly + frames[j, 8] * lz)
        vertices[i, 0] = x
        vertices[i, 1] = y
        vertices[i, 2] = z
        velocities[i, 0] = u
        velocities[i, 1] = v
        velocities[i, 2] = w


@compiled
def blend_velocity_listed(
    listed, offsets, segments, weights, points, rotations, local_velocities, velocities,
):
    """Write the velocities of the listed vertices as `blend_motion_listed` does."""
    frames = np.empty((rotations.shape[0], 15))
    for j in range(frames.shape[0]):
        for a in range(3):
            for b in range(3):
                frames[j, 3 * a + b] = rotations[j, a, b]
        for a in range(6):
            frames[j, 9 + a] = local_velocities[j, a]
    for i in listed:
        u = v = w = 0.0
        for k in range(np.uint64(offsets[i]), np.uint64(offsets[i + 1])):
            j = np.uint64(segments[k])
            p, q, r, weight = points[k, 0], points[k, 1], points[k, 2], weights[k]
            lx = frames[j, 9] + frames[j, 13] * r - frames[j, 14] * q
            ly = frames[j, 10] + frames[j, 14] * p - frames[j, 12] * r
            lz = frames[j, 11] + frames[j, 12] * q - frames[j, 13] * p
            u += weight * (frames[j, 0] * lx + frames[j, 1] * ly + frames[j, 2] * lz)
            v += weight * (frames[j, 3] * lx + frames[j, 4] * ly + frames[j, 5] * lz)
            w += weight * (frames[j, 6] * lx + frames[j, 7] * ly + frames[j, 8] * lz)
        velocities[i, 0] = u
        velocities[i, 1] = v
        velocities[i, 2] = w


@compiled
def wrench_listed(listed, offsets, segments, weights, points, rotations, force, wrench):
    """Write force and moment about each segment's origin (m, 6) of forces on listed vertices."""
    wrench[:] = 0.0
    turns = np.empty((rotations.shape[0], 9))
    for j in range(turns.shape[0]):
        for a in range(3):
            for b in range(3):
                turns[j, 3 * a + b] = rotations[j, a, b]
    for i in listed:
        fx, fy, fz = force[i, 0], force[i, 1], force[i, 2]
        if fx == 0.0 and fy == 0.0 and fz == 0.0:
            continue
        for k in range(np.uint64(offsets[i]), np.uint64(offsets[i + 1])):
            j = np.uint64(segments[k])
            p, q, r, weight = points[k, 0], points[k, 1], points[k, 2], weights[k]
            x = turns[j, 0] * p + turns[j, 1] * q + turns[j, 2] * r
            y = turns[j, 3] * p + turns[j, 4] * q + turns[j, 5] * r
            z = turns[j, 6] * p + turns[j, 7] * q + turns[j, 8] * r
            wrench[j, 0] += weight * fx
            wrench[j, 1] += weight * fy
            wrench[j, 2] += weight * fz
            wrench[j, 3] += weight * (y * fz - z * fy)
            wrench[j, 4] += weight * (z * fx - x * fz)
            wrench[j, 5] += weight * (x * fy - y * fx)


@compiled
def total_force(wrench):
    """Return the sum of the forces of wrenches (m, 6) [N]."""
    force = np.zeros(3)
    for j in range(wrench.shape[0]):
        for a in range(3):
            force[a] += wrench[j, a]
    return force


@compiled
def torque_of_wrenches(wrench, positions, jacobian, parents, first_dof, dof_count, torque):
    """Write τ = J_Bᵀ (f, m) (nv,) of wrenches about the segment origins (m, 6): Eqs. 10 to 12.

    A joint's columns of the world Jacobian (6, nv) see the summed wrench of its whole subtree,
    taken about the world origin.
    """
    total = wrench.copy()
    for j in range(total.shape[0]):
        x, y, z = positions[j, 0], positions[j, 1], positions[j, 2]
        total[j, 3] += y * wrench[j, 2] - z * wrench[j, 1]
        total[j, 4] += z * wrench[j, 0] - x * wrench[j, 2]
        total[j, 5] += x * wrench[j, 1] - y * wrench[j, 0]
    for j in range(total.shape[0] - 1, -1, -1):
        for column in range(first_dof[j], first_dof[j] + dof_count[j]):
            value = 0.0
            for a in range(6):
                value += jacobian[a, column] * total[j, a]
            torque[column] = value
        if parents[j] >= 0:
            total[parents[j]] += total[j]
