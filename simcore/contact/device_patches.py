"""Device points in groups of eight that lie together, and which skin is near each."""

from dataclasses import dataclass

import numpy as np

from simcore.compiled import compiled
from simcore.contact.eight import EIGHT, squares_of_eight, within_of_eight
from simcore.contact.neighbour_grid import (
    ClearanceGrid,
    build_clearance_grid,
    gather,
    sort_into_cells,
)

CLEARANCE_EDGE, CLEARANCE_MARGIN, CLEARANCE_SHARP = 0.02, 0.3, 0.04
"""Edge of the clearance grid's cells, its margin around the device, and where its bounds are sharp
[m]; tuned for time, without effect on the result (docs/performance.md)."""

ROUNDING = 1e-5
"""More than single precision takes off distances of less than ten metres [m]."""


@dataclass(frozen=True, eq=False)
class Patches:
    """Points of a device in p groups of up to eight.

    Attributes
    ----------
    vertex : (p, 8) int64
        Points of each, −1 where there is none.
    points : (p, 3, 8) float64
        Where they are, infinite where there is none [m].
    radius : (p,) float64
        Of a ball around each patch [m].
    group_centres : (g, 3, 8) float32
        Centres of the balls of every eight patches from the first on, from the middle of all,
        infinite where there is none [m].
    group_middle : (g, 3), group_radius : (g,) float64
        A ball around these eight patches [m].
    """

    vertex: np.ndarray
    points: np.ndarray
    radius: np.ndarray
    group_centres: np.ndarray
    group_middle: np.ndarray
    group_radius: np.ndarray


@dataclass(frozen=True, eq=False)
class DevicePoints:
    """Points of a rigid device (N, 3), device frame [m], with what searches around them need."""

    vertices: np.ndarray
    grid: ClearanceGrid
    patches: Patches


def device_points(vertices: np.ndarray) -> DevicePoints:
    """Return the points of a device (N, 3) [m], ready for searches."""
    grid = build_clearance_grid(vertices, CLEARANCE_EDGE, CLEARANCE_MARGIN, CLEARANCE_SHARP)
    return DevicePoints(vertices, grid, build_patches(vertices))


def build_patches(vertices: np.ndarray) -> Patches:
    """Return the points (N, 3) [m] by eights: halved along their longest extent, again and again.

    Patches that follow each other lie together.
    """
    order = _halved(np.ascontiguousarray(vertices))
    points, centre, radius = _eights(vertices[order], np.zeros(len(vertices)))
    vertex = np.full((len(points), EIGHT), -1)
    vertex.ravel()[: len(order)] = order
    centres, middle, around = _eights(centre, radius)
    centres = (centres - middle[..., None]).astype(np.float32)
    return Patches(vertex, points, radius, centres, middle, around)


