"""Forces on a sheet at the end of a backward Euler step, in double precision (Eqs. S9, S10)."""

import numpy as np

from simcore.compiled import compiled
from simcore.sheet.rows import (
    ANCHOR,
    C_T,
    COEFFICIENT,
    DAMPING,
    EPSILON,
    F_C,
    K_T,
    OFFSET,
    STIFFNESS,
    SURFACE,
)


@compiled
def add_springs(position, vertices, stiffness, rest_length, buckling_strain, share, force):
    """Add the force of every spring (Eq. 5) to both of its ends (n, 3) [N].

    `share` (s,) is what a spring keeps of its stiffness beyond the buckling strain.
    """
    for s in range(stiffness.size):
        i, j = vertices[s, 0], vertices[s, 1]
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        dz = position[j, 2] - position[i, 2]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        stretch = length - rest_length[s]
        beyond = stretch + buckling_strain * rest_length[s]
        if beyond < 0.0:
            stretch -= (1.0 - share[s]) * beyond
        factor = stiffness[s] * stretch / length
        fx, fy, fz = factor * dx, factor * dy, factor * dz
        force[i, 0] += fx
        force[i, 1] += fy
        force[i, 2] += fz
        force[j, 0] -= fx
        force[j, 1] -= fy
        force[j, 2] -= fz


@compiled
def add_straps(
    position, start, h, bar_point, bar_velocity, length, stiffness, damping, patch_start,
    patch_vertex, patch_weight, force, strap_force,
):
    """Add the tension of every strap (Eq. S4) to its patch and write it (s, 3) [N].

    `start` (n, 3) are the positions before the step, `bar_point` (s, 3) those of the bar after it.
    """
    for s in range(length.size):
        d, u = np.zeros(3), np.zeros(3)
        for e in range(patch_start[s], patch_start[s + 1]):
            i, w = patch_vertex[e], patch_weight[e]
            for axis in range(3):
                d[axis] -= w * position[i, axis]
                u[axis] -= w * (position[i, axis] - start[i, axis]) / h
        d += bar_point[s]
        u += bar_velocity[s]
        distance = np.sqrt((d * d).sum())
        strap_force[s] = 0.0
        if distance <= length[s]:
            continue
        spring = stiffness[s] * (distance - length[s])
        rate = (d * u).sum() / distance
        strap_force[s] = (spring + min(max(damping[s] * rate, -spring), spring)) / distance * d
        for e in range(patch_start[s], patch_start[s + 1]):
            for axis in range(3):
                force[patch_vertex[e], axis] += patch_weight[e] * strap_force[s, axis]


@compiled
def add_contact(position, start, h, rows, vertex, force, row_force, row_anchor):
    """Add contact and friction of every row to its vertex, and write them.

    Eqs. S5 to S7 as functions of the position after the step, with velocity (x − x_start) / h,
    but for the damper, which adds at most k d.

    Parameters
    ----------
    position, start : (n, 3) float64
        After and before the step [m].
    rows : (m, ROW_SIZE) float64
        As `simcore.sheet.rows` fills them.
    force : (n, 3) float64
        Added to [N].
    row_force : (m, 4) float64
        Force and its normal part; overwritten [N].
    row_anchor : (m, 3) float64
        Anchors after the step; overwritten [m].
    """
    for r in range(vertex.size):
        i = vertex[r]
        n, s = rows[r, 0:3], rows[r, SURFACE : SURFACE + 3]
        depth, approach, out = rows[r, OFFSET], 0.0, 0.0
        for axis in range(3):
            relative = (position[i, axis] - start[i, axis]) / h - s[axis]
            approach -= n[axis] * relative
            depth -= n[axis] * (position[i, axis] - h * s[axis])
            row_anchor[r, axis] = rows[r, ANCHOR + axis] + h * s[axis]
            out += n[axis] * (position[i, axis] - row_anchor[r, axis])
        # The damper adds no more than the spring: a jump at depth 0 may leave no solution.
        spring = rows[r, STIFFNESS] * depth
        normal = spring + min(rows[r, DAMPING] * approach, spring)
        row_force[r] = 0.0
        if normal <= 0.0 or depth <= 0.0:
            row_anchor[r] = position[i]
            continue
        size = 0.0
        for axis in range(3):
            slip = (position[i, axis] - start[i, axis]) / h - s[axis] + approach * n[axis]
            if rows[r, COEFFICIENT] < 0.0:
                row_force[r, axis] = -slip
            else:
                stretch = position[i, axis] - row_anchor[r, axis] - out * n[axis]
                row_force[r, axis] = -(rows[r, K_T] * stretch + rows[r, C_T] * slip)
            size += row_force[r, axis] ** 2
        size = np.sqrt(size)
        if rows[r, COEFFICIENT] < 0.0:
            cut = rows[r, F_C] / max(size, rows[r, EPSILON])
        else:
            limit = rows[r, COEFFICIENT] * normal
            cut = limit / size if size > limit else 1.0
        for axis in range(3):
            friction = cut * row_force[r, axis]
            if cut < 1.0 and rows[r, COEFFICIENT] >= 0.0 and rows[r, K_T] > 0.0:
                stretch = position[i, axis] - row_anchor[r, axis] - out * n[axis]
                row_anchor[r, axis] += stretch + friction / rows[r, K_T]
            row_force[r, axis] = friction + normal * n[axis]
            force[i, axis] += row_force[r, axis]
        row_force[r, 3] = normal
