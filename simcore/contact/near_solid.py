"""Which skin vertices are near a rigid solid, kept until something may have come near unseen."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.distance_lookup import distance_at, sure_clearance
from simcore.contact.neighbours import motion_bound, nearest_by_segment, write_relative

REACH = 0.03
"""Vertices nearer to the solid than this are listed [m]; tuned for time, without effect on the
result."""

UNSEEN = 0.005
"""So near a vertex never comes without being listed [m]: an impact at 1 m/s in 5 ms."""


class NearSolid:
    """The list of the skin vertices that may touch a solid.

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
    """

    def __init__(
        self, values, origin, spacing, influence_offsets, influence_segment, segment_centre,
        segment_radius,
    ):
        self._field = values, origin, spacing
        self._influences = influence_offsets, influence_segment
        self._balls = segment_centre, segment_radius
        count = len(influence_offsets) - 1
        self._all, self._clearance = np.arange(count), np.empty(count)
        self._pose = np.zeros((len(segment_radius), 3, 4))
        self._allowance = np.full(len(segment_radius), -1.0)
        self.listed = self._all[:0]
        self.rebuilds = 0

    def update(self, rotations, positions, device, pose, vertices) -> None:
        """Make the list valid for the present poses; parameters as of `Neighbours.update`."""
        if not _moved(
            rotations, positions, device.rotation, device.position, *self._balls, self._pose,
            self._allowance,
        ):
            return
        pose(self._all)
        _look_up(vertices, device.rotation, device.position, *self._field, self._clearance)
        self.listed = np.flatnonzero(self._clearance < REACH)
        write_relative(rotations, positions, device.rotation, device.position, self._pose)
        nearest, used = nearest_by_segment(
            *self._influences, self._clearance, self.listed, len(rotations)
        )
        self._allowance = np.where(used, REACH, np.maximum(nearest, REACH)) - UNSEEN
        self.rebuilds += 1


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
def _look_up(vertices, rotation, position, values, origin, spacing, clearance):
    """Write a lower bound of the distance of each vertex (n, 3) from the solid [m]."""
    for i in range(vertices.shape[0]):
        x, y, z = (vertices[i, 0] - position[0], vertices[i, 1] - position[1],
                   vertices[i, 2] - position[2])
        clearance[i] = sure_clearance(
            distance_at(
                values, origin, spacing,
                rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
                rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
                rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z,
            ),
            spacing,
        )
