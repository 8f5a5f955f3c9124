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
    vertex = [np.flatnonzero(contact.active) for contact in contacts]
    which = np.repeat(np.arange(len(contacts)), [len(v) for v in vertex])
    vertex = np.concatenate([*vertex, np.empty(0, np.int64)])
    data = np.empty((len(vertex), ROW_SIZE))
    done = 0
    for contact in contacts:
        done = _fill(
            data, done, contact.active, contact.normal, contact.offset, contact.stiffness,
            contact.damping, contact.surface_velocity, contact.tangential_stiffness,
            contact.tangential_damping, contact.anchor, contact.friction_force,
            contact.friction_coefficient, contact.friction_velocity,
        )
    if len(contacts) > 1:
        order = np.argsort(vertex, kind="stable")
        data, vertex, which = data[order], vertex[order], which[order]
    ends = np.flatnonzero(np.diff(vertex, append=-1)) + 1
    starts = np.concatenate([[0], ends])[: len(ends)]
    alone = ends - starts == 1
    return Rows(
        data=data,
        vertex=vertex,
        contact=which,
        single=starts[alone],
        several=np.stack([starts, ends], axis=1)[~alone],
        impulse=np.zeros((len(data), 4)),
    )


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


@njit(cache=True)
def _fill(
    data, row, active, normal, offset, stiffness, damping, surface_velocity, tangential_stiffness,
    tangential_damping, anchor, friction_force, friction_coefficient, friction_velocity,
):
    """Write the planes of one contact from a row on; return the row after the last."""
    for i in range(active.size):
        if not active[i]:
            continue
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
        data[row, F_C] = friction_force[i]
        data[row, EPSILON] = friction_velocity
        row += 1
    return row
