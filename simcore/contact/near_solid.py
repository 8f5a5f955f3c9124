"""Which skin vertices are near a solid, kept until another may have come so near unseen."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.distance_lookup import distance_and_gradient, seen_from, way_to_touch
from simcore.contact.segment_motion import motion_bound, skin_speeds, write_relative

OUTER_REACH = 0.05
"""Vertices nearer to the solid than this are looked at when the list is made anew [m]."""

INNER_REACH, HEADWAY = 0.004, 2.0
"""Of what is nearer than this [m], and so many times the way the skin of its segment makes in the
time looked ahead, it is asked at every step whether it can touch. Tuned for time, as is
`OUTER_REACH`; of the result they change no more than what Eq. I3 is told of clearances."""


class NearSolid:
    """The list of the skin vertices that may touch a solid, or will within a time.

    It is drawn from two tiers, each of which lasts until something may have come near unseen.

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
        self._balls = skin[2:]
        field = values, origin, spacing
        self._outer, self._inner = _Tier(field, skin), _Tier(field, skin)
        self._ways, self._spent = np.empty((2, len(segment_radius)))
        self.listed = self._all[:0]
        self.rebuilds = 0

    def update(self, segments, device, ahead: float, pose, vertices: np.ndarray) -> None:
        """Make the list valid for the present poses, and for a time from now.

        Parameters
        ----------
        segments : SegmentViews
            After forward kinematics with velocities.
        device : DeviceState
        ahead : float
            No skin vertex that would touch within this time, as it moves now, is left out [s].
        pose : callable
            Writes given skin vertices into `vertices`.
        vertices : (n, 3) float64
            Skin in the world, where posed [m].
        """
        at = segments.rotations, segments.positions, device.rotation, device.position
        inner, outer = self._inner, self._outer
        outer_stale, inner_stale = _stale(
            *at, segments.velocities, device.linear_velocity, device.angular_velocity,
            *self._balls, ahead, outer.pose, outer.allowance, inner.pose, inner.allowance,
            self._ways, self._spent,
        )
        if outer_stale:
            outer.look(self._all, at, OUTER_REACH + HEADWAY * self._ways, pose, vertices)
            inner.take(outer)
            self.rebuilds += 1
        if outer_stale or inner_stale:
            inner.look(outer.near, at, INNER_REACH + HEADWAY * self._ways, pose, vertices)
            self._spent[:] = self._ways
        self.listed = inner.touchable(self._spent)

    def pace(self, segments, device, motion: float) -> float:
        """Return the time within which no skin moves farther than told, or than it is away [s]."""
        outer = self._outer
        return _pace(
            segments.rotations, segments.positions, device.rotation, device.position,
            segments.velocities, device.linear_velocity, device.angular_velocity, *self._balls,
            outer.pose, outer.clearance, motion,
        )


class _Tier:
    """The vertices within a reach, until another may touch.

    Of every vertex it knows a bound of the way to the solid. What the skin has moved since is taken
    off it, and only where too little is left is the distance looked up again.
    """

    def __init__(self, field: tuple, skin: tuple):
        self._field, self._influences, self._balls = field, skin[:2], skin[2:]
        segments = len(skin[3])
        self._bound, self._moved = np.zeros(len(skin[0]) - 1), np.empty(segments)
        self.pose = np.zeros((segments, 3, 4))
        self.allowance = np.full(segments, -1.0)
        self.clearance = np.zeros(segments)
        self.used = np.zeros(segments, bool)
        self.near = np.empty(0, np.int64)

    def take(self, other: "_Tier") -> None:
        """Know what another tier knows."""
        self._bound[:], self.pose[:] = other._bound, other.pose

    def look(self, among: np.ndarray, at: tuple, reach: np.ndarray, pose, vertices) -> None:
        """Find the vertices within the reach of a segment (m,) [m] that they belong to.

        Those that are not among the ones given are far for other reasons. `allowance` is how far
        each segment's skin may then move until a vertex that is not near touches [m], `used`
        whether it has one that is.
        """
        _move_on(*at, *self._balls, self.pose, self._moved)
        due = _take_off(among, *self._influences, self._moved, reach, self._bound)
        pose(due)
        _look_up(due, vertices, *at[2:], *self._field, self._bound)
        self.near = _within(
            among, self._bound, *self._influences, reach, self.clearance, self.used
        )
        self.allowance = np.where(self.used, reach, np.maximum(self.clearance, reach))
        self.clearance[self.used] = 0.0

    def touchable(self, spent: np.ndarray) -> np.ndarray:
        """Return those near whose segments' skin has come as far as they were away (m,) [m]."""
        return _touchable(self.near, self._bound, *self._influences, spent)


