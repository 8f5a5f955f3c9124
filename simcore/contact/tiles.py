"""The skin under the tiles of a sheet: what presses a sheet vertex presses all that lies there."""

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array, eye_array

from simcore.body.skin import Skin
from simcore.compiled import compiled


@lru_cache(maxsize=4)
def two_rings(skin: Skin) -> tuple[np.ndarray, np.ndarray]:
    """Return offsets (n + 1,), and the vertices within two edges of each, itself among them."""
    near = csr_array(
        (np.ones(len(skin.ring_next), bool), skin.ring_next[:, 0], skin.ring_offsets),
        shape=(skin.vertex_count, skin.vertex_count),
    ) + eye_array(skin.vertex_count, dtype=bool, format="csr")
    twice = near @ near
    return twice.indptr, twice.indices


@compiled
def spread_by_tiles(
    on_sheet, along_sheet, sheet, skin, vertex, normal, radius, offsets, near, area, acted_on,
    total, tangential,
):
    """Share each force among the vertices of two rings, by area and a cone of the tile's size.

    Without, a sheet of another mesh than the skin's would press some vertices twice and leave
    others out.
    """
    weight = np.empty(np.diff(offsets).max())
    for p in range(on_sheet.size):
        i = vertex[p]
        if on_sheet[p] == 0.0 or i < 0:
            continue
        ring = near[offsets[i] : offsets[i + 1]]
        sum_of = 0.0
        for k in range(ring.size):
            out = square = 0.0
            for a in range(3):
                apart = skin[ring[k], a] - sheet[p, a]
                out += apart * normal[p, a]
                square += apart * apart
            beside = np.sqrt(max(square - out * out, 0.0))
            weight[k] = area[ring[k]] * max(1.0 - beside / radius, 0.0)
            sum_of += weight[k]
        if sum_of == 0.0:  # nothing is under the tile: all goes to the vertex itself
            for k in range(ring.size):
                weight[k] = 1.0 if ring[k] == i else 0.0
            sum_of = 1.0
        for k in range(ring.size):
            if weight[k] > 0.0:
                share = weight[k] / sum_of
                acted_on[ring[k]] = True
                total[ring[k]] += on_sheet[p] * share
                for a in range(3):
                    tangential[ring[k], a] -= along_sheet[p, a] * share
