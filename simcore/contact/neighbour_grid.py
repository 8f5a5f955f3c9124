"""Points in cubic cells: which is nearest to another, and how far a device is away."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from simcore.compiled import compiled, inlined

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


def build_clearance_grid(
    vertices: np.ndarray, edge: float, margin: float, sharp: float
) -> ClearanceGrid:
    """Return the grid around device vertices (N, 3) [m].

    Bounds are sharp within a distance [m]; beyond, they are taken between whole cells.
    """
    origin = vertices.min(axis=0) - margin
    shape = np.ceil((vertices.max(axis=0) + margin - origin) / edge).astype(np.int64)
    free = np.ones(shape, bool)
    free[tuple(((vertices - origin) / edge).astype(np.int64).T)] = False
    diagonal = edge * np.sqrt(3)
    clearance = np.maximum(distance_transform_edt(free) * edge - diagonal, 0.0)
    near = np.nonzero(clearance < sharp)
    centres = origin + (np.column_stack(near) + 0.5) * edge
    distance, _ = cKDTree(vertices).query(centres)
    clearance[near] = np.maximum(distance - diagonal / 2, 0.0)
    return ClearanceGrid(origin, edge, shape, clearance.ravel(), margin)


@compiled
def look_up_clearance(chosen, points, origin, edge, shape, clearance, margin, out):
    """Write a lower bound of the distance of chosen points from the device vertices [m].

    Points (n, 3) are in the device frame.
    """
    for i in chosen:
        a = int(np.floor((points[i, 0] - origin[0]) / edge))
        b = int(np.floor((points[i, 1] - origin[1]) / edge))
        c = int(np.floor((points[i, 2] - origin[2]) / edge))
        if 0 <= a < shape[0] and 0 <= b < shape[1] and 0 <= c < shape[2]:
            out[i] = clearance[(a * shape[1] + b) * shape[2] + c]
        else:
            out[i] = margin


@compiled
def nearest_within(low, shape, starts, vertex, point, points, chosen, known, reach):
    """Return distance [m] and index of the sorted vertex nearest to each chosen point.

    Parameters
    ----------
    low, shape, starts, vertex, point
        Of `sort_into_cells`.
    points : (m, 3) float64
        [m]
    chosen : (c,) int64
        Points to answer for.
    known : (c,) float64
        How far the nearest is at most [m]: infinite where nothing is known.
    reach : float
        Farther vertices are not looked for [m]: infinite, and −1.
    """
    near, square = np.empty(vertex.size + 1, np.int64), np.empty(vertex.size + 1)
    distance, nearest = np.full(chosen.size, np.inf), np.full(chosen.size, -1)
    for c in range(chosen.size):
        x, y, z = points[chosen[c], 0], points[chosen[c], 1], points[chosen[c], 2]
        radius = min(known[c] if known[c] < np.inf else SKIN_EDGE / 2, reach)
        while True:
            count, least = gather(point, low, shape, starts, x, y, z, radius, near, square)
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


@inlined
def gather(point, low, shape, starts, cx, cy, cz, radius, near, square):
    """Write the places, and squared distances, of the points in a ball; one more entry is needed.

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
    least, limit = np.inf, radius * radius
    if first_z >= last_z:
        last_x = first_x
    for i in range(first_x, last_x):
        for j in range(first_y, last_y):
            column = (i * shape[1] + j) * shape[2]
            start, end = starts[column + first_z], starts[column + last_z]
            for place in range(np.uint64(start), np.uint64(end)):
                dx = point[place, 0] - cx
                dy = point[place, 1] - cy
                dz = point[place, 2] - cz
                distance = dx * dx + dy * dy + dz * dz
                # Without a branch, which would be mispredicted half of the times.
                near[count] = place
                square[count] = distance
                inside = distance <= limit
                count += inside
                least = min(least, distance if inside else np.inf)
    return count, least


@compiled
def sort_into_cells(skin, chosen):
    """Return the chosen vertices (n, 3) sorted by cubic cell.

    Returns
    -------
    low : (3,) float64
        Lowest corner [m].
    shape : (3,) int64
    starts : (cells + 1,) int64
    vertex : (c,) int64, point : (c, 3) float64
        Cell by cell [m].
    """
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