@compiled
def _stale(
    rotations, positions, rotation, position, velocities, linear_velocity, turn, centre, radius,
    ahead, outer_pose, outer_allowance, inner_pose, inner_allowance, ways, spent,
):
    """Return whether skin outside of each tier may have moved so far as to touch, or will so soon.

    Writes how far each segment's skin goes in the time ahead (m,) [m], and together with what it
    has moved since the inner tier looked.
    """
    now = np.empty((rotations.shape[0], 3, 4))
    write_relative(rotations, positions, rotation, position, now)
    skin_speeds(
        rotations, positions, velocities, position, linear_velocity, turn, centre, radius, ways)
    outer = inner = False
    for j in range(now.shape[0]):
        ways[j] *= ahead
        since = motion_bound(now[j], outer_pose[j], centre[j], radius[j])
        outer = outer or since + ways[j] > outer_allowance[j]
        spent[j] = motion_bound(now[j], inner_pose[j], centre[j], radius[j]) + ways[j]
        inner = inner or spent[j] > inner_allowance[j]
    return outer, inner


@compiled
def _pace(
    rotations, positions, rotation, position, velocities, linear_velocity, turn, centre, radius,
    pose, clearance, motion,
):
    """Return the least of the segments' times for a motion, or for what is left of a clearance."""
    now, speed = np.empty((rotations.shape[0], 3, 4)), np.empty(rotations.shape[0])
    write_relative(rotations, positions, rotation, position, now)
    skin_speeds(
        rotations, positions, velocities, position, linear_velocity, turn, centre, radius, speed)
    least = np.inf
    for j in range(now.shape[0]):
        left = clearance[j] - motion_bound(now[j], pose[j], centre[j], radius[j])
        least = min(least, max(left, motion) / speed[j])
    return least


@compiled
def _move_on(rotations, positions, rotation, position, centre, radius, pose, moved):
    """Write how far each segment's skin has moved at most (m,) [m], and where it is now."""
    now = np.empty((rotations.shape[0], 3, 4))
    write_relative(rotations, positions, rotation, position, now)
    for j in range(now.shape[0]):
        moved[j] = motion_bound(now[j], pose[j], centre[j], radius[j])
        pose[j] = now[j]


@compiled
def _take_off(among, offsets, segments, moved, reach, bound):
    """Take motions off the bounds of some vertices; return those of which too little is left."""
    due, count = np.empty(among.size, np.int64), 0
    for i in among:
        way = most = 0.0
        for e in range(offsets[i], offsets[i + 1]):
            way = max(way, moved[segments[e]])
            most = max(most, reach[segments[e]])
        bound[i] -= way
        if bound[i] < most:
            due[count] = i
            count += 1
    return due[:count].copy()


@compiled
def _look_up(due, vertices, rotation, position, values, origin, spacing, bound):
    """Write the ways to the solid of some vertices (n, 3) [m]."""
    for i in due:
        x, y, z = seen_from(rotation, position, vertices, i)
        phi, _, _, _ = distance_and_gradient(values, origin, spacing, x, y, z)
        bound[i] = way_to_touch(phi, spacing)


@compiled
def _touchable(near, bound, offsets, segments, spent):
    """Return the vertices whose bound is used up."""
    left, count = np.empty(near.size, np.int64), 0
    for i in near:
        way = 0.0
        for e in range(offsets[i], offsets[i + 1]):
            way = max(way, spent[segments[e]])
        if bound[i] <= way:
            left[count] = i
            count += 1
    return left[:count].copy()


@compiled
def _within(among, bound, offsets, segments, reach, nearest, used):
    """Return the vertices within reach; write each segment's least bound, and if it has any."""
    nearest[:] = np.inf
    used[:] = False
    near, count = np.empty(among.size, np.int64), 0
    for i in among:
        most = 0.0
        for e in range(offsets[i], offsets[i + 1]):
            most = max(most, reach[segments[e]])
        if bound[i] < most:
            near[count] = i
            count += 1
        for e in range(offsets[i], offsets[i + 1]):
            j = segments[e]
            nearest[j] = min(nearest[j], bound[i])
            used[j] = used[j] or bound[i] < most
    return near[:count].copy()
