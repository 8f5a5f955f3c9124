"""Contact of a sheet with skin: planes for the sheet, forces for the skin."""

from collections.abc import Callable

import numpy as np

from simcore.body.flesh import THICKNESS_SHARE, limb_depth
from simcore.body.segments import INDEX, SEGMENTS
from simcore.body.skin_listed import segment_balls, two_rings
from simcore.compiled import compiled
from simcore.contact import tracking
from simcore.contact.foundation_energy import energy_between
from simcore.contact.segment_motion import SkinTravel
from simcore.contact.skin_planes import press_flesh, set_skin_planes
from simcore.contact.tangential import Impulses, add_parts
from simcore.contact.tiles import spread_by_tiles, under_tiles
from simcore.dynamics.pinocchio_views import SegmentViews
from simcore.errors import SimulationError
from simcore.scene import Scene, segment_of_vertex
from simcore.sheet.contact import ContactForce, PlaneContact
from simcore.sheet.solver import SheetState

MOTION = 0.5
"""Share of what skin may move on what is rigid within a step (Eq. I3) that sheet and skin may move
past each other: planes keep the direction and the tangent of the flesh that they start with."""

CARRIED = 10.0
"""Inertia that a sheet vertex opposes to the skin, over its own: within the lag of a step, some ten
sub-steps, its springs take hold of neighbours as far as the third (Eq. S13)."""

WINDOW = 0.016
"""Radius of the cone through which the skin feels a vertex of a fine sheet [m]: that of a tile of
4,000 vertices. Finer sheets are felt through the same, so that pressures compare."""


