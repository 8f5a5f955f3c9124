"""Linearly implicit midpoint step of q and v, one evaluation of the forces a step."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from simcore.compiled import compiled

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


@compiled
def joint_power(v, change, impedance, stiffness, damping, passive_torque, step, mean, late):
    """Return the powers of a step in the coordinates of the joints (Eq. E4).

    Parameters
    ----------
    v, change : (nv,) float64
        Velocity before the step, and its change.
    impedance : (nv, nv) float64
        Z = θh D + (θh)² K of all.
    stiffness, damping : (nv,) float64
        k_P and k_D of the joints.
    passive_torque : (nv,) float64
        [N·m]
    step : float
        h [s].
    mean, late : (nv,) float64
        Written: v̄ = v + Δv/2, and Z Δv, the impulse that the impedance takes.

    Returns
    -------
    taken, passive, heat, implicit : float
        v̄ · Z Δv/h, that of passive torques, k_D v̄², and (h/4 k_P + 1/2 k_D) Δv v̄ [W].
    """
    taken = passive = heat = implicit = 0.0
    for i in range(v.size):
        mean[i] = v[i] + 0.5 * change[i]
        late[i] = 0.0
        for j in range(v.size):
            late[i] += impedance[i, j] * change[j]
        taken += mean[i] * late[i] / step
        passive += passive_torque[i] * mean[i]
        heat += damping[i] * mean[i] * mean[i]
        implicit += (0.25 * step * stiffness[i] + 0.5 * damping[i]) * change[i] * mean[i]
    return taken, passive, heat, implicit


@compiled
def power_of_carrying(
    torque, late, rotations, positions, origin, linear_velocity, angular_velocity
):
    """Return the powers of two torques when a whole body is carried along as if it were rigid.

    Then only its root moves, whose velocity is that of its origin in world axes and its turn in
    its own. Of the torque of contact it is the power of what the body is carried by [W].

    Parameters
    ----------
    torque, late : (nv,) float64
        Of both the entries of the root are used.
    rotations : (m, 3, 3), positions : (m, 3) float64
        Segment frames in the world, the root first [m].
    origin, linear_velocity, angular_velocity : (3,) float64
        Of the motion, world axes [m, m/s, rad/s].
    """
    arm, turn, shift = np.empty(3), angular_velocity, np.empty(3)
    for a in range(3):
        arm[a] = positions[0, a] - origin[a]
    shift[0] = linear_velocity[0] + turn[1] * arm[2] - turn[2] * arm[1]
    shift[1] = linear_velocity[1] + turn[2] * arm[0] - turn[0] * arm[2]
    shift[2] = linear_velocity[2] + turn[0] * arm[1] - turn[1] * arm[0]
    of_torque = of_late = 0.0
    for a in range(3):
        spin = rotations[0, 0, a] * turn[0] + rotations[0, 1, a] * turn[1] + (
            rotations[0, 2, a] * turn[2])
        of_torque += torque[a] * shift[a] + torque[3 + a] * spin
        of_late += late[a] * shift[a] + late[3 + a] * spin
    return of_torque, of_late
