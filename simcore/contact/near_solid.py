"""Which skin vertices are near a solid, kept until another may have come so near unseen."""

import numpy as np

from simcore.compiled import compiled, inlined
from simcore.contact.distance_lookup import (
    AT_ONCE,
    distance_and_gradient,
    look_up,
    way_to_touch,
)
from simcore.contact.segment_motion import (
    cluster_ball,
    motion_bound,
    skin_speeds,
    write_relative,
)

REACH, HEADWAY = 0.004, 2.0
"""Of what is nearer to the solid than this [m], and so many times the way the skin of its segment
makes in the time looked ahead, it is asked at every step whether it can touch. Tuned for time; of
the result they change no more than what Eq. I3 is told of clearances."""


class NearSolid:
    """The list of the skin vertices that may touch a solid, or will within a time.

    Of every cluster of the skin, and of every vertex in those that are near, it knows a bound of
    the way to the solid. What the skin has moved since is taken off it, and only where too little
    is left the distance is looked up again: when something may have come near unseen.

    Parameters
    ----------
    values, origin, spacing
        Distance of the solid, in its frame (`simcore.contact.distance_lookup`).
    influences : tuple of array
        Offsets, segment, weight and point, as in `simcore.body.skin.Skin`.
    clusters, carriers : tuple of array
        As `simcore.body.skin_clusters.SkinClusters` and `SkinCarriers` have them.
    segment_centre, segment_radius : (m, 3), (m,) float64
        A ball around the skin of each segment, in its frame [m].

    Attributes
    ----------
    listed : (l,) int64, sorted
    looks : int
        How often distances were looked up again.
    """

    def __init__(
        self, values, origin, spacing, influences: tuple, clusters: tuple, carriers: tuple,
        segment_centre, segment_radius,
    ):
        self._field = values, origin, spacing
        self._influences, self._clusters, self._carriers = influences, clusters, carriers
        self._balls = segment_centre, segment_radius
        segments = len(segment_radius)
        self._ways, self._spent, self._clearance = np.zeros((3, segments))
        self._pose, self._allowance = np.zeros((segments, 3, 4)), np.full(segments, -1.0)
        self._gap, self._bound = np.zeros(len(clusters[0]) - 1), np.zeros(len(influences[0]) - 1)
        self._is_near = np.zeros(len(self._gap), bool)
        self._near = self.listed = np.empty(0, np.int64)
        self.looks = 0

    def update(self, segments, device, ahead: float) -> None:
        """Make the list valid for the present poses, and for a time from now.

        Parameters
        ----------
        segments : SegmentViews
            After forward kinematics with velocities.
        device : DeviceState
        ahead : float
            No skin vertex that would touch within this time, as it moves now, is left out [s].
        """
        at = segments.rotations, segments.positions, device.rotation, device.position
        if _stale(
            *at, segments.velocities, device.linear_velocity, device.angular_velocity,
            *self._balls, ahead, self._pose, self._allowance, self._ways, self._spent,
        ):
            near = _look(
                *at, *self._balls, *self._clusters, *self._carriers, *self._influences,
                *self._field,
                REACH + HEADWAY * self._ways, self._pose, self._gap, self._is_near,
                self._bound, self._clearance, self._allowance,
            )
            self._near = np.sort(near)  # as they lie in memory
            self._spent[:] = self._ways
            self.looks += 1
        self.listed = _touchable(self._near, self._bound, *self._carriers, self._spent)

    def pace(self, segments, device, motion: float) -> float:
        """Return the time within which no skin moves farther than told, or half way there [s]."""
        return _pace(
            segments.rotations, segments.positions, device.rotation, device.position,
            segments.velocities, device.linear_velocity, device.angular_velocity, *self._balls,
            self._pose, self._clearance, motion,
        )


@compiled
def _stale(
    rotations, positions, rotation, position, velocities, linear_velocity, turn, centre, radius,
    ahead, pose, allowance, ways, spent,
):
    """Return whether skin that is not near may have moved so far as to touch, or will so soon.

    Writes how far each segment's skin goes in the time ahead (m,) [m], and together with what it
    has moved since the last look.
    """
    now = np.empty((rotations.shape[0], 3, 4))
    write_relative(rotations, positions, rotation, position, now)
    skin_speeds(
        rotations, positions, velocities, position, linear_velocity, turn, centre, radius, ways)
    stale = False
    for j in range(now.shape[0]):
        ways[j] *= ahead
        spent[j] = motion_bound(now[j], pose[j], centre[j], radius[j]) + ways[j]
        stale = stale or spent[j] > allowance[j]
    return stale


@compiled
def _pace(
    rotations, positions, rotation, position, velocities, linear_velocity, turn, centre, radius,
    pose, clearance, motion,
):
    """Return the least of the segments' times for a motion, or half of what is left of the way."""
    now, speed = np.empty((rotations.shape[0], 3, 4)), np.empty(rotations.shape[0])
    write_relative(rotations, positions, rotation, position, now)
    skin_speeds(
        rotations, positions, velocities, position, linear_velocity, turn, centre, radius, speed)
    least = np.inf
    for j in range(now.shape[0]):
        left = clearance[j] - motion_bound(now[j], pose[j], centre[j], radius[j])
        least = min(least, max(left / 2, motion) / speed[j])
    return least


