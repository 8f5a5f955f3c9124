"""Body, sheet and bed: what each does to the others.

The body sees the sheet's force as constant over an exchange step; the sheet sees the skin as
planes that move with it (Eqs. S5 to S7, docs/sling.md). What one receives the other loses, so that
momentum is kept to rounding.
"""

import numpy as np
import pinocchio as pin

from simcore.body.segments import INDEX
from simcore.body.skin_listed import (
    blend_listed,
    blend_motion_listed,
    total_force,
    wrench_listed,
)
from simcore.contact.tangential import Impulses
from simcore.device.motion import DeviceState
from simcore.dynamics.impedance import add_point_impedance, project_blocks
from simcore.dynamics.implicit import IMPLICITNESS
from simcore.errors import SimulationError
from simcore.interaction import Interaction
from simcore.scene import Scene
from simcore.sheet.energy import dashpot_power, stored_energy
from simcore.sheet.hanging import bar_points
from simcore.sheet.solver import SheetState
from simcore.sling_contact import SheetOnSkin

LANDMARKS, LANDMARK_RADIUS = ("pelvis", "thoracic"), 0.1
"""Segments whose place on the sheet is watched, and the radius of the patch of the sheet that lies
under each at the start [m]."""


DASHPOTS_EVERY = 0.064
"""Time for which the heat of springs and straps is taken from one moment [s]: 1 or 2 J of some 400
in the shipped slings. To look at all springs costs as much as a sub-step."""


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
        self._solver, method = sling.solver, scene.method
        # Adaptive steps have one each.
        fixed = method.time_step_s
        self._steps_per_exchange = round(sling.step / fixed) if fixed else 1
        self._steps, self._time, self._dashpots_told = 0, 0.0, 0.0
        self.sheet = SheetState(sling.start.position.copy(), sling.start.velocity.copy())
        self._lag_share = IMPLICITNESS if method.integrator == "implicit" else 0.0
        self._on_skin = SheetOnSkin(scene)
        self._skin = np.zeros((skin.vertex_count, 3))
        self._skin_velocity, self._shown = np.zeros((2, skin.vertex_count, 3))
        self._bed_wrench = np.zeros_like(self.segment_wrench)
        self._sheet_wrench = np.zeros_like(self.segment_wrench)
        self._outer_force = np.zeros(3)  # on the sheet, of straps and bed
        self._spent = np.zeros(3)  # heat, friction and numerical loss that are not yet told
        self._bar, _ = bar_points(self._solver.sheet.straps, scene.motion(0.0))
        self._landmarks = self._lay_landmarks(scene)
        self.strap_force = np.zeros((len(self._solver.sheet.straps.length), 3))

    def exchange(self, moved: DeviceState, q: np.ndarray, v: np.ndarray, step: float) -> None:
        """Advance the sheet, once an exchange step, under a bar that is at `moved`."""
        if self._steps % self._steps_per_exchange:
            self._steps += 1
            return
        duration = step * self._steps_per_exchange
        pin.forwardKinematics(self.model, self.data, q, v)
        segments = self._views
        self._on_skin.find(
            self.sheet, segments, self._skin, lambda listed: self._pose(listed, self._skin)
        )
        blend_motion_listed(
            self._on_skin.near, *self._influences, segments.rotations, segments.positions,
            segments.velocities, self._skin, self._skin_velocity,
        )
        self._on_skin.give_back(self.sheet, self._skin_velocity)
        self._on_skin.set_planes(
            self.sheet, self._skin, self._skin_velocity, duration, self._lag_share * step
        )
        self._on_skin.refuse_passing(self._time)
        reaction = self._solver.advance(self.sheet, duration, self._on_skin.planes, moved)
        self._on_skin.press(reaction.contact)
        self._time += duration
        self._spend_by_sheet(reaction.spent, moved)
        self.strap_force = reaction.strap_force
        self._outer_force = self.strap_force.sum(axis=0) + reaction.bed_force
        self._steps += 1

    def pace(self, moved: DeviceState, q: np.ndarray, v: np.ndarray) -> float:
        """Return how long the next step may be, for bed and sheet [s]: Eq. I3."""
        return min(super().pace(moved, q, v), self._on_skin.pace)

    def account(
        self, v: np.ndarray, change: np.ndarray, step: float, after: DeviceState
    ) -> np.ndarray:
        """Return `energy.FLOWS` of a step [J], those of the sheet with the exchange."""
        flows = super().account(v, change, step, after)
        flows[2:] += self._spent
        self._spent[:] = 0.0
        return flows

    def stored_energy(self, q: np.ndarray, v: np.ndarray, moved: DeviceState) -> np.ndarray:
        """Return `energy.STORED` of body, sheet and what is between [J]."""
        of_body = super().stored_energy(q, v, moved)
        on_skin = self._on_skin
        self._pose(on_skin.followed, self._shown)
        solver = self._solver
        of_sheet = stored_energy(solver.sheet, solver.inertia, self.sheet, moved)
        of_sheet[2] += on_skin.stored_energy(self.sheet, self._shown)
        return of_body + of_sheet

    def _work_of_device(
        self, late: np.ndarray, step: float, after: DeviceState
    ) -> tuple[float, float]:
        """Return the work of the bar on the straps in a step [J]; the bed does none."""
        points, _ = bar_points(self._solver.sheet.straps, after)
        way, self._bar = points - self._bar, points
        return float((self.strap_force * way).sum()), 0.0

    def _pose(self, listed: np.ndarray, vertices: np.ndarray) -> None:
        """Write skin vertices (l,) where the segments are."""
        blend_listed(
            listed, *self._influences, self._views.rotations, self._views.positions, vertices
        )

    def _spend_by_sheet(self, of_planes: np.ndarray, moved: DeviceState) -> None:
        """Add what the exchange has spent (Eq. E5): sheet and straps by their powers."""
        solver = self._solver
        self._spent += of_planes
        if self._time - self._dashpots_told >= DASHPOTS_EVERY:
            power = dashpot_power(solver.sheet, solver.damping_time, self.sheet, moved)
            self._spent[0] += (self._time - self._dashpots_told) * power
            self._dashpots_told = self._time
        self._spent[2] -= self._on_skin.energy_given_back

    @property
    def support_force(self) -> np.ndarray:
        """Force of bed and straps on body and sheet (3,), world axes [N]."""
        return total_force(self._bed_wrench) + self._late_support + self._outer_force

    def place(self, q: np.ndarray, moved: DeviceState) -> np.ndarray:
        """Return where the sheet's landmarks are, in the frames of the segments above them [m]."""
        places = []
        for segment, patch in self._landmarks:
            frame = self.data.oMi[segment + 1]
            places.append(frame.actInv(self.sheet.position[patch].mean(axis=0)))
        return np.array(places)

    def add_mat_impulses(self, duration: float, on_mat: Impulses) -> float:
        """Add those of the skin on each sheet vertex; return what slips [N s]."""
        return self._on_skin.add_sheet_impulses(duration, on_mat)

    def share_impulses(self, on_mat: Impulses, on_skin: Impulses) -> None:
        """Add the opposite of those on sheet vertices to the skin under their tiles."""
        self._on_skin.spread(
            on_mat, self.sheet.position, self._shown, lambda under: self._pose(under, self._shown),
            on_skin,
        )

    def sheet_frame(self) -> dict[str, np.ndarray]:
        """Return position [m] and strap forces [N] of the sheet."""
        return {
            "sheet_position": self.sheet.position.astype(np.float32),
            "strap_force": self.strap_force,
        }

    @property
    def contact_count(self) -> int:
        """Skin vertices on the bed and sheet vertices on the skin."""
        return self.contact.contact_count + self._on_skin.contact_count

    @property
    def depth_max(self) -> float:
        """Deepest penetration of the skin, by bed or sheet [m]."""
        return max(self.contact.depth_max, self._on_skin.depth_max)

    def _load_segments(self) -> None:
        super()._load_segments()
        self._bed_wrench[:] = self.segment_wrench
        wrench_listed(
            self._on_skin.touched, *self._influences, self._views.rotations,
            self._on_skin.skin_force, self._sheet_wrench,
        )
        self.segment_wrench += self._sheet_wrench

    def _add_impedance_of_sheet(self) -> None:
        sheet, blocks = self._on_skin, self._blocks
        blocks[:] = 0.0
        add_point_impedance(
            sheet.touched, *self._influences[:3], self._skin, sheet.skin_direction,
            sheet.skin_along, sheet.skin_across, blocks,
        )
        project_blocks(blocks, self._views.jacobian, *self._tree, self._impedance)

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
        if not found:
            raise SimulationError(
                "misses_device", "neither the pelvis nor the chest lies on the sheet"
            )
        return found
