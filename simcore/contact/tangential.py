"""Contact forces as a recorder adds them up: normal, tangential, what of it slips, and where."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.distance_lookup import seen_from

# ASSUME: friction of a sheet is a mean over sub-steps, some of which stick; 1 % takes those in that
# slip all the same.
AT_LIMIT = 0.99
"""From this share of µN on, friction counts as slipping."""


@compiled
def add_parts(
    listed, force, normal_force, normals, friction, duration, normal_total, tangential_total
):
    """Add the parts of each listed point's impulse; return the normal one of those that slip.

    Parameters
    ----------
    listed : (l,) int64
    force : (n, 3), normal_force : (n,), normals : (n, 3) float64
        Whole force, world axes, its normal part [N] and the direction in which that pushes;
        where listed.
    friction : float
        µ; negative: a law that knows none.
    duration : float
        How long the forces act [s].
    normal_total : (n,), tangential_total : (n, 3) float64
        Have normal and tangential impulse added [N s].

    Returns
    -------
    slipping : float
        Σ N h where ‖F‖ ≥ `AT_LIMIT` µN [N s]; NaN without µ.
    """
    slipping = 0.0
    for i in listed:
        normal, square = normal_force[i], 0.0
        for a in range(3):
            tangential = force[i, a] - normal * normals[i, a]
            tangential_total[i, a] += duration * tangential
            square += tangential * tangential
        normal_total[i] += duration * normal
        limit = AT_LIMIT * friction * normal
        if square >= limit * limit:
            slipping += duration * normal
    return slipping if friction >= 0.0 else np.nan


@compiled
def bearing(impulses):
    """Return where impulses (n,) are not zero: as `numpy.flatnonzero`, at a fourth of its time."""
    found, count = np.empty(impulses.size, np.int64), 0
    for i in range(impulses.size):
        if impulses[i] != 0.0:
            found[count] = i
            count += 1
    return found[:count].copy()


@compiled
def add_to_mat(pressed, point, normal, total):
    """Add the impulse of each pressed vertex to its point of a mat (N,) [N s]."""
    for i in pressed:
        total[point[i]] += normal[i]


@compiled
def moved_on_mat(pressed, points, rotation, position, step, place):
    """Return those of the pressed points that have moved on a device since they were last told.

    Parameters
    ----------
    pressed : (p,) int64
    points : (n, 3) float64
        World, where pressed [m].
    rotation, position
        Of the device.
    step : float
        Along any axis; who moves by less has not [m].
    place : (n, 3) float64
        Where each was, device frame [m]; overwritten where it has moved.
    """
    moved, count = np.empty(pressed.size, np.int64), 0
    for i in pressed:
        x, y, z = seen_from(rotation, position, points, i)
        if not max(abs(x - place[i, 0]), abs(y - place[i, 1]), abs(z - place[i, 2])) <= step:
            place[i, 0], place[i, 1], place[i, 2] = x, y, z
            moved[count] = i
            count += 1
    return moved[:count].copy()
