"""Elastic moments of the joints against their anatomical angles (Eqs. J1 and J2)."""

from math import log, radians

import numpy as np
from numba import njit

from simcore.compiled import compiled
from simcore.dynamics.joint_angles import joint_ranges, without_side

LARGEST = 100.0
"""[N·m] Moment beyond which an exponential goes on along its tangent.

ASSUME: far above what a limb's weight can do, so that only a state gone wrong meets it.
"""
LOG_LARGEST = log(LARGEST)
PER_DEGREE = 180.0 / np.pi  # [deg/rad]

# Eq. J1. Riener and Edrich, J. Biomech. 32 (1999) 539, as transcribed alike by several codes; the
# paper itself was not read. Of each exponential: whose moment (0 hip, 1 knee, 2 ankle), sign,
# constant, factors of hip flexion, knee flexion and ankle plantarflexion [1/deg].
RIENER_TERMS = np.array([
    [0, 1, 1.4655, -0.0750, -0.0034, 0.0],
    [0, -1, 1.3403, 0.0305, -0.0226, 0.0],
    [1, 1, 1.800, 0.0217, -0.0352, -0.0460],
    [1, -1, -3.971, -0.0128, 0.0495, -0.0004],
    [1, 1, 2.220, 0.0, -0.150, 0.0],
    [2, 1, 2.1016, 0.0, -0.0176, -0.0843],
    [2, -1, -7.9763, 0.0, 0.0008, 0.1949],
])
RIENER_CONSTANTS = np.array([8.072, -4.820, -1.792])  # [N·m]
LEG = (("hip", "flexion"), ("knee", "flexion"), ("ankle", "dorsiflexion"))
LEG_SIGNS = np.array([1.0, 1.0, -1.0])  # plantarflexion is the ankle's positive sense in Eq. J1

# Eq. J2: (M_low [N·m], κ_low [1/rad], θ_low [rad], M_high, κ_high, θ_high).
# F. C. Anderson, A dynamic optimization solution for a complete cycle of normal gait, thesis,
# University of Texas at Austin (1999), Eq. 4.4 and Table G.2, as transcribed alike by several
# codes; the thesis was not read. Its −0.1 q̇ is left to the damping of the joints.
TRUNK_FLEXION = (0.35, 30.72, -0.17, 0.25, 20.36, 0.524)
TRUNK_TURN = (0.25, 20.36, -0.349, 0.25, 20.36, 0.349)  # of bending and of rotation
PUBLISHED = {
    ("hip", "abduction"): (0.03, 14.94, -0.5, 0.03, 14.94, 0.5),
    ("hip", "rotation"): (0.03, 14.94, -0.92, 0.03, 14.94, 0.92),
    ("ankle", "inversion"): (60.21, 16.32, -0.65, 60.21, 16.32, 0.65),
    ("toe", "extension"): (0.18, 70.08, 0.0, 0.9, 14.87, 1.134),
}

# The lumbar and thoracic joints are two springs in series: each carries the moment of the trunk.
# ASSUME: each takes half of the trunk's angle.
TRUNK_SHARE = 0.5

# Beyond what Riener and Edrich measured, a stop as steep as Anderson's knee in extension.
# ASSUME: 10 N·m is reached at these angles [deg], which leaves Eq. J1 as it is inside the range.
STOP_MOMENT, STOP_RATE = 10.0, 33.94  # [N·m], [1/rad]
STOPS = {
    ("hip", "flexion"): (-35.0, 145.0),
    ("knee", "flexion"): (-7.5, 150.0),
    ("ankle", "dorsiflexion"): (-65.0, 40.0),
}

# Joints without published parameters reach a moment [N·m] at the ends of their range, and a
# fourteenth of it 10° before.
# ASSUME: what a limb's own weight, or an examiner's light push, does to the joint. The neck stays
# below the 10 N·m that volunteers tolerated (McGill et al. 1994).
END_RATE = 15.0  # [1/rad] as the softest of Anderson's, the hip
END_MOMENT = {"neck": 5.0, "shoulder": 5.0, "elbow": 3.0, "wrist": 1.0, "ankle": 5.0}


