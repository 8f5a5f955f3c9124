"""What a sheet, its straps and its bed store and spend (Eqs. E2 to E4)."""

import numpy as np

from simcore.compiled import compiled
from simcore.sheet.contact import PlaneContact
from simcore.sheet.hanging import BarState, bar_points
from simcore.sheet.inertia import Inertia
from simcore.sheet.solver import Sheet, SheetState

BENDING = 2
"""Springs of this kind do not buckle (`Net.spring_kind`)."""


def stored_energy(
    sheet: Sheet, inertia: Inertia, state: SheetState, bar: BarState
) -> np.ndarray:
    """Return kinetic, potential and elastic energy [J] of a sheet under a bar.

    Parameters
    ----------
    inertia : Inertia
        `SheetSolver.inertia`: kinetic energy is that of what is integrated.
    """
    net, x = sheet.net, state.position
    kinetic = inertia.kinetic_energy(state.velocity)
    potential = -net.mass @ (x @ sheet.gravity)
    elastic = _springs_energy(
        x, net.spring_vertices, net.stiffness, net.rest_length, net.buckling_strain,
        net.spring_kind, net.compression_share,
    )
    if len(sheet.straps.length):
        points, _ = bar_points(sheet.straps, bar)
        distance = np.linalg.norm(points - sheet.straps.patch_centres(x), axis=1)
        stretch = np.maximum(distance - sheet.straps.length, 0.0)
        elastic += sheet.straps.stiffness @ stretch**2 / 2
    if state.on_bed:
        elastic += planes_energy(state.on_bed, x)
    return np.array([kinetic, potential, elastic])


def dashpot_power(
    sheet: Sheet, damping_time: float, state: SheetState, bar: BarState
) -> float:
    """Return the heat of drag and of the dashpots of springs and straps at this moment [W].

    Parameters
    ----------
    damping_time : float
        β of the springs (Eq. S3) [s].
    """
    net, straps, x, v = sheet.net, sheet.straps, state.position, state.velocity
    heat = sheet.drag_rate * (net.mass @ (v**2).sum(axis=1))
    heat += damping_time * _springs_power(x, v, net.spring_vertices, net.stiffness)
    if len(straps.length):
        points, velocities = bar_points(straps, bar)
        way = points - straps.patch_centres(x)
        distance = np.linalg.norm(way, axis=1)
        spring = straps.stiffness * np.maximum(distance - straps.length, 0.0)
        rate = ((velocities - straps.patch_centres(v)) * way).sum(axis=1) / distance
        heat += np.clip(straps.damping * rate, -spring, spring) @ rate
    return heat


def planes_energy(contact: PlaneContact, position: np.ndarray) -> float:
    """Return what the springs of planes and ties hold, k d²/2 + k_t ‖e‖²/2 [J].

    Parameters
    ----------
    position : (n, 3) float64
        Of the vertices [m].
    """
    return _planes_energy(
        contact.active, contact.normal, contact.offset, contact.stiffness, contact.anchor,
        contact.tangential_stiffness, contact.friction_coefficient > 0, position,
    )


@compiled
def _planes_energy(active, normal, offset, stiffness, anchor, tied, sticks, position):
    """Implement `planes_energy`."""
    stored = 0.0
    for i in range(active.size):
        if not active[i]:
            continue
        above = square = out = 0.0
        for axis in range(3):
            way = position[i, axis] - anchor[i, axis]
            above += normal[i, axis] * position[i, axis]
            square += way * way
            out += way * normal[i, axis]
        depth = max(offset[i] - above, 0.0)
        stored += 0.5 * stiffness[i] * depth * depth
        if sticks:
            stored += 0.5 * tied[i] * (square - out * out)
    return stored


@compiled
def _springs_energy(position, ends, stiffness, rest_length, buckling_strain, kind, kept):
    """Return the potential of Eq. 5 with the buckling of Eq. S3 [J]."""
    stored = 0.0
    for s in range(stiffness.size):
        i, j = np.uint64(ends[s, 0]), np.uint64(ends[s, 1])
        square = 0.0
        for axis in range(3):
            square += (position[j, axis] - position[i, axis]) ** 2
        length, rest = np.sqrt(square), rest_length[s]
        beyond = min(length - (1.0 - buckling_strain) * rest, 0.0)
        share = kept if kind[s] < BENDING else 1.0
        stored += 0.5 * stiffness[s] * (
            (length - rest) ** 2 - (1.0 - share) * beyond * beyond)
    return stored


@compiled
def _springs_power(position, velocity, ends, stiffness):
    """Return Σ k (d · ḋ)²/l² [N m/s²], the heat of all springs over their damping time."""
    power = 0.0
    for s in range(stiffness.size):
        i, j = np.uint64(ends[s, 0]), np.uint64(ends[s, 1])
        square = rate = 0.0
        for axis in range(3):
            d = position[j, axis] - position[i, axis]
            square += d * d
            rate += d * (velocity[j, axis] - velocity[i, axis])
        power += stiffness[s] * rate * rate / square
    return power
