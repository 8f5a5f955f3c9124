"""Steps as long as motion and stability allow."""

from collections.abc import Callable

import numpy as np
from scipy.linalg import eigh

RK4_DAMPED, RK4_FREE = 2.785, 2.828
"""Longest stable step of Runge–Kutta's method of fourth order, times the rate of a decay, and times
the frequency of an oscillation: where |1 + z + z²/2 + z³/6 + z⁴/24| = 1."""

SAFETY = 0.9
"""Part of them that is taken: mass matrices change with the posture, if little for light limbs."""


def stable_step(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> float:
    """Return the longest step that joints allow Runge–Kutta's method [s]: Eq. I4.

    Parameters
    ----------
    mass : (nv, nv) float64
        Mass matrix.
    stiffness, damping : (nv,) float64
        Of the joints [N·m/rad, N·m·s/rad].
    """
    decay = eigh(np.diag(damping), mass, eigvals_only=True)[-1]
    frequency = np.sqrt(eigh(np.diag(stiffness), mass, eigvals_only=True)[-1])
    return SAFETY / max(decay / RK4_DAMPED, frequency / RK4_FREE)


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
