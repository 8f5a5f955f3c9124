"""How far the skin around each patch of a device may move until a point of the patch can touch.

A patch has a budget of motion [m], and what the skin around it moves is taken off it. One with too
little left is tested again: it gets a new budget, or becomes active, so that contact looks at its
points in every step.
"""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.eight import EIGHT, freedom_of_eight, nearest_of_eight
from simcore.contact.normals import FARTHEST, normal_and_bend

ROUNDING = 1e-6
"""More than single precision takes off freedoms of `FARTHEST` and distances around them [m]."""


@compiled
def spend_budgets(part_offsets, parts, way, slack, budget, needed):
    """Take motions off the budgets; return which patches (d,) are to be tested.

    Parameters
    ----------
    part_offsets, parts
        Parts of the body that the skin around each patch moves with, as CSR.
    way, slack : (k,) float64
        How far the skin of each part has moved at most since the last call, and how little a budget
        is worth while its patch is not active [m].
    budget : (p,) float64
        [m]; overwritten.
    needed : (p,) float64
        The slack around each patch [m]; overwritten.
    """
    due, count = np.empty(budget.size + 1, np.int64), 0
    for p in range(budget.size):
        spent = own = 0.0
        for e in range(part_offsets[p], part_offsets[p + 1]):
            spent, own = max(spent, way[parts[e]]), max(own, slack[parts[e]])
        budget[p] -= spent
        needed[p] = own
        due[count] = p
        count += budget[p] < 0.5 * own
    return due[:count].copy()


@compiled
def least_budgets(part_offsets, parts, budget, count):
    """Return the least budget of the patches around which each of so many parts is [m]."""
    least = np.full(count, np.inf)
    for p in range(budget.size):
        for e in range(part_offsets[p], part_offsets[p + 1]):
            least[parts[e]] = min(least[parts[e]], budget[p])
    return least


@compiled
def renew_budgets(
    patches, near_offsets, near, due, needed, points, skin, ring_offsets, ring_next,
    edge_change_rate, radius, normals, known, budget,
):
    """Give each patch that is due a budget, infinite where less is left than it needs: active.

    Where the skin has moved by at most m, v − p has changed by at most that and n by at most b m
    (see `normal_and_bend`): d = n·(v − p) of a vertex cannot be positive before
    m = −d / (1 + b |v − p|). Nor can it be the nearest before m = (|v − p| − least) / 2, nor the
    nearest one within the radius before m = least − radius.

    Parameters
    ----------
    patches : (p,), near_offsets : (p + 1,), near : (k,)
        As of `simcore.contact.device_patches.near_patches`.
    due, needed
        As of `spend_budgets`.
    points : (P, 3, 8) float64
        Of all patches (`simcore.contact.device_patches.Patches`).
    skin : (n, 3) float64
        Device frame [m], valid around what is due, one-rings included.
    edge_change_rate : (n,) float64
        As of `simcore.contact.neighbours.Neighbours`.
    radius : float
        Points farther than this from the skin are free [m].
    normals : (n, 4), known : (n,) bool
        Overwritten, and false all over.
    budget : (p,) float64
        Overwritten where due [m].
    """
    squares, index = np.empty(EIGHT), np.empty(EIGHT, np.int64)
    least, free = np.empty((2, EIGHT), np.float32)
    for p in due:
        for e in range(near_offsets[p], near_offsets[p + 1]):
            i = np.uint64(near[e])
            if not known[i]:
                normals[i, 0], normals[i, 1], normals[i, 2], normals[i, 3] = normal_and_bend(
                    skin, i, ring_offsets, ring_next, edge_change_rate[i]
                )
                known[i] = True
    for p in due:
        row = near_offsets[p], near_offsets[p + 1]
        nearest_of_eight(points, patches[p], skin, near, *row, squares, index)
        for k in range(EIGHT):
            least[k] = np.sqrt(squares[k])
        freedom_of_eight(points, patches[p], skin, near, *row, normals, least, free)
        left = FARTHEST
        for k in range(EIGHT):
            if index[k] >= 0:
                left = min(left, max(free[k], least[k] - radius))
        left -= ROUNDING
        budget[p] = left if left > needed[p] else np.inf
    for p in due:
        for e in range(near_offsets[p], near_offsets[p + 1]):
            known[near[e]] = False