class SheetOnSkin:
    """Contact of a sheet with the skin; m sheet vertices, n skin vertices.

    Attributes
    ----------
    planes : PlaneContact
        What the skin is to the sheet.
    contact_count : int
        Sheet vertices that were pressed in the last step.
    pace : float
        How long a step may be as skin and sheet meet [s]: Eq. I3.
    depth_max, deepest : float, int
        Greatest depth of a sheet vertex in the skin at its start [m], and its skin vertex.
    near : (l,) int64
        Skin vertices that the sheet may touch.
    touched : (t,) int64
        Skin vertices that the sheet pressed in the last step.
    skin_force : (n, 3), skin_normal : (n,) float64
        Mean force on each skin vertex, world axes, and its normal part [N]; zero elsewhere.
    given_back : (3,) float64
        Impulse that the sheet was last given back [N s].
    energy_given_back : float
        By which it was faster then [J].
    skin_direction : (n, 3), skin_along, skin_across : (n,) float64
        Normal, and impedance lag² K + lag D along and across it [kg], of the sheet on each skin
        vertex that is touched; zero elsewhere.
    """

    def __init__(self, scene: Scene):
        skin, net = scene.body.skin, scene.sling.solver.sheet.net
        self._body, self._law, self._net = scene.body, scene.sling.law, net
        self._two_rings, self._vertex_area = two_rings(skin), skin.vertex_area
        self._tile = max(np.sqrt(3 / np.pi * net.spacing.prod()), WINDOW)
        self._tracker = tracking.SurfaceTracker(len(net.mass), skin.ring_offsets, skin.ring_next)
        self._pelvis = INDEX["pelvis"]
        self._travel = SkinTravel(*segment_balls(skin, len(SEGMENTS)), self._pelvis)
        self._thickness = scene.flesh.thickness if scene.flesh else limb_depth(scene.body)
        self._room = self._thickness / THICKNESS_SHARE
        self.planes = PlaneContact.empty(len(net.mass))
        self.planes.normal = self._tracker.normal
        if self._law:
            self.planes.set_penalty(self._law)
        else:
            contact = scene.method.contact
            self.planes.friction_coefficient = contact.friction_coefficient
            stiffening = contact.tissue == "stiffening"
            self._flesh = scene.flesh.modulus, stiffening, contact.damping_time_s
        self._of_skin = ContactForce(np.zeros((len(net.mass), 3)), np.zeros(len(net.mass)))
        self._met = np.empty(0, np.int64)  # sheet vertices that have a plane in this step
        self.contact_count, self.depth_max, self.deepest = 0, 0.0, -1
        self.near = self.touched = np.empty(0, np.int64)
        self.skin_force = np.zeros((skin.vertex_count, 3))
        self.skin_normal = np.zeros(skin.vertex_count)
        self.skin_direction = np.zeros((skin.vertex_count, 3))
        self.skin_along, self.skin_across = np.zeros((2, skin.vertex_count))
        self.given_back, self.energy_given_back = np.zeros(3), 0.0
        self._inertia = scene.sling.solver.inertia
        steps = scene.method.adaptive_step
        self._motion, self.pace = MOTION * steps.motion_m if steps else np.inf, np.inf
        self._step, self._lag = scene.sling.step, 0.0  # of the last exchange
        # Sheet vertices that pressed in the last step; of each, on which of the skin, and how.
        self._pressing, self._pressed = np.empty(0, np.int64), np.full(len(net.mass), -1)
        self._direction = np.zeros((len(net.mass), 3))
        self._along, self._across = np.zeros((2, len(net.mass)))
        # By how much planes lead the skin, and how fast that was an exchange before.
        self._lead, self._last_velocity = np.zeros((2, len(net.mass), 3))

    def find(
        self, sheet: SheetState, segments: SegmentViews, skin: np.ndarray,
        pose: Callable[[np.ndarray], None],
    ) -> None:
        """Follow the sheet over the skin.

        Parameters
        ----------
        segments : SegmentViews
            After forward kinematics.
        skin : (n, 3) float64
            Skin vertices in the world, where posed [m].
        pose : callable
            Writes given skin vertices (k,) into `skin`.
        """
        self._tracker.update(
            sheet.position, skin, segments.rotations[self._pelvis],
            segments.positions[self._pelvis], self._travel.since(segments), pose,
        )
        if self._tracker.searched:
            self._travel.mark(segments)
        self.near = _moving(
            self._tracker.vertex, self._tracker.gap, self._pressed, len(self.skin_normal)
        )

    @property
    def followed(self) -> np.ndarray:
        """Skin vertices (l,) that carry a plane."""
        return self._tracker.vertex[self.planes.active]

    def give_back(self, sheet: SheetState, skin_velocity: np.ndarray) -> None:
        """Give the sheet what an implicit step of the body did not take of its force (Eq. S13).

        That is the impedance times the change of the skin's velocity since the planes were set.
        """
        if self._lag:
            impulse, self.given_back = _not_taken(
                self._pressing, self._pressed, self._direction, self._along, self._across,
                skin_velocity, self.planes.surface_velocity,
            )
            self.energy_given_back = self._inertia.kick(sheet.velocity, self._pressing, impulse)

    def set_planes(
        self, sheet: SheetState, skin: np.ndarray, skin_velocity: np.ndarray, duration: float,
        lag: float,
    ) -> None:
        """Set the planes for a step of some duration [s], after `find`.

        Parameters
        ----------
        skin, skin_velocity : (n, 3) float64
            Skin vertices in the world where the sheet may touch them [m, m/s].
        lag : float
            Time after which the body's step wants to know the force, 0 for an explicit one [s].
        """
        tracker, planes = self._tracker, self.planes
        ahead, self._step, self._lag = duration / (2 * self._step), duration, lag
        self._met, self.pace = set_skin_planes(
            tracker.vertex, tracker.gap, skin, skin_velocity, sheet.position, sheet.velocity,
            duration, lag, ahead, self._motion, planes.normal, planes.active, planes.offset,
            planes.surface_velocity, planes.anchor, planes.force, self._lead, self._last_velocity,
        )
        if not self._law:
            press_flesh(
                self._met, tracker.vertex, tracker.gap, self._thickness,
                self._net.vertex_area, *self._flesh, planes.stiffness, planes.damping,
                planes.tangential_stiffness, planes.tangential_damping, planes.offset,
            )

    def stored_energy(self, sheet: SheetState, skin: np.ndarray) -> float:
        """Return the elastic energy of flesh between sheet and skin [J]: Eq. E3.

        Parameters
        ----------
        skin : (n, 3) float64
            Skin vertices in the world where the sheet touches them [m].
        """
        planes = self.planes
        modulus, stiffening = (np.empty(0), False) if self._law else self._flesh[:2]
        return energy_between(
            planes.active, self._tracker.vertex, sheet.position, skin, planes.normal,
            self._thickness, self._net.vertex_area, modulus, stiffening, planes.stiffness,
            planes.tangential_stiffness, planes.anchor, planes.friction_coefficient > 0,
        )

    def refuse_passing(self, time: float) -> None:
        """Raise where a point of the sheet has come to the middle of a limb, or to the bone."""
        tracker = self._tracker
        passed, left = _least_left(self._met, tracker.vertex, tracker.gap, self._room)
        if left <= 0:
            x, y = self._net.rest_position[passed]
            into = segment_of_vertex(self._body, tracker.vertex[passed])
            raise SimulationError(
                "slip_through", f"the sheet passed into the {into} {time:.2f} s after the start of "
                f"settling, with its point ({x:.2f}, {y:.2f}) m",
            )

    def add_sheet_impulses(self, duration: float, on_sheet: Impulses) -> float:
        """Add what the skin's mean forces of the last step do to sheet vertices in a time [s].

        Returns the normal impulse of those that slip [N s], NaN with friction that knows no µ.
        """
        return add_parts(
            self._met, self._of_skin.force, self._of_skin.normal_force, self.planes.normal,
            self.planes.friction_coefficient, duration, *on_sheet,
        )

    def spread(
        self, on_sheet: Impulses, sheet: np.ndarray, skin: np.ndarray,
        pose: Callable[[np.ndarray], None], on_skin: Impulses,
    ) -> None:
        """Give impulses on sheet vertices back to the skin vertices under their tiles.

        Parameters
        ----------
        on_sheet : Impulses
            On m vertices.
        sheet : (m, 3), skin : (n, 3) float64
            Positions [m]; the skin's wait for `pose`, which is as in `find`.
        on_skin : Impulses
            Have the normal ones and the opposite of the tangential ones added.
        """
        pose(under_tiles(on_sheet.normal, self._tracker.vertex, *self._two_rings))
        spread_by_tiles(
            on_sheet.normal, on_sheet.tangential, sheet, skin, self._tracker.vertex,
            self._tracker.normal, self._tile, *self._two_rings, self._vertex_area, *on_skin,
        )

    def press(self, of_skin: ContactForce) -> None:
        """Take note of what the skin did to the sheet; the opposite acts on the skin."""
        self._of_skin = of_skin
        point = int(self._tracker.gap.argmin())
        self.depth_max = -float(self._tracker.gap[point])
        self.deepest = int(self._tracker.vertex[point])
        planes = self.planes
        self.touched, self._pressing = _react(
            self._met, self._tracker.vertex, of_skin.force, of_skin.normal_force, planes.normal,
            planes.stiffness, planes.damping, planes.tangential_stiffness,
            planes.tangential_damping, self._inertia.local, self._lag, self.touched,
            self.skin_force, self.skin_normal, self.skin_direction, self.skin_along,
            self.skin_across, self._pressed, self._direction, self._along, self._across,
            self._lead, self._step,
        )
        self.contact_count = len(self._pressing)


