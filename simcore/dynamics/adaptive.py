"""Steps as long as the motion allows."""

from collections.abc import Callable

import numpy as np

from simcore.compiled import compiled
from simcore.dynamics.pinocchio_views import SegmentViews


class StepLadder:
    """Chooses each step from a longest one and its halves, quarters …

    A step is so short that no skin moves farther relative to what carries the body than a bound,
    or, where it is farther away, than to there:

        h = max {h_max / 2ᵏ ≥ h_min : h s_j ≤ max(d, c_j) for all segments j}            (Eq. I3)

    with the speed s_j and the clearance c_j of the skin of a segment. Steps start at multiples of
    their length, so that times are counted in whole ticks and every step of h_max ends on one.

    Parameters
    ----------
    longest, shortest : float
        h_max and h_min [s]; their ratio is a power of two.
    motion : float
        d [m].

    Attributes
    ----------
    longest, tick : float
        h_max and h_min [s].
    """

    def __init__(self, longest: float, shortest: float, motion: float):
        self._coarsest = round(longest / shortest)
        self._motion = motion
        self.longest = longest
        self.tick = longest / self._coarsest

    def choose(
        self, now: int, speed_and_clearance: Callable[[], tuple[np.ndarray, np.ndarray]]
    ) -> int:
        """Return the length of the step that starts after `now` ticks, in ticks.

        Parameters
        ----------
        speed_and_clearance : callable
            Returns s_j (m,) [m/s] and c_j (m,) [m]; asked where steps differ.
        """
        if self._coarsest == 1:
            return 1
        speed, clearance = speed_and_clearance()
        allowed = float((np.maximum(clearance, self._motion) / (speed + 1e-12)).min())
        ticks = self._coarsest
        while ticks > 1 and (now % ticks or ticks * self.tick > allowed):
            ticks //= 2
        return ticks


def skin_speed(
    segments: SegmentViews, device, centre: np.ndarray, radius: np.ndarray
) -> np.ndarray:
    """Return a bound of the speed of each segment's skin relative to the device (m,) [m/s].

    That of the middle of a ball around the skin, and what turning adds at its surface.

    Parameters
    ----------
    segments : SegmentViews
        After forward kinematics with velocities.
    device : simcore.device.motion.DeviceState
    centre, radius : (m, 3), (m,) float64
        Of the ball, in the segment's frame [m].
    """
    speed = np.empty(len(radius))
    _skin_speed(
        segments.rotations, segments.positions, segments.velocities, device.position,
        device.linear_velocity, device.angular_velocity, centre, radius, speed,
    )
    return speed


@compiled
def _skin_speed(
    rotations, positions, velocities, origin, linear_velocity, turn, centre, radius, speed
):
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
        speed[j] = np.sqrt((moving * moving).sum()) + radius[j] * np.sqrt((spin * spin).sum())
