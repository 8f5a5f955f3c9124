"""Human–device dynamics: the right-hand side of Eq. 1, from joints to skin and back."""

import numpy as np
import pinocchio as pin

from simcore.body.capsules import fit_capsules
from simcore.body.segments import PARENTS, SEGMENTS
from simcore.body.skin_listed import (
    blend_listed,
    blend_motion_listed,
    edge_change_rate,
    segment_balls,
    torque_of_wrenches,
    wrench_listed,
)
from simcore.compiled import compiled
from simcore.config.designs import Joints
from simcore.contact.neighbours import Neighbours
from simcore.contact.penalty import penalty_forces
from simcore.contact.self_contact import add_self_contact, overlaps
from simcore.device.motion import DeviceState
from simcore.dynamics.joints import PostureControl
from simcore.dynamics.pinocchio_views import view_segments
from simcore.scene import Scene, posed_skin


class Interaction:
    """Evaluates M(q) a + C + g = τ_joint + Jᵀf for one scene.

    What the last evaluation wrote stays readable, for a recorder to observe.

    Attributes
    ----------
    force : (n, 3) float64
        Contact force on each skin vertex, world axes [N]; current where listed.
    normal_force : (n,) float64
        Its normal part [N]; current where listed.
    listed : (l,) int64
        Skin vertices that can carry force.
    segment_wrench : (18, 6) float64
        Contact force [N] and moment about each segment's origin [N·m], world axes.
    contact_count : int
    depth_max : float
        Deepest penetration [m].
    deepest : int
        Its skin vertex, −1 without contact.
    """

    def __init__(self, scene: Scene):
        body = scene.body
        skin = body.skin
        self._body = body
        self.model = body.model
        self.data = body.model.createData()
        self._views = view_segments(self.model, self.data)
        self._control = PostureControl(
            self.model, scene.configuration, *joint_gains(self.model, scene.method.joints)
        )
        self._influences = (
            skin.influence_offsets, skin.influence_segment, skin.influence_weight,
            skin.influence_point,
        )
        self._rings = skin.ring_offsets, skin.ring_next
        joints = [self.model.joints[j + 1] for j in range(len(SEGMENTS))]
        self._tree = (
            np.array(PARENTS),
            np.array([joint.idx_v for joint in joints]),
            np.array([joint.nv for joint in joints]),
        )
        self._vertices = np.zeros((skin.vertex_count, 3))
        self._velocities = np.zeros((skin.vertex_count, 3))
        self.force = np.zeros((skin.vertex_count, 3))
        self.normal_force = np.zeros(skin.vertex_count)
        self.segment_wrench = np.zeros((len(SEGMENTS), 6))
        self._contact_torque = np.zeros(self.model.nv)
        self._total_wrench = np.zeros_like(self.segment_wrench)
        self._parts = None
        if scene.method.self_contact:
            self._parts = self._own_parts(scene)
        self._prepare_contact(scene)

    def _prepare_contact(self, scene: Scene) -> None:
        """Set up contact of the skin with the rigid device."""
        body, contact = scene.body, scene.method.contact
        skin = body.skin
        self._device_vertices = scene.surface.contact_points
        centre, radius = segment_balls(skin, len(SEGMENTS))
        rate = edge_change_rate(skin, posed_skin(body, body.rest_configuration), radius)
        self._neighbours = Neighbours(
            self._device_vertices, skin.influence_offsets, skin.influence_segment, *self._rings,
            rate, centre, radius, contact.search_radius_m,
        )
        self._law = (
            contact.stiffness_n_per_m, contact.damping_ns_per_m, contact.friction_force_n,
            contact.friction_velocity_m_per_s, contact.search_radius_m,
        )
        self._point_force = np.zeros(len(self._device_vertices))

    @property
    def listed(self) -> np.ndarray:
        """Skin vertices that can carry force (l,)."""
        return self._neighbours.listed

    @property
    def support_force(self) -> np.ndarray:
        """Force from outside that carries the body (3,), world axes [N]."""
        return self.segment_wrench[:, :3].sum(axis=0)

    def exchange(self, moved: DeviceState, q: np.ndarray, v: np.ndarray) -> None:
        """Advance what is neither body nor rigid by one step of the body; here there is nothing."""

    def place(self, q: np.ndarray, moved: DeviceState) -> np.ndarray:
        """Return where the body is on what carries it: its centre of mass, device frame (1, 3)."""
        centre = pin.centerOfMass(self.model, self.data, q, False)
        return (moved.rotation.T @ (centre - moved.position))[None]

    def add_skin_forces(self, total: np.ndarray) -> None:
        """Add the present normal force on each skin vertex (n,) [N]."""
        _add_listed(self.listed, self.normal_force, total)

    def add_support_forces(self, total: np.ndarray) -> None:
        """Add the present normal force on each point of `Scene.mat_points` (N,) [N]."""
        _add_listed(self._neighbours.rows, self._point_force, total)

    def sheet_frame(self) -> dict[str, np.ndarray]:
        """Return what a recorder keeps of the sheet, by name; here there is none."""
        return {}

    def acceleration(self, moved: DeviceState, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the joint acceleration (47,) at q (60,) and v (47,), the device at `moved`."""
        pin.forwardKinematics(self.model, self.data, q, v)
        self._contact(moved)
        torque = self._control.torque(q, v) + self._joint_torque_of_contact()
        return pin.aba(self.model, self.data, q, v, torque)

    def _contact(self, device: DeviceState) -> None:
        segments, neighbours = self._views, self._neighbours
        neighbours.update(
            segments.rotations, segments.positions, device, self._pose, self._vertices
        )
        blend_motion_listed(
            neighbours.listed, *self._influences, segments.rotations, segments.positions,
            segments.velocities, self._vertices, self._velocities,
        )
        self.contact_count, self.depth_max, self.deepest = penalty_forces(
            neighbours.rows, neighbours.offsets, neighbours.candidates, neighbours.listed,
            self._vertices, self._velocities, *self._rings, self._device_vertices,
            device.rotation, device.position, device.linear_velocity, device.angular_velocity,
            *self._law, self.force, self.normal_force, self._point_force,
        )

    def _joint_torque_of_contact(self) -> np.ndarray:
        """Return Jᵀf (47,) of the present contact forces: Eq. 12."""
        pin.computeJointJacobians(self.model, self.data)
        self._load_segments()
        self._total_wrench[:] = self.segment_wrench
        if self._parts:
            shapes, law = self._parts
            add_self_contact(
                *shapes, self._views.rotations, self._views.positions, self._views.velocities,
                *law, self._total_wrench,
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
        return (*shapes, np.maximum(allowed, 0.0)), (stiffness, law.damping_time_s * stiffness)

    def _load_segments(self) -> None:
        """Write the contact forces on the skin as wrenches on its segments: Eq. 9."""
        wrench_listed(
            self.listed, *self._influences, self._views.rotations, self.force, self.segment_wrench
        )

    def _pose(self, indices: np.ndarray) -> None:
        blend_listed(
            indices, *self._influences, self._views.rotations, self._views.positions,
            self._vertices,
        )


def joint_gains(model: pin.Model, joints: Joints) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness [N·m/rad] and damping [N·m·s/rad] by degree of freedom (nv,)."""
    stiffness, damping = np.zeros(model.nv), np.zeros(model.nv)
    for index, segment in enumerate(SEGMENTS):
        kind = segment.anatomy.removesuffix("_left").removesuffix("_right")
        if kind == "root":
            continue
        joint, gains = model.joints[index + 1], getattr(joints, kind)
        dofs = slice(joint.idx_v, joint.idx_v + joint.nv)
        stiffness[dofs] = gains.stiffness_nm_per_rad
        damping[dofs] = gains.damping_nms_per_rad
    return stiffness, damping


@compiled
def _add_listed(listed, values, total):
    for i in listed:
        total[i] += values[i]
