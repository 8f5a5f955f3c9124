"""Exact nearest-vertex search at little cost: two levels of neighbour lists (Verlet 1967).

The outer list holds, for patches of the device, the skin vertices that can be nearest to any point
of theirs. The inner one is cut from it: the device points that can touch, and for each of them the
skin vertices that can be its nearest. Each patch of it lasts until the skin around it may have
moved, in the device frame, by more than its budget; patches that touch nothing have large ones. So
the lists hold idx(k) of section V.A wherever d_k can be positive, equal to a search over all pairs.
"""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.neighbour_grid import (
    DevicePoints,
    look_up_clearance,
    near_patches,
    to_device,
)
from simcore.contact.neighbour_rows import keep_budgets, renew_rows, spend_budgets
from simcore.contact.segment_motion import motion_bound, write_relative

OUTER_SLACK, INNER_SLACK = (0.003, 0.016), (0.0005, 0.0015)
"""Least and greatest motion that each list allows the skin of a part of the body before it is made
again [m]; tuned for time, as is all below, without effect on the result (docs/performance.md)."""

OUTER_LIFE, INNER_LIFE = 20.0, 20.0
"""Between these, as much as it moves within so many updates."""


SEEN_BEYOND = 0.010
"""Skin is looked at so much beyond the search radius [m], so that patches may keep their rows."""


