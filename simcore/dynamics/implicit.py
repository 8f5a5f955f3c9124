"""Linearly implicit midpoint step of q and v, one evaluation of the forces a step."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin

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
    after = v + velocity_change(data.M, impedance, torque, bias, step)
    return pin.integrate(model, middle, step / 2 * after), after


@compiled
def velocity_change(mass, impedance, torque, bias, step):
    """Return Δv (nv,) of Eq. I1, by Cholesky's method; NaN where the matrix is not positive.

    Row by row of the upper factor, the right side as its last column. In each row many are added up
    at once, four of the rows above at a time, where LAPACK's blocks are made for larger matrices.

    Parameters
    ----------
    mass, impedance : (nv, nv) float64
        Of the mass matrix the upper triangle is read, which is all that `crba` writes.
    torque, bias : (nv,) float64
        τ and C + g.
    step : float
        h [s].
    """
    size = np.uint64(torque.size)
    one, four = np.uint64(1), np.uint64(4)
    wide = size + one
    factor, inverse, change = np.empty((size, wide)), np.empty(size), np.empty(size)
    for i in range(np.uint64(0), size):
        for j in range(i, size):
            factor[i, j] = impedance[i, j] + mass[i, j]
        factor[i, size] = step * (torque[i] - bias[i])
    for i in range(np.uint64(0), size):
        row, k = factor[i], np.uint64(0)
        while k + four <= i:
            first, second, third, fourth = (
                factor[k], factor[k + one], factor[k + one + one], factor[k + four - one])
            a, b, c, d = first[i], second[i], third[i], fourth[i]
            for j in range(i, wide):
                row[j] -= a * first[j] + b * second[j] + c * third[j] + d * fourth[j]
            k += four
        while k < i:
            first = factor[k]
            a = first[i]
            for j in range(i, wide):
                row[j] -= a * first[j]
            k += one
        if not row[i] > 0.0:
            change[:] = np.nan
            return change
        inverse[i] = 1.0 / np.sqrt(row[i])
        for j in range(i, wide):
            row[j] *= inverse[i]
    for i in range(torque.size - 1, -1, -1):
        rest = factor[i, torque.size]
        for j in range(i + 1, torque.size):
            rest -= factor[i, j] * change[j]
        change[i] = rest * inverse[i]
    return change


@compiled
def late_force(impedance, change, step, force):
    """Write −Z Δv/h of some rows of Z (r, nv) [N]: by so much forces change within a step."""
    for a in range(impedance.shape[0]):
        late = 0.0
        for j in range(change.size):
            late += impedance[a, j] * change[j]
        force[a] = -late / step


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
