"""A flat bed under a sheet: a plane for every vertex that is over it (Eqs. S5 to S7)."""

from dataclasses import dataclass, replace

import numpy as np

from simcore.compiled import compiled
from simcore.sheet.contact import PlaneContact

NEAR = 0.01
"""Vertices higher over the bed than this do not meet it within a step [m]."""


@dataclass(frozen=True, eq=False)
class BedContact:
    """A springy half space below z = 0 under a rectangle about the origin.

    Attributes
    ----------
    half_length, half_width : float
        Of the rectangle, along x and y [m].
    law : PlaneContact
        What the bed is to each sheet vertex, all above it.
    """

    half_length: float
    half_width: float
    law: PlaneContact

    def untouched(self) -> PlaneContact:
        """Return a contact that no vertex has come near yet."""
        law = self.law
        return replace(
            law, active=law.active.copy(), anchor=law.anchor.copy(), force=law.force.copy()
        )

    def find(self, position: np.ndarray, planes: PlaneContact) -> None:
        """Give a plane to the vertices (n, 3) [m] that may meet the bed within a step."""
        _find(
            position, self.half_length, self.half_width, planes.active, planes.anchor,
            planes.force,
        )


def springy_bed(
    half_length: float, half_width: float, stiffness: np.ndarray, damping_time: float,
    friction_coefficient: float, shear_stiffness: np.ndarray,
) -> BedContact:
    """Return a bed with friction that sticks.

    Parameters
    ----------
    stiffness, shear_stiffness : (n,) float64
        Under each sheet vertex, and along the bed [N/m].
    damping_time : float
        Damping over either [s].
    friction_coefficient : float
        µ.
    """
    law = PlaneContact.empty(len(stiffness))
    law.normal[:, 2] = 1.0
    law.stiffness[:], law.damping[:] = stiffness, damping_time * stiffness
    law.friction_coefficient = friction_coefficient
    law.tangential_stiffness[:] = shear_stiffness
    law.tangential_damping[:] = damping_time * shear_stiffness
    return BedContact(half_length, half_width, law)


@compiled
def _find(position, half_length, half_width, active, anchor, force):
    for i in range(active.size):
        near = (position[i, 2] < NEAR and abs(position[i, 0]) < half_length
                and abs(position[i, 1]) < half_width)
        if near and not active[i]:
            for axis in range(3):
                anchor[i, axis] = position[i, axis]
                force[i, axis] = 0.0
        active[i] = near
