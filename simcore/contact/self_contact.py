"""Penalty between the capsules of a body's own segments (Eq. 13)."""

import numpy as np
from numba import njit

from simcore.compiled import compiled

NEAR = 0.02
"""Capsules farther apart than this do not meet within a step [m]: at 1 m/s that takes 20 ms."""


@compiled
def overlaps(pairs, ends, radius, rotations, positions):
    """Return by how much each pair of capsules overlaps (p,) [m], negative when apart."""
    overlap = np.empty(pairs.shape[0])
    for e in range(pairs.shape[0]):
        overlap[e] = _meet(pairs[e, 0], pairs[e, 1], ends, radius, rotations, positions)[0]
    return overlap


@compiled
def add_self_contact(
    pairs, ends, radius, allowed, rotations, positions, local_velocities, stiffness, damping,
    lag, wrench, points, normals, along,
):
    """Add the forces between overlapping capsules to the wrenches on their segments.

        f = max(k δ + c δ̇, 0) n,   δ > 0                                            (Eq. 13)

    with δ the overlap beyond what is allowed, and n the line between the nearest points of the
    axes. A pair that is apart by no more than it moves in a step has no force, but the impedance:
    else a hand between two others would be thrown from one to the other, step by step.

    Parameters
    ----------
    pairs, ends, radius
        As in `simcore.body.capsules.Capsules`.
    allowed : (p,) float64
        Overlap of each pair that is no contact [m].
    rotations : (m, 3, 3), positions : (m, 3) float64
        Segment frames in the world [m].
    local_velocities : (m, 6) float64
        Linear and angular velocity in the segment's own axes [m/s, rad/s].
    stiffness, damping : (p,) float64
        k [N/m] and c [N·s/m] of each pair.
    lag : float
        Time after which an implicit step wants to know the force [s].
    wrench : (m, 6) float64
        Force and moment about each segment's origin, world axes [N, N·m]; added to.
    points, normals : (p, 3), along : (p,) float64
        Where each pair touches [m], its n, and its impedance lag² k + lag c [kg], zero if far;
        overwritten.
    """
    for e in range(pairs.shape[0]):
        i, j = pairs[e, 0], pairs[e, 1]
        overlap, n, at_i, at_j = _meet(i, j, ends, radius, rotations, positions)
        depth = overlap - allowed[e]
        along[e] = 0.0
        if depth <= -NEAR:
            continue
        rate = _approach(i, j, n, at_i, at_j, rotations, positions, local_velocities)
        size = max(stiffness[e] * depth + damping[e] * rate, 0.0) if depth > 0.0 else 0.0
        if size > 0.0 or -2.0 * lag * abs(rate) < depth <= 0.0:
            along[e] = lag * (lag * stiffness[e] + damping[e])
            for a in range(3):
                points[e, a], normals[e, a] = 0.5 * (at_i[a] + at_j[a]), n[a]
        force = (size * n[0], size * n[1], size * n[2])
        _add(i, at_i, (-force[0], -force[1], -force[2]), positions, wrench)
        _add(j, at_j, force, positions, wrench)


@njit(inline="always")
def _world(segment, point, rotations, positions):
    x, y, z = point
    r = rotations[segment]
    return (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + positions[segment, 0],
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + positions[segment, 1],
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + positions[segment, 2],
    )


@njit(inline="always")
def _end(segment, end, ends, rotations, positions):
    point = (ends[segment, end, 0], ends[segment, end, 1], ends[segment, end, 2])
    return _world(segment, point, rotations, positions)


