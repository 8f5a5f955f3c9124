"""The slow, obvious contact: every device vertex against every skin vertex.

It checks a start for penetration, and the tests hold the fast path to it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree


@dataclass(frozen=True, eq=False)
class Penetration:
    """Device vertices inside the body.

    Attributes
    ----------
    device_vertex : (c,) int64
    skin_vertex : (c,) int64
        idx(k), the skin vertex nearest to each of them.
    depth : (c,) float64
        d_k > 0 [m].
    normal : (c, 3) float64
        Outward skin normal at idx(k).
    """

    device_vertex: np.ndarray
    skin_vertex: np.ndarray
    depth: np.ndarray
    normal: np.ndarray


def find_penetration(
    skin_vertices: np.ndarray,
    skin_normals: np.ndarray,
    device_vertices: np.ndarray,
    search_radius: float,
) -> Penetration:
    """Return where d_k = n·(v − p) > 0 for the nearest skin vertex within a radius (section V.A).

    Parameters
    ----------
    skin_vertices, skin_normals : (n, 3) float64
        World frame [m], outward unit normals.
    device_vertices : (N, 3) float64
        World frame [m].
    search_radius : float
        Device vertices farther than this from every skin vertex are free [m].
    """
    distance, nearest = cKDTree(skin_vertices).query(
        device_vertices, distance_upper_bound=search_radius
    )
    near = np.flatnonzero(np.isfinite(distance))
    index = nearest[near]
    normal = skin_normals[index]
    depth = np.einsum("ij,ij->i", normal, skin_vertices[index] - device_vertices[near])
    inside = depth > 0
    return Penetration(near[inside], index[inside], depth[inside], normal[inside])
