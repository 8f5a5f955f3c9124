"""The skin as a sheet meets it: a plane for each sheet vertex that is near (docs/sling.md)."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact import tracking
from simcore.contact.foundation_law import LOOKED_AHEAD
from simcore.contact.layer import SHEAR_SHARE, STRAIN_MAX

NEAR = 0.01
"""Planes are given to points nearer than this, and to those that come so near within a step; never
to points beyond `simcore.contact.tracking.NEAR`, which no step of some milliseconds bridges [m]."""


@compiled
def set_skin_planes(
    vertex, gap, skin, skin_velocity, position, velocity, duration, lag, ahead, motion, normal,
    active, offset, surface_velocity, anchor, force, lead, last_velocity,
):
    """Give a plane to each sheet vertex that is near the skin, or will be within the duration.

    It moves as the skin will on the mean, `ahead` of a step before later: Eq. S15. Returns those,
    and how long a step may be in which what touches, or soon will, makes a motion [m]: Eq. I3.
    """
    met, count, haste = np.empty(vertex.size, np.int64), 0, 0.0
    for p in range(vertex.size):
        i, was_active, active[p] = vertex[p], active[p], False
        if i < 0 or gap[p] > tracking.NEAR:
            continue
        approach = squared = 0.0
        for a in range(3):
            apart = skin_velocity[i, a] - velocity[p, a]
            approach += normal[p, a] * apart
            squared += apart * apart
        if gap[p] > NEAR + max(approach, 0.0) * duration:
            continue
        if gap[p] < LOOKED_AHEAD * lag * approach:
            room = max(gap[p], motion)
            haste = max(haste, squared / (room * room))
        offset[p] = 0.0
        for a in range(3):
            offset[p] += normal[p, a] * skin[i, a]
            faster = skin_velocity[i, a] - last_velocity[p, a]
            lead[p, a] = ahead * faster if was_active else 0.0
            last_velocity[p, a] = skin_velocity[i, a]
            surface_velocity[p, a] = skin_velocity[i, a] + lead[p, a]
            if not was_active:
                anchor[p, a] = position[p, a]
                force[p, a] = 0.0
        active[p] = True
        met[count] = p
        count += 1
    return met[:count].copy(), 1.0 / np.sqrt(haste)


@compiled
def press_flesh(
    met, vertex, gap, thickness, area, modulus, stiffening, damping_time, stiffness, damping,
    tangential_stiffness, tangential_damping, offset,
):
    """Give each plane the tangent of the flesh's law at its present depth d (Eq. S12).

        N = A E ε / (1 − ε),  ε = d/D,  dN/dd = A E / D / (1 − ε)²

    for flesh of thickness D, linear beyond STRAIN_MAX, or throughout. The plane is moved so that
    its force at d is N.
    """
    for each in met:
        p, i = np.uint64(each), np.uint64(vertex[each])
        most = thickness[i]
        shallow = area[p] * modulus[i] / most
        strain = min(max(-gap[p], 0.0) / most, STRAIN_MAX) if stiffening else 0.0
        left = 1.0 - strain
        stiffness[p] = shallow / (left * left)
        offset[p] -= most * strain * strain
        damping[p] = damping_time * stiffness[p]
        tangential_stiffness[p] = SHEAR_SHARE * shallow
        tangential_damping[p] = SHEAR_SHARE * damping_time * shallow
