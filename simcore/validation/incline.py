"""The incline on which something with friction lets go: what is common to all that lies on it."""

from collections.abc import Callable
from math import atan, degrees, radians

import numpy as np

from simcore.sheet.solver import GRAVITY
from simcore.validation.table import Curve, Measurement, Plot

INCLINE_FRICTION = 0.5

ONSET = degrees(atan(INCLINE_FRICTION))
"""Incline at which it lets go, by Coulomb's law [°]."""

ONSET_RESOLUTION = radians(0.02)

STUCK = 1e-4
"""What is slower than this sticks [m/s]."""

CREEP_TIME = 600.0
"""Longer than a transfer takes (`simcore.limits`) [s]."""

CREEP_ANGLE = 0.9 * atan(INCLINE_FRICTION)


def measure_onset(
    key: str, what: str, slide: Callable[[float], tuple[float, float]]
) -> Measurement:
    """Find by bisection the incline at which something lets go.

    Parameters
    ----------
    key : str
        The rows are `{key}slip_onset` and `{key}slip_energy`, the plot `validation_{key}incline`.
    what : str
        Lies on the incline.
    slide : callable
        Incline [rad] → acceleration, zero if it sticks [m/s²], and residual of the energy (Eq. E6).
    """
    around = atan(INCLINE_FRICTION) + np.radians(np.linspace(-3.5, 3.5, 8))
    slides = {angle: slide(angle) for angle in around}
    low, high = around[0], around[-1]
    while high - low > ONSET_RESOLUTION:
        middle = (low + high) / 2
        slides[middle] = slide(middle)
        low, high = (low, middle) if slides[middle][0] > 0 else (middle, high)
    acceleration, residual = np.array(list(slides.values())).T
    fine = np.linspace(min(slides), max(slides), 201)
    coulomb = np.maximum(GRAVITY * (np.sin(fine) - INCLINE_FRICTION * np.cos(fine)), 0)
    plot = Plot(
        f"validation_{key}incline", f"A {what} with µ = {INCLINE_FRICTION} on an incline",
        "incline [°]", "acceleration [m/s²]",
        (Curve("Coulomb", np.degrees(fine), coulomb),
         Curve(what.split()[-1], np.degrees(list(slides)), acceleration, marked=True)),
    )
    onset = degrees((low + high) / 2)
    return Measurement({f"{key}slip_onset": onset, f"{key}slip_energy": residual.max()}, (plot,))
