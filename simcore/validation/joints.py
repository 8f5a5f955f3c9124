"""Passive moments of the leg against the formula of their source."""

from functools import cache
from itertools import product
from pathlib import Path

import numpy as np

from simcore.body import build_body, configuration
from simcore.body.build import Body
from simcore.config import BodyDesign, read_design
from simcore.dynamics.passive import PassiveJoints
from simcore.validation.table import Check, Criterion, Measurement

MAN = Path("designs/bodies/male_172_70.yaml")

# Riener and Edrich's formula is compared where people can put their joints (Soucie et al. 2011)
# and where no moment of it is beyond 100 N·m, from where on Eq. J1 goes on along a tangent.
HIP = range(-10, 101, 10)
KNEE = range(0, 131, 10)
PLANTAR = range(-10, 50, 10)
"""Flexion, flexion and plantarflexion of the poses [deg]; the published ones are among them."""


def riener_moments(hip, knee, plantar, exp=np.exp):
    """Return the moments of hip, knee and ankle [N·m] as Riener and Edrich (1999) print them.

    Parameters
    ----------
    hip, knee, plantar
        Hip flexion, knee flexion and plantarflexion [deg]; moments are positive as these.
    exp : callable
        The exponential.
    """
    return (
        exp(1.4655 - 0.0034 * knee - 0.0750 * hip) - exp(1.3403 - 0.0226 * knee + 0.0305 * hip)
        + 8.072,
        exp(1.800 - 0.0460 * plantar - 0.0352 * knee + 0.0217 * hip)
        - exp(-3.971 - 0.0004 * plantar + 0.0495 * knee - 0.0128 * hip) - 4.820
        + exp(2.220 - 0.150 * knee),
        exp(2.1016 - 0.0843 * plantar - 0.0176 * knee)
        - exp(-7.9763 + 0.1949 * plantar + 0.0008 * knee) - 1.792,
    )


@cache
def man() -> Body:
    """Return the shipped man of 70 kg."""
    return build_body(read_design(BodyDesign, MAN), MAN.stem)


def leg_pose(body: Body, hip: float, knee: float, plantar: float) -> np.ndarray:
    """Return the configuration (nq,) with both legs so [rad], all else at zero."""
    return configuration(body, {
        "hip": {"flexion": hip}, "knee": {"flexion": knee}, "ankle": {"dorsiflexion": -plantar},
    })


def leg_moments(body: Body, passive: PassiveJoints, q: np.ndarray, side: str) -> np.ndarray:
    """Return the moments (3,) [N·m] of a leg in a pose of `leg_pose`, signs as in Eq. J1."""
    torque = np.zeros(body.model.nv)
    passive.add_torque(
        q, np.zeros(body.model.nv), torque, np.zeros((body.model.nv, body.model.nv))
    )
    at = [body.model.joints[body.model.getJointId(f"{segment}_{side}")].idx_v
          for segment in ("thigh", "shank", "foot")]
    # About y, which points left: the hip flexes backwards about it, the foot plantarflexes.
    return np.array([-torque[at[0] + 1], torque[at[1]], torque[at[2] + 1]])


def measure_moments() -> Measurement:
    """Compare the engine's moments with the formula, over all poses and on both sides."""
    body = man()
    passive, worst = PassiveJoints(body.model), np.zeros(3)
    for pose in product(HIP, KNEE, PLANTAR):
        q, told = leg_pose(body, *np.radians(pose)), riener_moments(*pose)
        for side in ("left", "right"):
            worst = np.maximum(worst, np.abs(leg_moments(body, passive, q, side) - told))
    return Measurement(dict(zip(("passive_hip", "passive_knee", "passive_ankle"), worst,
                                strict=True)))


def _criterion(joint: str, high: float) -> Criterion:
    poses = len(HIP) * len(KNEE) * len(PLANTAR)
    return Criterion(
        f"passive_{joint}", f"passive moment of the {joint}, greatest difference in {poses} poses",
        0.0, high, "N·m", "formula of Riener and Edrich 1999; Silder's fit, root mean square",
    )


CHECKS = (
    Check((_criterion("hip", 2.5), _criterion("knee", 1.4), _criterion("ankle", 0.7)),
          measure_moments),
)
