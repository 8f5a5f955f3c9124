"""Steps as long as motion and stability allow."""

from collections.abc import Callable

import numpy as np
from scipy.linalg import eigh

RK4_DAMPED, RK4_FREE = 2.785, 2.828
"""Longest stable step of Runge–Kutta's method of fourth order, times the rate of a decay, and times
the frequency of an oscillation: where |1 + z + z²/2 + z³/6 + z⁴/24| = 1."""

SAFETY = 0.9
"""Part of them that is taken: mass matrices change with the posture, if little for light limbs."""

APART = 0.001
"""By how much the evaluations half-way through a step may differ in the change of velocity that
they make of it [m/s]; docs/physics.md tells what less and more did."""


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


def smooth_step(step: float, apart: float) -> float:
    """Return how long a step may be after one [s] whose evaluations half-way differ: Eq. I5.

    They are at one time, and what they differ by is what the step is too long for (Collatz 1960,
    The Numerical Treatment of Differential Equations): contacts that are stiff, or jump.

    Parameters
    ----------
    apart : float
        e, as a change of the root mean square speed of the body's mass [m/s].
    """
    return step * np.sqrt(APART / apart) if apart > 0 else np.inf


class StepLadder:
    """Chooses each step from a shortest one and its multiples, up to a longest one.

        h = max {k h_min ≤ h_max : h ≤ pace}, or h_min                                   (Eq. I3)

    Times are thus counted in whole ticks. No step is longer than twice the one before, which told
    what is near.

    Parameters
    ----------
    longest, shortest : float
        h_max and h_min [s]; their ratio is a whole number.

    Attributes
    ----------
    longest, tick : float
        h_max and h_min [s].
    """

    def __init__(self, longest: float, shortest: float):
        self._most = round(longest / shortest)
        self._last = self._most
        self.longest = longest
        self.tick = longest / self._most

    def choose(self, pace: Callable[[], float]) -> int:
        """Return the length of the next step in ticks.

        Parameters
        ----------
        pace : callable
            Returns how long a step may be for the motion there is [s]; asked where steps differ.
        """
        if self._most > 1:
            allowed = min(pace() / self.tick, 2 * self._last, self._most)
            self._last = max(int(allowed), 1)
        return self._last
