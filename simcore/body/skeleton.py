"""Joint centres, rest orientation and `pin.Model` of the 18-segment skeleton.

Anatomical zero (`pin.neutral`): standing, feet forward, legs vertical, arms straight down, palms
towards the thighs with the thumbs forward.  There every segment frame is parallel to the world
(x forward, y left, z up) and sits at its joint centre.  MakeHuman's rest pose is another
configuration of the same skeleton; `rest_rotations` gives the segment frames in it.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from simcore.body.makehuman import Template
from simcore.body.segments import INDEX, PARENTS, SEGMENTS

GRAVITY = 9.80665  # [m/s²] standard acceleration, CGPM 1901
DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Geometry of the skeleton in MakeHuman's rest pose.

    Attributes
    ----------
    origins : (18, 3) float64
        Joint centres, world axes [m].
    rest_rotations : (18, 3, 3) float64
        Segment frame to world, in the rest pose.
    """

    origins: np.ndarray
    rest_rotations: np.ndarray


def build_skeleton(template: Template, vertices: np.ndarray) -> Skeleton:
    """Skeleton of a phenotype from its vertices (19158, 3) [m]."""
    def head_of(*bones: str) -> np.ndarray:
        return np.mean([vertices[template.joint_vertices[bone]].mean(0) for bone in bones], axis=0)

    origins = np.array([head_of(*segment.origin) for segment in SEGMENTS])
    rotations = np.tile(np.eye(3), (len(SEGMENTS), 1, 1))  # ASSUME: the trunk rests upright
    for side, mark in (("left", ".L"), ("right", ".R")):
        at = {name: INDEX[f"{name}_{side}"]
              for name in ("thigh", "shank", "foot", "toe", "upper_arm", "forearm", "hand")}
        hip, knee, ankle, toes = (origins[at[k]] for k in ("thigh", "shank", "foot", "toe"))
        rotations[at["thigh"]], rotations[at["shank"]] = _leg_rotations(hip, knee, ankle)
        rotations[at["foot"]] = rotations[at["toe"]] = _foot_rotation(ankle, toes)
        shoulder, elbow, wrist = (origins[at[k]] for k in ("upper_arm", "forearm", "hand"))
        knuckle = head_of("finger3-1" + mark)
        thumbward = head_of("finger2-1" + mark) - head_of("finger5-1" + mark)
        hinge = np.cross(wrist - elbow, elbow - shoulder)  # elbow flexion turns about its negative
        rotations[at["upper_arm"]] = _frame(elbow - shoulder, np.cross(hinge, shoulder - elbow))
        rotations[at["forearm"]] = _frame(wrist - elbow, thumbward)
        rotations[at["hand"]] = _frame(knuckle - wrist, thumbward)
    return Skeleton(origins, rotations)


def _leg_rotations(hip: np.ndarray, knee: np.ndarray, ankle: np.ndarray):
    """Rest frames of thigh and shank.

    Both share one abduction, that of the line from hip to ankle, so that the knee between them
    is a pure hinge; the few degrees of valgus left over stay in the bones at anatomical zero.
    """
    line = ankle - hip
    abduction = _about(0, np.arctan2(line[1], -line[2]))
    return tuple(
        abduction @ _about(1, np.arctan2(-bone[0], -bone[2]))
        for bone in (abduction.T @ (knee - hip), abduction.T @ (ankle - knee))
    )


def _foot_rotation(ankle: np.ndarray, toes: np.ndarray) -> np.ndarray:
    """Rest frame of foot and toes: the sole stays level, the foot points forward at zero."""
    line = toes - ankle
    return _about(2, np.arctan2(line[1], line[0]))


def _frame(bone: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Rest frame whose −z runs along the bone and whose x is nearest `forward`."""
    z = -bone / np.linalg.norm(bone)
    y = np.cross(z, forward)
    y /= np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z], axis=1)


def _about(axis: int, angle: float) -> np.ndarray:
    """Rotation matrix about a coordinate axis [rad]."""
    return pin.utils.rotate("xyz"[axis], angle)


def joint_placements(skeleton: Skeleton) -> np.ndarray:
    """Joint centre (18, 3) in its parent's frame [m]; zero for the root."""
    offsets = np.zeros_like(skeleton.origins)
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            step = skeleton.origins[child] - skeleton.origins[parent]
            offsets[child] = skeleton.rest_rotations[parent].T @ step
    return offsets


def build_model(
    name: str, placements: np.ndarray, masses: np.ndarray, coms: np.ndarray, inertias: np.ndarray
) -> pin.Model:
    """The `pin.Model`: nq = 60, nv = 47, gravity along −z.

    Parameters
    ----------
    placements : (18, 3)
        Joint centre in the parent's frame [m].
    masses, coms, inertias : (18,), (18, 3), (18, 3, 3)
        Mass [kg], centre of mass [m] and inertia about it [kg m²], in the segment's frame.
    """
    model = pin.Model()
    model.name = name
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    for index, segment in enumerate(SEGMENTS):
        joint = model.addJoint(
            PARENTS[index] + 1, _joint_model(segment.joint),
            pin.SE3(np.eye(3), placements[index]), segment.name,
        )
        inertia = pin.Inertia(masses[index], coms[index], inertias[index])
        model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
    return model


def _joint_model(kind: str):
    if kind == "free":
        # Not a free-flyer: v[:3] is the origin's velocity in world axes, which integrates simply.
        joint = pin.JointModelComposite(pin.JointModelTranslation())
        joint.addJoint(pin.JointModelSpherical())
        return joint
    if kind == "spherical":
        return pin.JointModelSpherical()
    if kind == "flexion":
        return pin.JointModelRY()
    return pin.JointModelRevoluteUnaligned(0.0, -1.0, 0.0)


def configuration_of(
    model: pin.Model, rotations: np.ndarray, root_position: np.ndarray
) -> np.ndarray:
    """q (60,) that puts the segment frames at `rotations` (18, 3, 3), root at `root_position` [m].

    Revolute joints take the y component of the relative rotation; the caller sees to it that
    there is no other.
    """
    q = pin.neutral(model)
    q[:3] = root_position
    for index, segment in enumerate(SEGMENTS):
        parent = PARENTS[index]
        relative = rotations[index] if parent < 0 else rotations[parent].T @ rotations[index]
        start = model.joints[index + 1].idx_q + (3 if parent < 0 else 0)
        if segment.joint in ("free", "spherical"):
            q[start : start + 4] = pin.Quaternion(relative).coeffs()
        else:
            angle = np.arctan2(relative[0, 2], relative[0, 0])
            q[start] = -angle if segment.joint == "extension" else angle
    return q


def segment_placements(model: pin.Model, data: pin.Data) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (18, 3, 3) and origins (18, 3) [m] of the segment frames from `data.oMi`."""
    placements = [data.oMi[joint] for joint in range(1, model.njoints)]
    return np.array([m.rotation for m in placements]), np.array([m.translation for m in placements])


def segment_velocities(model: pin.Model, data: pin.Data) -> tuple[np.ndarray, np.ndarray]:
    """Origin velocities [m/s] and angular velocities [rad/s] (18, 3), world axes.

    `pin.forwardKinematics(model, data, q, v)` must have been called.
    """
    velocities = [
        pin.getVelocity(model, data, joint, pin.LOCAL_WORLD_ALIGNED)
        for joint in range(1, model.njoints)
    ]
    return np.array([v.linear for v in velocities]), np.array([v.angular for v in velocities])
