"""Body, sheet and bed: what each does to the others.

The body sees the sheet's force as constant over an exchange step; the sheet sees the skin as
planes that move with it (Eqs. S5 to S7, docs/sling.md). What one receives the other loses, so that
momentum is kept to rounding.
"""

import numpy as np
import pinocchio as pin
from numba import njit
from scipy.spatial import cKDTree

from simcore.body.inscribed import inscribed_radius
from simcore.body.segments import INDEX
from simcore.body.skin import vertex_normals
from simcore.body.skin_listed import blend_motion_listed, wrench_listed
from simcore.config.designs import SheetFoundation, SheetPenalty
from simcore.config.sling_lift import Bed
from simcore.contact.bed import bed_forces, near_bed
from simcore.contact.tracking import SurfaceTracker
from simcore.device.motion import DeviceState
from simcore.errors import SimulationError
from simcore.interaction import Interaction
from simcore.scene import Scene, posed_skin, segment_of_vertex
from simcore.sheet.contact import PlaneContact
from simcore.sheet.sling import Sling
from simcore.sheet.solver import SheetState

BED_MARGIN = 0.02
"""Skin lower than this may touch the bed before the next exchange [m]."""

NEAR, FAR = 0.01, 0.03
"""Planes are given to points nearer than the first, and to those that come so near within a step;
never to points beyond the second, which no step of a few milliseconds bridges [m]."""

SHEAR_SHARE = 1 / 3
"""Shear modulus over Young's modulus of what is incompressible, such as flesh."""

THICKNESS_SHARE = 0.9
"""Of the way to the middle of a limb that counts as its flesh; deeper a sheet has passed."""

STRAIN_MAX = 0.95
"""Of the flesh, beyond which it is taken as linear: 400 times as stiff as at rest."""

LANDMARKS, LANDMARK_RADIUS = ("pelvis", "thoracic"), 0.1
"""Segments whose place on the sheet is watched, and the radius of the patch of the sheet that lies
under each at the start [m]."""