@compiled
def _look(
    rotations, positions, rotation, position, centre, radius, offsets, members, ball_offsets,
    ball_segment, ball_centre, ball_weight, ball_spread, ball_radius, carriers, carrier_offsets,
    carrier_segments, influences, segments, weights, points, values, origin, spacing, reach, pose,
    gap, is_near, bound, clearance, allowance,
):
    """Return the vertices within the reach of a segment (m,) [m] that they belong to.

    Writes how far each segment's skin may then move until a vertex that is not near touches, and
    from how far it is away as a whole (m,) [m].
    """
    now, moved = np.empty((rotations.shape[0], 3, 4)), np.empty(reach.size)
    write_relative(rotations, positions, rotation, position, now)
    for j in range(reach.size):
        moved[j] = motion_bound(now[j], pose[j], centre[j], radius[j])
        pose[j] = now[j]
    way_of = _greatest_of_each(carrier_offsets, carrier_segments, moved)
    reach_of = _greatest_of_each(carrier_offsets, carrier_segments, reach)
    least = np.full(way_of.size, np.inf)
    asked, count = np.empty(bound.size, np.int64), 0
    clearance[:] = np.inf
    for c in range(gap.size):
        way = _greatest(moved, ball_offsets, ball_segment, c)
        most = _greatest(reach, ball_offsets, ball_segment, c)
        gap[c] -= way
        if gap[c] < most:
            x, y, z, wide = cluster_ball(
                ball_offsets, ball_segment, ball_centre, ball_weight, ball_spread, ball_radius,
                pose, c)
            phi, _, _, _ = distance_and_gradient(values, origin, spacing, x, y, z)
            gap[c] = way_to_touch(phi, spacing) - wide
        if gap[c] >= most:
            is_near[c] = False
            _lessen(clearance, ball_offsets, ball_segment, c, gap[c])
            continue
        for m in range(offsets[c], offsets[c + 1]):
            i = members[m]
            k = carriers[i]
            # Of a cluster that was far, nothing is known of its vertices.
            bound[i] = bound[i] - way_of[k] if is_near[c] else -np.inf
            if bound[i] < reach_of[k]:
                asked[count] = i
                count += 1
            else:
                least[k] = min(least[k], bound[i])
        is_near[c] = True
    asked = asked[:count]
    _look_up(values, origin, spacing, influences, segments, weights, points, pose, asked, bound)
    count = 0
    for i in asked:
        k = carriers[i]
        least[k] = min(least[k], bound[i])
        if bound[i] < reach_of[k]:
            asked[count] = i
            count += 1
    for k in range(least.size):
        _lessen(clearance, carrier_offsets, carrier_segments, k, least[k])
    for j in range(reach.size):
        allowance[j] = max(clearance[j], reach[j])
    return asked[:count].copy()


@compiled
def _look_up(values, origin, spacing, influences, segments, weights, points, pose, asked, bound):
    """Write the bounds of the vertices that are asked for, where segment poses have them [m]."""
    place, told = np.empty((3, AT_ONCE)), np.empty((4, AT_ONCE))
    for first in range(0, asked.size, AT_ONCE):
        block = asked[first : first + AT_ONCE]
        for k in range(block.size):
            place[0, k], place[1, k], place[2, k] = _blend(
                influences, segments, weights, points, pose, block[k])
        look_up(values, origin, spacing, place, np.uint64(block.size), told)
        for k in range(block.size):
            bound[block[k]] = way_to_touch(told[0, k], spacing)


@inlined
def _lessen(clearance, offsets, segments, i, bound):
    """Bring the clearances of the segments of row i down to a bound [m]."""
    for e in range(offsets[i], offsets[i + 1]):
        clearance[segments[e]] = min(clearance[segments[e]], bound)


@inlined
def _greatest(values, offsets, segments, i):
    """Return the greatest of what the segments of row i have, or 0."""
    most = 0.0
    for e in range(offsets[i], offsets[i + 1]):
        most = max(most, values[segments[e]])
    return most


@compiled
def _greatest_of_each(offsets, segments, values):
    """Return the same of every row."""
    most = np.empty(offsets.size - 1)
    for i in range(most.size):
        most[i] = _greatest(values, offsets, segments, i)
    return most


@inlined
def _blend(offsets, segments, weights, points, pose, i):
    """Return where vertex i is in the frame of segment poses (m, 3, 4) [m]: Eq. 3."""
    x = y = z = 0.0
    for e in range(offsets[i], offsets[i + 1]):
        j, w = segments[e], weights[e]
        p, q, r = points[e, 0], points[e, 1], points[e, 2]
        x += w * (pose[j, 0, 0] * p + pose[j, 0, 1] * q + pose[j, 0, 2] * r + pose[j, 0, 3])
        y += w * (pose[j, 1, 0] * p + pose[j, 1, 1] * q + pose[j, 1, 2] * r + pose[j, 1, 3])
        z += w * (pose[j, 2, 0] * p + pose[j, 2, 1] * q + pose[j, 2, 2] * r + pose[j, 2, 3])
    return x, y, z


@compiled
def _touchable(near, bound, carriers, carrier_offsets, carrier_segments, spent):
    """Return the vertices whose bound is used up."""
    way_of = _greatest_of_each(carrier_offsets, carrier_segments, spent)
    left, count = np.empty(near.size, np.int64), 0
    for i in near:
        if bound[i] <= way_of[carriers[i]]:
            left[count] = i
            count += 1
    return left[:count].copy()
