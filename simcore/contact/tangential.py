"""Contact forces as a recorder adds them up: normal, tangential, what of it slips, and where."""

from typing import NamedTuple

import numpy as np

from simcore.compiled import compiled
from simcore.contact.distance_lookup import seen_from

# ASSUME: friction of a sheet is a mean over sub-steps, some of which stick; 1 % takes those in that
# slip all the same.
AT_LIMIT = 0.99
"""From this share of µN on, friction counts as slipping."""


class Impulses(NamedTuple):
    """Impulses on n points, added up over a frame.

    Attributes
    ----------
    acted_on : (n,) bool
        Whether a point had any.
    normal : (n,), tangential : (n, 3) float64
        Its parts; world axes [N s].
    """

    acted_on: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray

    @classmethod
    def zero(cls, count: int) -> "Impulses":
        """Return none yet, on so many points."""
        return cls(np.zeros(count, bool), np.zeros(count), np.zeros((count, 3)))

    def take(self, duration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return who bore a normal one (k,), and both parts there as forces; leave zero.

        The forces (k,) and (k, 3) are means over a duration [s].
        """
        return _take(self.acted_on.nonzero()[0], duration, *self)


@compiled
def _take(points, duration, acted_on, normal, tangential):
    """Read and clear; a dashpot that would pull leaves friction without a normal force."""
    count = points.size
    bore, normals, tangentials = np.empty(count, np.int64), np.empty(count), np.empty((count, 3))
    found = 0
    for i in points:
        if normal[i] != 0.0:
            bore[found], normals[found] = i, normal[i] / duration
            for a in range(3):
                tangentials[found, a] = tangential[i, a] / duration
            found += 1
        acted_on[i] = False
        normal[i] = 0.0
        for a in range(3):
            tangential[i, a] = 0.0
    return bore[:found], normals[:found], tangentials[:found]


@compiled
def add_parts(listed, force, normal_force, normals, friction, duration, acted_on, total, along):
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
    acted_on, total, along
        The `Impulses` that they are added to.

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
            along[i, a] += duration * tangential
            square += tangential * tangential
        total[i] += duration * normal
        if normal != 0.0 or square != 0.0:
            acted_on[i] = True
        limit = AT_LIMIT * friction * normal
        if square >= limit * limit:
            slipping += duration * normal
    return slipping if friction >= 0.0 else np.nan


@compiled
def add_normal_parts(points, forces, duration, acted_on, total):
    """Add what normal forces (p,) on some points do in a time [s] to their `Impulses`."""
    for k in range(points.size):
        total[points[k]] += duration * forces[k]
        acted_on[points[k]] = True


def bearing(acted_on: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return which points (k,) of `Impulses` have a normal one; those not acted on are not read."""
    points = acted_on.nonzero()[0]
    return points[normal[points] != 0.0]


@compiled
def add_to_mat(pressed, point, normal, acted_on, total):
    """Add the normal impulse of each pressed vertex to those on its point of a mat [N s]."""
    for i in pressed:
        total[point[i]] += normal[i]
        acted_on[point[i]] = True


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
