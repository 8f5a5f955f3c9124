"""Steps as long as the motion allows."""

from collections.abc import Callable


class StepLadder:
    """Chooses each step from a longest one and its halves, quarters …

        h = max {h_max / 2ᵏ ≥ h_min : h ≤ pace}                                          (Eq. I3)

    Steps start at multiples of their length, so that times are counted in whole ticks and every
    step of h_max ends on one. None is longer than twice the one before, which told what is near.

    Parameters
    ----------
    longest, shortest : float
        h_max and h_min [s]; their ratio is a power of two.

    Attributes
    ----------
    longest, tick : float
        h_max and h_min [s].
    """

    def __init__(self, longest: float, shortest: float):
        self._coarsest = round(longest / shortest)
        self._last = self._coarsest
        self.longest = longest
        self.tick = longest / self._coarsest

    def choose(self, now: int, pace: Callable[[], float]) -> int:
        """Return the length of the step that starts after `now` ticks, in ticks.

        Parameters
        ----------
        pace : callable
            Returns how long a step may be for the motion there is [s]; asked where steps differ.
        """
        if self._coarsest == 1:
            return 1
        allowed = pace()
        ticks = min(2 * self._last, self._coarsest)
        while ticks > 1 and (now % ticks or ticks * self.tick > allowed):
            ticks //= 2
        self._last = ticks
        return ticks
