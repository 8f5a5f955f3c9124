"""The mass–spring net of a sheet: an even grid inside an outline (Eqs. 4 and 5, S1 to S3)."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from simcore.config.sling_lift import Fabric, SheetDesign
from simcore.errors import DesignError
from simcore.sheet.outline import area, contains, corners

STRUCTURAL_SHARE = 0.75
"""k_structural / E_w of a square grid that is isotropic with ν = 1/3: Eq. S2."""

DIAGONAL_SHARE = 0.375
"""k_diagonal / E_w of the same: Eq. S2."""

# ASSUME: fabric has next to no bending stiffness; this much smooths creases of one cell and adds
# less than 1 % to E_w.
BENDING_SHARE = 0.002
"""k_bending / k_structural."""

SPRING_OFFSETS = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 0), (0, 2))
"""Grid steps (rows, columns) of the springs: structural, diagonal (shear), bending."""


@dataclass(frozen=True, eq=False)
class Net:
    """A mass–spring net.

    Attributes
    ----------
    rest_position : (n, 2) float64
        In the sheet plane: x towards the feet, y to the left [m].
    faces : (f, 3) int32
        Counter-clockwise seen from above (+z when the sheet lies flat).
    spring_vertices : (s, 2) int32
    rest_length : (s,) float64
        [m]
    stiffness : (s,) float64
        [N/m]
    spring_kind : (s,) int8
        0 structural, 1 diagonal, 2 bending.
    buckling_strain, compression_share : float
        Structural and diagonal springs keep this share of their stiffness beyond this compression.
    mass : (n,) float64
        [kg]
    vertex_area : (n,) float64
        [m²]
    on_edge : (n,) bool
        Vertices on the outline.
    grid_shape : (int, int)
        Rows (along x) and columns (along y) of the grid that holds the net.
    grid_place : (n,) int32
        Place of each vertex in the flattened grid, ascending.
    spacing : (2,) float64
        Of rows and of columns [m].
    outline : (m, 2) float64
        Corners [m].
    """

    rest_position: np.ndarray
    faces: np.ndarray
    spring_vertices: np.ndarray
    rest_length: np.ndarray
    stiffness: np.ndarray
    spring_kind: np.ndarray
    buckling_strain: float
    compression_share: float
    mass: np.ndarray
    vertex_area: np.ndarray
    on_edge: np.ndarray
    grid_shape: tuple[int, int]
    grid_place: np.ndarray
    spacing: np.ndarray
    outline: np.ndarray


def build_net(design: SheetDesign) -> Net:
    """Return the net of a design.

    Cells of the grid whose centre lies inside the outline are kept. Masses and areas go by
    quarters of cells. A structural spring on an edge belongs to one cell, not to two, and in a
    fabric has half the stiffness.

    Raises
    ------
    DesignError
        An outline that `simcore.sheet.outline.corners` refuses, or one narrower than a cell.
    """
    outline = corners(design.outline)
    cells, low, spacing = _fit_grid(outline, design.vertex_count)
    rows, columns = cells.shape[0] + 1, cells.shape[1] + 1

    quarters = np.zeros((rows, columns))  # number of cells around each grid point
    for i in (0, 1):
        for j in (0, 1):
            quarters[i : i + rows - 1, j : j + columns - 1] += cells
    present = quarters > 0
    index = np.full((rows, columns), -1, np.int32)
    index[present] = np.arange(present.sum())
    place = np.flatnonzero(present).astype(np.int32)
    grid = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1)
    position = (low + grid * spacing)[present]

    vertices, stiffness, kind = _springs(cells, index, spacing, design)
    rest_length = np.linalg.norm(position[vertices[:, 1]] - position[vertices[:, 0]], axis=1)
    _check_connected(vertices, len(position))

    vertex_area = quarters[present] / 4 * spacing.prod()
    if isinstance(design.material, Fabric):
        mass = vertex_area * design.material.areal_density_kg_per_m2
        buckling_strain = design.material.buckling_strain
        compression_share = design.material.compression_share
    else:
        mass = vertex_area * (design.material.mass_kg / vertex_area.sum())
        buckling_strain, compression_share = 0.0, 1.0
    a, b = index[:-1, :-1][cells], index[1:, :-1][cells]
    c, d = index[1:, 1:][cells], index[:-1, 1:][cells]
    return Net(
        rest_position=position,
        faces=np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]),
        spring_vertices=vertices,
        rest_length=rest_length,
        stiffness=stiffness,
        spring_kind=kind,
        buckling_strain=buckling_strain,
        compression_share=compression_share,
        mass=mass,
        vertex_area=vertex_area,
        on_edge=quarters[present] < 4,
        grid_shape=(rows, columns),
        grid_place=place,
        spacing=spacing,
        outline=outline,
    )


def _fit_grid(outline: np.ndarray, vertex_count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the kept cells (rows − 1, columns − 1) bool, the low corner and the spacing (2,) [m].

    The grid fills the bounding box exactly, with nearly square cells: of the row counts around the
    wanted one, that with the least misfit of number and shape.
    """
    low, high = outline.min(axis=0), outline.max(axis=0)
    size = high - low
    perimeter = float(np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1).sum())
    # vertex_count = area / h² + perimeter / 2h + 1
    half = perimeter / 2
    covered = area(outline)
    inverse = (-half + np.sqrt(half**2 + 4 * covered * (vertex_count - 1))) / (2 * covered)
    wanted = size[0] * inverse
    best = None
    for row_cells in range(max(1, int(0.95 * wanted)), int(1.05 * wanted) + 2):
        column_cells = max(1, round(size[1] / size[0] * row_cells))
        spacing = size / (row_cells, column_cells)
        misfit = abs(row_cells / wanted - 1) + 4 * abs(np.log(spacing[0] / spacing[1]))
        if best is None or misfit < best[0]:
            best = misfit, row_cells, column_cells
    shape = best[1:]
    spacing = size / shape
    centre = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in shape), indexing="ij"), axis=-1)
    cells = contains(outline, (low + centre * spacing).reshape(-1, 2)).reshape(shape)
    if not cells.any():
        raise DesignError(
            "device.sheet.outline: is narrower than a cell of the sheet; raise vertex_count"
        )
    return cells, low, spacing


