"""What the joints of a scene do by themselves: posture control and passive structures."""

from functools import lru_cache

import numpy as np
import pinocchio as pin

from simcore.body.build import Body
from simcore.body.segments import SEGMENTS
from simcore.config.designs import Joints
from simcore.dynamics.joints import PostureControl
from simcore.dynamics.passive import PassiveJoints
from simcore.scene import Scene


class JointTorque:
    """Torque of all joints without contact: Eq. 2, and Eq. J5 where the method has it.

    Attributes
    ----------
    stiffness, damping : (47,) float64
        Of posture control [N·m/rad, N·m·s/rad].
    passive : PassiveJoints or None
        None where the method has no passive structures: then joints have no ranges either.
    passive_torque : (47,) float64
        What it did in the last evaluation [N·m].
    """

    def __init__(self, scene: Scene):
        model, joints = scene.body.model, scene.method.joints
        self.stiffness, self.damping = joint_gains(model, joints)
        self._control = PostureControl(model, scene.configuration, self.stiffness, self.damping)
        self.passive = _passive_joints(scene.body) if joints.passive == "anatomical" else None
        self.passive_torque = np.zeros(model.nv)

    def torque(self, q: np.ndarray, v: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
        """Return the torque (47,) at q (60,) and v (47,) [N·m], nothing on the root.

        That of passive structures is added to `stiffness` (47, 47) [N·m/rad], as in
        `PassiveJoints.add_torque`.
        """
        torque = self._control.torque(q, v)
        if self.passive:
            self.passive_torque[:] = 0.0
            self.passive.add_torque(q, v, self.passive_torque, stiffness)
            torque += self.passive_torque
        return torque

    def stored_energy(self, q: np.ndarray) -> float:
        """Return the energy of the springs to the posture at q (60,) [J]."""
        return self._control.stored_energy(q)


@lru_cache(maxsize=4)
def _passive_joints(body: Body) -> PassiveJoints:
    return PassiveJoints(body.model)


def joint_gains(model: pin.Model, joints: Joints) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness [N·m/rad] and damping [N·m·s/rad] by degree of freedom (nv,)."""
    stiffness, damping = np.zeros(model.nv), np.zeros(model.nv)
    for index, segment in enumerate(SEGMENTS):
        kind = segment.anatomy.removesuffix("_left").removesuffix("_right")
        if kind == "root":
            continue
        joint, gains = model.joints[index + 1], getattr(joints, kind)
        dofs = slice(joint.idx_v, joint.idx_v + joint.nv)
        stiffness[dofs] = joints.muscle_tone * gains.stiffness_nm_per_rad
        damping[dofs] = gains.damping_nms_per_rad
    return stiffness, damping
