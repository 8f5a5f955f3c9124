"""Pressure and shear as a tactile sensor reads them: force over area, averaged over cells."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.spatial import cKDTree

AT_ONCE = 64
"""Frames whose shear is averaged at a time: more take memory, and no less time."""


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
        cells, mean = self._means(bearing, np.ascontiguousarray(force[:, bearing].T, dtype=float))
        found = np.zeros(force.shape)
        found[:, cells] = mean.T
        return found.reshape(np.shape(normal_force))

    def shear(
        self, bearing: Sequence[np.ndarray], tangential_force: Sequence[np.ndarray]
    ) -> np.ndarray:
        """Return the size (T, n) [Pa] of tangential forces averaged as vectors, float32: Eq. P3.

        Skin that is pulled both ways within a cell is not sheared as a whole.

        Parameters
        ----------
        bearing : T times (k,) int64
            Vertices that forces act on.
        tangential_force : T times (k, 3) float64
            [N].
        """
        size = np.zeros((len(bearing), self._operator.shape[0]), np.float32)
        for first in range(0, len(bearing), AT_ONCE):
            frames = slice(first, first + AT_ONCE)
            points, place = told(bearing[frames], size.shape[1])
            count = len(bearing[frames])
            force = np.zeros((len(points), 3, count))
            for frame, (borne, forces) in enumerate(
                zip(bearing[frames], tangential_force[frames], strict=True)
            ):
                force[place[borne], :, frame] = forces
            cells, mean = self._means(points, force.reshape(len(points), 3 * count))
            mean = mean.reshape(len(cells), 3, count)
            size[frames, cells] = np.sqrt(np.square(mean, out=mean).sum(axis=1)).T
        return size

    def _means(self, points: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return which cells (c,) hold any of the points (k,), and Eq. P1 for forces (k, C)."""
        part = self._operator[:, points].tocsr()
        cells = np.flatnonzero(np.diff(part.indptr))
        return cells, part[cells] @ force


def told(points: Sequence[np.ndarray], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return which of `count` points occur in any frame (k,), and the place of each there."""
    mark = np.zeros(count, bool)
    for frame in points:
        mark[frame] = True
    return np.flatnonzero(mark), np.cumsum(mark) - 1


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