class SlingInteraction(Interaction):
    """Evaluates M(q) a + C + g = τ_joint + Jᵀ(f_bed + f_sheet), and advances the sheet.

    Attributes
    ----------
    sheet : SheetState
    strap_force : (s, 3) float64
        On the sheet from each strap, mean over the last exchange step, world axes [N].
    """

    def __init__(self, scene: Scene):
        super().__init__(scene)
        sling, skin = scene.sling, scene.body.skin
        count = len(sling.start.position)
        self._solver, self._step, self._sheet_law = sling.solver, sling.step, sling.law
        self._steps_per_exchange = round(sling.step / scene.method.time_step_s)
        self._steps = 0
        self.sheet = SheetState(sling.start.position.copy(), sling.start.velocity.copy())
        self._tracker = SurfaceTracker(count, *self._rings)
        self._on_skin = _contact(sling, None)
        self._on_skin.normal = self._tracker.normal
        self._thickness = _flesh_thickness(scene)
        self._on_bed = _contact(sling, sling.bed)
        self._on_bed.normal[:, 2] = 1.0
        self._skin = np.zeros((skin.vertex_count, 3))
        self._skin_velocity = np.zeros((skin.vertex_count, 3))
        self._all = np.arange(skin.vertex_count)
        self._sheet_force = np.zeros((skin.vertex_count, 3))
        self._sheet_normal = np.zeros(skin.vertex_count)
        self._speed = np.zeros(count)  # of the sheet in relation to the pelvis [m/s]
        self._touched = np.empty(0, np.int64)
        self._sheet_wrench = np.zeros_like(self.segment_wrench)
        self._outer_force = np.zeros(3)  # on the sheet, of straps and bed
        self._landmarks = self._lay_landmarks(scene)
        self._on_sheet = np.zeros(count)  # normal force of the skin [N]
        self.strap_force = np.zeros((len(self._solver.sheet.straps.length), 3))

    def exchange(self, moved: DeviceState, q: np.ndarray, v: np.ndarray) -> None:
        """Advance the sheet, once an exchange step, under a bar that is at `moved`."""
        self._steps += 1
        if (self._steps - 1) % self._steps_per_exchange:
            return
        pin.forwardKinematics(self.model, self.data, q, v)
        segments = self._views
        blend_motion_listed(
            self._all, *self._influences, segments.rotations, segments.positions,
            segments.velocities, self._skin, self._skin_velocity,
        )
        self._over_bed = near_bed(self._skin, BED_MARGIN, *self._bed_half)
        _speeds(self.sheet.velocity, v[:3], self._speed)
        self._tracker.update(
            self.sheet.position, self._skin, self._step * self._speed,
            self._step * _fastest(self._skin_velocity, v[:3]),
        )
        self._refuse_passing()
        _set_skin_planes(
            self._tracker.vertex, self._tracker.gap, self._skin, self._skin_velocity,
            self.sheet.position, self.sheet.velocity, self._step, self._on_skin.normal,
            self._on_skin.active, self._on_skin.offset, self._on_skin.surface_velocity,
            self._on_skin.anchor,
        )
        if isinstance(self._sheet_law, SheetFoundation):
            on_skin, law = self._on_skin, self._sheet_law
            _press_flesh(
                on_skin.active, self._tracker.vertex, self._tracker.gap, self._thickness,
                self._solver.sheet.net.vertex_area, law.flesh_modulus_pa, law.damping_time_s,
                on_skin.stiffness, on_skin.damping, on_skin.tangential_stiffness,
                on_skin.tangential_damping, on_skin.offset,
            )
        _set_bed_planes(
            self.sheet.position, *self._bed_half, self._on_bed.active, self._on_bed.anchor
        )
        reaction = self._solver.advance(
            self.sheet, self._step, (self._on_skin, self._on_bed), moved
        )
        of_skin, of_bed = reaction.contacts
        self._touched = _react(
            self._tracker.vertex, of_skin.force, of_skin.normal_force, self._touched,
            self._sheet_force, self._sheet_normal,
        )
        self._on_sheet = of_skin.normal_force
        self.strap_force = reaction.strap_force
        self._outer_force = self.strap_force.sum(axis=0) + of_bed.force.sum(axis=0)

    @property
    def support_force(self) -> np.ndarray:
        """Force of bed and straps on body and sheet (3,), world axes [N]."""
        return self._bed_force + self._outer_force

    def place(self, q: np.ndarray, moved: DeviceState) -> np.ndarray:
        """Return where the sheet's landmarks are, in the frames of the segments above them [m]."""
        places = []
        for segment, patch in self._landmarks:
            frame = self.data.oMi[segment + 1]
            places.append(frame.actInv(self.sheet.position[patch].mean(axis=0)))
        return np.array(places)

    def add_skin_forces(self, total: np.ndarray) -> None:
        """Add the present normal force on each skin vertex (n,), of bed and sheet [N]."""
        super().add_skin_forces(total)
        total[self._touched] += self._sheet_normal[self._touched]

    def add_support_forces(self, total: np.ndarray) -> None:
        """Add the normal force of the skin on each sheet vertex (m,) [N]."""
        total += self._on_sheet

    def sheet_frame(self) -> dict[str, np.ndarray]:
        """Return position [m] and strap forces [N] of the sheet."""
        return {
            "sheet_position": self.sheet.position.astype(np.float32),
            "strap_force": self.strap_force,
        }

    def _prepare_contact(self, scene: Scene) -> None:
        """Set up contact of the skin with the bed."""
        bed = scene.sling.bed
        self._bed_half = bed.length_m / 2, bed.width_m / 2
        self._bed_law = (
            scene.body.skin.vertex_area, bed.pressure_stiffness_pa_per_m, bed.damping_time_s,
            bed.friction_coefficient,
        )
        self._over_bed = np.empty(0, np.int64)

    @property
    def listed(self) -> np.ndarray:
        """Skin vertices that the bed can carry (l,)."""
        return self._over_bed

    def _contact(self, moved: DeviceState) -> None:
        segments = self._views
        blend_motion_listed(
            self.listed, *self._influences, segments.rotations, segments.positions,
            segments.velocities, self._vertices, self._velocities,
        )
        self.contact_count, self.depth_max, self.deepest = bed_forces(
            self.listed, self._vertices, self._velocities, *self._bed_law, self.force,
            self.normal_force,
        )
        deepest = int(self._tracker.gap.argmin())
        depth = -float(self._tracker.gap[deepest])
        self.contact_count += np.count_nonzero(self._on_sheet)
        if depth > self.depth_max:
            self.depth_max, self.deepest = depth, int(self._tracker.vertex[deepest])

    def _load_segments(self) -> None:
        super()._load_segments()
        self._bed_force = self.segment_wrench[:, :3].sum(axis=0)
        wrench_listed(
            self._touched, *self._influences, self._views.rotations, self._sheet_force,
            self._sheet_wrench,
        )
        self.segment_wrench += self._sheet_wrench

    def _lay_landmarks(self, scene: Scene) -> list[tuple[int, np.ndarray]]:
        """Return segment and sheet vertices of each landmark that lies on the sheet."""
        pin.forwardKinematics(self.model, self.data, scene.configuration)
        found = []
        for name in LANDMARKS:
            above = self.data.oMi[INDEX[name] + 1].translation[:2]
            distance = np.linalg.norm(scene.sling.start.position[:, :2] - above, axis=1)
            patch = np.flatnonzero(distance < LANDMARK_RADIUS)
            if len(patch):
                found.append((INDEX[name], patch))
        return found

    def _refuse_passing(self) -> None:
        """Raise where a point of the sheet has come to the middle of a limb, or to the bone."""
        left = self._tracker.gap + self._thickness[self._tracker.vertex] / THICKNESS_SHARE
        passed = int(left.argmin())
        if left[passed] <= 0:
            part = segment_of_vertex(self._body, self._tracker.vertex[passed])
            x, y = self._solver.sheet.net.rest_position[passed]
            time = (self._steps - 1) * self._step / self._steps_per_exchange
            raise SimulationError(
                "slip_through",
                f"the sheet passed through the skin of the {part} at {time:.2f} s, with its point "
                f"({x:.2f}, {y:.2f}) m",
            )


