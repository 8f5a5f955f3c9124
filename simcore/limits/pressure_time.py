"""What pressure may last for how long: two published curves.

Both were meant for hours. Neither tells whether a patient is injured; see docs/limits.md.
"""

import numpy as np
from scipy.special import expit

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
    floor, ceiling, rate, midpoint = (
        limits()[f"pressure_time_{name}", "rat muscle"].value
        for name in ("floor", "ceiling", "rate", "midpoint")
    )
    return floor + (ceiling - floor) * expit(-rate * (np.asarray(time, float) - midpoint))


def reswick_rogers_pressure(time):
    """Return the pressure that patients bore over a bony prominence for a time [Pa].

    P t = 300 mmHg h, from memory: Reswick and Rogers 1976, in Kenedi, Cowden and Scales (eds),
    Bedsore Biomechanics, 301. It comes from 980 patients and times of hours.

    Parameters
    ----------
    time : array_like
        How long the pressure lasts [s], above 0.
    """
    return limits()["pressure_time_product", "bony prominences"].value / np.asarray(time, float)
