"""Bounds of where skin is, and where that of a segment may go: between poses, and as it moves."""

import numpy as np

from simcore.compiled import compiled, inlined


@compiled
def write_relative(rotations, positions, rotation, position, out):
    """Write each segment's pose in the device frame as [R | x]."""
    for j in range(out.shape[0]):
        for a in range(3):
            shift = 0.0
            for c in range(3):
                shift += rotation[c, a] * (positions[j, c] - position[c])
            out[j, a, 3] = shift
            for b in range(3):
                total = 0.0
                for c in range(3):
                    total += rotation[c, a] * rotations[j, c, b]
                out[j, a, b] = total


@compiled
def motion_bound(now, then, centre, radius):
    """Return a bound of how far any point of a ball has moved between two poses [m].

    |ΔR c + Δx| + ‖ΔR‖₂ r, where ‖ΔR‖₂ = ‖ΔR‖_F / √2 for a difference of rotations.
    """
    shift = 0.0
    frobenius = 0.0
    for a in range(3):
        d = now[a, 3] - then[a, 3]
        for b in range(3):
            r = now[a, b] - then[a, b]
            d += r * centre[b]
            frobenius += r * r
        shift += d * d
    return np.sqrt(shift) + np.sqrt(frobenius / 2) * radius


@compiled
def poses_ahead(now, then, times):
    """Return where poses [R | x] come by that go on as from `then` to `now`, so many times as far.

    All are (m, 3, 4). They turn along a straight line, put back on the rotations: near where they
    come by if they turn little.
    """
    ahead = now + times * (now - then)
    for pose in ahead:
        x, y, z = pose[0, 0], pose[1, 0], pose[2, 0]
        long = np.sqrt(x * x + y * y + z * z)
        x, y, z = x / long, y / long, z / long
        along = x * pose[0, 1] + y * pose[1, 1] + z * pose[2, 1]
        u, v, w = pose[0, 1] - along * x, pose[1, 1] - along * y, pose[2, 1] - along * z
        long = np.sqrt(u * u + v * v + w * w)
        u, v, w = u / long, v / long, w / long
        pose[0, 0], pose[1, 0], pose[2, 0] = x, y, z
        pose[0, 1], pose[1, 1], pose[2, 1] = u, v, w
        pose[0, 2], pose[1, 2], pose[2, 2] = y * w - z * v, z * u - x * w, x * v - y * u
    return ahead


@compiled
def skin_speeds(
    rotations, positions, velocities, origin, linear_velocity, turn, centre, radius, speed
):
    """Write a bound of the speed of each segment's skin relative to a device (m,) [m/s].

    That of the middle of a ball around the skin, and what turning adds at its surface.

    Parameters
    ----------
    rotations : (m, 3, 3), positions : (m, 3) float64
        Segment frames in the world [m].
    velocities : (m, 6) float64
        Linear and angular velocity in the segment's own axes [m/s, rad/s].
    origin, linear_velocity, turn : (3,) float64
        Of the device, world axes [m, m/s, rad/s].
    centre, radius : (m, 3), (m,) float64
        Of the ball, in the segment's frame [m].
    """
    spin, at, moving = np.empty(3), np.empty(3), np.empty(3)
    for j in range(radius.size):
        c, v = centre[j], velocities[j]
        local = (v[0] + v[4] * c[2] - v[5] * c[1], v[1] + v[5] * c[0] - v[3] * c[2],
                 v[2] + v[3] * c[1] - v[4] * c[0])
        for a in range(3):
            row = rotations[j, a]
            at[a] = row[0] * c[0] + row[1] * c[1] + row[2] * c[2] + positions[j, a] - origin[a]
            moving[a] = row[0] * local[0] + row[1] * local[1] + row[2] * local[2]
            spin[a] = row[0] * v[3] + row[1] * v[4] + row[2] * v[5] - turn[a]
        moving[0] -= linear_velocity[0] + turn[1] * at[2] - turn[2] * at[1]
        moving[1] -= linear_velocity[1] + turn[2] * at[0] - turn[0] * at[2]
        moving[2] -= linear_velocity[2] + turn[0] * at[1] - turn[1] * at[0]
        size = moving[0] * moving[0] + moving[1] * moving[1] + moving[2] * moving[2]
        spins = spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]
        speed[j] = np.sqrt(size) + radius[j] * np.sqrt(spins)


@inlined
def cluster_ball(segment_offsets, segments, centre, weight, spread, radius, pose, c):
    """Return middle and radius (x, y, z, r) [m] of a ball around cluster c: Eq. D4.

    Parameters
    ----------
    segment_offsets, segments, centre, weight, spread, radius
        As in `simcore.body.skin_clusters.SkinClusters`.
    pose : (m, 3, 4) float64
        [R | x] of each segment.
    """
    x = y = z = wide = 0.0
    first_x = first_y = first_z = 0.0
    first = segment_offsets[c]
    for e in range(first, segment_offsets[c + 1]):
        j = segments[e]
        p, q, r = centre[e, 0], centre[e, 1], centre[e, 2]
        here_x = pose[j, 0, 0] * p + pose[j, 0, 1] * q + pose[j, 0, 2] * r + pose[j, 0, 3]
        here_y = pose[j, 1, 0] * p + pose[j, 1, 1] * q + pose[j, 1, 2] * r + pose[j, 1, 3]
        here_z = pose[j, 2, 0] * p + pose[j, 2, 1] * q + pose[j, 2, 2] * r + pose[j, 2, 3]
        x += weight[e] * here_x
        y += weight[e] * here_y
        z += weight[e] * here_z
        if e == first:
            first_x, first_y, first_z = here_x, here_y, here_z
        else:
            wide += spread[e] * np.sqrt(
                (here_x - first_x) ** 2 + (here_y - first_y) ** 2 + (here_z - first_z) ** 2)
    return x, y, z, radius[c] + wide


class SkinTravel:
    """How far skin may have moved as seen from one of its segments.

    Parameters
    ----------
    centre : (m, 3), radius : (m,) float64
        A ball around the skin of each segment, in its frame [m].
    of : int
        The segment.
    """

    def __init__(self, centre: np.ndarray, radius: np.ndarray, of: int):
        self._balls, self._of = (centre, radius), of
        self._pose, self._now = np.zeros((2, len(radius), 3, 4))

    def since(self, segments) -> float:
        """Return how far any may have moved since the mark [m].

        Parameters
        ----------
        segments : SegmentViews
            After forward kinematics.
        """
        self._see(segments)
        return _greatest_motion(self._now, self._pose, *self._balls)

    def mark(self, segments) -> None:
        """Count from where the segments are now."""
        self._see(segments)
        self._pose[:] = self._now

    def _see(self, segments) -> None:
        rotation, position = segments.rotations[self._of], segments.positions[self._of]
        write_relative(segments.rotations, segments.positions, rotation, position, self._now)


@compiled
def _greatest_motion(now, then, centre, radius):
    way = 0.0
    for j in range(radius.size):
        way = max(way, motion_bound(now[j], then[j], centre[j], radius[j]))
    return way
