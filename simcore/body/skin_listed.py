"""Skinning of listed vertices only, and its transpose: the fast path of `simcore.body.skin`."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array, eye_array

from simcore.body.skin import Skin
from simcore.compiled import compiled, inlined
from simcore.four import first_three, four_of, put_four, put_three, spread, three_of, turned

_ONE = np.uint64(1)  # numba would make a float of an unsigned index and 1


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
    frames = _columns(rotations, positions)
    for each in listed:
        i, place = np.uint64(each), spread(0.0)
        for k in range(np.uint64(offsets[i]), np.uint64(offsets[i + _ONE])):
            j = np.uint64(segments[k])
            place = place + spread(weights[k]) * _placed_by(frames, j, three_of(points, k))
        put_three(place, vertices, i)


@compiled
def blend_motion_listed(
    listed, offsets, segments, weights, points, rotations, positions, local_velocities, vertices,
    velocities,
):
    """Write positions (Eq. 3) and velocities (Eq. 8) of the listed vertices.

    `local_velocities` (m, 6) are each segment's linear and angular velocity in its own axes, so
    that v̇_i = Σ_j α_ij R_j (ẋ_j + ω_j × p_ij).
    """
    frames, motions = _columns(rotations, positions), _columns_of_motion(local_velocities)
    for each in listed:
        i, place, velocity = np.uint64(each), spread(0.0), spread(0.0)
        for k in range(np.uint64(offsets[i]), np.uint64(offsets[i + _ONE])):
            j, weight, point = np.uint64(segments[k]), spread(weights[k]), three_of(points, k)
            place = place + weight * _placed_by(frames, j, point)
            velocity = velocity + weight * _turned_by(frames, j, _own_velocity(motions, j, point))
        put_three(place, vertices, i)
        put_three(velocity, velocities, i)


@compiled
def blend_velocity_listed(
    listed, offsets, segments, weights, points, rotations, local_velocities, velocities,
):
    """Write the velocities of the listed vertices as `blend_motion_listed` does."""
    frames = _columns(rotations, np.zeros((rotations.shape[0], 3)))
    motions = _columns_of_motion(local_velocities)
    for each in listed:
        i, velocity = np.uint64(each), spread(0.0)
        for k in range(np.uint64(offsets[i]), np.uint64(offsets[i + _ONE])):
            j, weight, point = np.uint64(segments[k]), spread(weights[k]), three_of(points, k)
            velocity = velocity + weight * _turned_by(frames, j, _own_velocity(motions, j, point))
        put_three(velocity, velocities, i)


@compiled
def _columns(rotations, positions):
    """Return the columns of [R | x] of each segment, and 0 (4 m, 4)."""
    columns = np.zeros((4 * rotations.shape[0], 4))
    for j in range(rotations.shape[0]):
        for a in range(3):
            for b in range(3):
                columns[4 * j + b, a] = rotations[j, a, b]
            columns[4 * j + 3, a] = positions[j, a]
    return columns


@compiled
def _columns_of_motion(local_velocities):
    """Return linear velocity, (ω_y, ω_z, ω_x) and (ω_z, ω_x, ω_y) of each segment (3 m, 4)."""
    columns = np.zeros((3 * local_velocities.shape[0], 4))
    for j in range(local_velocities.shape[0]):
        for a in range(3):
            columns[3 * j, a] = local_velocities[j, a]
            columns[3 * j + 1, a] = local_velocities[j, 3 + (a + 1) % 3]
            columns[3 * j + 2, a] = local_velocities[j, 3 + (a + 2) % 3]
    return columns


@inlined
def _turned_by(frames, segment, vector):
    """Return R v, by the columns of a segment's frame."""
    first = np.uint64(4) * segment
    x, y, z = first_three(vector)
    return (
        four_of(frames, first) * spread(x) + four_of(frames, first + _ONE) * spread(y)
    ) + four_of(frames, first + np.uint64(2)) * spread(z)


@inlined
def _placed_by(frames, segment, point):
    """Return R p + x, likewise."""
    return _turned_by(frames, segment, point) + four_of(
        frames, np.uint64(4) * segment + np.uint64(3))


@inlined
def _own_velocity(motions, segment, point):
    """Return ẋ + ω × p in the axes of a segment, by its columns of motion."""
    first, next_to = np.uint64(3) * segment, turned(point)
    return (
        four_of(motions, first) + four_of(motions, first + _ONE) * turned(next_to)
    ) - four_of(motions, first + np.uint64(2)) * next_to


@compiled
def wrench_listed(listed, offsets, segments, weights, points, rotations, force, wrench):
    """Write force and moment about each segment's origin (m, 6) of forces on listed vertices."""
    frames = _columns(rotations, np.zeros((rotations.shape[0], 3)))
    # Of each segment, force and (m_z, m_x, m_y).
    sums = np.zeros((2 * rotations.shape[0], 4))
    for each in listed:
        i = np.uint64(each)
        push = three_of(force, i)
        fx, fy, fz = first_three(push)
        if fx == 0.0 and fy == 0.0 and fz == 0.0:
            continue
        turned_push = turned(push)
        for k in range(np.uint64(offsets[i]), np.uint64(offsets[i + _ONE])):
            j, weight = np.uint64(segments[k]), spread(weights[k])
            arm = _turned_by(frames, j, three_of(points, k))
            moment = arm * turned_push - turned(arm) * push
            first, second = np.uint64(2) * j, np.uint64(2) * j + _ONE
            put_four(four_of(sums, first) + weight * push, sums, first)
            put_four(four_of(sums, second) + weight * moment, sums, second)
    for j in range(wrench.shape[0]):
        for a in range(3):
            wrench[j, a] = sums[2 * j, a]
            wrench[j, 3 + a] = sums[2 * j + 1, (a + 1) % 3]


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
