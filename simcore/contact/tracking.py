"""Which skin vertex each point of a thin sheet touches, followed from step to step.

A sheet has two sides and a limb is thin: the nearest skin vertex of a point that is pressed into
the skin may lie on the limb's far side. A point that touches therefore keeps to the surface
that it has: it walks over the skin, downhill in distance. Only points that touch nothing are given
the nearest of all vertices.
"""

from collections.abc import Callable

import numpy as np

from simcore.compiled import compiled, inlined
from simcore.contact.distance_lookup import seen_from
from simcore.contact.neighbour_grid import nearest_within, sort_into_cells
from simcore.contact.rings import RING, ordered_rings, walk_over_rings

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


ROUNDING = 1e-9
"""Of a distance that bounds itself."""

AHEAD = 3.0
"""What would have to be looked for again within so many times as long, going on like this, is
looked for at once: a search of one point costs as much as one of hundreds."""

PAGE = 8
"""So many skin vertices that follow each other in memory are posed together."""


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
    searched : bool
        Whether the last update has looked at all of the skin.
    """

    def __init__(self, point_count: int, ring_offsets: np.ndarray, ring_next: np.ndarray):
        self._rings = ring_offsets, ring_next, ordered_rings(ring_offsets, ring_next)
        self._all = np.arange(len(ring_offsets) - 1)
        self._posed, self._listed = np.zeros(len(self._all), bool), self._all
        self.vertex = np.full(point_count, -1)
        self.normal = np.zeros((point_count, 3))
        self.gap = np.full(point_count, REACH)
        self.searched = False
        self._last = np.full((point_count, 1 + RING), -1, np.int32)
        self._square = np.empty(point_count)  # of distances from the vertices last followed
        self._unseen = np.full(point_count, -np.inf)  # way that each can come before it is sought
        # Since the last search, in which all of this was taken:
        self._way = np.zeros(point_count)  # that each point and the skin have come, at most
        self._clear = np.zeros(point_count)  # gap of each
        self._points = np.zeros((point_count, 3))  # in the frame with which they move

    def update(
        self, points: np.ndarray, vertices: np.ndarray, rotation: np.ndarray, position: np.ndarray,
        travelled: float, pose: Callable[[np.ndarray], None],
    ) -> None:
        """Follow the points (m, 3) to where they are now.

        Parameters
        ----------
        points : (m, 3), vertices : (n, 3) float64
            Points, and skin where it was posed, in the world [m].
        rotation : (3, 3), position : (3,) float64
            A frame with which both move, such as the pelvis': their ways are taken from there [m].
        travelled : float
            How far any of the skin can have moved, seen from there, since it was `searched` [m].
        pose : callable
            Writes given skin vertices (k,) into `vertices`.
        """
        self.searched = _ways(
            points, self._points, rotation, position, travelled, self._unseen, self._way
        )
        if self.searched:
            self._pose_all(pose)
            self._search(points, vertices, rotation, position)
            self._pose_near()
            return
        pose(self._listed)
        if not self._follow(points, vertices):  # somewhere it is not posed
            self._pose_all(pose)
            self._follow(points, vertices)
            self._pose_near()

    def _follow(self, points: np.ndarray, vertices: np.ndarray) -> bool:
        return _follow(
            points, vertices, *self._rings, self._posed, self._last, self._clear, self._way,
            self.vertex, self._square, self.normal, self.gap,
        )

    def _search(
        self, points: np.ndarray, vertices: np.ndarray, rotation: np.ndarray, position: np.ndarray
    ) -> None:
        """Give each point that is due, and touches nothing, the nearest of all vertices."""
        self._unseen -= self._way
        free = (self.vertex < 0) | (self.gap > 0)
        due = np.flatnonzero((self._unseen < np.minimum(AHEAD * self._way, SECOND)) & free)
        cells = sort_into_cells(vertices, self._all)
        known = _ways_to_followed(due, points, vertices, self.vertex)
        distance, self.vertex[due] = nearest_within(*cells, points, due, known, REACH)
        # Another part of the body may be hardly farther than the one that is followed.
        self._unseen[due] = np.where(
            np.isfinite(distance), np.maximum(distance, SECOND), REACH - MARGIN
        )
        self._unseen[(self.vertex >= 0) & (self.gap <= 0)] = REACH - MARGIN  # these touch
        self._way[:], self._clear[:] = 0.0, 0.0
        self._points[:] = (points - position) @ rotation
        self._follow(points, vertices)
        self._clear[:] = self.gap

    def _pose_all(self, pose: Callable[[np.ndarray], None]) -> None:
        self._listed = self._all
        self._posed[:] = True
        pose(self._all)

    def _pose_near(self) -> None:
        """From now on, pose what lies around points that are near, or may be soon."""
        _mark_pages(
            self.vertex, self.gap, self._clear, self._way, *self._rings[:2], self._posed
        )
        self._listed = np.flatnonzero(self._posed)


@compiled
def _ways(points, points_then, rotation, position, travelled, unseen, way):
    """Write how far each point can have come towards the skin, both seen from a frame.

    Returns whether that is too far to stay `unseen` for any.
    """
    due = False
    for p in range(points.shape[0]):
        x, y, z = seen_from(rotation, position, points, p)
        way[p] = travelled + np.sqrt(
            (x - points_then[p, 0]) ** 2 + (y - points_then[p, 1]) ** 2
            + (z - points_then[p, 2]) ** 2)
        due |= unseen[p] < way[p]
    return due


@compiled
def _ways_to_followed(chosen, points, vertices, vertex):
    """Return how far at most the vertices are that points follow (c,) [m], infinite for none."""
    ways = np.full(chosen.size, np.inf)
    for c in range(chosen.size):
        p = chosen[c]
        i = vertex[p]
        if i >= 0:
            square = 0.0
            for axis in range(3):
                square += (points[p, axis] - vertices[i, axis]) ** 2
            ways[c] = np.sqrt(square) * (1.0 + ROUNDING)
    return ways


@compiled
def _mark_pages(vertex, gap, clear, way, ring_offsets, ring_next, posed):
    """Mark the pages of rings around vertices whose points are walked, or will be a MARGIN on."""
    posed[:] = False
    for p in range(vertex.size):
        if vertex[p] < 0 or min(gap[p], clear[p] - way[p]) > NEAR + MARGIN:
            continue
        _mark_page(vertex[p], posed)
        for e in range(ring_offsets[vertex[p]], ring_offsets[vertex[p] + 1]):
            _mark_page(ring_next[e, 0], posed)


@inlined
def _mark_page(i, posed):
    if not posed[i]:
        for each in range(i - i % PAGE, min(i - i % PAGE + PAGE, posed.size)):
            posed[each] = True


@compiled
def _follow(
    points, vertices, ring_offsets, ring_next, rings, posed, last, clear, way, vertex, square,
    normal, gap,
):
    """Walk every followed point downhill; write its skin vertex, normal and gap.

    One that was `clear` of the skin by more than NEAR and its way since then stays as it is.
    Returns whether all skin that was met is posed; if not, some have not come to their ends.
    """
    chosen, count = np.empty(vertex.size, np.int64), 0
    for p in range(vertex.size):
        if vertex[p] < 0:
            continue
        if clear[p] - way[p] > NEAR:
            gap[p] = clear[p] - way[p]
            continue
        chosen[count] = p
        count += 1
    chosen = chosen[:count]
    complete, normals, heights = walk_over_rings(
        points, chosen, vertices, ring_offsets, ring_next, rings, posed, last, vertex, square)
    if not complete:
        return False
    for j in range(count):
        p = chosen[j]
        if square[p] > REACH * REACH and gap[p] > 0.0:
            vertex[p] = -1
            gap[p] = REACH
        elif gap[p] > 0.0 and square[p] > NEAR * NEAR:
            gap[p] = np.sqrt(square[p])
        else:
            gap[p] = heights[j]
            for axis in range(3):
                normal[p, axis] = normals[axis, j]
    return True
