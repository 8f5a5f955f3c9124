"""How thick a body is under its skin: the balls that touch each vertex from within."""

import numpy as np
from scipy.spatial import cKDTree

BALL_STEPS = 8  # of a shrinking ball; most come to rest after 3 or 4


def inscribed_radius(
    tree: cKDTree, points: np.ndarray, normals: np.ndarray, largest: float
) -> np.ndarray:
    """Radius (n,) [m] of the largest ball, up to `largest`, that touches each point from within.

    A ball that holds another point shrinks until it touches that one (Ma, Bae and Choi 2012,
    "3D medial axis point approximation using nearest neighbors and the normal field").

    Parameters
    ----------
    tree : cKDTree
        Of the points.
    points, normals : (n, 3) float64
        Vertices of a closed surface [m], and outward normals of any length.
    """
    normals = normals / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-30)
    radius = np.full(len(points), largest)
    for _ in range(BALL_STEPS):
        _, other = tree.query(points - radius[:, None] * normals)
        apart = points - points[other]
        depth = np.einsum("nc,nc->n", apart, normals)
        inside = depth > 0  # else the nearest is the point itself, and the ball is at rest
        touching = np.einsum("nc,nc->n", apart, apart)[inside] / (2 * depth[inside])
        radius[inside] = np.minimum(radius[inside], touching)
    return radius