@compiled
def _meet(i, j, ends, radius, rotations, positions):
    """Return overlap, unit vector from i to j, and the nearest points of the two axes (world).

    Nearest points of two segments as in Ericson, Real-Time Collision Detection (2005), 5.1.9.
    """
    p, q = _end(i, 0, ends, rotations, positions), _end(i, 1, ends, rotations, positions)
    r, s = _end(j, 0, ends, rotations, positions), _end(j, 1, ends, rotations, positions)
    d1 = (q[0] - p[0], q[1] - p[1], q[2] - p[2])
    d2 = (s[0] - r[0], s[1] - r[1], s[2] - r[2])
    between = (p[0] - r[0], p[1] - r[1], p[2] - r[2])
    a, e, b = _dot(d1, d1) + 1e-12, _dot(d2, d2) + 1e-12, _dot(d1, d2)
    c, f = _dot(d1, between), _dot(d2, between)
    denominator = a * e - b * b
    t1 = min(max((b * f - c * e) / denominator, 0.0), 1.0) if denominator > 1e-9 * a * e else 0.5
    t2 = (b * t1 + f) / e
    if t2 < 0.0:
        t2, t1 = 0.0, min(max(-c / a, 0.0), 1.0)
    elif t2 > 1.0:
        t2, t1 = 1.0, min(max((b - c) / a, 0.0), 1.0)
    at_i = (p[0] + t1 * d1[0], p[1] + t1 * d1[1], p[2] + t1 * d1[2])
    at_j = (r[0] + t2 * d2[0], r[1] + t2 * d2[1], r[2] + t2 * d2[2])
    way = (at_j[0] - at_i[0], at_j[1] - at_i[1], at_j[2] - at_i[2])
    distance = np.sqrt(_dot(way, way)) + 1e-12
    reach = (radius[i, 0] + t1 * (radius[i, 1] - radius[i, 0])
             + radius[j, 0] + t2 * (radius[j, 1] - radius[j, 0]))
    n = (way[0] / distance, way[1] / distance, way[2] / distance)
    return reach - distance, n, at_i, at_j


@njit(inline="always")
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _velocity(segment, point, rotations, positions, local):
    """Return the world velocity (3) of a world point that moves with a segment."""
    r = rotations[segment]
    v = (local[segment, 0], local[segment, 1], local[segment, 2])
    w = (local[segment, 3], local[segment, 4], local[segment, 5])
    linear = (_dot(r[0], v), _dot(r[1], v), _dot(r[2], v))
    turn = (_dot(r[0], w), _dot(r[1], w), _dot(r[2], w))
    x, y, z = (point[0] - positions[segment, 0], point[1] - positions[segment, 1],
               point[2] - positions[segment, 2])
    return (linear[0] + turn[1] * z - turn[2] * y, linear[1] + turn[2] * x - turn[0] * z,
            linear[2] + turn[0] * y - turn[1] * x)


@compiled
def _approach(i, j, n, at_i, at_j, rotations, positions, local):
    """Return how fast the touching points of two segments come together along n."""
    u = _velocity(i, at_i, rotations, positions, local)
    w = _velocity(j, at_j, rotations, positions, local)
    return n[0] * (u[0] - w[0]) + n[1] * (u[1] - w[1]) + n[2] * (u[2] - w[2])


@compiled
def _add(segment, point, force, positions, wrench):
    x, y, z = (point[0] - positions[segment, 0], point[1] - positions[segment, 1],
               point[2] - positions[segment, 2])
    for axis in range(3):
        wrench[segment, axis] += force[axis]
    wrench[segment, 3] += y * force[2] - z * force[1]
    wrench[segment, 4] += z * force[0] - x * force[2]
    wrench[segment, 5] += x * force[1] - y * force[0]


@compiled
def self_contact_power(
    pairs, ends, radius, allowed, rotations, positions, before, mean, stiffness, damping, step,
):
    """Return what the dashpots between limbs turn into heat [W], and their implicit part [W].

    As `simcore.contact.foundation_energy.foundation_power`; `before` and `mean` (m, 6) are the
    velocities of the segments that the forces were told and that the step took, in their own axes.
    """
    heat = implicit = 0.0
    for e in range(pairs.shape[0]):
        i, j = pairs[e, 0], pairs[e, 1]
        overlap, n, at_i, at_j = _meet(i, j, ends, radius, rotations, positions)
        depth = overlap - allowed[e]
        if depth <= 0.0:
            continue
        first = _approach(i, j, n, at_i, at_j, rotations, positions, before)
        rate = _approach(i, j, n, at_i, at_j, rotations, positions, mean)
        change = 2.0 * (rate - first)
        spring = 0.25 * step * stiffness[e] * change
        if stiffness[e] * depth + damping[e] * first > 0.0:
            heat += damping[e] * rate * rate
            implicit += (spring + 0.5 * damping[e] * change) * rate
        else:
            heat -= (stiffness[e] * depth + spring) * rate
    return heat, implicit
