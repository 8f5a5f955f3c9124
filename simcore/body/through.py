"""How thick a body is: the way straight through it from each point of its skin."""

import numpy as np
import trimesh

LONGEST = 0.24
"""Way through the body that is told apart from longer ones [m]: a trunk's, and no flesh is thicker
than half of it."""

ASKEW = (7e-4, -4e-4, 9e-4)
"""By how much that way is not straight: a ray that meets an edge in a symmetric mesh may pass."""

BELOW_SKIN = 1e-3
"""How far below the skin that way is begun [m], so that it does not end where it begins."""


def way_through(
    points: np.ndarray, normals: np.ndarray, vertices: np.ndarray, faces: np.ndarray
) -> np.ndarray:
    """Return how far it is from each point (n,) through the inside to the other side [m].

    At most `LONGEST`.

    Parameters
    ----------
    points, normals : (n, 3) float64
        On the surface [m], and outward unit normals there.
    vertices, faces : (v, 3) float64, (f, 3) int
        Closed surface [m].
    """
    start = points - BELOW_SKIN * normals
    rays = trimesh.Trimesh(vertices, faces, process=False).ray
    ends, found, _ = rays.intersects_location(start, ASKEW - normals, multiple_hits=False)
    length = np.full(len(points), LONGEST)
    length[found] = BELOW_SKIN + np.linalg.norm(ends - start[found], axis=1)
    return np.minimum(length, LONGEST)
