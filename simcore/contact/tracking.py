"""Which skin vertex each point of a thin sheet touches, followed from step to step.

A sheet has two sides and a limb is thin: the nearest skin vertex of a point that is pressed into
the skin may lie on the limb's far side. A point that touches therefore keeps to the surface
that it has: it walks over the skin, downhill in distance. Only points that touch nothing are given
the nearest of all vertices.
"""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.neighbour_grid import nearest_within, sort_into_cells
from simcore.contact.neighbour_rows import vertex_normal

REACH = 0.1
"""Points farther than this from the skin are not followed [m]."""

NEAR = 0.02
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
        Distance of the point from its tangent plane, negative inside [m]. Beyond NEAR a lower
        bound of the distance from the skin that it follows, and REACH for none.
    """

    def __init__(self, point_count: int, ring_offsets: np.ndarray, ring_next: np.ndarray):
        self._rings = ring_offsets, ring_next
        self.vertex = np.full(point_count, -1)
        self.normal = np.zeros((point_count, 3))
        self.gap = np.full(point_count, REACH)
        self._unseen = np.full(point_count, -np.inf)  # way that each can come before it is sought
        # Since the last search, in which all of this was taken:
        self._way = np.zeros(point_count)  # that each point and the skin have come, at most
        self._clear = np.zeros(point_count)  # gap of each
        self._points, self._vertices = np.zeros((point_count, 3)), None
        self._reference = np.zeros(3)

    def update(self, points: np.ndarray, vertices: np.ndarray, reference: np.ndarray) -> None:
        """Follow the points (m, 3) to where they are now.

        Parameters
        ----------
        points : (m, 3), vertices : (n, 3) float64
            Points and skin in the world [m].
        reference : (3,) float64
            A point with which both move, such as the pelvis [m]: their ways are taken from there.
        """
        if self._vertices is None:
            self._search(points, vertices, reference)
            return
        _ways(
            points, self._points, vertices, self._vertices, reference - self._reference, self._way
        )
        if (self._unseen < self._way).any():
            self._search(points, vertices, reference)
        else:
            _follow(
                points, vertices, *self._rings, self._clear, self._way, self.vertex, self.normal,
                self.gap,
            )

    def near(self) -> np.ndarray:
        """Return the skin vertices (l,) that points within NEAR follow."""
        return _followed(self.vertex, self.gap)

    def _search(self, points: np.ndarray, vertices: np.ndarray, reference: np.ndarray) -> None:
        """Give each point that is due, and touches nothing, the nearest of all vertices."""
        self._unseen -= self._way
        due = np.flatnonzero((self._unseen < SECOND / 2) & ((self.vertex < 0) | (self.gap > 0)))
        cells = sort_into_cells(vertices, np.arange(len(vertices)))
        distance, self.vertex[due] = nearest_within(*cells, points, due, REACH)
        # Another part of the body may be hardly farther than the one that is followed.
        self._unseen[due] = np.where(
            np.isfinite(distance), np.maximum(distance, SECOND), REACH - MARGIN
        )
        self._unseen[(self.vertex >= 0) & (self.gap <= 0)] = REACH - MARGIN  # these touch
        self._way[:], self._clear[:] = 0.0, 0.0
        self._points[:], self._reference = points, np.array(reference)
        self._vertices = vertices.copy()
        _follow(
            points, vertices, *self._rings, self._clear, self._way, self.vertex, self.normal,
            self.gap,
        )
        self._clear[:] = self.gap


@compiled
def _ways(points, points_then, vertices, vertices_then, shift, way):
    """Write how far each point can have come towards the skin, seen from what moved by `shift`."""
    furthest = 0.0
    for i in range(vertices.shape[0]):
        x = vertices[i, 0] - vertices_then[i, 0] - shift[0]
        y = vertices[i, 1] - vertices_then[i, 1] - shift[1]
        z = vertices[i, 2] - vertices_then[i, 2] - shift[2]
        furthest = max(furthest, x * x + y * y + z * z)
    furthest = np.sqrt(furthest)
    for p in range(points.shape[0]):
        x = points[p, 0] - points_then[p, 0] - shift[0]
        y = points[p, 1] - points_then[p, 1] - shift[1]
        z = points[p, 2] - points_then[p, 2] - shift[2]
        way[p] = np.sqrt(x * x + y * y + z * z) + furthest


@compiled
def _follow(points, vertices, ring_offsets, ring_next, clear, way, vertex, normal, gap):
    """Walk every followed point downhill; write its skin vertex, normal and gap.

    One that was `clear` of the skin by more than NEAR and its way since then stays as it is.
    """
    for p in range(points.shape[0]):
        i = vertex[p]
        if i < 0:
            continue
        if clear[p] - way[p] > NEAR:
            gap[p] = clear[p] - way[p]
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


@compiled
def _followed(vertex, gap):
    near = np.empty(vertex.size, np.int64)
    count = 0
    for p in range(vertex.size):
        if vertex[p] >= 0 and gap[p] <= NEAR:
            near[count] = vertex[p]
            count += 1
    return near[:count].copy()
