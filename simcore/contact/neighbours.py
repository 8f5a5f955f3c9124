"""Exact nearest-vertex search at little cost: two levels of neighbour lists (Verlet 1967).

Each list holds the device vertices that can touch the skin, and for each of them the skin vertices
that can be its nearest. The inner list, of little slack, is cut from the outer. Each is valid
while no segment has moved, in the device frame, by more than its allowance; the lists then still
hold idx(k) of section V.A wherever d_k can be positive, equal to a search over all pairs.
"""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.neighbour_grid import (
    build_clearance_grid,
    build_patches,
    look_up_clearance,
    near_pairs,
    to_device,
)
from simcore.contact.segment_motion import motion_bound, write_relative

OUTER_SLACK, INNER_SLACK = 0.005, 0.001
"""Motion that each list allows before it is made again [m]; tuned for time, without effect on
the result (docs/performance.md)."""

CLEARANCE_EDGE, CLEARANCE_MARGIN, PATCH_EDGE = 0.02, 0.3, 0.03
"""Edge of the clearance grid's cells, its margin around the device, and edge of the device's
patches [m]; tuned likewise."""


class Neighbours:
    """Neighbour lists between a skin and a rigid device.

    Parameters
    ----------
    device_vertices : (N, 3) float64
        Device frame [m].
    influence_offsets, influence_segment
        Skin as in `simcore.body.skin.Skin`.
    ring_offsets, ring_next
        One-ring of each skin vertex, likewise.
    edge_change_rate : (n,) float64
        How much the edges at each vertex can change per motion of the skin around it, 1.
    segment_centre : (m, 3), segment_radius : (m,) float64
        Ball around the skin of each segment, segment frame [m].
    search_radius : float
        Device vertices farther than this from the skin are free [m].

    Attributes
    ----------
    rows, offsets, candidates
        Inner list: device vertices, and the skin vertices that can be their nearest, as CSR.
    listed : (l,) int64
        Skin vertices that the inner list needs posed, one-rings included.
    """

    def __init__(
        self,
        device_vertices: np.ndarray,
        influence_offsets: np.ndarray,
        influence_segment: np.ndarray,
        ring_offsets: np.ndarray,
        ring_next: np.ndarray,
        edge_change_rate: np.ndarray,
        segment_centre: np.ndarray,
        segment_radius: np.ndarray,
        search_radius: float,
    ):
        self._device_vertices = device_vertices
        self._influences = influence_offsets, influence_segment
        self._rings = ring_offsets, ring_next
        self._search_radius = search_radius
        self._edge_change_rate = edge_change_rate
        self._grid = build_clearance_grid(device_vertices, CLEARANCE_EDGE, CLEARANCE_MARGIN)
        patches = build_patches(device_vertices, PATCH_EDGE)
        self._patches = patches.offsets, patches.vertex, patches.centre, patches.radius
        self._spheres = segment_centre, segment_radius
        segment_count = len(segment_radius)
        self._outer_allowance = np.zeros(segment_count)
        self._inner_allowance = np.zeros(segment_count)
        self._outer_pose = np.zeros((segment_count, 3, 4))
        self._inner_pose = np.zeros((segment_count, 3, 4))
        self._clearance = np.empty(len(influence_offsets) - 1)
        self._skin_in_device = np.empty((len(influence_offsets) - 1, 3))
        self._all = np.arange(len(influence_offsets) - 1)
        self._stale = True
        self.rebuilds = np.zeros(2, dtype=np.int64)  # outer, inner

    def update(self, rotations, positions, device, pose, vertices) -> None:
        """Make the lists valid for the present poses.

        Parameters
        ----------
        rotations : (m, 3, 3), positions : (m, 3)
            Segment frames in the world.
        device : DeviceState-like
            `rotation`, `position` of the device frame in the world.
        pose : callable
            `pose(indices)` writes these skin vertices' positions into `vertices`.
        vertices : (n, 3) float64
            World positions of the skin vertices [m], overwritten where needed.
        """
        outer_used, inner_used = (True, True) if self._stale else _used_up(
            rotations, positions, device.rotation, device.position, *self._spheres,
            self._outer_pose, self._outer_allowance, self._inner_pose, self._inner_allowance,
        )
        if outer_used:
            self._build_outer(rotations, positions, device, pose, vertices)
        if outer_used or inner_used:
            self._build_inner(rotations, positions, device, pose, vertices)
        self._stale = False

    def _build_outer(self, rotations, positions, device, pose, vertices) -> None:
        grid, (offsets, segments) = self._grid, self._influences
        pose(self._all)
        to_device(vertices, device.rotation, device.position, self._skin_in_device)
        look_up_clearance(
            self._skin_in_device, grid.origin, grid.edge, grid.shape, grid.clearance, grid.margin,
            self._clearance,
        )
        near = near_pairs(
            self._skin_in_device,
            np.flatnonzero(self._clearance <= self._search_radius + 3 * OUTER_SLACK),
            self._device_vertices,
            *self._patches,
            self._search_radius,
            OUTER_SLACK,
        )
        self._outer = self._can_touch(near, vertices, device, OUTER_SLACK)
        self._outer_listed = _with_rings(self._outer[2], *self._rings, len(vertices))
        write_relative(
            rotations, positions, device.rotation, device.position, self._outer_pose
        )
        # A segment whose skin is far from the device may move by as much as it is far.
        nearest, used = nearest_by_segment(
            offsets, segments, self._clearance, self._outer_listed, len(rotations)
        )
        far = np.maximum(OUTER_SLACK, nearest - self._search_radius)
        self._outer_allowance = np.where(used, OUTER_SLACK, far)
        self._inner_allowance = np.where(used, INNER_SLACK, far)
        self.rebuilds[0] += 1

    def _build_inner(self, rotations, positions, device, pose, vertices) -> None:
        pose(self._outer_listed)
        self.rows, self.offsets, self.candidates = self._can_touch(
            self._outer, vertices, device, INNER_SLACK
        )
        self.listed = _with_rings(self.candidates, *self._rings, len(vertices))
        write_relative(
            rotations, positions, device.rotation, device.position, self._inner_pose
        )
        self.rebuilds[1] += 1

    def _can_touch(self, pairs, vertices, device, slack):
        return _can_touch(
            *pairs, vertices, *self._rings, self._edge_change_rate, self._device_vertices,
            device.rotation, device.position, slack,
        )


