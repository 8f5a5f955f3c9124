"""The skin under the tiles of a sheet: what presses a sheet vertex presses all that lies there."""

import numpy as np

from simcore.compiled import compiled


@compiled
def under_tiles(on_sheet, vertex, offsets, near):
    """Return the skin vertices (l,), each once, among which `spread_by_tiles` shares forces."""
    told = np.zeros(offsets.size - 1, np.bool_)
    asked = np.zeros(offsets.size - 1, np.bool_)
    for p in range(on_sheet.size):
        i = vertex[p]
        if on_sheet[p] == 0.0 or i < 0 or told[i]:
            continue
        told[i] = True
        for k in range(offsets[i], offsets[i + 1]):
            asked[np.uint64(near[k])] = True
    return np.flatnonzero(asked)


@compiled
def spread_by_tiles(
    on_sheet, along_sheet, sheet, skin, vertex, normal, radius, offsets, near, area, acted_on,
    total, tangential,
):
    """Share each force among the vertices of two rings, by area and a cone of the tile's size.

    Without, a sheet of another mesh than the skin's would press some vertices twice and leave
    others out.

    Parameters
    ----------
    on_sheet : (m,), along_sheet : (m, 3) float64
        Normal and tangential impulses on sheet vertices [N s].
    sheet : (m, 3), skin : (n, 3) float64
        Positions [m].
    vertex : (m,) int64, normal : (m, 3) float64
        Skin vertex that each sheet vertex follows, −1 for none, and its normal.
    radius : float
        Of a tile [m].
    offsets, near
        Of `simcore.body.skin_listed.two_rings`.
    area : (n,) float64
        Of the skin vertices [m²].
    acted_on, total, tangential
        `Impulses` on the skin, added to: the normal ones, and the opposite of the tangential ones.
    """
    weight = np.empty(np.diff(offsets).max())
    for p in range(on_sheet.size):
        i = vertex[p]
        if on_sheet[p] == 0.0 or i < 0:
            continue
        ring = near[offsets[i] : offsets[i + 1]]
        sum_of = 0.0
        for k in range(ring.size):
            near_by = np.uint64(ring[k])
            out = square = 0.0
            for a in range(3):
                apart = skin[near_by, a] - sheet[p, a]
                out += apart * normal[p, a]
                square += apart * apart
            beside = np.sqrt(max(square - out * out, 0.0))
            weight[k] = area[near_by] * max(1.0 - beside / radius, 0.0)
            sum_of += weight[k]
        if sum_of == 0.0:  # nothing is under the tile: all goes to the vertex itself
            for k in range(ring.size):
                weight[k] = 1.0 if ring[k] == i else 0.0
            sum_of = 1.0
        for k in range(ring.size):
            if weight[k] > 0.0:
                near_by, share = np.uint64(ring[k]), weight[k] / sum_of
                acted_on[near_by] = True
                total[near_by] += on_sheet[p] * share
                for a in range(3):
                    tangential[near_by, a] -= along_sheet[p, a] * share
