"""How long a pressure may last: two published curves, and their inverses.

Both were meant for hours. Neither tells whether a patient is injured; see docs/limits.md.
"""

import numpy as np
from scipy.special import expit, logit

from simcore.limits.table import limits


def linder_ganz_pressure(time):
    """Return the pressure that kills muscle cells of rats within a time [Pa].

    P(t) = C + K / (1 + exp(α (t − t₀))), C = 9 kPa, C + K = 32 kPa, α = 0.15/min, t₀ = 90 min:
    Linder-Ganz, Engelberg, Scheinowitz and Gefen 2006, J. Biomech. 39, 2725. Made from exposures
    of 15 min and more; the pressure is that in the muscle.

    Parameters
    ----------
    time : array_like
        How long the pressure lasts [s].
    """
    floor, drop, rate, midpoint = _sigmoid()
    return floor + drop * expit(-rate * (np.asarray(time, float) - midpoint))


def linder_ganz_time(pressure):
    """Return how long a steady pressure lasts until it reaches that curve [s].

    0 for a pressure above the whole curve, infinite for one below it.

    Parameters
    ----------
    pressure : array_like
        [Pa].
    """
    floor, drop, rate, midpoint = _sigmoid()
    height = np.clip((np.asarray(pressure, float) - floor) / drop, 0.0, 1.0)
    return np.maximum(midpoint - logit(height) / rate, 0.0)


def reswick_rogers_pressure(time):
    """Return the pressure that patients bore over a bony prominence for a time [Pa].

    P t = 300 mmHg h, from memory: Reswick and Rogers 1976, in Kenedi, Cowden and Scales (eds),
    Bedsore Biomechanics, 301. It comes from 980 patients and times of hours.

    Parameters
    ----------
    time : array_like
        How long the pressure lasts [s]; without bound at 0.
    """
    return _hyperbola(time)


def reswick_rogers_time(pressure):
    """Return how long a steady pressure lasts until it reaches that curve [s].

    Parameters
    ----------
    pressure : array_like
        [Pa]; infinite time for 0.
    """
    return _hyperbola(pressure)


def _sigmoid() -> tuple[float, float, float, float]:
    """Return C [Pa], K [Pa], α [1/s] and t₀ [s]."""
    floor, ceiling, rate, midpoint = (
        limits()[f"pressure_time_{name}", "rat muscle"].value
        for name in ("floor", "ceiling", "rate", "midpoint")
    )
    return floor, ceiling - floor, rate, midpoint


def _hyperbola(factor):
    product = limits()["pressure_time_product", "bony prominences"].value
    with np.errstate(divide="ignore"):
        return product / np.asarray(factor, float)
