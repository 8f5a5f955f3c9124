"""Which skin vertices are near a rigid solid, kept until something may have come near unseen."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.distance_lookup import distance_at, seen_from, sure_clearance
from simcore.contact.neighbours import motion_bound, nearest_by_segment, write_relative

REACHES = (0.03, 0.008)
"""Vertices nearer to the solid than the first are looked at again when a segment has moved by what
is left of the second; nearer than that they are listed [m]. Tuned for time, without effect on the
result."""

UNSEEN = 0.004
"""So near a vertex never comes without being listed [m]: an impact at 0.4 m/s in 10 ms."""


class NearSolid:
    """The list of the skin vertices that may touch a solid, in two tiers.

    Parameters
    ----------
    values, origin, spacing
        Distance of the solid, in its frame (`simcore.contact.distance_lookup`).
    influence_offsets, influence_segment
        Of the skin, as in `simcore.body.skin.Skin`.
    segment_centre, segment_radius : (m, 3), (m,) float64
        A ball around the skin of each segment, in its frame [m].

    Attributes
    ----------
    listed : (l,) int64
    rebuilds : int
        Of the outer tier: looks at all of the skin.
    """

    def __init__(
        self, values, origin, spacing, influence_offsets, influence_segment, segment_centre,
        segment_radius,
    ):
        count = len(influence_offsets) - 1
        skin = influence_offsets, influence_segment, segment_centre, segment_radius
        self._all = np.arange(count)
        self._outer, self._inner = (
            _Tier(reach, (values, origin, spacing), skin, count) for reach in REACHES
        )
        self.listed = self._all[:0]
        self.rebuilds = 0

    def update(self, rotations, positions, device, pose, vertices) -> None:
        """Make the list valid for the present poses; parameters as of `Neighbours.update`."""
        at = rotations, positions, device.rotation, device.position
        around = self._outer.moved(*at)
        if around:
            self._outer.look(self._all, *at, pose, vertices)
            self.rebuilds += 1
        if around or self._inner.moved(*at):
            self._inner.look(self._outer.near, *at, pose, vertices)
            self.listed = self._inner.near

    def clearance(self, rotations, positions, device) -> np.ndarray:
        """Return how far the skin of each segment is from the solid at least (m,) [m]."""
        return self._outer.clearance_by_segment(
            rotations, positions, device.rotation, device.position
        )


class _Tier:
    """The vertices within a reach [m], until another may have come as near as `UNSEEN`."""

    def __init__(self, reach: float, field: tuple, skin: tuple, count: int):
        self._reach, self._field = reach, field
        self._influences, self._balls = skin[:2], skin[2:]
        segments = len(self._balls[1])
        self._clearance = np.empty(count)
        self._pose = np.zeros((segments, 3, 4))
        self._allowance = np.full(segments, -1.0)
        self._clearance_then = np.zeros(segments)
        self.near = np.empty(0, np.int64)

    def moved(self, rotations, positions, rotation, position) -> bool:
        """Return whether any segment's skin may have moved beyond its allowance."""
        return _moved(
            rotations, positions, rotation, position, *self._balls, self._pose, self._allowance
        )

    def look(self, among, rotations, positions, rotation, position, pose, vertices) -> None:
        """Look up the distance of some vertices; those left out must be far for other reasons."""
        pose(among)
        self._clearance[:] = np.inf
        _look_up(among, vertices, rotation, position, *self._field, self._clearance)
        self.near = among[self._clearance[among] < self._reach]
        write_relative(rotations, positions, rotation, position, self._pose)
        nearest, used = nearest_by_segment(
            *self._influences, self._clearance, self.near, len(rotations)
        )
        self._allowance = np.where(used, self._reach, np.maximum(nearest, self._reach)) - UNSEEN
        self._clearance_then = np.where(used, 0.0, nearest)

    def clearance_by_segment(self, rotations, positions, rotation, position) -> np.ndarray:
        """Return how far from the solid the skin of each segment is at least (m,) [m]."""
        found = np.empty(len(rotations))
        _clearance(
            rotations, positions, rotation, position, *self._balls, self._pose,
            self._clearance_then, found,
        )
        return found


@compiled
def _moved(rotations, positions, rotation, position, centre, radius, pose, allowance):
    """Return whether any segment's skin may have moved beyond its allowance."""
    now = np.empty((rotations.shape[0], 3, 4))
    write_relative(rotations, positions, rotation, position, now)
    for j in range(now.shape[0]):
        if motion_bound(now[j], pose[j], centre[j], radius[j]) > allowance[j]:
            return True
    return False


@compiled
def _clearance(rotations, positions, rotation, position, centre, radius, pose, then, found):
    """Write what each segment's motion since has left of its clearance then (m,) [m]."""
    now = np.empty((rotations.shape[0], 3, 4))
    write_relative(rotations, positions, rotation, position, now)
    for j in range(now.shape[0]):
        found[j] = max(then[j] - motion_bound(now[j], pose[j], centre[j], radius[j]), 0.0)


@compiled
def _look_up(among, vertices, rotation, position, values, origin, spacing, clearance):
    """Write a lower bound of the distance of some vertices (n, 3) from the solid [m]."""
    for i in among:
        x, y, z = seen_from(rotation, position, vertices, i)
        clearance[i] = sure_clearance(distance_at(values, origin, spacing, x, y, z), spacing)
