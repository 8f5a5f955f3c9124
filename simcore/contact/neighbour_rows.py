"""Which device points can touch the skin, and which skin vertices can be nearest to them.

What `renew_rows` takes and writes, for p patches that skin is near, m parts of the body and n skin
vertices:

patches : (p,) int64
near_offsets, near, part_offsets, parts, due, needed, around
    Of `spend_budgets`.
patch_offsets, patch_vertex, patch_centre, patch_radius, patch_size
    Of all patches (`simcore.contact.neighbour_grid.Patches`).
budget : (p,) float64
    How far the skin around each patch may move [m]; overwritten where due.
row_spans : (p, 2) int64
    First row of each patch that is not due, and one behind its last; overwritten.
rows, offsets, candidates
    Result of the last call.
skin : (n, 3) float64
    Device frame [m], valid around what is due.
edge_change_rate : (n,) float64
    As of `simcore.contact.neighbours.Neighbours`.
normals : (n, 4), known : (n,) bool
    Overwritten, and false all over.
allowance : (m,) float64
    How far each part may now move until a budget is used up [m]; overwritten.
"""

import numpy as np

from simcore.compiled import compiled, inlined

FARTHEST, NEARLY = 0.010, 0.003
"""No patch has a greater budget of motion [m], for bounds of turning normals hold for as much; and
none with points that might touch before it is so large."""


@compiled
def keep_budgets(
    old_patches, old_budget, old_row_spans, complete, patches, nearest, patch_radius, budget,
    row_spans,
):
    """Write budgets and rows of patches around which the skin was looked for anew.

    A vertex that was left out before is farther than `complete`. It can be nearest to no point of
    a patch, of radius r, before the skin has moved by m = (complete − nearest − 2 r) / 2.
    """
    place = np.full(patch_radius.size, -1)
    for p in range(old_patches.size):
        place[old_patches[p]] = p
    for p in range(patches.size):
        budget[p] = -1.0
        row_spans[p, 0] = row_spans[p, 1] = 0
        old = place[patches[p]]
        if old >= 0:
            left = (complete[old] - nearest[p]) / 2 - patch_radius[patches[p]]
            budget[p] = min(old_budget[old], left)
            row_spans[p, 0], row_spans[p, 1] = old_row_spans[old, 0], old_row_spans[old, 1]


@compiled
def spend_budgets(part_offsets, parts, moved, slack, near_offsets, near, budget, needed, mark):
    """Take motions off the budgets of patches; return which are used up, and skin to be posed.

    Parameters
    ----------
    part_offsets, parts
        Parts of the body that the skin around each patch moves with, as CSR.
    moved, slack : (m,) float64
        How far the skin of each part has moved at most since the last call, and how far it may
        before a row that can touch is made again [m].
    near_offsets, near
        Skin vertices around each patch (`simcore.contact.neighbour_grid.near_patches`).
    budget : (p,) float64
        How far the skin around each patch may move yet [m].
    needed : (p,) float64
        The slack of the rows of each patch [m]; overwritten.
    mark : (n,) bool
        False all over.

    Returns
    -------
    due : (p,) bool
        With less than half the budget that a row that can touch has.
    around : (k,) int64
        Skin vertices around these.
    """
    due = np.zeros(budget.size, np.bool_)
    around, count = np.empty(mark.size + 1, np.int64), 0
    for p in range(budget.size):
        way = own = 0.0
        for e in range(part_offsets[p], part_offsets[p + 1]):
            way, own = max(way, moved[parts[e]]), max(own, slack[parts[e]])
        budget[p] -= way
        needed[p] = own
        if budget[p] < 0.5 * own:
            due[p] = True
            for e in range(near_offsets[p], near_offsets[p + 1]):
                around[count] = near[e]
                count += not mark[near[e]]
                mark[near[e]] = True
    for e in range(count):
        mark[around[e]] = False
    return due, around[:count].copy()


