"""Body region of each skin vertex, for pressures and pictures."""

import numpy as np

from simcore.body.segments import INDEX, SEGMENT_NAMES, kind_of
from simcore.body.skeleton import Skeleton

PAIRED = (
    "buttock", "upper_thigh", "lower_thigh", "knee", "calf", "shin", "heel", "foot", "arm", "hand"
)
REGION_NAMES = (
    "head", "upper_back", "lower_back", "sacrum", "chest", "abdomen",
    *(f"{name}_{side}" for side in ("left", "right") for name in PAIRED),
)

# ASSUME: borders a reader of a pressure map would draw; none is used by the dynamics.
KNEE_HALF_LENGTH = 0.05  # [m] along the leg, either side of the joint
SACRUM_HALF_WIDTH = 0.028  # of stature; the sacrum is some 0.1 m wide in an adult
SACRUM_HEIGHT = 0.065  # of stature, upward from the hip joints, where the coccyx lies
FACING_DOWN = -0.7  # z of the normal; such pelvic skin is sat upon
GLUTEAL_FOLD = 0.2  # of thigh length below the hip joint
HEEL_FRONT = 0.0  # [m] ahead of the ankle joint


def vertex_regions(
    vertices: np.ndarray, normals: np.ndarray, weights: np.ndarray, skeleton: Skeleton
) -> np.ndarray:
    """Index into `REGION_NAMES` (n,) from rest vertices [m], their normals and skin weights."""
    main = weights.argmax(axis=1)
    local = np.einsum(
        "nji,nj->ni", skeleton.rest_rotations[main], vertices - skeleton.origins[main]
    )
    behind = np.einsum("nji,nj->ni", skeleton.rest_rotations[main], normals)[:, 0] < 0
    left = vertices[:, 1] > 0
    stature = np.ptp(vertices[:, 2])
    regions = np.empty(len(vertices), int)

    def mark(where: np.ndarray, name: str) -> None:
        if name in REGION_NAMES:
            regions[where] = REGION_NAMES.index(name)
        else:
            regions[where & left] = REGION_NAMES.index(f"{name}_left")
            regions[where & ~left] = REGION_NAMES.index(f"{name}_right")

    of = {
        kind: np.isin(main, [i for i, name in enumerate(SEGMENT_NAMES) if kind_of(name) == kind])
        for kind in map(kind_of, SEGMENT_NAMES)
    }
    mark(of["head"], "head")
    mark(of["thoracic"], "chest")
    mark(of["thoracic"] & behind, "upper_back")
    mark(of["lumbar"] | of["pelvis"], "abdomen")
    mark(of["lumbar"] & behind, "lower_back")
    mark(of["pelvis"] & (behind | (normals[:, 2] < FACING_DOWN)), "buttock")
    central = abs(vertices[:, 1]) < SACRUM_HALF_WIDTH * stature
    above_hips = (vertices[:, 2] - skeleton.origins[INDEX["pelvis"], 2]) / stature
    on_sacrum = central & (above_hips > 0) & (above_hips < SACRUM_HEIGHT)
    mark((of["pelvis"] | of["lumbar"]) & behind & on_sacrum, "sacrum")

    thigh_length = np.linalg.norm(
        skeleton.origins[INDEX["shank_left"]] - skeleton.origins[INDEX["thigh_left"]]
    )
    down_thigh = -local[:, 2] / thigh_length
    mark(of["thigh"], "upper_thigh")
    mark(of["thigh"] & (down_thigh > 0.5), "lower_thigh")
    mark(of["thigh"] & behind & (down_thigh < GLUTEAL_FOLD), "buttock")
    mark(of["shank"], "shin")
    mark(of["shank"] & behind, "calf")
    mark(of["thigh"] & ((1 - down_thigh) * thigh_length < KNEE_HALF_LENGTH), "knee")
    mark(of["shank"] & (-local[:, 2] < KNEE_HALF_LENGTH), "knee")
    mark(of["foot"] | of["toe"], "foot")
    mark(of["foot"] & (local[:, 0] < HEEL_FRONT), "heel")
    mark(of["upper_arm"] | of["forearm"], "arm")
    mark(of["hand"], "hand")
    return regions