def limit_of(joint: str, angle: str) -> tuple[float, ...]:
    """Return M_low [N·m], κ_low [1/rad], θ_low [rad], M_high, κ_high, θ_high of Eq. J2.

    Parameters
    ----------
    joint, angle : str
        As in `joint_ranges`; the joint without its side.
    """
    if joint in ("lumbar", "thoracic"):
        trunk = TRUNK_FLEXION if angle == "flexion" else TRUNK_TURN
        scale = (1.0, 1.0 / TRUNK_SHARE, TRUNK_SHARE) * 2
        return tuple(value * factor for value, factor in zip(trunk, scale, strict=True))
    if (joint, angle) in PUBLISHED:
        return PUBLISHED[joint, angle]
    if (joint, angle) in STOPS:
        low, high = (radians(stop) for stop in STOPS[joint, angle])
        return STOP_MOMENT, STOP_RATE, low, STOP_MOMENT, STOP_RATE, high
    reach = joint_ranges()[joint, angle]
    low_moment = 0.0 if angle == "reach" else END_MOMENT[joint]  # a cone has an outside only
    return low_moment, END_RATE, reach.low, END_MOMENT[joint], END_RATE, reach.high


def lay_out_limits(names: tuple[tuple[str, str], ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits (n, 6) of all angles, and where each leg's (l, 3) are among them.

    The moments of the limits are given by their logarithms.

    Parameters
    ----------
    names : tuple of (joint, angle)
        Joints with their side.
    """
    limits = np.array([limit_of(without_side(joint), angle) for joint, angle in names])
    with np.errstate(divide="ignore"):
        limits[:, [0, 3]] = np.log(limits[:, [0, 3]])
    legs = [
        [names.index((f"{joint}_{side}", angle)) for joint, angle in LEG]
        for side in ("left", "right")
    ]
    return limits, np.array(legs)


@compiled
def evaluate_moments(angles, limits, legs, moments, slopes):
    """Write the moment of each angle (Eqs. J1 and J2) and its own slope.

    Parameters
    ----------
    angles : (n,) float64
        [rad].
    limits, legs
        As from `lay_out_limits`.
    moments : (n,) float64
        Written: moment in the positive sense of each angle [N·m].
    slopes : (n,) float64
        Written: −∂m_i/∂θ_i ≥ 0 [N·m/rad].
    """
    for n in range(angles.shape[0]):
        low, low_slope = _exponential(limits[n, 0] - limits[n, 1] * (angles[n] - limits[n, 2]))
        high, high_slope = _exponential(limits[n, 3] + limits[n, 4] * (angles[n] - limits[n, 5]))
        moments[n] = low - high
        slopes[n] = limits[n, 1] * low_slope + limits[n, 4] * high_slope
    for e in range(legs.shape[0]):
        for joint in range(3):
            moments[legs[e, joint]] += LEG_SIGNS[joint] * RIENER_CONSTANTS[joint]
        for t in range(RIENER_TERMS.shape[0]):
            exponent = RIENER_TERMS[t, 2]
            for joint in range(3):
                # LEG_SIGNS turn dorsiflexion into plantarflexion, and its moment back
                in_degrees = LEG_SIGNS[joint] * angles[legs[e, joint]] * PER_DEGREE
                exponent += RIENER_TERMS[t, 3 + joint] * in_degrees
            joint, sign = int(RIENER_TERMS[t, 0]), RIENER_TERMS[t, 1]
            value, slope = _exponential(exponent)
            moments[legs[e, joint]] += LEG_SIGNS[joint] * sign * value
            slopes[legs[e, joint]] -= sign * RIENER_TERMS[t, 3 + joint] * slope * PER_DEGREE


@njit(inline="always")
def _exponential(exponent):
    """Return e^x and its slope; beyond LARGEST, the tangent there."""
    if exponent > LOG_LARGEST:
        return LARGEST * (1.0 + exponent - LOG_LARGEST), LARGEST
    value = np.exp(exponent)
    return value, value
