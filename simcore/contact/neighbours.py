"""Exact nearest-vertex search at little cost: two levels of neighbour lists (Verlet 1967).

The outer list holds, for patches of the device, the skin vertices that can be nearest to any point
of theirs. The inner one says which of the patches can touch: contact looks at all of their points,
and at all of the skin near these. A patch that cannot has a budget of motion, which the skin around
it spends in the device frame. So the lists hold idx(k) of section V.A wherever d_k can be positive,
equal to a search over all pairs.
"""

from collections.abc import Callable

import numpy as np

from simcore.compiled import compiled
from simcore.contact.device_patches import DevicePoints, near_patches
from simcore.contact.neighbour_grid import look_up_clearance
from simcore.contact.patch_budgets import least_budgets, renew_budgets, spend_budgets
from simcore.contact.segment_motion import motion_bound, poses_ahead
from simcore.contact.skin_kinds import (
    SkinKinds,
    greatest_of_kinds,
    least_of_parts,
    list_around,
    parts_around,
)

OUTER_SLACK, INNER_SLACK = (0.003, 0.016), (0.0003, 0.001)
"""Least and greatest motion that each list allows the skin of a part of the body before it is made
again [m]; tuned for time, as is all below, without effect on the result (docs/performance.md)."""

OUTER_LIFE, INNER_LIFE = 20.0, 10.0
"""Between these, as much as it moves within so many updates."""

AHEAD = 0.8
"""Lists are made for where the skin comes by after this part of their lives."""


class Neighbours:
    """Neighbour lists between a skin and a rigid device, both seen from the device.

    Parameters
    ----------
    device : DevicePoints
    kinds : SkinKinds
    parts : tuple of (m + 1,) int64, (p, 3), (p,) float64
        Parts of the skin of each segment, which move with it: offsets, centres and radii of
        `simcore.body.skin_listed.SkinParts` [m].
    rings : tuple of array
        One-ring of each skin vertex, offsets and pairs, as in `simcore.body.skin.Skin`.
    edge_change_rate : (n,) float64
        How much the edges at each vertex can change per motion of the skin around it, 1.
    search_radius : float
        Device vertices farther than this from the skin are free [m].

    Attributes
    ----------
    patches : (a,) int64
        Those with points that can touch.
    first, last : (a,) int64
        Where in `near` the skin vertices are that can be nearest to points of each.
    near : (k,) int64
    listed : (l,) int64
        Skin vertices that these need posed, one-rings included.
    """

    def __init__(
        self,
        device: DevicePoints,
        kinds: SkinKinds,
        parts: tuple[np.ndarray, np.ndarray, np.ndarray],
        rings: tuple[np.ndarray, np.ndarray],
        edge_change_rate: np.ndarray,
        search_radius: float,
    ):
        self._device, self._kinds, self._parts, self._rings = device, kinds, parts, rings
        self._edge_change_rate, self._search_radius = edge_change_rate, search_radius
        segments, count, vertices = len(parts[0]) - 1, len(parts[2]), len(kinds.kind)
        self._outer_pose, self._inner_pose, self._last_pose = np.zeros((3, segments, 3, 4))
        # Of each part: how far it may move, how much of that is left, and its motion in an update.
        self._outer_allowance, self._inner_allowance = np.full((2, count), -1.0)
        self._outer_left, self._inner_left = np.zeros((2, count))
        self._pace = np.zeros(count)
        self._age = 0
        self._clearance, self._mark = np.zeros(vertices), np.zeros(vertices, bool)
        # Skin that tests ask for and that contact does, and which is among them.
        self._asked, self._all_listed = np.empty((2, vertices + 1), np.int64)
        self._known, self._is_listed = np.zeros((2, vertices), np.uint8)
        self._normals = np.empty((vertices, 4))
        none = np.empty(0, np.int64)
        self.patches = self.first = self.last = self.near = self.listed = none
        self._offsets, self._near_patches, self._near_parts = none, none, (none, none)
        self._budget, self._needed = np.empty((2, 0))
        self.rebuilds = np.zeros(2, dtype=np.int64)  # outer, inner

    def update(
        self,
        segments: np.ndarray,
        pose: Callable[[np.ndarray, np.ndarray], None],
        skin: np.ndarray,
    ) -> None:
        """Make the lists valid for the present poses.

        Parameters
        ----------
        segments : (m, 3, 4) float64
            [R | x] of each, device frame [m].
        pose : callable
            `pose(segments, indices)` writes the positions of these skin vertices into `skin`.
        skin : (n, 3) float64
            Skin vertices in the device frame [m], overwritten where needed.
        """
        self._age += 1
        outer_used, inner_used = _used_up(
            segments, *self._parts, self._outer_pose, self._outer_allowance, self._outer_left,
            self._inner_pose, self._inner_allowance, self._inner_left,
        )
        if not inner_used:
            return
        if not self.rebuilds[0]:  # nothing is known of any motion
            self._last_pose[:] = segments
        self._pace = _motions(segments, self._last_pose, *self._parts) / self._age
        if outer_used:
            ahead = self._ahead(segments, OUTER_LIFE, OUTER_SLACK, self._outer_left)
            self._list_near(ahead, pose, skin)
            if (_motions(segments, ahead, *self._parts) > self._outer_allowance).any():
                self._list_near(segments, pose, skin)  # what is to come is too far from here
        self._renew(segments, pose, skin)
        self._last_pose[:] = segments
        self._age = 0

    def _ahead(self, segments, life, bounds, left) -> np.ndarray:
        """Return the poses (m, 3, 4) to make a list for that lives for so many updates at most.

        A list is exact for all poses within its allowance from those that it is made for. It lasts
        longest if skin first comes nearer to these, and then leaves them behind.
        """
        slack = np.maximum(self._slack(life, bounds), left / 2)
        using_up = (self._pace / slack).max()  # by the fastest, an update
        times = AHEAD / max(using_up, 1 / life)
        return poses_ahead(segments, self._last_pose, times / self._age)

    def _slack(self, life, bounds) -> np.ndarray:
        """Return how far each part may move within so many updates, between bounds (p,) [m]."""
        return np.clip(life * self._pace, *bounds)

    def _list_near(self, segments, pose, skin) -> None:
        """Make the outer list for some poses."""
        kinds, radius, grid = self._kinds, self._search_radius, self._device.grid
        patches = self._device.patches
        allowed = self._slack(OUTER_LIFE, OUTER_SLACK)
        way = _motions(segments, self._outer_pose, *self._parts)
        self._outer_pose[:] = segments
        slack = greatest_of_kinds(kinds.offsets, kinds.parts, allowed)
        way = greatest_of_kinds(kinds.offsets, kinds.parts, way)
        due = _come_near(kinds.kind, way, slack, radius, self._clearance)
        pose(self._outer_pose, due)
        look_up_clearance(
            due, skin, grid.origin, grid.edge, grid.shape, grid.clearance, grid.margin,
            self._clearance,
        )
        chosen = due[self._clearance[due] <= radius + slack[kinds.kind[due]]]
        self._near_patches, self._offsets, self.near = near_patches(
            skin, chosen, kinds.kind, slack, patches.points, patches.radius,
            patches.group_centres, patches.group_middle, patches.group_radius, radius,
        )
        self._near_parts = parts_around(
            self._offsets, self.near, kinds.kind, kinds.offsets, kinds.parts, len(allowed)
        )
        self._budget, self._needed = np.full((2, len(self._near_patches)), -1.0)
        self.patches = self.first = self.last = self.listed = self._near_patches[:0]
        self._is_listed[:] = 0
        # Skin that is far from the device may move by as much as it is far.
        least = least_of_parts(
            kinds.offsets, kinds.parts, _least_clearance(kinds.kind, self._clearance, len(slack)),
            len(allowed),
        )
        self._outer_allowance[:] = np.maximum(allowed, least - radius)
        self.rebuilds[0] += 1

    def _renew(self, segments, pose, skin) -> None:
        """Test patches with little left of their budgets, and list those that can touch."""
        stars = self._kinds.star_offsets, self._kinds.star
        rows = self._offsets, self.near
        slack = self._slack(INNER_LIFE, INNER_SLACK)
        ahead = self._ahead(segments, INNER_LIFE, INNER_SLACK, self._inner_left)
        # What is tested there has to hold here too.
        slack += 2 * _motions(segments, ahead, *self._parts)
        way = _motions(ahead, self._inner_pose, *self._parts)
        self._inner_pose[:] = ahead
        due = spend_budgets(*self._near_parts, way, slack, self._budget, self._needed)
        count = list_around(due, *rows, *stars, self._asked, 0, self._known)
        asked = self._asked[:count]
        self._known[asked] = 0
        pose(self._inner_pose, asked)
        renew_budgets(
            self._near_patches, *rows, due, self._needed, self._device.patches.points, skin,
            *self._rings, self._edge_change_rate, self._search_radius, self._normals, self._mark,
            self._budget,
        )
        came = due[np.isinf(self._budget[due])]
        if len(came):
            active = np.isinf(self._budget)
            self.patches = self._near_patches[active]
            self.first, self.last = self._offsets[:-1][active], self._offsets[1:][active]
            count = list_around(
                came, *rows, *stars, self._all_listed, len(self.listed), self._is_listed
            )
            self.listed = self._all_listed[:count]
        self._inner_allowance[:] = least_budgets(*self._near_parts, self._budget, len(self._pace))
        self.rebuilds[1] += 1


