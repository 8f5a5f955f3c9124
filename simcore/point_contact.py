"""The paper's contact of the skin with a rigid device: a spring at each of its points."""

from functools import lru_cache

import numpy as np

from simcore.body.build import Body, posed_skin
from simcore.body.segments import SEGMENTS
from simcore.body.skin_listed import (
    SkinParts,
    blend_listed,
    blend_velocity_listed,
    edge_change_rate,
    skin_parts,
)
from simcore.compiled import compiled
from simcore.contact.device_patches import DevicePoints, device_points
from simcore.contact.neighbours import Neighbours
from simcore.contact.normals import chained
from simcore.contact.penalty import find_contacts, penalty_forces
from simcore.contact.segment_motion import write_relative
from simcore.contact.skin_kinds import SkinKinds, skin_kinds
from simcore.contact.tangential import Impulses, add_normal_parts
from simcore.device.motion import DeviceState
from simcore.device.surface import Surface
from simcore.dynamics.pinocchio_views import SegmentViews
from simcore.scene import Scene
from simcore.skin_contact import OnSkin

PART_LENGTH = 0.12
"""Length of the parts of the skin whose motions are told apart [m]; tuned for time."""


class PointContact(OnSkin):
    """The paper's: a spring at each contact point of the device (Eqs. 6 and 7).

    All is looked at from the device, which its points stand still in.
    """

    def __init__(self, scene: Scene):
        super().__init__(scene)
        skin, law = scene.body.skin, scene.method.contact
        self._rings = _rings(scene.body)
        device = _device_points(scene.surface)
        self._device_points = device.vertices
        self._patches = device.patches.points, device.patches.vertex
        self._neighbours = Neighbours(
            device, *_moving_skin(scene.body), self._rings, _bending(scene.body),
            law.search_radius_m,
        )
        self._search_radius = law.search_radius_m
        self._law = (
            law.stiffness_n_per_m, law.damping_ns_per_m, law.friction_force_n,
            law.friction_velocity_m_per_s,
        )
        self._outward = np.zeros((skin.vertex_count, 3))
        self._pose = np.zeros((len(SEGMENTS), 3, 4))
        self._touching, self._on_point = np.empty(0, np.int64), np.empty(0)
        steps = scene.method.adaptive_step
        self._motion, self._fastest = steps.motion_m if steps else np.inf, 0.0

    def evaluate(self, segments: SegmentViews, device: DeviceState, lag: float) -> None:
        """Implement `SkinContact.evaluate`; it has no impedance, steps are explicit."""
        write_relative(
            segments.rotations, segments.positions, device.rotation, device.position, self._pose
        )
        rotations, positions, skin = self._pose[:, :, :3], self._pose[:, :, 3], self.points
        neighbours = self._neighbours

        def pose(poses, indices):
            blend_listed(indices, *self._influences, poses[:, :, :3], poses[:, :, 3], skin)

        neighbours.update(self._pose, pose, skin)
        self.listed, self._touching, self._on_point, self._fastest, self.depth_max, self.deepest = (
            _touch(
                neighbours.listed, *self._influences, rotations, positions, segments.velocities,
                neighbours.patches, neighbours.first, neighbours.last, neighbours.near,
                *self._patches, skin, self._velocities, *self._rings, self._search_radius,
                self._outward, self._device_points, device.rotation, device.linear_velocity,
                device.angular_velocity, *self._law, self.force, self.normal_force, self.normals,
            )
        )
        self.contact_count = len(self._touching)

    def pace(self, segments: SegmentViews, device: DeviceState) -> float:
        """Implement `SkinContact.pace`: of what touched in the last evaluation."""
        return self._motion / self._fastest if self._fastest > 0 else np.inf

    def add_mat_impulses(self, duration: float, on_mat: Impulses) -> None:
        """Implement `SkinContact.add_mat_impulses`: every point has a force of its own."""
        add_normal_parts(
            self._touching, self._on_point, duration, on_mat.acted_on, on_mat.normal
        )


@compiled
def _touch(
    listed, offsets, segments, weights, influence_points, rotations, positions, local_velocities,
    patches, first, last, near, points, point_index, skin, velocities, ring_offsets, ring_next,
    search_radius, outward, device_points, rotation, linear_velocity, angular_velocity, stiffness,
    damping, friction_force, friction_velocity, force, normal_force, normals,
):
    """Pose what is listed, find what touches, and write its forces; arguments as of these four.

    One kernel, for between four Python takes as long as the least of them. Returns the skin
    vertices and the points that touch, the normal force on these, the greatest speed of a contact,
    and the greatest depth and its vertex.
    """
    blend_listed(
        listed, offsets, segments, weights, influence_points, rotations, positions, skin
    )
    point, vertex, depth, touched = find_contacts(
        patches, first, last, near, points, point_index, skin, ring_offsets, ring_next,
        search_radius, outward,
    )
    blend_velocity_listed(
        touched, offsets, segments, weights, influence_points, rotations, local_velocities,
        velocities,
    )
    on_point, deepest, fastest = penalty_forces(
        point, vertex, depth, touched, velocities, outward, device_points, rotation,
        linear_velocity, angular_velocity, stiffness, damping, friction_force, friction_velocity,
        force, normal_force, normals,
    )
    if deepest < 0:
        return touched, point, on_point, fastest, 0.0, -1
    return touched, point, on_point, fastest, depth[deepest], vertex[deepest]


@lru_cache(maxsize=4)
def _device_points(surface: Surface) -> DevicePoints:
    return device_points(surface.contact_points)


@lru_cache(maxsize=4)
def _rings(body: Body) -> tuple[np.ndarray, np.ndarray]:
    skin = body.skin
    return skin.ring_offsets, chained(skin.ring_offsets, skin.ring_next)


@lru_cache(maxsize=4)
def _skin_parts(body: Body) -> SkinParts:
    return skin_parts(body.skin, len(SEGMENTS), PART_LENGTH)


@lru_cache(maxsize=4)
def _moving_skin(body: Body) -> tuple[SkinKinds, tuple[np.ndarray, ...]]:
    """Return kinds and parts of the skin, as `Neighbours` takes them."""
    skin, parts = body.skin, _skin_parts(body)
    kinds = skin_kinds(
        skin.influence_offsets, parts.of_influence, skin.ring_offsets, skin.ring_next
    )
    return kinds, (parts.offsets, parts.centre, parts.radius)


@lru_cache(maxsize=4)
def _bending(body: Body) -> np.ndarray:
    """Return how much edges change as the parts of the skin move (n,)."""
    parts, rest = _skin_parts(body), posed_skin(body, body.rest_configuration)
    return edge_change_rate(body.skin, rest, parts.of_influence, parts.radius)
