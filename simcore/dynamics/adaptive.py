"""Steps as long as the motion allows."""

from collections.abc import Callable

import numpy as np


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
