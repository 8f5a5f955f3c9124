"""What every sheet solver takes and gives."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simcore.errors import SimulationError
from simcore.sheet.bed import BedContact
from simcore.sheet.contact import ContactForce, PlaneContact
from simcore.sheet.hanging import BarState, Straps
from simcore.sheet.inertia import Inertia
from simcore.sheet.net import Net

GRAVITY = 9.80665
"""Standard gravity, along −z [m/s²] (CGPM 1901)."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A net that hangs by straps.

    Attributes
    ----------
    net : Net
    straps : Straps
    pinned : (n,) bool
        Vertices that keep their velocity whatever pulls at them.
    gravity : (3,) float64
        [m/s²]
    bed : BedContact or None
        What it may lie on.
    drag_rate : float
        Damping of all motion, per true mass [1/s].
    """

    net: Net
    straps: Straps
    pinned: np.ndarray
    gravity: np.ndarray
    bed: BedContact | None = None
    # ASSUME: air and seams take out e^−1 of a swing in a second.
    drag_rate: float = 1.0


@dataclass(eq=False)
class SheetState:
    """Vertices of a sheet in the world; `advance` overwrites them in place.

    Attributes
    ----------
    position, velocity : (n, 3) float64
        [m], [m/s]
    on_bed : PlaneContact or None
        What the bed is to it, once a solver has looked.
    """

    position: np.ndarray
    velocity: np.ndarray
    on_bed: PlaneContact | None = None


@dataclass(frozen=True, eq=False)
class Reaction:
    """What acted on a sheet during a step, as means over it.

    Attributes
    ----------
    contact : ContactForce
    bed_force : (3,) float64
        Sum over the vertices, world [N].
    strap_force : (s, 3) float64
        On the sheet, from each strap, world [N]; the bar carries its opposite.
    passes : int
        Sub-steps or iterations taken.
    spent : (3,) float64
        Heat of the dashpots of planes and bed, work of their sliding friction, and what the
        sub-steps themselves took out there [J]; NaN where a solver does not tell.
    """

    contact: ContactForce
    bed_force: np.ndarray
    strap_force: np.ndarray
    passes: int
    spent: np.ndarray


class SheetSolver(Protocol):
    """Advances a sheet through one outer step with frozen contact planes.

    Attributes
    ----------
    sheet : Sheet
    inertia : Inertia
        No less than the mass of the vertices.
    damping_time : float
        Damping over stiffness of every spring, β of Eq. S3 [s].
    """

    sheet: Sheet
    inertia: Inertia
    damping_time: float

    def advance(
        self, state: SheetState, dt: float, contact: PlaneContact, bar: BarState
    ) -> Reaction:
        """Overwrite the state, and the contact's anchors and forces, with those dt [s] later.

        `bar` is taken at the start of the step; its points move on with its velocity.

        Raises
        ------
        SimulationError
            A position that is not finite.
        """
        ...


def make_sheet(
    net: Net, straps: Straps, pinned: np.ndarray | None = None, bed: BedContact | None = None
) -> Sheet:
    """Return a sheet under gravity; nothing is pinned unless told."""
    free = np.zeros(len(net.mass), bool) if pinned is None else pinned
    return Sheet(net, straps, free, np.array([0.0, 0.0, -GRAVITY]), bed)


def lay_flat(net: Net, origin: np.ndarray, rotation: np.ndarray | None = None) -> SheetState:
    """Return the sheet at rest and unstretched.

    Parameters
    ----------
    origin : (3,) float64
        Where the origin of the sheet plane lies in the world [m].
    rotation : (3, 3) float64, optional
        Sheet frame (x, y in its plane) to world.
    """
    position = np.column_stack([net.rest_position, np.zeros(len(net.rest_position))])
    if rotation is not None:
        position = position @ rotation.T
    position = np.ascontiguousarray(position + origin)
    return SheetState(position, np.zeros_like(position))


def planes_of_bed(sheet: Sheet, state: SheetState) -> PlaneContact:
    """Return the planes of the bed under a sheet for a step; none without a bed."""
    if state.on_bed is None:
        state.on_bed = (
            sheet.bed.untouched() if sheet.bed else PlaneContact.empty(len(sheet.net.mass))
        )
    if sheet.bed:
        sheet.bed.find(state.position, state.on_bed)
    return state.on_bed


def check_finite(state: SheetState) -> None:
    """Refuse a state that blew up.

    Raises
    ------
    SimulationError
        With status "blow_up".
    """
    if not np.isfinite(state.position.sum()):
        bad = int((~np.isfinite(state.position).all(axis=1)).argmax())
        raise SimulationError("blow_up", f"the sheet diverged at its vertex {bad}")
