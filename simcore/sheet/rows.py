"""The planes of a contact gathered into rows, one for each vertex that has one."""

from dataclasses import dataclass

import numpy as np

from simcore.compiled import compiled
from simcore.sheet.contact import ContactForce, PlaneContact

# Columns of a row; vectors take three, and the normal comes first.
OFFSET, STIFFNESS, DAMPING, ANCHOR, SURFACE, K_T, C_T, COEFFICIENT, F_C, EPSILON = (
    3, 4, 5, 6, 9, 12, 13, 14, 15, 16
)
ROW_SIZE = 17


@dataclass(frozen=True, eq=False)
class Rows:
    """The planes of a step.

    Attributes
    ----------
    data : (m, ROW_SIZE) float64
        Columns as above.
    vertex : (m,) int64
        Vertex that a row belongs to.
    force : (m, 3) float64
        On the vertex in the sub-step before [N].
    impulse : (m, 4) float64
        On the vertex, and its normal part [N s].
    """

    data: np.ndarray
    vertex: np.ndarray
    force: np.ndarray
    impulse: np.ndarray


def gather_rows(contact: PlaneContact) -> Rows:
    """Return the planes of a contact as rows."""
    vertex = np.flatnonzero(contact.active)
    data = np.empty((len(vertex), ROW_SIZE))
    _fill(
        data, vertex, contact.normal, contact.offset, contact.stiffness, contact.damping,
        contact.surface_velocity, contact.tangential_stiffness, contact.tangential_damping,
        contact.anchor, contact.friction_coefficient, contact.friction_velocity,
        contact.friction_force,
    )
    return Rows(data, vertex, contact.force[vertex], np.zeros((len(vertex), 4)))


def scatter_rows(rows: Rows, contact: PlaneContact, duration: float) -> ContactForce:
    """Return the mean force of a contact over a step; write back its anchors and last forces."""
    force, normal = np.zeros(contact.normal.shape), np.zeros(len(contact.normal))
    force[rows.vertex] = rows.impulse[:, :3] / duration
    normal[rows.vertex] = rows.impulse[:, 3] / duration
    contact.anchor[rows.vertex] = rows.data[:, ANCHOR : ANCHOR + 3]
    contact.force[rows.vertex] = rows.force
    return ContactForce(force, normal)


@compiled
def _fill(
    data, vertex, normal, offset, stiffness, damping, surface_velocity, tangential_stiffness,
    tangential_damping, anchor, friction_coefficient, friction_velocity, friction_force,
):
    """Write the planes row by row."""
    for row in range(vertex.size):
        i = vertex[row]
        for axis in range(3):
            data[row, axis] = normal[i, axis]
            data[row, SURFACE + axis] = surface_velocity[i, axis]
            data[row, ANCHOR + axis] = anchor[i, axis]
        data[row, OFFSET] = offset[i]
        data[row, STIFFNESS] = stiffness[i]
        data[row, DAMPING] = damping[i]
        data[row, K_T] = tangential_stiffness[i]
        data[row, C_T] = tangential_damping[i]
        data[row, COEFFICIENT] = friction_coefficient
        data[row, EPSILON] = friction_velocity
        data[row, F_C] = friction_force[i]