class Neighbours:
    """Neighbour lists between a skin and a rigid device.

    Parameters
    ----------
    device : DevicePoints
    influence_offsets : (n + 1,) int64
        Skin as in `simcore.body.skin.Skin`.
    part_offsets, influence_part, part_centre, part_radius
        Parts of the skin of each segment, which move with it: `simcore.body.skin_listed.SkinParts`.
    ring_offsets, ring_next
        One-ring of each skin vertex, as in `Skin`.
    edge_change_rate : (n,) float64
        How much the edges at each vertex can change per motion of the skin around it, 1.
    search_radius : float
        Device vertices farther than this from the skin are free [m].

    Attributes
    ----------
    rows, offsets, candidates
        Inner list: device vertices, and the skin vertices that can be their nearest, as CSR.
    listed : (l,) int64
        Skin vertices that the inner list needs posed, one-rings included.
    """

    def __init__(
        self,
        device: DevicePoints,
        influence_offsets: np.ndarray,
        part_offsets: np.ndarray,
        influence_part: np.ndarray,
        part_centre: np.ndarray,
        part_radius: np.ndarray,
        ring_offsets: np.ndarray,
        ring_next: np.ndarray,
        edge_change_rate: np.ndarray,
        search_radius: float,
    ):
        self._device_vertices, self._grid = device.vertices, device.grid
        self._influences = influence_offsets, influence_part
        self._rings = ring_offsets, ring_next
        self._search_radius = search_radius
        self._edge_change_rate = edge_change_rate
        patches = device.patches
        self._patches = (
            patches.offsets, patches.vertex, patches.centre, patches.radius, patches.size
        )
        self._parts = part_offsets, part_centre, part_radius
        segments, parts, count = len(part_offsets) - 1, len(part_radius), len(influence_offsets) - 1
        self._outer_pose, self._inner_pose = np.zeros((2, segments, 3, 4))
        # Of each part: how far it may move, how far it has, and how far it has in an update.
        self._outer_allowance, self._inner_allowance = np.full((2, parts), -1.0)
        self._outer_motion, self._inner_motion = np.zeros((2, parts))
        self._pace = np.zeros(parts)
        self._age = 0
        self._clearance, self._slack = np.zeros((2, count))
        self._stars = _stars(*self._rings)
        self._around = _parts_around(*self._influences, *self._stars)
        self._kind = _kinds(*self._around)
        self._normals, self._known = np.empty((count, 4)), np.zeros(count, bool)
        self._skin_in_device = np.empty((count, 3))
        none = np.empty(0, np.int64)
        self.rows, self.offsets, self.candidates = none, np.zeros(1, np.int64), none
        self._near, self._near_parts = [none, np.zeros(1, np.int64), none], (none, none)
        self._budget, self._needed, self._complete = np.empty((3, 0))
        self._row_spans = np.empty((0, 2), np.int64)
        self._stale = True
        self.rebuilds = np.zeros(2, dtype=np.int64)  # outer, inner

    def update(self, rotations, positions, device, pose, vertices) -> None:
        """Make the lists valid for the present poses.

        Parameters
        ----------
        rotations : (m, 3, 3), positions : (m, 3)
            Segment frames in the world.
        device : DeviceState-like
            `rotation`, `position` of the device frame in the world.
        pose : callable
            `pose(indices)` writes these skin vertices' positions into `vertices`.
        vertices : (n, 3) float64
            World positions of the skin vertices [m], overwritten where needed.
        """
        self._age += 1
        outer_used, inner_used = _used_up(
            rotations, positions, device.rotation, device.position, *self._parts,
            self._outer_pose, self._outer_allowance, self._outer_motion,
            self._inner_pose, self._inner_allowance, self._inner_motion,
        )
        if not inner_used:
            return
        if self._stale:  # nothing is known of any motion
            self._outer_motion[:], self._stale = np.inf, False
        else:
            self._pace[:] = self._inner_motion / self._age
        if outer_used:
            self._spend()
            self._inner_motion[:] = 0.0
            self._build_outer(device, pose, vertices)
            write_relative(rotations, positions, device.rotation, device.position, self._outer_pose)
        self._build_inner(device, pose, vertices)
        write_relative(rotations, positions, device.rotation, device.position, self._inner_pose)
        self._age = 0

    def _build_outer(self, device, pose, vertices) -> None:
        grid, radius = self._grid, self._search_radius
        allowed = np.clip(OUTER_LIFE * self._pace, *OUTER_SLACK)
        due = _come_near(
            *self._influences, self._outer_motion, allowed, radius + SEEN_BEYOND, self._clearance,
            self._slack,
        )
        # Patches have seen all vertices as near as this, but for what moved farther than allowed.
        seen = np.minimum(self._complete, radius + SEEN_BEYOND - self._patches[3][self._near[0]])
        seen -= max(0.0, (self._outer_motion - self._outer_allowance).max())
        pose(due)
        to_device(due, vertices, device.rotation, device.position, self._skin_in_device)
        look_up_clearance(
            due, self._skin_in_device, grid.origin, grid.edge, grid.shape, grid.clearance,
            grid.margin, self._clearance,
        )
        before = self._near[0], self._budget, self._row_spans, seen
        chosen = due[self._clearance[due] <= radius + SEEN_BEYOND + self._slack[due]]
        *self._near, nearest, self._complete = near_patches(
            self._skin_in_device, chosen, self._slack, *self._patches[2:4], radius
        )
        self._near_parts = _parts_of(*self._near[1:], *self._around, self._kind, len(allowed))
        self._budget, self._needed = np.empty((2, len(nearest)))
        self._row_spans = np.empty((len(nearest), 2), np.int64)
        keep_budgets(
            *before, self._near[0], nearest, self._patches[3], self._budget, self._row_spans
        )
        # Skin that is far from the device may move by as much as it is far.
        least = _nearest_by_part(*self._influences, self._clearance, len(allowed))
        self._outer_allowance[:] = np.maximum(allowed, least - radius - SEEN_BEYOND)
        self._outer_allowance[self._near_parts[1]] = allowed[self._near_parts[1]]
        self.rebuilds[0] += 1

    def _build_inner(self, device, pose, vertices) -> None:
        due, around = self._spend()
        needed = _with_stars(around, *self._stars, self._known)
        pose(needed)
        to_device(needed, vertices, device.rotation, device.position, self._skin_in_device)
        self.rows, self.offsets, self.candidates = renew_rows(
            *self._near, *self._near_parts, due, self._needed, *self._patches, self._budget,
            self._row_spans, self.rows, self.offsets, self.candidates, self._skin_in_device,
            *self._rings, self._edge_change_rate, self._device_vertices, self._search_radius,
            self._normals, around, self._known, self._inner_allowance,
        )
        self.listed = _with_stars(self.candidates, *self._stars, self._known)
        self.rebuilds[1] += 1

    def _spend(self) -> tuple[np.ndarray, np.ndarray]:
        """Return which patches are due, and the skin around them."""
        slack = np.clip(INNER_LIFE * self._pace, *INNER_SLACK)
        return spend_budgets(
            *self._near_parts, self._inner_motion, slack, *self._near[1:], self._budget,
            self._needed, self._known,
        )


@compiled
def _used_up(
    rotations, positions, rotation, position, part_offsets, centre, radius, outer_pose,
    outer_allowance, outer_motion, inner_pose, inner_allowance, inner_motion,
):
    """Return whether any part's skin may have moved beyond its outer, and inner, allowance.

    Writes how far each has moved at most since either list was made [m].
    """
    now = np.empty((rotations.shape[0], 3, 4))
    write_relative(rotations, positions, rotation, position, now)
    outer = inner = False
    for j in range(now.shape[0]):
        for part in range(part_offsets[j], part_offsets[j + 1]):
            moved = motion_bound(now[j], outer_pose[j], centre[part], radius[part])
            outer = outer or moved > outer_allowance[part]
            outer_motion[part] = moved
            moved = motion_bound(now[j], inner_pose[j], centre[part], radius[part])
            inner = inner or moved > inner_allowance[part]
            inner_motion[part] = moved
    return outer, outer or inner