@compiled
def _motions(now, then, part_offsets, centre, radius):
    """Return bounds of how far the skin of each part is between two poses (p,) [m]."""
    moved = np.empty(radius.size)
    for j in range(now.shape[0]):
        for part in range(part_offsets[j], part_offsets[j + 1]):
            moved[part] = motion_bound(now[j], then[j], centre[part], radius[part])
    return moved


@compiled
def _used_up(
    segments, part_offsets, centre, radius, outer_pose, outer_allowance, outer_left, inner_pose,
    inner_allowance, inner_left,
):
    """Return whether any part's skin may have moved beyond its outer, and inner, allowance.

    Writes how much of either is left [m].
    """
    outer = inner = False
    for j in range(segments.shape[0]):
        for part in range(part_offsets[j], part_offsets[j + 1]):
            moved = motion_bound(segments[j], outer_pose[j], centre[part], radius[part])
            outer_left[part] = outer_allowance[part] - moved
            outer = outer or outer_left[part] < 0
            moved = motion_bound(segments[j], inner_pose[j], centre[part], radius[part])
            inner_left[part] = inner_allowance[part] - moved
            inner = inner or inner_left[part] < 0
    return outer, outer or inner


@compiled
def _come_near(kind, way, slack, radius, clearance):
    """Take motions off the clearances (n,); return the vertices that can come within the radius.

    `way` and `slack` (k,) are how far each kind has moved, and may move [m].
    """
    due, count = np.empty(clearance.size, np.int64), 0
    for i in range(clearance.size):
        clearance[i] -= way[kind[i]]
        due[count] = i
        count += clearance[i] <= radius + slack[kind[i]]
    return due[:count].copy()


@compiled
def _least_clearance(kind, clearance, count):
    """Return the least clearance of each of so many kinds [m]."""
    least = np.full(count, np.inf)
    for i in range(kind.size):
        least[kind[i]] = min(least[kind[i]], clearance[i])
    return least
