"""Contact of a sheet with skin: planes for the sheet, forces for the skin."""

import numpy as np
from scipy.spatial import cKDTree

from simcore.body.inscribed import inscribed_radius
from simcore.body.skin import vertex_normals
from simcore.compiled import compiled
from simcore.config.designs import SheetFoundation, SheetPenalty
from simcore.contact import tracking
from simcore.errors import SimulationError
from simcore.scene import Scene, posed_skin, segment_of_vertex
from simcore.sheet.contact import ContactForce, PlaneContact
from simcore.sheet.solver import SheetState

NEAR = 0.01
"""Planes are given to points nearer than this, and to those that come so near within a step; never
to points beyond `simcore.contact.tracking.NEAR`, which no step of some milliseconds bridges [m]."""

SHEAR_SHARE = 1 / 3
"""Shear modulus over Young's modulus of what is incompressible, such as flesh."""

THICKNESS_SHARE = 0.9
"""Of the way to the middle of a limb that counts as its flesh; deeper a sheet has passed."""

STRAIN_MAX = 0.8
"""Of the flesh, beyond which it is taken as linear: 25 times as stiff as at rest."""


class SheetOnSkin:
    """Contact of a sheet with the skin; m sheet vertices, n skin vertices.

    Attributes
    ----------
    planes : PlaneContact
        What the skin is to the sheet.
    normal_force : (m,) float64
        Of the skin on each sheet vertex, mean over the last step [N].
    contact_count : int
        Sheet vertices that were pressed in the last step.
    depth_max, deepest : float, int
        Greatest depth of a sheet vertex in the skin at its start [m], and its skin vertex.
    touched : (t,) int64
        Skin vertices that the sheet pressed in the last step.
    skin_force : (n, 3), skin_normal : (n,) float64
        Mean force on each skin vertex, world axes, and its normal part [N]; zero elsewhere.
    """

    def __init__(self, scene: Scene):
        skin, net = scene.body.skin, scene.sling.solver.sheet.net
        self._body, self._law, self._net = scene.body, scene.sling.law, net
        self._tracker = tracking.SurfaceTracker(len(net.mass), skin.ring_offsets, skin.ring_next)
        self._thickness = _flesh_thickness(scene)
        self.planes = PlaneContact.empty(len(net.mass))
        self.planes.normal = self._tracker.normal
        if isinstance(self._law, SheetPenalty):
            _set_penalty(self.planes, self._law)
        else:
            self.planes.friction_coefficient = self._law.friction_coefficient
        self.normal_force = np.zeros(len(net.mass))
        self.contact_count, self.depth_max, self.deepest = 0, 0.0, -1
        self.touched = np.empty(0, np.int64)
        self.skin_force = np.zeros((skin.vertex_count, 3))
        self.skin_normal = np.zeros(skin.vertex_count)

    def find(self, sheet: SheetState, skin: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Follow the sheet over the skin; return the skin vertices (l,) that it may touch.

        Parameters
        ----------
        skin : (n, 3) float64
            All skin vertices in the world [m].
        reference : (3,) float64
            Where the pelvis is [m].
        """
        tracker = self._tracker
        tracker.update(sheet.position, skin, reference)
        return tracker.vertex[(tracker.gap <= tracking.NEAR) & (tracker.vertex >= 0)]

    def set_planes(
        self, sheet: SheetState, skin: np.ndarray, skin_velocity: np.ndarray, duration: float
    ) -> None:
        """Set the planes for a step of some duration [s], after `find`.

        Parameters
        ----------
        skin, skin_velocity : (n, 3) float64
            Skin vertices in the world where the sheet may touch them [m, m/s].
        """
        tracker, planes, law = self._tracker, self.planes, self._law
        _set_skin_planes(
            tracker.vertex, tracker.gap, skin, skin_velocity, sheet.position, sheet.velocity,
            duration, planes.normal, planes.active, planes.offset, planes.surface_velocity,
            planes.anchor, planes.force,
        )
        if isinstance(law, SheetFoundation):
            _press_flesh(
                planes.active, tracker.vertex, tracker.gap, self._thickness,
                self._net.vertex_area, law.flesh_modulus_pa, law.damping_time_s,
                planes.stiffness, planes.damping, planes.tangential_stiffness,
                planes.tangential_damping, planes.offset,
            )

    def refuse_passing(self, time: float) -> None:
        """Raise where a point of the sheet has come to the middle of a limb, or to the bone."""
        tracker = self._tracker
        left = tracker.gap + self._thickness[tracker.vertex] / THICKNESS_SHARE
        passed = int(left.argmin())
        if left[passed] <= 0:
            x, y = self._net.rest_position[passed]
            raise SimulationError(
                "slip_through",
                f"the sheet passed into the {segment_of_vertex(self._body, tracker.vertex[passed])}"
                f" {time:.2f} s after the start of settling, with its point ({x:.2f}, {y:.2f}) m",
            )

    def press(self, of_skin: ContactForce) -> None:
        """Take note of what the skin did to the sheet; the opposite acts on the skin."""
        self.normal_force = of_skin.normal_force
        self.contact_count = int(np.count_nonzero(self.normal_force))
        point = int(self._tracker.gap.argmin())
        self.depth_max = -float(self._tracker.gap[point])
        self.deepest = int(self._tracker.vertex[point])
        self.touched = _react(
            self._tracker.vertex, of_skin.force, of_skin.normal_force, self.touched,
            self.skin_force, self.skin_normal,
        )


def _set_penalty(planes: PlaneContact, law: SheetPenalty) -> None:
    planes.stiffness[:] = law.stiffness_n_per_m
    planes.damping[:] = law.damping_ns_per_m
    planes.friction_force[:] = law.friction_force_n
    planes.friction_velocity = law.friction_velocity_m_per_s
    planes.friction_coefficient = -1.0  # Eq. S7


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


@compiled
def _set_skin_planes(
    vertex, gap, skin, skin_velocity, position, velocity, duration, normal, active, offset,
    surface_velocity, anchor, force,
):
    """Give a plane to each sheet vertex that is near the skin, or will be within the duration."""
    for p in range(vertex.size):
        i = vertex[p]
        if i < 0 or gap[p] > tracking.NEAR:
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
                force[p, a] = 0.0
        active[p] = True


@compiled
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


@compiled
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
