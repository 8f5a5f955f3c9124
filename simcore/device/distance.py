"""Signed distance of a rigid device on a regular grid (Eqs. D1 to D3)."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from simcore.cache import cache_folder, cached_arrays, content_key
from simcore.config.robotic_lift import MeshSurface, SeatAndBackrest
from simcore.device.nearest import box_tree, signed_distances
from simcore.device.surface import SOLID_DEPTH, Surface, support_solid
from simcore.device.winding import Shell, shells

SPACING = 0.005
"""Between the nodes of a grid [m]."""

MARGIN = 0.05
"""Of a grid around the solid [m]."""

BAND = 0.03
"""Distances up to this are exact, farther ones outside lower bounds [m]."""

COARSENING = 4
"""Nodes from one at which the far distance is known to the next."""

NODE_COUNT_MAX = 10_000_000
"""A grid of more nodes, 40 MB, is made coarser."""

SOURCES = ("distance", "nearest", "surface", "winding")  # modules that decide what is cached


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Signed distance φ of a rigid solid at the nodes of a regular grid, device frame.

    Positive outside and negative inside; to be looked up with `simcore.contact.distance_lookup`.

    Contact is with the carrying side: flesh is pressed into a support from there by centimetres,
    and past the middle of a thin slab its nearest side would be the other one. What the solid is
    depends on the device:

    seat and backrest
        The carrying side with `SOLID_DEPTH` of matter behind it (`support_solid`).
    open surface from CAD
        As much matter behind every point of it, along the normal, as deep as no other point is
        nearer; its sides stand at right angles on the border. φ < 0 is as exact as in front, but
        for where a side or the end of the matter is nearest: exact to 1.5 spacings there.
    closed mesh from CAD
        The mesh as it is; of several bodies, all of them. A body thinner than twice the depth to
        which flesh is pressed lets it through: of a thin shell export the carrying face alone.

    Attributes
    ----------
    values : (nx, ny, nz) float32, row by row
        φ at the nodes [m], exact where not said otherwise; inside of bodies that overlap it is
        that of the one that is deepest there, a lower bound of the depth.
    origin : (3,) float64
        Of the grid [m].
    spacing : float
        [m]
    """

    values: np.ndarray
    origin: np.ndarray
    spacing: float

    @property
    def depth_max(self) -> float:
        """Greatest depth in the solid [m]: no flesh can be pressed deeper and come back."""
        return -float(self.values.min())


def device_distance(
    design: SeatAndBackrest | MeshSurface, surface: Surface, spacing: float = SPACING
) -> DistanceField:
    """Return the signed distance of a design's surface; built once and then read from the cache.

    Raises
    ------
    DesignError
        A mesh file's outside cannot be told.
    """
    if isinstance(design, MeshSurface):
        where = f"{design.file}: device.surface.file"
        return mesh_distance(surface.vertices, surface.faces, spacing, where=where)
    solid = support_solid(design)
    return mesh_distance(solid.vertices, solid.faces, spacing)


def mesh_distance(
    vertices: np.ndarray, faces: np.ndarray, spacing: float = SPACING, margin: float = MARGIN,
    where: str = "mesh",
) -> DistanceField:
    """Return the signed distance of a triangle mesh, closed or open (see `DistanceField`).

    Parameters
    ----------
    vertices : (n, 3) float64, faces : (f, 3) int
        Device frame [m].
    spacing : float
        Of the grid [m]; more where it would have more than `NODE_COUNT_MAX` nodes.
    margin : float
        From the solid to the grid's sides at least [m].
    where : str
        File and key, for messages.

    Raises
    ------
    DesignError
        The outside cannot be told (`simcore.device.winding`).
    """
    vertices = np.ascontiguousarray(vertices, dtype=np.float64)
    faces = np.ascontiguousarray(faces, dtype=np.int32)
    key = content_key(
        "device", SOURCES, vertices.tobytes(), faces.tobytes(), f"{spacing} {margin}"
    )
    stored = cached_arrays(
        cache_folder() / "devices" / f"distance-{key}.npz",
        lambda: _sample(shells(vertices, faces, where), spacing, margin),
    )
    return DistanceField(stored["values"], stored["origin"], float(stored["spacing"]))


