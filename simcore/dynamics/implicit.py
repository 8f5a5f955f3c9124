"""Linearly implicit midpoint step of q and v, one evaluation of the forces a step."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

Linearised = Callable[[float, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]

IMPLICITNESS = 0.55
"""θ: share of the step after which stiffness and damping act. 1/2 is of second order and damps
nothing; a little more quiets contacts that open and close. Backward Euler, θ = 1, is of first
order."""


def implicit_step(
    model: pin.Model,
    data: pin.Data,
    linearised: Linearised,
    time: float,
    q: np.ndarray,
    v: np.ndarray,
    step: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return q and v a step h later.

    Half a step of drift, the forces there, their impulse, and the other half:

        q½ = q ⊕ h/2 v
        (M + θh D + (θh)² K) Δv = h (τ(q½, v) − C − g)                               (Eq. I1)
        q′ = q½ ⊕ h/2 (v + Δv)

    K = −∂τ/∂q and D = −∂τ/∂v need not be exact: what is left out is of the order of the step.
    Stable where explicit steps would have to follow the stiffest contact.

    Parameters
    ----------
    linearised : callable
        (t, q, v) → torque (nv,) and θh D + (θh)² K (nv, nv).
    time, step : float
        [s].
    q : (nq,), v : (nv,) float64
    """
    middle = pin.integrate(model, q, step / 2 * v)
    torque, impedance = linearised(time + step / 2, middle, v)
    pin.crba(model, data, middle)
    bias = pin.nonLinearEffects(model, data, middle, v)
    # LAPACK reads the upper triangle, all that crba writes.
    _, change, failed = dposv(data.M + impedance, step * (torque - bias))
    if failed:
        change = np.full_like(v, np.nan)
    after = v + change
    return pin.integrate(model, middle, step / 2 * after), after
