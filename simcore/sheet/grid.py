"""The vertices of a sheet on its flattened grid, as the vector units of a machine want them."""

import numpy as np

from simcore.compiled import compiled
from simcore.sheet.net import SPRING_OFFSETS
from simcore.sheet.solver import Sheet

LANES = 16
"""Numbers of single precision in the widest registers: what loops run over is a multiple."""


class SheetGrid:
    """The constant arrays of a sheet on its grid, with absent points before and after.

    Attributes
    ----------
    place : (n,) int64
        Point of each vertex.
    first, last : int
        Loops run from the first of these points to before the last; the rest is padding.
    offsets : (6,) uint64
        Steps of the springs' directions.
    stiffness : (6, N)
        Of the spring that starts at a point, 0 where there is none [N/m].
    rest_length : (6,)
        Of the springs by direction [m].
    mass, mobility : (N,)
        True mass [kg] and 1 / inertia [1/kg]; 0 where there is no vertex, or none that moves.
    precision, pair : type
        Of all of these: single, or double; and of two such numbers that are moved as one.
    """

    def __init__(self, sheet: Sheet, inertia: np.ndarray, precision: type):
        net = sheet.net
        rows, columns = net.grid_shape
        reach = max(r * columns + c for r, c in SPRING_OFFSETS)
        self.precision = precision
        self.pair = np.float64 if precision is np.float32 else np.complex128
        self.first = -(-reach // LANES) * LANES
        self.last = self.first - (-(rows * columns) // LANES) * LANES
        self.place = net.grid_place.astype(np.int64) + self.first
        self.offsets = np.array([r * columns + c for r, c in SPRING_OFFSETS], np.uint64)

        self.stiffness = self.zeros(len(self.offsets))
        ends = self.place[net.spring_vertices]
        step = ends[:, 1] - ends[:, 0]
        for direction, offset in enumerate(self.offsets):
            mine = (step == offset) & (net.spring_kind == direction // 2)
            self.stiffness[direction, ends[mine, 0]] = net.stiffness[mine]
        steps = np.array(SPRING_OFFSETS) * net.spacing
        self.rest_length = np.linalg.norm(steps, axis=1).astype(precision)
        self.mass, self.mobility = self.zeros(2)
        self.mass[self.place] = net.mass
        self.mobility[self.place] = np.where(sheet.pinned, 0.0, 1 / inertia)

    def zeros(self, *shape: int) -> np.ndarray:
        """Return zeros (*shape, N), aligned as vectors are."""
        shape = *shape, self.last + self.first
        size = int(np.prod(shape)) * np.dtype(self.precision).itemsize
        memory = np.zeros(size + 64, np.uint8)
        start = -memory.ctypes.data % 64
        return memory[start : start + size].view(self.precision).reshape(shape)


@compiled
def split(position, velocity, place, coarse, fine, on_grid):
    """Put vertices (n, 3) on the grid (3, N): positions in a rounded part and what is left."""
    for i in range(place.size):
        p = np.uint64(place[i])
        for axis in range(3):
            coarse[axis, p] = position[i, axis]
            fine[axis, p] = position[i, axis] - coarse[axis, p]
            on_grid[axis, p] = velocity[i, axis]


@compiled
def unite(position, velocity, place, coarse, fine, on_grid):
    """Take vertices (n, 3) back from the grid (3, N)."""
    for i in range(place.size):
        p = np.uint64(place[i])
        for axis in range(3):
            position[i, axis] = np.float64(coarse[axis, p]) + fine[axis, p]
            velocity[i, axis] = on_grid[axis, p]