def _sample(parts: list[Shell], spacing: float, margin: float) -> dict[str, np.ndarray]:
    low, high = _box(parts, margin)
    spacing = max(float(spacing), (np.prod(high - low) / NODE_COUNT_MAX) ** (1 / 3))
    counts = np.ceil((high - low) / spacing).astype(int) + 1
    # Centred, so that what is symmetric is looked up symmetrically.
    origin = (low + high - (counts - 1) * spacing) / 2
    values = np.full(counts, np.inf, dtype=np.float32)
    for part in parts:
        np.minimum(values, _distance_from(part, origin, spacing, counts), out=values)
    return {"values": values, "origin": origin, "spacing": np.array(spacing)}


def _distance_from(part: Shell, origin, spacing: float, counts) -> np.ndarray:
    """Return the signed distances at the nodes from one part, with the matter behind an open one.

    First exactly at every fourth node of each axis, then exactly near the part and inside it;
    elsewhere the lower bound that follows from the first (Eq. D3).
    """
    order, offsets, boxes = box_tree(part.triangles)
    mesh = part.triangles[order], offsets, boxes, part.normals[order], part.borders[order]

    def exact(wanted, step):
        values = np.full(wanted.shape, np.inf, dtype=np.float32)
        at_border = np.zeros(wanted.shape, dtype=bool)
        signed_distances(*mesh, origin, step, wanted, values, at_border)
        return values, at_border

    step = COARSENING * spacing
    coarse, _ = exact(np.ones((counts + COARSENING - 2) // COARSENING + 1, dtype=bool), step)
    bound = _refined(np.abs(coarse), counts)
    bound = np.sqrt(np.maximum(bound**2 - 0.75 * step**2, 0))
    matter = 0.0 if part.closed else SOLID_DEPTH
    wanted = (bound < BAND + matter) | (_refined(coarse, counts) < 0 if part.closed else False)
    values, at_border = exact(wanted, spacing)
    if not part.closed:
        values = _with_matter(values, at_border, spacing)
    values[~wanted] = bound[~wanted] - matter
    return values


def _refined(coarse: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Interpolate linearly between every fourth node of each axis."""
    for axis, count in enumerate(counts):
        left, share = np.divmod(np.arange(count), COARSENING)
        share = (share / COARSENING).astype(np.float32).reshape((-1,) + (1,) * (2 - axis))
        right = np.minimum(left + 1, coarse.shape[axis] - 1)
        coarse = (1 - share) * coarse.take(left, axis) + share * coarse.take(right, axis)
    return coarse


def _box(parts: list[Shell], margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of the box around all parts with what is behind them [m]."""
    points = [part.triangles for part in parts]
    points += [
        part.triangles - SOLID_DEPTH * part.normals[:, :1] for part in parts if not part.closed
    ]
    points = np.concatenate(points).reshape(-1, 3)
    return points.min(axis=0) - margin, points.max(axis=0) + margin


def _with_matter(distance: np.ndarray, at_border: np.ndarray, spacing: float) -> np.ndarray:
    """Return signed distances to an open surface with matter behind it.

    A node is in the matter if it is behind the surface, nearer than `SOLID_DEPTH`, and its nearest
    point is not on the border. What is behind but not matter decides where its sides are.
    """
    behind = distance < 0
    matter = behind & ~at_border & (distance > -SOLID_DEPTH)
    free = behind & ~matter
    if not free.any() or not matter.any():
        return distance
    # Sides run half-way between the nodes on either of theirs.
    to_free = distance_transform_edt(~free, sampling=spacing) - spacing / 2
    to_matter = distance_transform_edt(~matter, sampling=spacing) - spacing / 2
    signed = np.where(free, np.minimum(to_matter, -distance), distance)
    return np.where(matter, np.maximum(distance, -to_free), signed).astype(np.float32)