@compiled
def _used_up(
    rotations, positions, rotation, position, centre, radius, outer_pose, outer_allowance,
    inner_pose, inner_allowance,
):
    """Return whether any segment's skin may have moved beyond its outer, and inner, allowance."""
    now = np.empty((rotations.shape[0], 3, 4))
    write_relative(rotations, positions, rotation, position, now)
    inner = False
    for j in range(now.shape[0]):
        if motion_bound(now[j], outer_pose[j], centre[j], radius[j]) > outer_allowance[j]:
            return True, True
        if motion_bound(now[j], inner_pose[j], centre[j], radius[j]) > inner_allowance[j]:
            inner = True
    return False, inner


@compiled
def _with_rings(chosen, ring_offsets, ring_next, count):
    """Return the chosen vertices and their one-rings, sorted, each once."""
    chosen_before = np.zeros(count, np.bool_)
    mark = np.zeros(count, np.bool_)
    for s in chosen:
        if not chosen_before[s]:
            chosen_before[s] = mark[s] = True
            for e in range(ring_offsets[s], ring_offsets[s + 1]):
                mark[ring_next[e, 0]] = True
                mark[ring_next[e, 1]] = True
    return np.flatnonzero(mark)


@compiled
def vertex_normal(vertices, i, ring_offsets, ring_next):
    """Return the area-weighted unit normal of skin vertex i."""
    nx = ny = nz = 0.0
    for e in range(ring_offsets[i], ring_offsets[i + 1]):
        b, c = ring_next[e, 0], ring_next[e, 1]
        ux, uy, uz = (vertices[b, 0] - vertices[i, 0], vertices[b, 1] - vertices[i, 1],
                      vertices[b, 2] - vertices[i, 2])
        wx, wy, wz = (vertices[c, 0] - vertices[i, 0], vertices[c, 1] - vertices[i, 1],
                      vertices[c, 2] - vertices[i, 2])
        nx += uy * wz - uz * wy
        ny += uz * wx - ux * wz
        nz += ux * wy - uy * wx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    return nx / length, ny / length, nz / length