def _springs(
    cells: np.ndarray, index: np.ndarray, spacing: np.ndarray, design: SheetDesign
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices (s, 2), stiffness (s,) [N/m] and kind (s,) of all springs (Eq. S2)."""
    rows, columns = index.shape
    across = np.zeros((rows - 1, columns))  # cells beside each spring along x, then along y
    across[:, :-1] += cells
    across[:, 1:] += cells
    along = np.zeros((rows, columns - 1))
    along[:-1] += cells
    along[1:] += cells
    diagonal = cells.astype(float)
    bend_x, bend_y = (np.minimum(across[1:], across[:-1]), np.minimum(along[:, 1:], along[:, :-1]))
    if isinstance(design.material, Fabric):
        # A strip of one cell: k = E_w width / length, exact also for cells that are not square.
        width = design.material.stiffness_per_width_n_per_m
        aspect = spacing[1] / spacing[0]
        structural = np.array([aspect, 1 / aspect]) * STRUCTURAL_SHARE * width / 2
        shear = DIAGONAL_SHARE * width
    else:
        structural = np.full(2, design.material.stiffness_n_per_m)
        shear = design.material.stiffness_n_per_m
        across, along = (across > 0).astype(float), (along > 0).astype(float)
        bend_x, bend_y = (bend_x > 0).astype(float), (bend_y > 0).astype(float)
    pieces = (
        (index[:-1], index[1:], structural[0] * across, 0),
        (index[:, :-1], index[:, 1:], structural[1] * along, 0),
        (index[:-1, :-1], index[1:, 1:], shear * diagonal, 1),
        (index[:-1, 1:], index[1:, :-1], shear * diagonal, 1),
        (index[:-2], index[2:], BENDING_SHARE * structural[0] * bend_x, 2),
        (index[:, :-2], index[:, 2:], BENDING_SHARE * structural[1] * bend_y, 2),
    )
    vertices, stiffness, kind = [], [], []
    for first, second, k, name in pieces:
        kept = k > 0
        vertices.append(np.stack([first[kept], second[kept]], axis=1))
        stiffness.append(k[kept])
        kind.append(np.full(kept.sum(), name, np.int8))
    return np.concatenate(vertices), np.concatenate(stiffness), np.concatenate(kind)


def _check_connected(spring_vertices: np.ndarray, count: int) -> None:
    links = coo_matrix((np.ones(len(spring_vertices)), spring_vertices.T), shape=(count, count))
    if connected_components(links, directed=False)[0] > 1:
        raise DesignError(
            "device.sheet.outline: falls apart where it is narrower than a cell; "
            "raise vertex_count"
        )
