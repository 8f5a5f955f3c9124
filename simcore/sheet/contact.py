"""Contact of sheet vertices with frozen planes, as the caller describes it (Eqs. S5 to S7)."""

from dataclasses import dataclass

import numpy as np

from simcore.config.designs import SheetPenalty


@dataclass(eq=False)
class PlaneContact:
    """One plane for each sheet vertex that touches, or may touch, one thing.

    The planes hold for one `advance`; within it they move with `surface_velocity`.

    Attributes
    ----------
    active : (n,) bool
        Vertices that have a plane.
    normal : (n, 3) float64
        Unit normal; the direction in which the vertex is pushed out. World.
    offset : (n,) float64
        Depth of a vertex at x is `offset − normal · x` at the start of the step [m].
    stiffness, damping : (n,) float64
        k [N/m] and c_n [N s/m] of the vertex.
    surface_velocity : (n, 3) float64
        Of the touched point of the surface, world [m/s].
    friction_coefficient : float
        µ of sticking friction; negative: the paper's regularised friction instead.
    tangential_stiffness, tangential_damping : (n,) float64
        k_t [N/m] and c_t [N s/m] of sticking friction.
    anchor : (n, 3) float64
        Where the tangential spring is tied to the surface, world [m]. `advance` moves it with the
        surface, drags it when the vertex slides, and puts it on the vertex while nothing touches.
        A plane that is new needs its anchor put on the vertex.
    force : (n, 3) float64
        What the plane did to the vertex in the last sub-step, from which the next one starts where
        the vertex has another contact too [N]; overwritten by `advance`.
    friction_force : (n,) float64
        F_c of the regularised friction [N].
    friction_velocity : float
        ε of the same [m/s].
    """

    active: np.ndarray
    normal: np.ndarray
    offset: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    surface_velocity: np.ndarray
    friction_coefficient: float
    tangential_stiffness: np.ndarray
    tangential_damping: np.ndarray
    anchor: np.ndarray
    force: np.ndarray
    friction_force: np.ndarray
    friction_velocity: float

    @classmethod
    def empty(cls, count: int) -> "PlaneContact":
        """Return a contact of `count` vertices that has no planes and no friction."""
        return cls(
            active=np.zeros(count, bool),
            normal=np.zeros((count, 3)),
            offset=np.zeros(count),
            stiffness=np.zeros(count),
            damping=np.zeros(count),
            surface_velocity=np.zeros((count, 3)),
            friction_coefficient=0.0,
            tangential_stiffness=np.zeros(count),
            tangential_damping=np.zeros(count),
            anchor=np.zeros((count, 3)),
            force=np.zeros((count, 3)),
            friction_force=np.zeros(count),
            friction_velocity=0.1,
        )

    def set_penalty(self, law: SheetPenalty) -> None:
        """Take the paper's law for all vertices (Eqs. S5 and S7)."""
        self.stiffness[:], self.damping[:] = law.stiffness_n_per_m, law.damping_ns_per_m
        self.tangential_stiffness[:] = self.tangential_damping[:] = 0.0
        self.friction_coefficient = -1.0
        self.friction_force[:] = law.friction_force_n
        self.friction_velocity = law.friction_velocity_m_per_s


@dataclass(frozen=True, eq=False)
class ContactForce:
    """What a `PlaneContact` did to the sheet, as means over the step.

    Attributes
    ----------
    force : (n, 3) float64
        On the sheet vertices, world [N]; its opposite times dt is the impulse on the other side.
    normal_force : (n,) float64
        Its part along the normals [N], not negative.
    """

    force: np.ndarray
    normal_force: np.ndarray