@compiled
def normal_change(vertices, i, ring_offsets, ring_next, edge_change):
    """Return a bound of how far the unit normal of skin vertex i moves when the skin is deformed.

    The normal is that of N = Σ u × w over the ring. Where no edge changes by more than δ
    (`edge_change` [m]), N changes by at most ΔN = Σ δ (|u| + |w| + δ), and its direction by at most
    √2 ΔN/|N| if ΔN < |N|.
    """
    nx = ny = nz = 0.0
    change = 0.0
    for e in range(ring_offsets[i], ring_offsets[i + 1]):
        b, c = ring_next[e, 0], ring_next[e, 1]
        ux, uy, uz = (vertices[b, 0] - vertices[i, 0], vertices[b, 1] - vertices[i, 1],
                      vertices[b, 2] - vertices[i, 2])
        wx, wy, wz = (vertices[c, 0] - vertices[i, 0], vertices[c, 1] - vertices[i, 1],
                      vertices[c, 2] - vertices[i, 2])
        nx += uy * wz - uz * wy
        ny += uz * wx - ux * wz
        nz += ux * wy - uy * wx
        change += edge_change * (np.sqrt(ux * ux + uy * uy + uz * uz)
                                 + np.sqrt(wx * wx + wy * wy + wz * wz) + edge_change)
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    return np.sqrt(2.0) * change / length if change < length else 2.0


@compiled
def _can_touch(
    rows, offsets, candidates, vertices, ring_offsets, ring_next, edge_change_rate, device_vertices,
    rotation, position, slack,
):
    """Return the rows of the outer list, and of each the candidates, that can matter for contact.

    While the skin moves by at most `slack`, v − p changes by at most that and n by at most Δ (see
    `normal_change`); so d = n·(v − p) of a candidate can become positive only if it is above
    −slack − |v − p| Δ now.
    """
    normals = np.empty((vertices.shape[0], 4))
    known = np.zeros(vertices.shape[0], np.bool_)
    kept_rows = np.empty(rows.size, np.int64)
    kept_offsets = np.zeros(rows.size + 1, np.int64)
    kept = np.empty(candidates.size, np.int64)
    count = 0
    total = 0
    for r in range(rows.size):
        k = rows[r]
        px, py, pz = to_world(device_vertices, k, rotation, position)
        nearest = np.inf
        for e in range(offsets[r], offsets[r + 1]):
            s = candidates[e]
            square = ((vertices[s, 0] - px) ** 2 + (vertices[s, 1] - py) ** 2
                      + (vertices[s, 2] - pz) ** 2)
            nearest = min(nearest, square)
        reach = (np.sqrt(nearest) + 2 * slack) ** 2
        touches = False
        start = total
        for e in range(offsets[r], offsets[r + 1]):
            s = candidates[e]
            dx, dy, dz = vertices[s, 0] - px, vertices[s, 1] - py, vertices[s, 2] - pz
            square = dx * dx + dy * dy + dz * dz
            if square > reach:
                continue
            kept[total] = s
            total += 1
            if touches:
                continue
            if not known[s]:
                nx, ny, nz = vertex_normal(vertices, s, ring_offsets, ring_next)
                normals[s, 0], normals[s, 1], normals[s, 2] = nx, ny, nz
                normals[s, 3] = normal_change(
                    vertices, s, ring_offsets, ring_next, slack * edge_change_rate[s]
                )
                known[s] = True
            depth = normals[s, 0] * dx + normals[s, 1] * dy + normals[s, 2] * dz
            touches = depth >= -slack - np.sqrt(square) * normals[s, 3]
        if touches:
            kept_rows[count] = k
            count += 1
            kept_offsets[count] = total
        else:
            total = start
    return kept_rows[:count].copy(), kept_offsets[: count + 1].copy(), kept[:total].copy()


@compiled
def nearest_by_segment(offsets, segments, clearance, listed, segment_count):
    """Return each segment's least skin clearance [m], and whether it carries a listed vertex."""
    nearest = np.full(segment_count, np.inf)
    used = np.zeros(segment_count, np.bool_)
    for i in range(clearance.size):
        for e in range(offsets[i], offsets[i + 1]):
            nearest[segments[e]] = min(nearest[segments[e]], clearance[i])
    for i in listed:
        for e in range(offsets[i], offsets[i + 1]):
            used[segments[e]] = True
    return nearest, used


@compiled
def to_world(points, k, rotation, position):
    """Return point k of a frame in the world."""
    x, y, z = points[k, 0], points[k, 1], points[k, 2]
    return (
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z + position[0],
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z + position[1],
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z + position[2],
    )
