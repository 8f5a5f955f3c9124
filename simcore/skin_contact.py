"""What a contact of the skin is to all others, whatever carries it and by whichever law."""

from typing import Protocol

import numpy as np

from simcore.contact.tangential import Impulses, add_parts
from simcore.device.motion import DeviceState
from simcore.dynamics.pinocchio_views import SegmentViews
from simcore.scene import Scene


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
        Afterwards `force` and `normal_force` are what the step had of them on its mean.
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


class OnSkin:
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
