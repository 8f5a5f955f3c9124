"""Contact of the skin with what is rigid, behind one interface: a lift, or a mattress."""

from functools import lru_cache
from typing import Protocol

import numpy as np

from simcore.body.build import Body, posed_skin
from simcore.body.segments import SEGMENTS
from simcore.body.skin_clusters import skin_carriers, skin_clusters
from simcore.body.skin_listed import (
    SkinParts,
    blend_listed,
    blend_motion_listed,
    blend_velocity_listed,
    edge_change_rate,
    segment_balls,
    skin_parts,
)
from simcore.contact.device_patches import DevicePoints, device_points
from simcore.contact.foundation import foundation_forces, release
from simcore.contact.foundation_energy import foundation_energy, foundation_power
from simcore.contact.foundation_law import LOOKED_AHEAD
from simcore.contact.layer import compliance
from simcore.contact.near_solid import NearSolid
from simcore.contact.neighbour_grid import nearest_within, sort_into_cells
from simcore.contact.neighbours import Neighbours
from simcore.contact.penalty import find_contacts, penalty_forces
from simcore.contact.segment_motion import write_relative
from simcore.contact.skin_kinds import SkinKinds, skin_kinds
from simcore.contact.tangential import Impulses, add_parts, add_to_mat, bearing, moved_on_mat
from simcore.device.motion import DeviceState
from simcore.device.surface import Surface
from simcore.dynamics.pinocchio_views import SegmentViews
from simcore.scene import Scene

FREE_MOTION = 4.0
"""Skin that touches nothing may move so much farther within a step than skin that does: for the
sake of joints at the ends of their ranges, and of limbs that meet."""


PART_LENGTH, CLUSTER_SIZE = 0.12, 32
"""Length of the parts of the skin whose motions are told apart [m], and vertices of its clusters at
most; tuned for time."""


class SkinContact(Protocol):
    """What carries the skin.

    Attributes
    ----------
    listed : (l,) int64
        Skin vertices that can carry force.
    force : (n, 3), normal_force : (n,) float64
        On each skin vertex, world axes, and its normal part [N]; current where listed.
    points, normals : (n, 3), along, across : (n,) float64
        Where, and with what impedance lag² K + lag D, an implicit step finds it; where listed.
    contact_count : int
    depth_max : float
        Deepest penetration [m].
    deepest : int
        Its skin vertex, −1 without contact.
    """

    listed: np.ndarray
    force: np.ndarray
    normal_force: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    along: np.ndarray
    across: np.ndarray
    contact_count: int
    depth_max: float
    deepest: int

    def evaluate(self, segments: SegmentViews, device: DeviceState, lag: float) -> None:
        """Write the forces for the present poses, and the impedances if there is a lag [s]."""

    def power(self, segments: SegmentViews, step: float) -> tuple[float, float, float]:
        """Return the powers of an implicit step [s]: heat, friction, implicit part [W] (Eq. E4).

        `segments` are where `evaluate` found them, and move with the mean velocity of the step.
        The implicit part is what of Eq. I1 belongs to the laws of contact, over the whole step.
        """

    def stored_energy(self, segments: SegmentViews, device: DeviceState) -> float:
        """Return the elastic energy for the present poses [J]: Eq. E3."""

    def add_skin_impulses(self, duration: float, on_skin: Impulses) -> float:
        """Add what the present forces do to each skin vertex in a time [s].

        Returns the normal impulse of what slips [N s], NaN with friction that knows no µ.
        """

    def add_mat_impulses(self, duration: float, on_mat: Impulses) -> None:
        """Add the normal part of what is done to `Scene.mat` in a time [s]."""

    def pace(self, segments: SegmentViews, device: DeviceState) -> float:
        """Return how long a step may be for the motion of the skin [s]: Eq. I3."""

    def add_skin_to_mat(self, on_skin: Impulses, on_mat: Impulses) -> None:
        """Add the normal impulses on the skin that `add_mat_impulses` leaves out."""


