"""Which skin vertex each point of a thin sheet touches, followed from step to step.

A sheet has two sides and a limb is thin: the nearest skin vertex of a point that is pressed into
the skin may lie on the limb's far side. A point that touches therefore keeps to the surface
that it has: it walks over the skin, downhill in distance. Only points that touch nothing are given
the nearest of all vertices.
"""

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from simcore.contact.neighbours import vertex_normal

REACH = 0.1
"""Points farther than this from the skin are not followed [m]."""

NEAR = 0.035
"""The gap of a point that is outside and farther than this is its distance [m]: its normal would
cost more than all else, and nothing asks for it."""

MARGIN = 0.02
"""A point is looked for again before it can have come as near as this unseen [m]."""


SECOND = 0.02
"""A point that follows one part of the body is looked for again before it has come so far, or as
far as that part was: so deep at most it enters another part unseen [m]."""


class SurfaceTracker:
    """Follows points over a skin.

    Parameters
    ----------
    point_count : int
    ring_offsets, ring_next
        One-rings of the skin, as in `simcore.body.skin.Skin`.

    Attributes
    ----------
    vertex : (m,) int64
        Skin vertex that each point follows, −1 for none.
    normal : (m, 3) float64
        Its outward normal; old where the gap is beyond NEAR.
    gap : (m,) float64
        Distance of the point from its tangent plane, negative inside [m]; from the vertex where
        it is beyond NEAR, and REACH for none.
    """

    def __init__(self, point_count: int, ring_offsets: np.ndarray, ring_next: np.ndarray):
        self._rings = ring_offsets, ring_next
        self._unseen = np.full(point_count, -np.inf)  # way that each can come before it is sought
        self.vertex = np.full(point_count, -1)
        self.normal = np.zeros((point_count, 3))
        self.gap = np.full(point_count, REACH)

    def update(
        self, points: np.ndarray, vertices: np.ndarray, way: np.ndarray, skin_way: float
    ) -> None:
        """Follow the points (m, 3) to where they are now.

        Parameters
        ----------
        points : (m, 3) float64
            [m].
        vertices : (n, 3) float64
            Skin, of the same frame [m].
        way : (m,) float64
            No point has moved farther than this since the last call [m].
        skin_way : float
            Nor has the skin [m]. Both are seen from any one frame.
        """
        self._unseen -= way + skin_way
        if self._unseen.min() < 0:
            self._search(points, vertices)
        _follow(points, vertices, *self._rings, self.vertex, self.normal, self.gap)

    def _search(self, points: np.ndarray, vertices: np.ndarray) -> None:
        """Give each point that is due, and touches nothing, the nearest of all vertices."""
        due = np.flatnonzero((self._unseen < SECOND / 2) & ((self.vertex < 0) | (self.gap > 0)))
        tree = cKDTree(vertices, balanced_tree=False, compact_nodes=False)  # is asked but once
        distance, nearest = tree.query(points[due])
        self.vertex[due] = np.where(distance < REACH, nearest, -1)
        # Another part of the body may be hardly farther than the one that is followed.
        self._unseen[due] = np.where(
            distance < REACH, np.maximum(distance, SECOND), distance - MARGIN
        )
        self._unseen[(self.vertex >= 0) & (self.gap <= 0)] = REACH - MARGIN  # these touch


@njit(cache=True, error_model="numpy")
def _follow(points, vertices, ring_offsets, ring_next, vertex, normal, gap):
    """Walk every followed point downhill; write its skin vertex, normal and gap."""
    for p in range(points.shape[0]):
        i = vertex[p]
        if i < 0:
            continue
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        least = ((vertices[i, 0] - x) ** 2 + (vertices[i, 1] - y) ** 2
                 + (vertices[i, 2] - z) ** 2)
        here = -1
        while here != i:
            here = i
            for e in range(ring_offsets[here], ring_offsets[here + 1]):
                b = ring_next[e, 0]
                square = ((vertices[b, 0] - x) ** 2 + (vertices[b, 1] - y) ** 2
                          + (vertices[b, 2] - z) ** 2)
                if square < least:
                    least = square
                    i = b
        if least > REACH * REACH and gap[p] > 0.0:
            vertex[p] = -1
            gap[p] = REACH
            continue
        vertex[p] = i
        if gap[p] > 0.0 and least > NEAR * NEAR:
            gap[p] = np.sqrt(least)
            continue
        nx, ny, nz = vertex_normal(vertices, i, ring_offsets, ring_next)
        normal[p, 0], normal[p, 1], normal[p, 2] = nx, ny, nz
        gap[p] = (nx * (x - vertices[i, 0]) + ny * (y - vertices[i, 1])
                  + nz * (z - vertices[i, 2]))
