"""Pressure and shear as a tactile sensor reads them: force over area, averaged over cells."""

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.spatial import cKDTree

FRAMES_AT_ONCE = 32
"""Of whose forces there are copies at a time; in so few much the same skin is pressed."""


class SensorCells:
    """Cell-averaged pressure on the skin, one overlapping cell centred at each vertex.

    p_i = Σ_j w_ij N_j / Σ_j w_ij A_j (Eq. P1), where N_j is the normal force on vertex j, A_j its
    area at rest, and w a cone of radius √(3/π)·pitch, so that ∫ w dA is the area of a square
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
    pitch : float
        Edge of a cell [m]; measured peaks depend on it.
    """

    def __init__(
        self, rest_vertices: np.ndarray, normals: np.ndarray, vertex_area: np.ndarray, pitch: float
    ):
        count = len(rest_vertices)
        radius = np.sqrt(3 / np.pi) * pitch
        i, j = cKDTree(rest_vertices).query_pairs(radius, output_type="ndarray").T
        # A thin limb's other side is near, but no part of the cell.
        same_side = np.einsum("ij,ij->i", normals[i], normals[j]) > 0
        i, j = i[same_side], j[same_side]
        weight = 1 - np.linalg.norm(rest_vertices[i] - rest_vertices[j], axis=1) / radius
        rows = np.concatenate([i, j, np.arange(count)])
        columns = np.concatenate([j, i, np.arange(count)])
        weights = np.concatenate([weight, weight, np.ones(count)])
        sums = csr_array((weights, (rows, columns)), shape=(count, count))
        self._operator = csc_array(sums.multiply(1 / (sums @ vertex_area)[:, None]))

    def pressure(self, normal_force: np.ndarray) -> np.ndarray:
        """Return pressure [Pa] of normal forces [N]; (n,) or (T, n)."""
        force = np.atleast_2d(normal_force)
        bearing = np.flatnonzero(force.any(axis=0))
        cells, mean = self._mean(bearing, force[:, bearing].T)
        found = np.zeros(force.shape)
        found[:, cells] = mean.T
        return found.reshape(np.shape(normal_force))

    def shear(self, tangential_force: np.ndarray, bearing: np.ndarray | None = None) -> np.ndarray:
        """Return the size (..., n) [Pa] of tangential forces, averaged as vectors: Eq. P3.

        Skin that is pulled both ways within a cell is not sheared as a whole.

        Parameters
        ----------
        tangential_force : (n, 3) or (T, k, 3)
            [N]
        bearing : (k,) int, optional
            Vertices that the latter are of; unless told, all.
        """
        force = tangential_force if tangential_force.ndim == 3 else tangential_force[None]
        bearing = np.arange(force.shape[1]) if bearing is None else bearing
        found = np.zeros((len(force), self._operator.shape[0]), tangential_force.dtype)
        for start in range(0, len(force), FRAMES_AT_ONCE):
            part = force[start : start + FRAMES_AT_ONCE]
            borne = np.flatnonzero(part.any(axis=(0, 2)))
            columns = np.moveaxis(part[:, borne], 1, 0).reshape(len(borne), 3 * len(part))
            cells, mean = self._mean(bearing[borne], columns)
            mean = mean.reshape(len(cells), len(part), 3)
            found[start : start + FRAMES_AT_ONCE, cells] = np.sqrt(
                np.einsum("itj,itj->ti", mean, mean)
            )
        return found if tangential_force.ndim == 3 else found[0]

    def _mean(self, bearing: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return cells (m,) that read anything, and force per area (m, c) of forces (k, c)."""
        part = self._operator[:, bearing].tocsr()
        cells = np.flatnonzero(np.diff(part.indptr))
        return cells, part[cells] @ np.ascontiguousarray(force, dtype=float)


class SensorMat:
    """A grid of square cells laid over what carries the body, as a tactile sensor sheet.

    Each point stands for a tile of the mat and spreads its force evenly over it; a cell's pressure
    is the force on it over its area (Eq. P2). The readings add up to the whole force, even pressure
    is read as it is, and the peak converges under refinement of the points, which it would not
    with point forces sorted into cells.

    Parameters
    ----------
    points : (N, 2) float64
        Where the force-bearing points lie on the mat [m].
    tile : (2,) float64
        Size of a point's tile, its spacing [m].
    pitch : float
        Edge of a cell [m].

    Attributes
    ----------
    x, y : (rows,), (columns,) float64
        Centres of the cells [m].
    """

    def __init__(self, points: np.ndarray, tile: np.ndarray, pitch: float):
        (self.x, along), (self.y, across) = (
            _overlaps(points[:, axis], tile[axis], pitch) for axis in (0, 1)
        )
        rows, weights = [], []
        for row, share in along:
            for column, other in across:
                rows.append(row * len(self.y) + column)
                weights.append(share * other)
        columns = np.tile(np.arange(len(points)), len(rows))
        self._operator = csc_array(
            (np.concatenate(weights) / pitch**2, (np.concatenate(rows), columns)),
            shape=(len(self.x) * len(self.y), len(points)),
        )

    def pressure(
        self, normal_force: np.ndarray, bearing: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the reading (..., rows, columns) [Pa] of normal forces at the points [N].

        Parameters
        ----------
        normal_force : (N,) or (T, k)
            [N]
        bearing : (k,) int, optional
            Points that the latter are of; unless told, all.
        """
        operator = self._operator if bearing is None else self._operator[:, bearing]
        reading = operator @ np.asarray(normal_force, dtype=float).T
        return reading.T.reshape(*np.shape(normal_force)[:-1], len(self.x), len(self.y))


def _overlaps(
    place: np.ndarray, size: float, pitch: float
) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """Return centres of the cells of one axis, and cells and shares of each interval in them.

    Intervals of a size [m] lie around each place (N,) [m]; the shares (N,) of one add up to 1.
    """
    low = np.floor((place - size / 2) / pitch).astype(int)
    reach = int(np.ceil(size / pitch)) + 1
    first = low.min()
    cells = []
    for step in range(reach):
        start = (low + step) * pitch
        covered = np.minimum(place + size / 2, start + pitch) - np.maximum(place - size / 2, start)
        cells.append((low + step - first, np.maximum(covered, 0.0) / size))
    count = low.max() - first + reach
    return (first + np.arange(count) + 0.5) * pitch, cells