class _OnSkin:
    """The arrays of a `SkinContact`."""

    _friction = -1.0
    """µ; negative: none."""

    def __init__(self, scene: Scene):
        skin = scene.body.skin
        count = skin.vertex_count
        self._influences = (
            skin.influence_offsets, skin.influence_segment, skin.influence_weight,
            skin.influence_point,
        )
        self.listed = np.empty(0, np.int64)
        self.points, self.force, self.normals, self._velocities = np.zeros((4, count, 3))
        self.normal_force, self.along, self.across = np.zeros((3, count))
        self.contact_count, self.depth_max, self.deepest = 0, 0.0, -1

    def add_skin_impulses(self, duration: float, on_skin: Impulses) -> float:
        """Implement `SkinContact.add_skin_impulses`."""
        return add_parts(
            self.listed, self.force, self.normal_force, self.normals, self._friction, duration,
            *on_skin,
        )

    def add_mat_impulses(self, duration: float, on_mat: Impulses) -> None:
        """Implement `SkinContact.add_mat_impulses`: none."""

    def add_skin_to_mat(self, on_skin: Impulses, on_mat: Impulses) -> None:
        """Implement `SkinContact.add_skin_to_mat`: nothing is left out."""

    def _move(self, segments: SegmentViews) -> None:
        blend_motion_listed(
            self.listed, *self._influences, segments.rotations, segments.positions,
            segments.velocities, self.points, self._velocities,
        )


class PointContact(_OnSkin):
    """The paper's: a spring at each contact point of the device (Eqs. 6 and 7).

    All is looked at from the device, which its points stand still in.
    """

    def __init__(self, scene: Scene):
        super().__init__(scene)
        skin, law = scene.body.skin, scene.method.contact
        self._rings = skin.ring_offsets, skin.ring_next
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

        def pose(indices):
            blend_listed(indices, *self._influences, rotations, positions, skin)

        neighbours.update(self._pose, pose, skin)
        pose(neighbours.listed)
        self._touching, vertex, depth, self.listed = find_contacts(
            neighbours.patches, neighbours.first, neighbours.last, neighbours.near,
            *self._patches, skin, *self._rings, self._search_radius, self._outward,
        )
        blend_motion_listed(
            self.listed, *self._influences, rotations, positions, segments.velocities, skin,
            self._velocities,
        )
        self._on_point, deepest, self._fastest = penalty_forces(
            self._touching, vertex, depth, self.listed, self._velocities, self._outward,
            self._device_points, device.rotation, device.linear_velocity, device.angular_velocity,
            *self._law, self.force, self.normal_force, self.normals,
        )
        self.contact_count = len(vertex)
        self.depth_max, self.deepest = (
            (depth[deepest], vertex[deepest]) if len(vertex) else (0.0, -1)
        )

    def pace(self, segments: SegmentViews, device: DeviceState) -> float:
        """Implement `SkinContact.pace`: of what touched in the last evaluation."""
        return self._motion / self._fastest if self._fastest > 0 else np.inf

    def add_mat_impulses(self, duration: float, on_mat: Impulses) -> None:
        """Implement `SkinContact.add_mat_impulses`: every point has a force of its own."""
        on_mat.normal[self._touching] += duration * self._on_point
        on_mat.acted_on[self._touching] = True


@lru_cache(maxsize=4)
def _device_points(surface: Surface) -> DevicePoints:
    return device_points(surface.contact_points)


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


def _near_shapes(body: Body) -> tuple:
    """Return clusters of the skin and its carriers, and balls (m, 3), (m,) of its segments [m]."""
    count = len(SEGMENTS)
    clusters = vars(skin_clusters(body.skin, count, CLUSTER_SIZE)).values()
    carriers = vars(skin_carriers(body.skin)).values()
    return tuple(clusters), tuple(carriers), *segment_balls(body.skin, count)


@lru_cache(maxsize=4)
def _mat(surface: Surface) -> tuple[np.ndarray, ...]:
    points = surface.contact_points
    return sort_into_cells(points, np.arange(len(points)))


