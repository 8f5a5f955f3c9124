"""Contact of the body's flesh with what is rigid, or with a mattress."""

from functools import lru_cache

import numpy as np

from simcore.body.build import Body
from simcore.body.segments import SEGMENTS
from simcore.body.skin_clusters import skin_carriers, skin_clusters
from simcore.body.skin_listed import (
    blend_listed,
    blend_motion_listed,
    blend_velocity_listed,
    segment_balls,
)
from simcore.contact.foundation import foundation_forces, release, write_late_forces
from simcore.contact.foundation_energy import foundation_energy, foundation_power
from simcore.contact.foundation_law import LOOKED_AHEAD
from simcore.contact.layer import compliance
from simcore.contact.near_solid import NearSolid
from simcore.contact.neighbour_grid import nearest_within, sort_into_cells
from simcore.contact.tangential import Impulses, add_to_mat, bearing, moved_on_mat
from simcore.device.motion import DeviceState
from simcore.device.surface import Surface
from simcore.dynamics.pinocchio_views import SegmentViews
from simcore.scene import Scene
from simcore.skin_contact import OnSkin

FREE_MOTION = 4.0
"""Skin that touches nothing may move so much farther within a step than skin that does: for the
sake of joints at the ends of their ranges, and of limbs that meet."""


CLUSTER_SIZE = 32
"""Vertices of a cluster of the skin at most; tuned for time."""


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


class FoundationContact(OnSkin):
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
        blend_motion_listed(
            self.listed, *self._influences, segments.rotations, segments.positions,
            segments.velocities, self.points, self._velocities,
        )
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
        write_late_forces(
            pressed, self._velocities, self._mean_velocities, step, self._friction, self.normals,
            self.along, self.across, self.force, self.normal_force,
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