@compiled
def renew_rows(
    patches, near_offsets, near, part_offsets, parts, due, needed, patch_offsets, patch_vertex,
    patch_centre, patch_radius, patch_size, budget, row_spans, rows, offsets, candidates, skin,
    ring_offsets, ring_next, edge_change_rate, device_vertices, radius, normals, around, known,
    allowance,
):
    """Renew the rows of the patches that are due; return all rows. Arguments: head of this file.

    They are rows, offsets, candidates: device vertices, and the skin vertices that can be their
    nearest, as CSR.
    """
    new_rows = np.empty(device_vertices.shape[0], np.int64)
    new_offsets = np.zeros(device_vertices.shape[0] + 1, np.int64)
    new = np.empty(8 * 1024, np.int64)
    square, place = np.empty(known.size), np.empty((3, known.size))
    close, some = np.empty((2, known.size + 2), np.int64)
    count = total = 0
    allowance[:] = np.inf
    for p in range(patches.size):
        patch = patches[p]
        points = patch_offsets[patch + 1] - patch_offsets[patch]
        span = near_offsets[p + 1] - near_offsets[p]
        kept = 0
        for r in range(row_spans[p, 0], row_spans[p, 1]):
            kept += offsets[r + 1] - offsets[r]
        while total + max(points * span, kept) >= new.size:
            new = np.concatenate((new, new))
        first_row = count
        if due[p]:
            own, ball = needed[p], patch_radius[patch]
            for e in range(span):
                close[e] = near[near_offsets[p] + e]
                for a in range(3):
                    place[a, e] = skin[close[e], a]
            budget[p], nearest = _freedom(
                close, place, span, patch_centre, patch, ball, patch_size[patch, 0],
                patch_size[patch, 1], patch_size[patch, 2], FARTHEST, skin, ring_offsets,
                ring_next, edge_change_rate, radius, square, some, normals, known,
            )
            if budget[p] <= own:
                farthest = max(NEARLY, own)
                limit = (nearest + 2 * (ball + farthest)) * (nearest + 2 * (ball + farthest))
                kept = 0
                for e in range(span):
                    close[kept] = close[e]
                    for a in range(3):
                        place[a, kept] = place[a, e]
                    kept += square[e] <= limit
                budget[p] = farthest
                for entry in range(patch_offsets[patch], patch_offsets[patch + 1]):
                    k = patch_vertex[entry]
                    free, nearest = _freedom(
                        close, place, kept, device_vertices, k, 0.0, 0.0, 0.0, 0.0, farthest, skin,
                        ring_offsets, ring_next, edge_change_rate, radius, square, some, normals,
                        known,
                    )
                    budget[p] = min(budget[p], max(free, own))
                    if free <= own:
                        limit = (nearest + 2 * own) * (nearest + 2 * own)
                        for e in range(kept):
                            new[total] = close[e]
                            total += square[e] <= limit
                        new_rows[count] = k
                        count += 1
                        new_offsets[count] = total
        else:
            for r in range(row_spans[p, 0], row_spans[p, 1]):
                for e in range(offsets[r], offsets[r + 1]):
                    new[total] = candidates[e]
                    total += 1
                new_rows[count] = rows[r]
                count += 1
                new_offsets[count] = total
        row_spans[p, 0], row_spans[p, 1] = first_row, count
        for e in range(part_offsets[p], part_offsets[p + 1]):
            allowance[parts[e]] = min(allowance[parts[e]], budget[p])
    for i in around:
        known[i] = False
    return new_rows[:count].copy(), new_offsets[: count + 1].copy(), new[:total].copy()