def _eights(centre: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return every eight balls, (e, 3, 8), and the middle (e, 3) and radius (e,) of one around."""
    count = -(-len(centre) // EIGHT)
    each, wide = np.full((count, EIGHT, 3), np.nan), np.zeros((count, EIGHT))
    each.reshape(-1, 3)[: len(centre)], wide.ravel()[: len(centre)] = centre, radius
    middle = (np.nanmin(each, axis=1) + np.nanmax(each, axis=1)) / 2
    around = np.nanmax(np.linalg.norm(each - middle[:, None], axis=2) + wide, axis=1)
    places = np.nan_to_num(each, nan=np.inf).transpose(0, 2, 1)
    return np.ascontiguousarray(places), middle, around


@compiled
def _halved(vertices):
    """Return an order of points in which every eight from the first on lie together."""
    order = np.arange(vertices.shape[0])
    parts = [(0, vertices.shape[0])]
    while parts:
        start, end = parts.pop()
        eights = (end - start + EIGHT - 1) // EIGHT
        if eights < 2:
            continue
        here = order[start:end]
        widest, axis = -1.0, 0
        for a in range(3):
            along = vertices[here, a]
            if along.max() - along.min() > widest:
                widest, axis = along.max() - along.min(), a
        order[start:end] = here[np.argsort(vertices[here, axis], kind="mergesort")]
        # Eights of eights lie together too.
        whole = EIGHT if eights > EIGHT else 1
        middle = start + -(-eights // whole) // 2 * whole * EIGHT
        parts.append((start, middle))
        parts.append((middle, end))
    return order


@compiled
def near_patches(
    skin, chosen, kind, slack, patch_points, patch_radius, group_centres, group_middle,
    group_radius, radius,
):
    """Return for each patch the skin vertices that can be nearest to a point of it.

    While no skin vertex moves by more than its slack σ in the device frame, that of a point p is
    among those with d − σ ≤ min d + σ, d being the distances from p now. Of these, those that can
    come within `radius` are kept. Distances are of single precision, and a few more vertices are.

    Parameters
    ----------
    skin : (n, 3) float64
        Device frame [m]; valid where chosen.
    chosen : (c,) int64
        Skin vertices to consider.
    kind : (n,) int64, slack : (k,) float64
        Kind of each vertex (`simcore.contact.skin_kinds`), and σ of each kind [m].
    patch_points, patch_radius, group_centres, group_middle, group_radius
        See `Patches`.
    radius : float
        [m].

    Returns
    -------
    patches : (p,) int64
        Those with such a vertex.
    offsets : (p + 1,) int64
    near : (offsets[-1],) int64
        Skin vertices of each.
    """
    patches, offsets = np.zeros((2, patch_points.shape[0] + 1), np.int64)
    if chosen.size == 0:
        return patches[:0].copy(), offsets[:1].copy(), patches[:0].copy()
    low, shape, starts, vertex, point = sort_into_cells(skin, chosen)
    places, distances = np.empty(chosen.size + 1, np.int64), np.empty(chosen.size + 1)
    around, targets = np.empty(chosen.size, np.int64), np.empty((chosen.size, 3), np.float32)
    squares, points = np.empty((chosen.size, EIGHT), np.float32), np.empty((3, EIGHT), np.float32)
    apart, least, limit = np.empty((3, EIGHT), np.float32)
    near, most = np.empty(16 * 1024, np.int64), 0.0
    for i in chosen:
        most = max(most, slack[kind[i]])
    count = total = 0
    for g in range(group_radius.size):
        met, _ = gather(
            point, low, shape, starts, group_middle[g, 0], group_middle[g, 1], group_middle[g, 2],
            radius + group_radius[g] + most, places, distances,
        )
        if met == 0:
            continue
        moves = 0.0
        for e in range(met):
            around[e] = vertex[places[e]]
            moves = max(moves, slack[kind[around[e]]])
            for a in range(3):
                targets[e, a] = point[places[e], a] - group_middle[g, a]
        while total + EIGHT * met >= near.size:
            near = np.concatenate((near, near))
        squares_of_eight(group_centres[g], targets, met, squares, apart)
        for lane in range(min(EIGHT, patch_points.shape[0] - EIGHT * g)):
            patch = EIGHT * g + lane
            if np.sqrt(apart[lane]) > radius + moves + patch_radius[patch] + ROUNDING:
                continue
            for a in range(3):
                for k in range(EIGHT):
                    points[a, k] = patch_points[patch, a, k] - group_middle[g, a]
            squares_of_eight(points, targets, met, squares, least)
            for k in range(EIGHT):
                reach = min(np.sqrt(np.float64(least[k])) + 2 * moves, radius + moves) + ROUNDING
                limit[k] = reach * reach if least[k] < np.inf else -1.0
            start = total
            for e in range(np.uint64(met)):
                near[total] = around[e]
                total += within_of_eight(squares, e, limit)
            if total > start:
                patches[count] = patch
                count += 1
                offsets[count] = total
    return patches[:count].copy(), offsets[: count + 1].copy(), near[:total].copy()