@compiled
def _come_near(offsets, parts, moved, allowed, radius, clearance, slack):
    """Take motions off the clearances; return the vertices that can come within the radius.

    Writes the slack of each vertex, the greatest allowed to a part that it belongs to.
    """
    due, count = np.empty(clearance.size, np.int64), 0
    for i in range(clearance.size):
        way = most = 0.0
        for e in range(offsets[i], offsets[i + 1]):
            way = max(way, moved[parts[e]])
            most = max(most, allowed[parts[e]])
        clearance[i] -= way
        slack[i] = most
        if clearance[i] <= radius + most:
            due[count] = i
            count += 1
    return due[:count].copy()


@compiled
def _stars(ring_offsets, ring_next):
    """Return the vertices of each one-ring, each once, as CSR."""
    count = ring_offsets.size - 1
    starts, star = np.zeros(count + 1, np.int64), np.empty(2 * ring_next.shape[0] + 1, np.int64)
    seen, total = np.full(count, -1), 0
    for i in range(count):
        for e in range(ring_offsets[i], ring_offsets[i + 1]):
            for a in range(2):
                b = ring_next[e, a]
                star[total] = b
                total += seen[b] != i
                seen[b] = i
        starts[i + 1] = total
    return starts, star[:total].copy()


@compiled
def _parts_around(offsets, parts, star_offsets, star):
    """Return the parts that each vertex and those next to it belong to, as CSR."""
    count = offsets.size - 1
    starts, around = np.zeros(count + 1, np.int64), np.empty(4 * parts.size, np.int64)
    seen = np.full(parts.max() + 1, -1)
    total = 0
    for i in range(count):
        while total + seen.size >= around.size:
            around = np.concatenate((around, around))
        for f in range(star_offsets[i] - 1, star_offsets[i + 1]):
            s = i if f < star_offsets[i] else star[f]
            for e in range(offsets[s], offsets[s + 1]):
                around[total] = parts[e]
                total += seen[parts[e]] != i
                seen[parts[e]] = i
        starts[i + 1] = total
    return starts, around[:total].copy()


def _kinds(offsets: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Return a number for each vertex (n,), the same where the parts around are the same."""
    word = np.zeros((len(offsets) - 1, around.max() // 60 + 1), np.int64)
    owner = np.repeat(np.arange(len(word)), np.diff(offsets))
    np.add.at(word, (owner, around // 60), 1 << around % 60)
    kind = np.zeros(len(word), np.int64)
    for column in word.T:
        kind = np.unique(kind, return_inverse=True)[1] * len(word)
        kind += np.unique(column, return_inverse=True)[1]
    return np.unique(kind, return_inverse=True)[1]


@compiled
def _parts_of(offsets, candidates, around_offsets, around, kind, count):
    """Return the parts that the candidates of each patch move with, as CSR."""
    starts, parts = np.zeros(offsets.size, np.int64), np.empty(8 * offsets.size + count, np.int64)
    seen, met = np.full(count, -1), np.full(kind.size, -1)
    total = 0
    for p in range(offsets.size - 1):
        while total + count > parts.size:
            parts = np.concatenate((parts, parts))
        for e in range(offsets[p], offsets[p + 1]):
            i = candidates[e]
            if met[kind[i]] == p:
                continue
            met[kind[i]] = p
            for f in range(around_offsets[i], around_offsets[i + 1]):
                if seen[around[f]] != p:
                    seen[around[f]] = p
                    parts[total] = around[f]
                    total += 1
        starts[p + 1] = total
    return starts, parts[:total].copy()


@compiled
def _nearest_by_part(offsets, parts, clearance, count):
    """Return each part's least skin clearance [m]."""
    nearest = np.full(count, np.inf)
    for i in range(clearance.size):
        for e in range(offsets[i], offsets[i + 1]):
            nearest[parts[e]] = min(nearest[parts[e]], clearance[i])
    return nearest


@compiled
def _with_stars(chosen, star_offsets, star, mark):
    """Return the chosen vertices and those next to them, each once; `mark` (n,) is all false."""
    listed, count = np.empty(mark.size + 1, np.int64), 0
    # Without branches, which would be mispredicted half of the times.
    for s in chosen:
        listed[count] = s
        count += not mark[s]
        mark[s] = True
    for place in range(count):
        s = listed[place]
        for e in range(star_offsets[s], star_offsets[s + 1]):
            listed[count] = star[e]
            count += not mark[star[e]]
            mark[star[e]] = True
    for place in range(count):
        mark[listed[place]] = False
    return listed[:count].copy()
