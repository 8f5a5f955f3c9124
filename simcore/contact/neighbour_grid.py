"""Which skin vertices are, or can be, nearest to which points: a search over cubic cells."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from simcore.compiled import compiled

SKIN_EDGE = 0.03
"""Edge of the cells that skin vertices are sorted into [m]; tuned for time, without effect on the
result (docs/performance.md)."""


@dataclass(frozen=True, eq=False)
class ClearanceGrid:
    """Distance from a rigid device on cubic cells, at rest in the device frame.

    Attributes
    ----------
    origin : (3,) float64
        Lowest corner [m].
    edge : float
        Of a cell [m].
    shape : (3,) int64
    clearance : (cells,) float64
        Lower bound of the distance from any point of the cell to any device vertex [m].
    margin : float
        Lower bound of that distance outside the grid [m].
    """

    origin: np.ndarray
    edge: float
    shape: np.ndarray
    clearance: np.ndarray
    margin: float


def build_clearance_grid(vertices: np.ndarray, edge: float, margin: float) -> ClearanceGrid:
    """Return the grid around device vertices (N, 3) [m]."""
    origin = vertices.min(axis=0) - margin
    shape = np.ceil((vertices.max(axis=0) + margin - origin) / edge).astype(np.int64)
    centres = origin + (np.indices(tuple(shape)).reshape(3, -1).T + 0.5) * edge
    distance, _ = cKDTree(vertices).query(centres)
    clearance = np.maximum(distance - edge * np.sqrt(3) / 2, 0)
    return ClearanceGrid(origin, edge, shape, clearance, margin)


@compiled
def to_device(points, rotation, position, out):
    """Write world points (n, 3) in the device frame."""
    for i in range(points.shape[0]):
        x, y, z = (points[i, 0] - position[0], points[i, 1] - position[1],
                   points[i, 2] - position[2])
        for a in range(3):
            out[i, a] = rotation[0, a] * x + rotation[1, a] * y + rotation[2, a] * z


@compiled
def look_up_clearance(points, origin, edge, shape, clearance, margin, out):
    """Write a lower bound of each point's distance from the device vertices [m].

    Points (n, 3) are in the device frame.
    """
    for i in range(points.shape[0]):
        a = int(np.floor((points[i, 0] - origin[0]) / edge))
        b = int(np.floor((points[i, 1] - origin[1]) / edge))
        c = int(np.floor((points[i, 2] - origin[2]) / edge))
        if 0 <= a < shape[0] and 0 <= b < shape[1] and 0 <= c < shape[2]:
            out[i] = clearance[(a * shape[1] + b) * shape[2] + c]
        else:
            out[i] = margin


@dataclass(frozen=True, eq=False)
class Patches:
    """Device vertices in small groups that lie together.

    Attributes
    ----------
    offsets : (p + 1,) int64
    vertex : (N,) int64
        Device vertices, patch by patch.
    centre : (p, 3), radius : (p,) float64
        A ball around each patch [m].
    """

    offsets: np.ndarray
    vertex: np.ndarray
    centre: np.ndarray
    radius: np.ndarray


def build_patches(vertices: np.ndarray, edge: float) -> Patches:
    """Return the vertices (N, 3) [m] grouped by cubic cells of an edge [m]."""
    cell = np.floor((vertices - vertices.min(axis=0)) / edge).astype(np.int64)
    _, patch, counts = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(patch, kind="stable")
    offsets = np.concatenate([[0], np.cumsum(counts)])
    low = np.minimum.reduceat(vertices[order], offsets[:-1])
    high = np.maximum.reduceat(vertices[order], offsets[:-1])
    centre = (low + high) / 2
    distance = np.linalg.norm(vertices - centre[patch], axis=1)
    return Patches(offsets, order, centre, np.maximum.reduceat(distance[order], offsets[:-1]))


@compiled
def near_pairs(
    skin, chosen, device, patch_offsets, patch_vertex, patch_centre, patch_radius, radius, slack
):
    """Return for each device vertex the skin vertices that can be its nearest one.

    A device vertex whose nearest chosen skin vertex is d₁ ≤ radius + slack away keeps all chosen
    skin vertices within d₁ + 2·slack: while no skin vertex moves by more than `slack` in the
    device frame, the nearest of all is among them.

    Parameters
    ----------
    skin : (n, 3), device : (N, 3) float64
        Device frame [m].
    chosen : (c,) int64
        Skin vertices to consider.
    patch_offsets, patch_vertex, patch_centre, patch_radius
        See `Patches`.
    radius, slack : float
        [m].

    Returns
    -------
    rows : (r,) int64
        Device vertices with such a neighbour.
    offsets : (r + 1,) int64
    candidates : (offsets[-1],) int64
        Skin vertices of each row.
    """
    rows = np.empty(device.shape[0], np.int64)
    offsets = np.zeros(device.shape[0] + 1, np.int64)
    if chosen.size == 0:
        return rows[:0].copy(), offsets[:1].copy(), rows[:0].copy()
    low, shape, starts, vertex, point = _sort_into_cells(skin, chosen)
    x, y, z = np.empty(chosen.size), np.empty(chosen.size), np.empty(chosen.size)
    near = np.empty(chosen.size, np.int64)
    square = np.empty(chosen.size)
    candidates = np.empty(16 * 1024, np.int64)
    row_count = 0
    total = 0
    reach = radius + slack
    for patch in range(patch_radius.size):
        cx, cy, cz = patch_centre[patch, 0], patch_centre[patch, 1], patch_centre[patch, 2]
        ball = patch_radius[patch]
        count, nearest = _gather(
            point, low, shape, starts, cx, cy, cz, reach + 2 * slack + ball, near, square
        )
        if nearest > (reach + ball) ** 2:
            continue
        # From anywhere in the patch the nearest is at most d + r away, d being seen from its
        # centre; what can matter is then at most d + 2r + 2·slack from the centre.
        limit = (np.sqrt(nearest) + 2 * ball + 2 * slack) ** 2
        kept = 0
        for e in range(count):
            if square[e] <= limit:
                place = near[e]
                near[kept] = vertex[place]
                x[kept], y[kept], z[kept] = point[place, 0], point[place, 1], point[place, 2]
                kept += 1
        for entry in range(patch_offsets[patch], patch_offsets[patch + 1]):
            k = patch_vertex[entry]
            px, py, pz = device[k, 0], device[k, 1], device[k, 2]
            nearest = np.inf
            for e in range(kept):
                distance = (x[e] - px) ** 2 + (y[e] - py) ** 2 + (z[e] - pz) ** 2
                square[e] = distance
                if distance < nearest:
                    nearest = distance
            if nearest > reach * reach:
                continue
            limit = (np.sqrt(nearest) + 2 * slack) ** 2
            while total + kept > candidates.size:
                candidates = np.concatenate((candidates, candidates))
            for e in range(kept):
                if square[e] <= limit:
                    candidates[total] = near[e]
                    total += 1
            rows[row_count] = k
            row_count += 1
            offsets[row_count] = total
    return rows[:row_count].copy(), offsets[: row_count + 1].copy(), candidates[:total].copy()


@compiled
def nearest_within(skin, points, chosen, reach):
    """Return distance [m] and index of the skin vertex nearest to each chosen point.

    Parameters
    ----------
    skin : (n, 3), points : (m, 3) float64
        [m]
    chosen : (c,) int64
        Points to answer for.
    reach : float
        Farther skin is not looked for [m]: infinite, and −1.
    """
    low, shape, starts, vertex, point = _sort_into_cells(skin, np.arange(skin.shape[0]))
    near, square = np.empty(skin.shape[0], np.int64), np.empty(skin.shape[0])
    distance, nearest = np.full(chosen.size, np.inf), np.full(chosen.size, -1)
    for c in range(chosen.size):
        x, y, z = points[chosen[c], 0], points[chosen[c], 1], points[chosen[c], 2]
        radius = min(SKIN_EDGE, reach)
        while True:
            count, least = _gather(point, low, shape, starts, x, y, z, radius, near, square)
            if count:
                distance[c] = np.sqrt(least)
                for e in range(count):
                    if square[e] == least:
                        nearest[c] = vertex[near[e]]
                        break
                break
            if radius == reach:
                break
            radius = min(2 * radius, reach)
    return distance, nearest


@njit(inline="always")
def _gather(point, low, shape, starts, cx, cy, cz, radius, near, square):
    """Write the places, and squared distances, of the points in a ball.

    Returns their number and the least squared distance. In line, because passing the arrays would
    cost more than the search.
    """
    first_x = max(int(np.floor((cx - radius - low[0]) / SKIN_EDGE)), 0)
    last_x = min(int(np.floor((cx + radius - low[0]) / SKIN_EDGE)) + 1, shape[0])
    first_y = max(int(np.floor((cy - radius - low[1]) / SKIN_EDGE)), 0)
    last_y = min(int(np.floor((cy + radius - low[1]) / SKIN_EDGE)) + 1, shape[1])
    first_z = max(int(np.floor((cz - radius - low[2]) / SKIN_EDGE)), 0)
    last_z = min(int(np.floor((cz + radius - low[2]) / SKIN_EDGE)) + 1, shape[2])
    count = 0
    least = np.inf
    if first_z >= last_z:
        last_x = first_x
    for i in range(first_x, last_x):
        for j in range(first_y, last_y):
            column = (i * shape[1] + j) * shape[2]
            for place in range(starts[column + first_z], starts[column + last_z]):
                dx = point[place, 0] - cx
                dy = point[place, 1] - cy
                dz = point[place, 2] - cz
                distance = dx * dx + dy * dy + dz * dz
                if distance <= radius * radius:
                    near[count] = place
                    square[count] = distance
                    count += 1
                    if distance < least:
                        least = distance
    return count, least


@compiled
def _sort_into_cells(skin, chosen):
    """Return the chosen skin vertices sorted by cubic cell: lowest corner, shape, cell starts,
    vertex and position of each."""
    edge = SKIN_EDGE
    low = np.full(3, np.inf)
    high = np.full(3, -np.inf)
    for i in chosen:
        for a in range(3):
            low[a] = min(low[a], skin[i, a])
            high[a] = max(high[a], skin[i, a])
    shape = np.empty(3, np.int64)
    for a in range(3):
        shape[a] = int((high[a] - low[a]) / edge) + 1
    cell = np.empty(chosen.size, np.int64)
    starts = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    for e in range(chosen.size):
        i = chosen[e]
        cell[e] = (
            int((skin[i, 0] - low[0]) / edge) * shape[1] + int((skin[i, 1] - low[1]) / edge)
        ) * shape[2] + int((skin[i, 2] - low[2]) / edge)
        starts[cell[e] + 1] += 1
    for e in range(starts.size - 1):
        starts[e + 1] += starts[e]
    fill = starts[:-1].copy()
    vertex = np.empty(chosen.size, np.int64)
    point = np.empty((chosen.size, 3))
    for e in range(chosen.size):
        place = fill[cell[e]]
        fill[cell[e]] += 1
        vertex[place] = chosen[e]
        for a in range(3):
            point[place, a] = skin[chosen[e], a]
    return low, shape, starts, vertex, point
