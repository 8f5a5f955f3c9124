"""The skin under the tiles of a sheet: what presses a sheet vertex presses all that lies there."""

import numpy as np

from simcore.compiled import compiled


@compiled
def spread_by_tiles(
    on_sheet, along_sheet, sheet, skin, vertex, normal, radius, ring_offsets, ring_next, area,
    acted_on, total, tangential,
):
    """Share each force among the vertices of two rings, by area and a cone of the tile's size.

    Without, a sheet of another mesh than the skin's would press some vertices twice and leave
    others out.
    """
    near, weight = np.empty(256, np.int64), np.empty(256)
    found_by = np.full(area.size, -1)
    for p in range(on_sheet.size):
        i = vertex[p]
        if on_sheet[p] == 0.0 or i < 0:
            continue
        near[0], count, found_by[i] = i, 1, p
        first, last = 0, 1
        for _ in range(2):
            for at in range(first, last):
                for e in range(ring_offsets[near[at]], ring_offsets[near[at] + 1]):
                    j = ring_next[e, 0]
                    if found_by[j] != p and count < near.size:
                        near[count], found_by[j] = j, p
                        count += 1
            first, last = last, count
        sum_of = 0.0
        for k in range(count):
            out = square = 0.0
            for a in range(3):
                apart = skin[near[k], a] - sheet[p, a]
                out += apart * normal[p, a]
                square += apart * apart
            beside = np.sqrt(max(square - out * out, 0.0))
            weight[k] = area[near[k]] * max(1.0 - beside / radius, 0.0)
            sum_of += weight[k]
        if sum_of == 0.0:
            weight[0] = sum_of = 1.0
            count = 1
        for k in range(count):
            share = weight[k] / sum_of
            acted_on[near[k]] = True
            total[near[k]] += on_sheet[p] * share
            for a in range(3):
                tangential[near[k], a] -= along_sheet[p, a] * share
