"""Contact planes of all contacts gathered into rows, grouped by vertex."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from simcore.sheet.contact import ContactForce, PlaneContact
from simcore.sheet.vertex_contact import (
    ANCHOR,
    C_T,
    COEFFICIENT,
    DAMPING,
    EPSILON,
    F_C,
    K_T,
    OFFSET,
    ROW_SIZE,
    STIFFNESS,
    SURFACE,
)


@dataclass(frozen=True, eq=False)
class Rows:
    """The planes of a step, sorted by vertex.

    Attributes
    ----------
    data : (m, ROW_SIZE) float64
        Columns as in `simcore.sheet.vertex_contact`.
    vertex, contact : (m,) int64
        Vertex and contact that a row belongs to.
    single : (t,) int64
        Rows that are alone with their vertex.
    several : (u, 2) int64
        First row, and row after the last, of the vertices that have more.
    impulse : (m, 4) float64
        On the vertex, and its normal part [N s].
    """

    data: np.ndarray
    vertex: np.ndarray
    contact: np.ndarray
    single: np.ndarray
    several: np.ndarray
    impulse: np.ndarray


def gather_rows(contacts: Sequence[PlaneContact]) -> Rows:
    """Return the planes of all contacts as rows."""
    if not contacts:
        nothing = np.empty(0, np.int64)
        return Rows(np.empty((0, ROW_SIZE)), nothing, nothing, nothing, nothing.reshape(0, 2),
                    np.empty((0, 4)))
    total = sum(int(np.count_nonzero(contact.active)) for contact in contacts)
    data = np.empty((total, ROW_SIZE))
    vertex, which = np.empty(total, np.int64), np.empty(total, np.int64)
    single, several = _fill(
        data, vertex, which,
        tuple(contact.active for contact in contacts),
        tuple(contact.normal for contact in contacts),
        tuple(contact.offset for contact in contacts),
        tuple(contact.stiffness for contact in contacts),
        tuple(contact.damping for contact in contacts),
        tuple(contact.surface_velocity for contact in contacts),
        tuple(contact.tangential_stiffness for contact in contacts),
        tuple(contact.tangential_damping for contact in contacts),
        tuple(contact.anchor for contact in contacts),
        np.array([
            (contact.friction_coefficient, contact.friction_velocity) for contact in contacts
        ]),
        tuple(contact.friction_force for contact in contacts),
    )
    return Rows(data, vertex, which, single, several, np.zeros((total, 4)))


def scatter_rows(
    rows: Rows, contacts: Sequence[PlaneContact], duration: float
) -> tuple[ContactForce, ...]:
    """Return the mean force of each contact over a step, and write back the anchors."""
    forces = []
    for index, contact in enumerate(contacts):
        force, normal = np.zeros(contact.normal.shape), np.zeros(len(contact.normal))
        _spread(
            rows.data, rows.vertex, rows.contact, rows.impulse, index, duration, force, normal,
            contact.anchor,
        )
        forces.append(ContactForce(force, normal))
    return tuple(forces)


@njit(cache=True, error_model="numpy")
def _spread(data, vertex, which, impulse, index, duration, force, normal_force, anchor):
    """Write the mean forces and anchors of one contact to its vertices."""
    for r in range(vertex.size):
        if which[r] != index:
            continue
        i = vertex[r]
        for axis in range(3):
            force[i, axis] = impulse[r, axis] / duration
            anchor[i, axis] = data[r, ANCHOR + axis]
        normal_force[i] = impulse[r, 3] / duration


@njit(cache=True, error_model="numpy")
def _fill(
    data, vertex, which, active, normal, offset, stiffness, damping, surface_velocity,
    tangential_stiffness, tangential_damping, anchor, friction, friction_force,
):
    """Write all planes vertex by vertex; return the single rows and the bounds of the others."""
    count = active[0].size
    single, several = np.empty(count, np.int64), np.empty((count, 2), np.int64)
    row = singles = severals = 0
    for i in range(count):
        first = row
        for c in range(len(active)):
            if not active[c][i]:
                continue
            for axis in range(3):
                data[row, axis] = normal[c][i, axis]
                data[row, SURFACE + axis] = surface_velocity[c][i, axis]
                data[row, ANCHOR + axis] = anchor[c][i, axis]
            data[row, OFFSET] = offset[c][i]
            data[row, STIFFNESS] = stiffness[c][i]
            data[row, DAMPING] = damping[c][i]
            data[row, K_T] = tangential_stiffness[c][i]
            data[row, C_T] = tangential_damping[c][i]
            data[row, COEFFICIENT] = friction[c, 0]
            data[row, EPSILON] = friction[c, 1]
            data[row, F_C] = friction_force[c][i]
            vertex[row], which[row] = i, c
            row += 1
        if row == first + 1:
            single[singles] = first
            singles += 1
        elif row > first:
            several[severals] = first, row
            severals += 1
    return single[:singles].copy(), several[:severals].copy()
