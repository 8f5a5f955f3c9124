"""Explicit integration of q and v on the manifold of configurations."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin

Acceleration = Callable[[float, np.ndarray, np.ndarray], np.ndarray]


def rk4_step(
    model: pin.Model,
    acceleration: Acceleration,
    time: float,
    q: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    step: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q and v one classical Runge–Kutta step later, at fourth order on the manifold.

    The stages live in the tangent space at q (Munthe-Kaas 1999): with q(t) = q ⊕ u(t),
    u̇ = (∂(q(t) ⊖ q)/∂q(t)) v(t). Averaging the stage velocities themselves, which belong to
    different tangent spaces, would be of second order only.

    Parameters
    ----------
    model : pin.Model
    acceleration : callable
        a(t, q, v) → (nv,).
    time, step : float
        [s].
    q : (nq,), v : (nv,), a : (nv,) float64
        Present state and its acceleration, which the caller has evaluated.

    Returns
    -------
    q : (nq,), v : (nv,) float64
        One step later.
    apart : (nv,) float64
        Change of velocity in the step by which its two evaluations half-way differ: Eq. I5.
    """
    half = step / 2
    u1, a1 = v, a

    q2, v2 = pin.integrate(model, q, half * u1), v + half * a1
    u2, a2 = _to_tangent(model, q, q2, v2), acceleration(time + half, q2, v2)

    q3, v3 = pin.integrate(model, q, half * u2), v + half * a2
    u3, a3 = _to_tangent(model, q, q3, v3), acceleration(time + half, q3, v3)

    q4, v4 = pin.integrate(model, q, step * u3), v + step * a3
    u4, a4 = _to_tangent(model, q, q4, v4), acceleration(time + step, q4, v4)

    return (
        pin.integrate(model, q, step / 6 * (u1 + 2 * u2 + 2 * u3 + u4)),
        v + step / 6 * (a1 + 2 * a2 + 2 * a3 + a4),
        step * (a3 - a2),
    )


def _to_tangent(
    model: pin.Model, base: np.ndarray, q: np.ndarray, v: np.ndarray
) -> np.ndarray:
    """Map a velocity at q into the tangent space at `base`."""
    return pin.dDifference(model, base, q, pin.ARG1) @ v
