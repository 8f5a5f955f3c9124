"""Pressure and shear as a tactile sensor reads them: force over area, averaged over cells."""

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.spatial import cKDTree

from simcore.compiled import compiled


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
        self._sums = np.zeros((count, 3))

    def pressure(self, normal_force: np.ndarray) -> np.ndarray:
        """Return pressure [Pa] of normal forces [N]; (n,) or (T, n)."""
        force = np.atleast_2d(normal_force)
        bearing = np.flatnonzero(force.any(axis=0))
        part = self._operator[:, bearing].tocsr()
        cells = np.flatnonzero(np.diff(part.indptr))
        found = np.zeros(force.shape)
        found[:, cells] = (part[cells] @ np.ascontiguousarray(force[:, bearing].T, dtype=float)).T
        return found.reshape(np.shape(normal_force))

    def shear(self, tangential_force: np.ndarray, bearing: np.ndarray | None = None) -> np.ndarray:
        """Return the size (n,) [Pa] of tangential forces (k, 3) [N] averaged as vectors: Eq. P3.

        Skin that is pulled both ways within a cell is not sheared as a whole.

        Parameters
        ----------
        bearing : (k,) int64, optional
            Vertices that they act on; unless told, all.
        """
        bearing = np.arange(self._operator.shape[1]) if bearing is None else bearing
        operator = self._operator
        size = np.zeros(operator.shape[0], np.float32)
        _write_mean_size(
            bearing, tangential_force, operator.indptr, operator.indices, operator.data,
            self._sums, size,
        )
        return size


@compiled
def _write_mean_size(bearing, force, starts, cells, weights, sums, size):
    """Write the length of each cell's weighted sum (n,) of vectors (k, 3), by columns.

    `sums` (n, 3) is zero, and left so; cells that nothing bears on keep their size.
    """
    for k in range(bearing.size):
        x, y, z = force[k, 0], force[k, 1], force[k, 2]
        for e in range(starts[bearing[k]], starts[bearing[k] + 1]):
            sums[cells[e], 0] += weights[e] * x
            sums[cells[e], 1] += weights[e] * y
            sums[cells[e], 2] += weights[e] * z
    for k in range(bearing.size):
        for e in range(starts[bearing[k]], starts[bearing[k] + 1]):
            x, y, z = sums[cells[e], 0], sums[cells[e], 1], sums[cells[e], 2]
            if x != 0.0 or y != 0.0 or z != 0.0:
                size[cells[e]] = np.sqrt(x * x + y * y + z * z)
                sums[cells[e], 0] = sums[cells[e], 1] = sums[cells[e], 2] = 0.0


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