@compiled
def _moving(vertex, gap, pressed, count):
    """Return the skin vertices (l,) of `count`, each once, whose velocities are asked for.

    Those near the sheet, and those that were pressed: what is left by the sheet still has to tell
    what it did not take.
    """
    told, asked, found = np.zeros(count, np.bool_), np.empty(count, np.int64), 0
    for p in range(vertex.size):
        near = vertex[p] if gap[p] <= tracking.NEAR else -1
        for i in (near, pressed[p]):
            if i >= 0 and not told[i]:
                told[i] = True
                asked[found] = i
                found += 1
    return asked[:found].copy()


@compiled
def _least_left(met, vertex, gap, room):
    """Return the sheet vertex with the least way left to bone or middle, and that way [m]."""
    passed, least = -1, np.inf
    for p in met:
        left = gap[p] + room[vertex[p]]
        if left < least:
            passed, least = p, left
    return passed, least


@compiled
def _react(
    met, vertex, force, normal_force, normal, stiffness, damping, tangential_stiffness,
    tangential_damping, inertia, lag, touched_before, skin_force, skin_normal, skin_direction,
    skin_along, skin_across, pressed, direction, along, across, lead, step,
):
    """Write the opposite of the sheet's contact forces on the skin, and their impedances.

    Forces are those of a surface that leads the skin; that it does not is Z times the lead
    (Eqs. S13 and S15). Returns the skin vertices that are touched, and what touches them.
    """
    for i in touched_before:
        skin_normal[i] = skin_along[i] = skin_across[i] = 0.0
        for a in range(3):
            skin_force[i, a] = 0.0
    touched, pressing = np.empty(met.size, np.int64), np.empty(met.size, np.int64)
    count = touching = 0
    pressed[:] = -1
    for each in met:
        p = np.uint64(each)
        i = vertex[p]
        if i < 0 or normal_force[p] == 0.0:
            continue
        pressing[touching] = p
        touching += 1
        if skin_normal[i] == 0.0:
            touched[count] = i
            count += 1
        skin_normal[i] += normal_force[p]
        pressed[p] = i
        carried = CARRIED * inertia[p]
        z = lag * (lag * stiffness[p] + damping[p])
        along[p] = z * carried / (z + carried)
        z = lag * (lag * tangential_stiffness[p] + tangential_damping[p])
        across[p] = z * carried / (z + carried)
        skin_along[i] += along[p]
        skin_across[i] += across[p]
        out = lead[p, 0] * normal[p, 0] + lead[p, 1] * normal[p, 1] + lead[p, 2] * normal[p, 2]
        for a in range(3):
            upward = out * normal[p, a]
            taken = along[p] * upward + across[p] * (lead[p, a] - upward)
            skin_force[i, a] += taken / step - force[p, a]
            skin_direction[i, a] = direction[p, a] = normal[p, a]
    return touched[:count].copy(), pressing[:touching].copy()


@compiled
def _not_taken(pressing, pressed, direction, along, across, skin_velocity, skin_velocity_then):
    """Return what sheet vertices are given back (k, 3) [N s], and the sum."""
    change, total, impulse = np.empty(3), np.zeros(3), np.empty((pressing.size, 3))
    for e in range(pressing.size):
        p = pressing[e]
        i, out = pressed[p], 0.0
        for a in range(3):
            change[a] = skin_velocity[i, a] - skin_velocity_then[p, a]
            out += direction[p, a] * change[a]
        for a in range(3):
            normal = out * direction[p, a]
            impulse[e, a] = along[p] * normal + across[p] * (change[a] - normal)
            total[a] += impulse[e, a]
    return impulse, total
