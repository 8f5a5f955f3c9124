"""Human–device dynamics: the right-hand side of Eq. 1, from joints to skin and back."""

import numpy as np
import pinocchio as pin

from simcore.body.capsules import fit_capsules
from simcore.body.segments import PARENTS, SEGMENTS
from simcore.body.skin_listed import torque_of_wrenches, total_force, wrench_listed
from simcore.contact.self_contact import add_self_contact, overlaps, self_contact_power
from simcore.contact.tangential import Impulses
from simcore.device.motion import DeviceState
from simcore.dynamics.adaptive import stable_step
from simcore.dynamics.impedance import (
    PACKED,
    add_joint_impedance,
    add_pair_impedance,
    add_point_impedance,
    project_blocks,
)
from simcore.dynamics.implicit import joint_power, late_force, power_of_carrying
from simcore.dynamics.pinocchio_views import view_segments
from simcore.foundation_contact import FoundationContact
from simcore.joint_torque import JointTorque
from simcore.point_contact import PointContact
from simcore.scene import Scene
from simcore.skin_contact import SkinContact

ROUNDING = 1e-12
"""Parts of the body that keep the distance they start at do not touch by so much [m]."""


class Interaction:
    """Evaluates M(q) a + C + g = τ_joint + Jᵀf for one scene.

    What the last evaluation wrote stays readable, for a recorder to observe.

    Attributes
    ----------
    contact : SkinContact
        Of the skin with what is rigid.
    segment_wrench : (18, 6) float64
        Contact force [N] and moment about each segment's origin [N·m], world axes.
    """

    def __init__(self, scene: Scene):
        body = scene.body
        skin = body.skin
        self._body = body
        self.model = body.model
        self.data = body.model.createData()
        self._views = view_segments(self.model, self.data)
        self._joints = JointTorque(scene)
        self._surface_state = scene.surface_state
        self._influences = (
            skin.influence_offsets, skin.influence_segment, skin.influence_weight,
            skin.influence_point,
        )
        each = [self.model.joints[j + 1] for j in range(len(SEGMENTS))]
        self._tree = (
            np.array(PARENTS),
            np.array([joint.idx_v for joint in each]),
            np.array([joint.nv for joint in each]),
        )
        self.segment_wrench = np.zeros((len(SEGMENTS), 6))
        self._mean, self._late = np.zeros((2, self.model.nv))
        self._moved, self._middle, self._before = None, None, None  # of the last implicit step
        self._contact_torque = np.zeros(self.model.nv)
        self._total_wrench = np.zeros_like(self.segment_wrench)
        self._impedance = np.zeros((self.model.nv, self.model.nv))
        self._late_support, self._support_impedance = np.zeros(3), np.zeros((3, self.model.nv))
        self._blocks = np.zeros((len(SEGMENTS), len(SEGMENTS), PACKED))
        self._parts = self._own_parts(scene) if scene.method.self_contact else None
        self.contact = _contact_with_device(scene)
        self._stable = np.inf
        if scene.method.integrator == "rk4":
            mass = pin.crba(self.model, self.data, scene.configuration)
            mass = np.triu(mass) + np.triu(mass, 1).T
            self._stable = stable_step(mass, self._joints.stiffness, self._joints.damping)

    @property
    def support_force(self) -> np.ndarray:
        """Force from outside that carries the body (3,), world axes [N]."""
        return total_force(self.segment_wrench) + self._late_support

    @property
    def contact_count(self) -> int:
        """Points in contact."""
        return self.contact.contact_count

    @property
    def depth_max(self) -> float:
        """Deepest penetration [m]."""
        return self.contact.depth_max

    def exchange(self, moved: DeviceState, q: np.ndarray, v: np.ndarray, step: float) -> None:
        """Advance what is neither body nor rigid by one step [s]; here there is nothing."""

    def pace(self, moved: DeviceState, q: np.ndarray, v: np.ndarray) -> float:
        """Return how long the next step may be, from q (60,) and v (47,) [s]: Eqs. I3 and I4."""
        pin.forwardKinematics(self.model, self.data, q, v)
        return min(self._stable, self.contact.pace(self._views, self._surface_state(moved)))

    def place(self, q: np.ndarray, moved: DeviceState) -> np.ndarray:
        """Return where the body is on what carries it: its centre of mass, device frame (1, 3)."""
        centre = pin.centerOfMass(self.model, self.data, q, False)
        return (moved.rotation.T @ (centre - moved.position))[None]

    def add_skin_impulses(self, duration: float, on_skin: Impulses) -> float:
        """Add impulses on each skin vertex as `SkinContact` does."""
        return self.contact.add_skin_impulses(duration, on_skin)

    def add_mat_impulses(self, duration: float, on_mat: Impulses) -> float:
        """Add what the present forces on `Scene.mat` do to them in a time [s].

        Tangential parts only where they reach the skin through the mat; return the normal impulse
        of what of that slips [N s]. With a rigid device, all of the skin's are those of
        `add_skin_impulses`.
        """
        self.contact.add_mat_impulses(duration, on_mat)
        return 0.0

    def share_impulses(self, on_mat: Impulses, on_skin: Impulses) -> None:
        """Complete the impulses of a frame: what reaches the mat through the skin.

        Or, as with a sheet, the skin through the mat.
        """
        self.contact.add_skin_to_mat(on_skin, on_mat)

    def sheet_frame(self) -> dict[str, np.ndarray]:
        """Return what a recorder keeps of the sheet, by name; here there is none."""
        return {}

    def acceleration(self, moved: DeviceState, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the joint acceleration (47,) at q (60,) and v (47,), the device at `moved`."""
        pin.forwardKinematics(self.model, self.data, q, v)
        return pin.aba(self.model, self.data, q, v, self._torque(moved, q, v, 0.0))

    def linearised(
        self, moved: DeviceState, q: np.ndarray, v: np.ndarray, lag: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return all torques but inertial ones (47,), and lag² K + lag D of them (47, 47)."""
        pin.forwardKinematics(self.model, self.data, q, v)
        self._moved, self._middle, self._before = moved, q, self._views.velocities.copy()
        self._before.flags.writeable = False  # as the views: a type of its own is compiled again
        impedance, blocks, contact = self._impedance, self._blocks, self.contact
        impedance[:] = 0.0
        torque = self._torque(moved, q, v, lag)
        # So far it is K of passive joints.
        add_joint_impedance(self._joints.stiffness, self._joints.damping, lag, impedance)
        blocks[:] = 0.0
        add_point_impedance(
            contact.listed, *self._influences[:3], contact.points, contact.normals, contact.along,
            contact.across, blocks,
        )
        if self._parts:
            add_pair_impedance(*self._parts_met, blocks)
        project_blocks(blocks, self._views.jacobian, *self._tree, impedance)
        self._support_impedance[:] = impedance[:3]
        self._add_impedance_of_sheet()
        return torque, impedance

    def conclude(self, change: np.ndarray, step: float) -> None:
        """Take note of the change of velocity (47,) that an implicit step [s] has come to.

        By so much the support changed within the step: the root's first three velocities are the
        world's, and neither joints nor self-contact act on them.
        """
        late_force(self._support_impedance, change, step, self._late_support)

    def account(
        self, v: np.ndarray, change: np.ndarray, step: float, after: DeviceState
    ) -> np.ndarray:
        """Return what an implicit step [s] from v (47,) has done, `energy.FLOWS` [J]: Eq. E4.

        After `linearised`, and before anything else moves the model.

        Parameters
        ----------
        change : (47,) float64
            Of the velocity, over the step.
        after : DeviceState
            Where the motion program is at the end of the step.
        """
        joints, mean, late = self._joints, self._mean, self._late
        taken, passive, joint_heat, joint_implicit = joint_power(
            v, change, self._impedance, joints.stiffness, joints.damping, joints.passive_torque,
            step, mean, late,
        )
        pin.forwardKinematics(self.model, self.data, self._middle, mean)
        flesh_heat, rubbed, flesh_implicit = self.contact.power(self._views, step)
        limb_heat = limb_implicit = 0.0
        if self._parts:
            shapes, law = self._parts
            limb_heat, limb_implicit = self_contact_power(
                *shapes, self._views.rotations, self._views.positions, self._before,
                self._views.velocities, *law, step,
            )
        work, late_work = self._work_of_device(late, step, after)
        implicit = joint_implicit + flesh_implicit + limb_implicit
        return np.array([
            work + late_work,
            step * passive,
            step * (joint_heat + flesh_heat + limb_heat),
            step * rubbed,
            step * (taken - implicit) + late_work,
        ])

    def stored_energy(self, q: np.ndarray, v: np.ndarray, moved: DeviceState) -> np.ndarray:
        """Return the energies `energy.STORED` [J] at q (60,) and v (47,): Eqs. E2 and E3."""
        kinetic = pin.computeKineticEnergy(self.model, self.data, q, v)
        potential = pin.computePotentialEnergy(self.model, self.data, q)
        elastic = self._joints.stored_energy(q)
        elastic += self.contact.stored_energy(self._views, self._surface_state(moved))
        if self._parts:
            (pairs, ends, radius, allowed), (stiffness, _) = self._parts
            depth = overlaps(pairs, ends, radius, self._views.rotations, self._views.positions)
            elastic += stiffness @ np.maximum(depth - allowed, 0.0) ** 2 / 2
        return np.array([kinetic, potential, elastic])

    def _work_of_device(
        self, late: np.ndarray, step: float, after: DeviceState
    ) -> tuple[float, float]:
        """Return the work that the device has done in a step, and that of late forces [J].

        The latter are what the impedance takes off the impulse on the root, `late` (47,) [N·s].
        """
        moved, views = self._moved, self._views
        power, late_work = power_of_carrying(
            self._contact_torque, late, views.rotations, views.positions, moved.position,
            moved.linear_velocity, moved.angular_velocity,
        )
        return step * power, -late_work

    def _torque(
        self, moved: DeviceState, q: np.ndarray, v: np.ndarray, lag: float
    ) -> np.ndarray:
        """Return torques of joints and contact (47,); add K of passive joints to `_impedance`."""
        self.contact.evaluate(self._views, self._surface_state(moved), lag)
        torque = self._joints.torque(q, v, self._impedance)
        return torque + self._joint_torque_of_contact(lag)

    def _joint_torque_of_contact(self, lag: float) -> np.ndarray:
        """Return Jᵀf (47,) of the present contact forces: Eq. 12."""
        pin.computeJointJacobians(self.model, self.data)
        self._load_segments()
        self._total_wrench[:] = self.segment_wrench
        if self._parts:
            shapes, law = self._parts
            add_self_contact(
                *shapes, self._views.rotations, self._views.positions, self._views.velocities,
                *law, lag, self._total_wrench, *self._parts_met[1:],
            )
        torque_of_wrenches(
            self._total_wrench, self._views.positions, self._views.jacobian, *self._tree,
            self._contact_torque,
        )
        return self._contact_torque

    def _own_parts(self, scene: Scene) -> tuple[tuple, tuple]:
        """Return shapes and law of self-contact; parts may overlap as they do at the start."""
        capsules = fit_capsules(scene.body.skin)
        shapes = capsules.pairs, capsules.ends, capsules.radius
        pin.forwardKinematics(self.model, self.data, scene.configuration)
        allowed = overlaps(*shapes, self._views.rotations, self._views.positions)
        law = scene.method.self_contact
        diameter = 2 * capsules.radius.mean(axis=1)
        stiffness = law.flesh_modulus_pa * diameter[capsules.pairs].min(axis=1)
        count = len(capsules.pairs)
        self._parts_met = (
            capsules.pairs, np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
        )
        allowed = np.maximum(allowed, 0.0) + ROUNDING
        return (*shapes, allowed), (stiffness, law.damping_time_s * stiffness)

    def _load_segments(self) -> None:
        """Write the contact forces on the skin as wrenches on its segments: Eq. 9."""
        wrench_listed(
            self.contact.listed, *self._influences, self._views.rotations, self.contact.force,
            self.segment_wrench,
        )

    def _add_impedance_of_sheet(self) -> None:
        """Add that of a sheet to `_impedance`; here there is none."""


def _contact_with_device(scene: Scene) -> SkinContact:
    """Return the contact of the skin with the rigid part of a scene."""
    if scene.method.contact.law == "penalty" and not scene.sling:
        return PointContact(scene)
    return FoundationContact(scene)
