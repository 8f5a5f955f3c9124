"""Where a triangulated surface pierces itself."""

import numpy as np

from simcore.body.scalar_product import dot
from simcore.compiled import compiled


def piercing_faces(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Flags (f,) of the triangles crossed by an edge they share no corner with, and of that edge's.

    Triangles that meet only in a common plane do not count.
    """
    corners = points[faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    origin, cell = points.min(axis=0), (high - low).mean() * 2
    shape = ((points.max(axis=0) - origin) / cell).astype(np.int64) + 1
    first = ((low - origin) / cell).astype(np.int64)
    last = ((high - origin) / cell).astype(np.int64)
    starts, members = _fill_cells(first, last, shape)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return _crossed(points, faces, normals, low, high, first, last, shape, starts, members)


@compiled
def _fill_cells(first, last, shape):
    """The triangles `members[starts[c]:starts[c + 1]]` whose boxes reach into each cell c."""
    starts = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    members = np.empty(0, np.int32)
    for filling in (False, True):
        for f in range(len(first)):
            for i in range(first[f, 0], last[f, 0] + 1):
                for j in range(first[f, 1], last[f, 1] + 1):
                    for k in range(first[f, 2], last[f, 2] + 1):
                        cell = (i * shape[1] + j) * shape[2] + k
                        if filling:
                            starts[cell] -= 1
                            members[starts[cell]] = f
                        else:
                            starts[cell] += 1
        if not filling:
            starts = np.cumsum(starts)
            members = np.empty(starts[-1], np.int32)
    return starts, members


@compiled
def _crossed(points, faces, normals, low, high, first, last, shape, starts, members):
    flags = np.zeros(len(faces), np.bool_)
    for f in range(len(faces)):
        for i in range(first[f, 0], last[f, 0] + 1):
            for j in range(first[f, 1], last[f, 1] + 1):
                for k in range(first[f, 2], last[f, 2] + 1):
                    cell = (i * shape[1] + j) * shape[2] + k
                    for g in members[starts[cell] : starts[cell + 1]]:
                        if g <= f or (
                            low[f, 0] > high[g, 0] or low[g, 0] > high[f, 0]
                            or low[f, 1] > high[g, 1] or low[g, 1] > high[f, 1]
                            or low[f, 2] > high[g, 2] or low[g, 2] > high[f, 2]
                        ):
                            continue
                        if _an_edge_crosses(points, faces, normals, f, g) or (
                            _an_edge_crosses(points, faces, normals, g, f)
                        ):
                            flags[f] = flags[g] = True
    return flags


@compiled
def _an_edge_crosses(points, faces, normals, f, g):
    """Whether an edge of triangle f passes through triangle g without a common corner."""
    a, b, c = faces[g]
    for k in range(3):
        p, q = faces[f, k], faces[f, (k + 1) % 3]
        if p in (a, b, c) or q in (a, b, c):
            continue
        if _height(points, normals, p, a, g) * _height(points, normals, q, a, g) >= 0:
            continue
        start, along = points[p], points[q] - points[p]
        ab = dot(along, np.cross(points[a] - start, points[b] - start))
        bc = dot(along, np.cross(points[b] - start, points[c] - start))
        ca = dot(along, np.cross(points[c] - start, points[a] - start))
        if (ab > 0 and bc > 0 and ca > 0) or (ab < 0 and bc < 0 and ca < 0):
            return True
    return False


@compiled
def _height(points, normals, p, a, g):
    """Height of point p over the plane of triangle g, which has corner a, times twice g's area."""
    return (
        (points[p, 0] - points[a, 0]) * normals[g, 0]
        + (points[p, 1] - points[a, 1]) * normals[g, 1]
        + (points[p, 2] - points[a, 2]) * normals[g, 2]
    )
