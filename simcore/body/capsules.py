"""The coarse shapes by which parts of a body keep out of each other: one tapered capsule each."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simcore.body.segments import INDEX, SEGMENT_NAMES
from simcore.body.skin import Skin

TRUNK = ("pelvis", "lumbar", "thoracic")
"""Lie along the lateral axis of their segment; the others along their greatest extent."""

DOMINANT = 0.6
"""Least blend weight of the skin that a shape is fitted to."""

# ASSUME: flesh on flesh gives before skin touches skin, so that the shapes are the mean limb.
RADIUS_QUANTILE = 0.5
"""Of the distances of the skin from the axis."""

LEGS = ("thigh", "shank", "foot")
ARMS = ("upper_arm", "forearm", "hand")


@dataclass(frozen=True, eq=False)
class Capsules:
    """A tapered capsule for each of the 18 segments, and the pairs that may meet.

    Attributes
    ----------
    ends : (18, 2, 3) float64
        Of the axes, segment frames [m].
    radius : (18, 2) float64
        At the ends [m].
    pairs : (p, 2) int64
    """

    ends: np.ndarray
    radius: np.ndarray
    pairs: np.ndarray


@lru_cache(maxsize=4)
def fit_capsules(skin: Skin) -> Capsules:
    """Return the capsules of a body, from the skin that each segment carries."""
    ends, radius = np.empty((len(SEGMENT_NAMES), 2, 3)), np.empty((len(SEGMENT_NAMES), 2))
    axes = []
    for index, name in enumerate(SEGMENT_NAMES):
        mine = (skin.influence_segment == index) & (skin.influence_weight > DOMINANT)
        points = skin.influence_point[mine]
        centre = (points.min(axis=0) + points.max(axis=0)) / 2
        from_centre = points - centre
        if name in TRUNK:
            axis = np.array([0.0, 1.0, 0.0])
        else:
            axis = np.linalg.svd(from_centre - from_centre.mean(axis=0), full_matrices=False)[2][0]
            axis *= np.sign(axis @ centre)  # away from the joint
        along = from_centre @ axis
        distance = np.linalg.norm(from_centre - along[:, None] * axis, axis=1)
        low, high = along.min(), along.max()
        middle = (low + high) / 2
        radius[index] = (
            np.quantile(distance[along < middle], RADIUS_QUANTILE),
            np.quantile(distance[along >= middle], RADIUS_QUANTILE),
        )
        axes.append((centre, axis, low, high))
    # Bodies are symmetric, and hands and feet of an uneven mesh nearly: both sides are as thick.
    for index, other in enumerate(_mirrored()):
        radius[index] = radius[other] = (radius[index] + radius[other]) / 2
    for index, (centre, axis, low, high) in enumerate(axes):
        # The round caps end with the skin; a shape as wide as it is long becomes a ball.
        inset = np.minimum(radius[index], (high - low) / 2)
        ends[index] = centre + np.array([[low + inset[0]], [high - inset[1]]]) * axis
    return Capsules(ends, radius, _pairs())


def _mirrored() -> list[int]:
    """Return the segment on the other side of each, itself where there is none."""
    sides = {"_left": "_right", "_right": "_left"}
    return [
        next((INDEX[name.removesuffix(side) + other] for side, other in sides.items()
              if name.endswith(side)), index)
        for index, name in enumerate(SEGMENT_NAMES)
    ]


def _pairs() -> np.ndarray:
    """Return the pairs (p, 2) of segments that can meet.

    Neighbours in the skeleton are left out but for upper arm and chest: an arm lies on its side.
    """
    pairs = {(f"{a}_left", f"{b}_right") for part in (LEGS, ARMS) for a in part for b in part}
    for side in ("left", "right"):
        pairs |= {(f"{arm}_{side}", trunk) for arm in ARMS for trunk in TRUNK}
        pairs |= {(f"{arm}_{side}", f"thigh_{other}") for arm in ARMS[1:]
                  for other in ("left", "right")}
        pairs |= {(f"thigh_{side}", "lumbar")}
        pairs -= {(f"upper_arm_{side}", "pelvis")}
    return np.array(sorted((INDEX[a], INDEX[b]) for a, b in pairs))