@inlined
def _freedom(
    near, place, count, points, k, ball, size_x, size_y, size_z, farthest, skin, ring_offsets,
    ring_next, edge_change_rate, radius, square, some, normals, known,
):
    """Return how far the skin may move until a point in a box can touch, and its distance [m].

    Where the skin has moved by at most m, v − p has changed by at most that and n by at most b m
    (see `normal_and_bend`): d = n·(v − p) of a vertex cannot be positive before
    m = −d / (1 + b |v − p|). Nor can it be the nearest before m = (|v − p| − least) / 2, nor the
    nearest one within the radius before m = least − radius. For all points of a box about point k
    and within a ball, d is taken at its greatest, and |v − p| − least = (|v − p|² − least²) /
    (|v − p| + least) at its least; both are linear in p, but for the denominator. No more than
    `farthest` is told; writes all squared distances from point k.
    """
    x, y, z = points[k, 0], points[k, 1], points[k, 2]
    least = np.inf
    for e in range(count):
        dx, dy, dz = place[0, e] - x, place[1, e] - y, place[2, e] - z
        square[e] = dx * dx + dy * dy + dz * dz
        least = min(least, square[e])
    first = 0
    while square[first] != least:
        first += 1
    nearest = np.sqrt(least)
    free = farthest
    tested, left = 0, 1
    some[0] = first  # the nearest first, as it is most likely to touch
    while tested < left and free > 0.0:
        e = some[tested]
        i = near[e]
        if not known[i]:
            normals[i, 0], normals[i, 1], normals[i, 2], normals[i, 3] = normal_and_bend(
                skin, i, ring_offsets, ring_next, edge_change_rate[i]
            )
            known[i] = True
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        depth = nx * (place[0, e] - x) + ny * (place[1, e] - y) + nz * (place[2, e] - z)
        depth += abs(nx) * size_x + abs(ny) * size_y + abs(nz) * size_z
        distance = np.sqrt(square[e])
        ahead = square[e] - least - 2 * (
            abs(place[0, e] - place[0, first]) * size_x
            + abs(place[1, e] - place[1, first]) * size_y
            + abs(place[2, e] - place[2, first]) * size_z
        )
        way = max(ahead / (2 * (distance + nearest + 2 * ball)),
                  -depth / (1 + normals[i, 3] * (distance + ball)))
        free = max(min(free, way), 0.0)
        tested += 1
        if tested == 1:  # those that can be the nearest before, without a branch
            far = nearest + 2 * (ball + free)
            for e in range(count):
                some[left] = e
                left += square[e] <= far * far
    return min(max(free, nearest - ball - radius), farthest), nearest


@inlined
def normal_and_bend(vertices, i, ring_offsets, ring_next, edge_change_rate):
    """Return the unit normal of skin vertex i, and how far it turns at most per motion [1/m].

    It is that of N = Σ u × w over the ring. Where no edge changes by more than δ, N changes by at
    most ΔN = Σ δ (|u| + |w| + δ), and its direction by at most √2 ΔN/|N| if ΔN < |N|, and 2
    otherwise. δ is `edge_change_rate` times the motion, which is `FARTHEST` at most.
    """
    nx = ny = nz = 0.0
    squares = 0.0
    for e in range(ring_offsets[i], ring_offsets[i + 1]):
        b, c = ring_next[e, 0], ring_next[e, 1]
        ux, uy, uz = (vertices[b, 0] - vertices[i, 0], vertices[b, 1] - vertices[i, 1],
                      vertices[b, 2] - vertices[i, 2])
        wx, wy, wz = (vertices[c, 0] - vertices[i, 0], vertices[c, 1] - vertices[i, 1],
                      vertices[c, 2] - vertices[i, 2])
        nx += uy * wz - uz * wy
        ny += uz * wx - ux * wz
        nz += ux * wy - uy * wx
        squares += ux * ux + uy * uy + uz * uz + wx * wx + wy * wy + wz * wz
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    count = ring_offsets[i + 1] - ring_offsets[i]
    change = FARTHEST * edge_change_rate
    # Σ (|u| + |w|) is at most what equal lengths would give.
    grown = (np.sqrt(2 * count * squares) + count * change) / length
    bend = edge_change_rate * grown * (np.sqrt(2.0) if change * grown < 1.0 else 2.0)
    return nx / length, ny / length, nz / length, bend


@compiled
def vertex_normal(vertices, i, ring_offsets, ring_next):
    """Return the area-weighted unit normal of skin vertex i."""
    nx = ny = nz = 0.0
    for e in range(ring_offsets[i], ring_offsets[i + 1]):
        b, c = ring_next[e, 0], ring_next[e, 1]
        ux, uy, uz = (vertices[b, 0] - vertices[i, 0], vertices[b, 1] - vertices[i, 1],
                      vertices[b, 2] - vertices[i, 2])
        wx, wy, wz = (vertices[c, 0] - vertices[i, 0], vertices[c, 1] - vertices[i, 1],
                      vertices[c, 2] - vertices[i, 2])
        nx += uy * wz - uz * wy
        ny += uz * wx - ux * wz
        nz += ux * wy - uy * wx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    return nx / length, ny / length, nz / length


@compiled
def to_world(points, k, rotation, position):
    """Return point k of a frame in the world."""
    x, y, z = points[k, 0], points[k, 1], points[k, 2]
    return (
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z + position[0],
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z + position[1],
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z + position[2],
    )