class FoundationContact(_OnSkin):
    """Flesh pressed by what is rigid or by a mattress: Eqs. C1 to C3.

    Pressure over depth, friction that sticks.
    """

    def __init__(self, scene: Scene):
        super().__init__(scene)
        body, skin, field = scene.body, scene.body.skin, scene.distance
        self._field = field.values, field.origin, field.spacing
        self._near = NearSolid(*self._field, self._influences, *_near_shapes(body))
        law = (_mattress_law if scene.sling else _flesh_law)(scene)
        self._flesh = skin.vertex_area, skin.vertex_area / compliance(*law[:3]), *law
        carrier = scene.sling.bed if scene.sling else scene.method.contact
        self._friction = carrier.friction_coefficient
        steps = scene.method.adaptive_step
        self._motion, self._pace = steps.motion_m if steps else np.inf, np.inf
        self._depths, self._steepness = np.zeros((2, skin.vertex_count))
        self._mean_velocities, self._shown, self._stretch = np.zeros((3, skin.vertex_count, 3))
        self._sticks = np.zeros(skin.vertex_count, bool)
        self._slid, self._lag, self._pressed = np.zeros(1), 0.0, self.listed
        self._anchor = np.zeros((body.skin.vertex_count, 3))
        self._closed = np.zeros(body.skin.vertex_count, bool)
        self._mat = _mat(scene.surface)
        self._mat_point = np.full(body.skin.vertex_count, -1)
        self._mat_place = np.full((body.skin.vertex_count, 3), np.inf)
        self._mat_step = scene.surface.spacing / 2
        self._device = None

    def evaluate(self, segments: SegmentViews, device: DeviceState, lag: float) -> None:
        """Implement `SkinContact.evaluate`."""
        self._near.update(segments, device, LOOKED_AHEAD * lag)
        before, self.listed = self.listed, self._near.listed
        release(
            before, self.listed, self._flesh[1], self.normal_force, self._closed, self._stretch,
            self._slid,
        )
        self._move(segments)
        self._device, self._lag = device, lag
        count, depth_max, deepest, self._pressed, self._pace = foundation_forces(
            self.listed, self.points, self._velocities, *self._field, device.rotation,
            device.position, device.linear_velocity, device.angular_velocity, *self._flesh,
            self._friction, lag, self._motion, self._anchor, self._closed, self.force,
            self.normal_force, self.normals, self.along, self.across, self._depths,
            self._steepness, self._sticks, self._stretch, self._slid,
        )
        self.contact_count, self.depth_max, self.deepest = count, depth_max, deepest

    def power(self, segments: SegmentViews, step: float) -> tuple[float, float, float]:
        """Implement `SkinContact.power`."""
        pressed, device = self._pressed, self._device
        blend_velocity_listed(
            pressed, *self._influences, segments.rotations, segments.velocities,
            self._mean_velocities,
        )
        heat, implicit = foundation_power(
            pressed, self.points, self._velocities, self._mean_velocities, device.position,
            device.linear_velocity, device.angular_velocity, *self._flesh, self._lag, step,
            self._depths, self._steepness, self.normals, self.normal_force, self.along,
            self._sticks,
        )
        slid, self._slid[0] = self._slid[0], 0.0
        return heat, slid / step, implicit

    def stored_energy(self, segments: SegmentViews, device: DeviceState) -> float:
        """Implement `SkinContact.stored_energy`.

        What touches at the end of a step bears force half-way: Eq. C1 sees it coming.
        """
        pressed = self._pressed
        blend_listed(
            pressed, *self._influences, segments.rotations, segments.positions, self._shown
        )
        return foundation_energy(
            pressed, self._shown, *self._field, device.rotation, device.position, *self._flesh[:6],
            self._anchor, self._closed,
        )

    def pace(self, segments: SegmentViews, device: DeviceState) -> float:
        """Implement `SkinContact.pace`."""
        return min(self._pace, self._near.pace(segments, device, FREE_MOTION * self._motion))

    def add_skin_to_mat(self, on_skin: Impulses, on_mat: Impulses) -> None:
        """Implement `SkinContact.add_skin_to_mat`: to the point of the mat that is nearest now."""
        pressed = bearing(on_skin.acted_on, on_skin.normal)
        moved = moved_on_mat(
            pressed, self.points, self._device.rotation, self._device.position, self._mat_step,
            self._mat_place,
        )
        if len(moved):
            unknown = np.full(len(moved), np.inf)
            _, nearest = nearest_within(*self._mat, self._mat_place, moved, unknown, np.inf)
            self._mat_point[moved] = nearest
        add_to_mat(pressed, self._mat_point, on_skin.normal, on_mat.acted_on, on_mat.normal)


def _flesh_law(scene: Scene) -> tuple:
    """Return modulus and thickness of flesh (n,), give, stiffening, damping time (n,): Eq. C1."""
    flesh, law = scene.flesh, scene.method.contact
    damping_time = np.full(len(flesh.modulus), law.damping_time_s)
    return flesh.modulus, flesh.thickness, 0.0, law.tissue == "stiffening", damping_time


def _mattress_law(scene: Scene) -> tuple:
    """Return the same of flesh on a mattress: Eq. C3; under `penalty` of the mattress alone."""
    bed, count = scene.sling.bed, scene.body.skin.vertex_count
    give = 1 / bed.pressure_stiffness_pa_per_m
    if scene.flesh is None:
        return np.ones(count), np.zeros(count), give, False, np.full(count, bed.damping_time_s)
    modulus, thickness, _, stiffening, damping_time = _flesh_law(scene)
    soft = thickness / modulus
    damping_time = (soft * damping_time + give * bed.damping_time_s) / (soft + give)
    return modulus, thickness, give, stiffening, damping_time


def contact_with_device(scene: Scene) -> SkinContact:
    """Return the contact of the skin with the rigid part of a scene."""
    if scene.method.contact.law == "penalty" and not scene.sling:
        return PointContact(scene)
    return FoundationContact(scene)