def _flesh_thickness(scene: Scene) -> np.ndarray:
    """Return the depth at which the flesh under each skin vertex (n,) gives no more [m].

    That of the law, or most of the way to the middle of a limb that is thinner.
    """
    skin, law = scene.body.skin, scene.sling.law
    rest = posed_skin(scene.body, scene.body.rest_configuration)
    most = law.flesh_thickness_m if isinstance(law, SheetFoundation) else np.ptp(rest[:, 0])
    radius = inscribed_radius(
        cKDTree(rest), rest, vertex_normals(skin, rest), most / THICKNESS_SHARE
    )
    return THICKNESS_SHARE * radius


def _contact(sling: Sling, bed: Bed | None) -> PlaneContact:
    """Return the contact of the sheet with the skin, or with a bed."""
    law, area = sling.law, sling.solver.sheet.net.vertex_area
    contact = PlaneContact.empty(len(area))
    if isinstance(law, SheetPenalty):
        contact.stiffness[:] = law.stiffness_n_per_m
        contact.damping[:] = law.damping_ns_per_m
        contact.friction_force[:] = law.friction_force_n
        contact.friction_velocity = law.friction_velocity_m_per_s
        contact.friction_coefficient = -1.0  # Eq. S7
        return contact
    if bed is None:
        contact.friction_coefficient = law.friction_coefficient  # `_press_flesh` does the rest
        return contact
    contact.friction_coefficient = bed.friction_coefficient
    contact.stiffness[:] = bed.pressure_stiffness_pa_per_m * area
    contact.damping[:] = bed.damping_time_s * contact.stiffness
    contact.tangential_stiffness[:] = SHEAR_SHARE * contact.stiffness
    contact.tangential_damping[:] = SHEAR_SHARE * contact.damping
    return contact


