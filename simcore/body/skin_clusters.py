"""Small groups of skin vertices, and the balls that they stay in however the body is posed."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simcore.body.skin import Skin


@dataclass(frozen=True, eq=False)
class SkinClusters:
    """Vertices that lie together and are blended alike; k clusters, entries e of their segments.

    Attributes
    ----------
    offsets : (k + 1,) int64
        Vertices of cluster c are the entries from `[c]` to `[c + 1]`.
    vertex : (n,) int64
        Skin vertices, cluster by cluster.
    segment_offsets : (k + 1,) int64
        Segments of each cluster, likewise; the one that carries most of it first.
    segment : (e,) int64
    centre : (e, 3) float64
        Middle of the cluster's points p_ij in that segment's frame [m].
    weight : (e,) float64
        Middle of their weights α_ij; sums to 1 over each cluster.
    spread : (e,) float64
        How far a weight is from that at most.
    radius : (k,) float64
        How far a point p_ij is from its middle at most [m].
    """

    offsets: np.ndarray
    vertex: np.ndarray
    segment_offsets: np.ndarray
    segment: np.ndarray
    centre: np.ndarray
    weight: np.ndarray
    spread: np.ndarray
    radius: np.ndarray


@lru_cache(maxsize=4)
def skin_clusters(skin: Skin, segment_count: int, size: int) -> SkinClusters:
    """Return clusters of at most `size` vertices.

    The vertices that a segment carries most of are halved along their longest extent until they
    are few enough.
    """
    count = skin.vertex_count
    owner = np.repeat(np.arange(count), np.diff(skin.influence_offsets))
    weights = np.zeros((count, segment_count))
    weights[owner, skin.influence_segment] = skin.influence_weight
    points = np.zeros((count, segment_count, 3))
    points[owner, skin.influence_segment] = skin.influence_point
    main = weights.argmax(axis=1)
    groups = [
        group
        for j in range(segment_count)
        for group in _halved(np.flatnonzero(main == j), points[:, j], size)
    ]
    entries = [_blend_of(group, weights[group], points[group]) for group in groups]
    segment, centre, weight, spread, radius = zip(*entries, strict=True)
    return SkinClusters(
        _offsets(groups), np.concatenate(groups), _offsets(segment), np.concatenate(segment),
        np.concatenate(centre), np.concatenate(weight), np.concatenate(spread), np.array(radius),
    )


@dataclass(frozen=True, eq=False)
class SkinCarriers:
    """The different sets of segments that carry vertices; there are few.

    Attributes
    ----------
    of_vertex : (n,) int64
        Set of each skin vertex.
    offsets : (s + 1,) int64
        Segments of set k are the entries from `[k]` to `[k + 1]`.
    segment : (e,) int64
    """

    of_vertex: np.ndarray
    offsets: np.ndarray
    segment: np.ndarray


@lru_cache(maxsize=4)
def skin_carriers(skin: Skin) -> SkinCarriers:
    """Return the sets of segments of a skin."""
    bits = np.bitwise_or.reduceat(1 << skin.influence_segment, skin.influence_offsets[:-1])
    sets, of_vertex = np.unique(bits, return_inverse=True)
    segments = [np.flatnonzero(each >> np.arange(each.bit_length()) & 1) for each in sets.tolist()]
    return SkinCarriers(of_vertex, _offsets(segments), np.concatenate(segments))


def _halved(group: np.ndarray, points: np.ndarray, size: int) -> list[np.ndarray]:
    if len(group) == 0:
        return []
    if len(group) <= size:
        return [np.sort(group)]
    here = points[group]
    order = group[np.argsort(here[:, np.ptp(here, axis=0).argmax()], kind="stable")]
    half = len(order) // 2
    return _halved(order[:half], points, size) + _halved(order[half:], points, size)


def _blend_of(group: np.ndarray, weights: np.ndarray, points: np.ndarray) -> tuple:
    """Return segments, centres, weights and spreads of a cluster, and its radius [m]."""
    middle = (weights.min(axis=0) + weights.max(axis=0)) / 2
    middle /= middle.sum()
    segment = np.flatnonzero(middle)
    segment = segment[np.argsort(-middle[segment], kind="stable")]
    centre, radius = np.empty((len(segment), 3)), 0.0
    for entry, j in enumerate(segment):
        carried = points[weights[:, j] > 0, j]
        centre[entry] = (carried.min(axis=0) + carried.max(axis=0)) / 2
        radius = max(radius, np.linalg.norm(carried - centre[entry], axis=1).max())
    spread = np.abs(weights - middle).max(axis=0)
    return segment, centre, middle[segment], spread[segment], radius


def _offsets(groups: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum([len(group) for group in groups])])
