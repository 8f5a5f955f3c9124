"""Pressure as a tactile sensor reads it: force over area, averaged over cells of 25 mm."""

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

CELL_EDGE = 0.025
"""Edge of a sensor cell [m]; measured peaks depend on it (docs/physics.md, Eq. P1)."""


class SensorCells:
    """Cell-averaged pressure on the skin, one overlapping cell centred at each vertex.

    p_i = Σ_j w_ij N_j / Σ_j w_ij A_j (Eq. P1), where N_j is the normal force on vertex j, A_j its
    area at rest, and w a cone of radius √(3/π)·25 mm, so that ∫ w dA is the area of a square
    cell. Forces and areas are weighted alike: with hard bins the peak would not converge under
    refinement of the mesh.

    Parameters
    ----------
    rest_vertices : (n, 3) float64
        Skin at rest, limbs apart [m].
    normals : (n, 3) float64
        Outward unit normals there.
    vertex_area : (n,) float64
        [m²].
    """

    def __init__(self, rest_vertices: np.ndarray, normals: np.ndarray, vertex_area: np.ndarray):
        count = len(rest_vertices)
        radius = np.sqrt(3 / np.pi) * CELL_EDGE
        i, j = cKDTree(rest_vertices).query_pairs(radius, output_type="ndarray").T
        # A thin limb's other side is near, but no part of the cell.
        same_side = np.einsum("ij,ij->i", normals[i], normals[j]) > 0
        i, j = i[same_side], j[same_side]
        weight = 1 - np.linalg.norm(rest_vertices[i] - rest_vertices[j], axis=1) / radius
        rows = np.concatenate([i, j, np.arange(count)])
        columns = np.concatenate([j, i, np.arange(count)])
        weights = np.concatenate([weight, weight, np.ones(count)])
        sums = csr_array((weights, (rows, columns)), shape=(count, count))
        self._operator = csr_array(sums.multiply(1 / (sums @ vertex_area)[:, None]))

    def pressure(self, normal_force: np.ndarray) -> np.ndarray:
        """Return pressure [Pa] of normal forces [N]; (n,) or (T, n)."""
        return (self._operator @ np.asarray(normal_force, dtype=float).T).T