@njit(cache=True, error_model="numpy")
def _fastest(velocity, reference):
    """Return the greatest speed of any of (n, 3) in relation to a reference (3,) [m/s]."""
    square = 0.0
    for i in range(velocity.shape[0]):
        x, y, z = (velocity[i, 0] - reference[0], velocity[i, 1] - reference[1],
                   velocity[i, 2] - reference[2])
        square = max(square, x * x + y * y + z * z)
    return np.sqrt(square)


@njit(cache=True, error_model="numpy")
def _speeds(velocity, reference, speed):
    """Write the speed (n,) of each of (n, 3) in relation to a reference (3,) [m/s]."""
    for i in range(velocity.shape[0]):
        x, y, z = (velocity[i, 0] - reference[0], velocity[i, 1] - reference[1],
                   velocity[i, 2] - reference[2])
        speed[i] = np.sqrt(x * x + y * y + z * z)


@njit(cache=True, error_model="numpy")
def _set_skin_planes(
    vertex, gap, skin, skin_velocity, position, velocity, duration, normal, active, offset,
    surface_velocity, anchor,
):
    """Give a plane to each sheet vertex that is near the skin, or will be within the duration."""
    for p in range(vertex.size):
        i = vertex[p]
        if i < 0 or gap[p] > FAR:
            active[p] = False
            continue
        approach = 0.0
        for a in range(3):
            approach += normal[p, a] * (skin_velocity[i, a] - velocity[p, a])
        if gap[p] > NEAR + approach * duration:
            active[p] = False
            continue
        offset[p] = 0.0
        for a in range(3):
            offset[p] += normal[p, a] * skin[i, a]
            surface_velocity[p, a] = skin_velocity[i, a]
            if not active[p]:
                anchor[p, a] = position[p, a]
        active[p] = True


@njit(cache=True, error_model="numpy")
def _press_flesh(
    active, vertex, gap, thickness, area, modulus, damping_time, stiffness, damping,
    tangential_stiffness, tangential_damping, offset,
):
    """Give each plane the tangent of the flesh's law at its present depth d (Eq. S12).

        N = A E ε / (1 − ε),  ε = d/D,  dN/dd = A E / D / (1 − ε)²

    for flesh of thickness D, linear beyond STRAIN_MAX. The plane is moved so that its force at d
    is N.
    """
    for p in range(active.size):
        if not active[p]:
            continue
        most = thickness[vertex[p]]
        strain = min(max(-gap[p], 0.0) / most, STRAIN_MAX)
        shallow = area[p] * modulus / most
        left = 1.0 - strain
        stiffness[p] = shallow / (left * left)
        offset[p] -= most * strain * strain
        damping[p] = damping_time * shallow
        tangential_stiffness[p] = SHEAR_SHARE * shallow
        tangential_damping[p] = SHEAR_SHARE * damping[p]


@njit(cache=True, error_model="numpy")
def _set_bed_planes(position, half_length, half_width, active, anchor):
    """Give a plane to each sheet vertex that is over the bed and near it."""
    for p in range(active.size):
        over = abs(position[p, 0]) < half_length and abs(position[p, 1]) < half_width
        if not over or position[p, 2] > NEAR:
            active[p] = False
            continue
        if not active[p]:
            for a in range(3):
                anchor[p, a] = position[p, a]
        active[p] = True


@njit(cache=True, error_model="numpy")
def _react(vertex, force, normal_force, touched_before, skin_force, skin_normal):
    """Write the opposite of the sheet's contact forces on the skin; return the skin vertices."""
    for i in touched_before:
        skin_normal[i] = 0.0
        for a in range(3):
            skin_force[i, a] = 0.0
    touched = np.empty(vertex.size, np.int64)
    count = 0
    for p in range(vertex.size):
        i = vertex[p]
        if i < 0 or normal_force[p] == 0.0:
            continue
        if skin_normal[i] == 0.0:
            touched[count] = i
            count += 1
        skin_normal[i] += normal_force[p]
        for a in range(3):
            skin_force[i, a] -= force[p, a]
    return touched[:count].copy()
