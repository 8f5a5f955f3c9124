"""Normals of skin vertices, one at a time, and how far they can turn."""

import numpy as np

from simcore.compiled import compiled, inlined

FARTHEST = 0.010
"""Bounds of how far normals turn hold for so much motion [m]."""


@compiled
def chained(ring_offsets, ring_next):
    """Return the pairs (r, 2) of each ring so ordered that one starts where the one before ends.

    Normals along them read every vertex once. A ring that is open, or is several, is chained as far
    as it goes.
    """
    pairs = ring_next.copy()
    for i in range(ring_offsets.size - 1):
        end = ring_offsets[i + 1]
        for e in range(ring_offsets[i] + 1, end):
            for later in range(e, end):
                if pairs[later, 0] == pairs[e - 1, 1]:
                    for a in range(2):
                        pairs[e, a], pairs[later, a] = pairs[later, a], pairs[e, a]
                    break
    return pairs


@compiled
def vertex_normal(vertices, i, ring_offsets, ring_next):
    """Return the area-weighted unit normal of skin vertex i; fastest along chained rings."""
    nx = ny = nz = 0.0
    x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
    wx = wy = wz = 0.0
    c = np.uint64(i)
    for e in range(np.uint64(ring_offsets[i]), np.uint64(ring_offsets[i + 1])):
        b = np.uint64(ring_next[e, 0])
        if b != c:
            wx, wy, wz = vertices[b, 0] - x, vertices[b, 1] - y, vertices[b, 2] - z
        ux, uy, uz = wx, wy, wz
        c = np.uint64(ring_next[e, 1])
        wx, wy, wz = vertices[c, 0] - x, vertices[c, 1] - y, vertices[c, 2] - z
        nx += uy * wz - uz * wy
        ny += uz * wx - ux * wz
        nz += ux * wy - uy * wx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    return nx / length, ny / length, nz / length


@inlined
def normal_and_bend(vertices, i, ring_offsets, ring_next, edge_change_rate):
    """Return the unit normal of skin vertex i, and how far it turns at most per motion [1/m].

    It is that of N = Σ u × w over the ring. Where no edge changes by more than δ, N changes by at
    most ΔN = Σ δ (|u| + |w| + δ), and its direction by at most √2 ΔN/|N| if ΔN < |N|, and 2
    otherwise. δ is `edge_change_rate` times the motion, which is `FARTHEST` at most.
    """
    nx = ny = nz = 0.0
    squares = 0.0
    x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
    wx = wy = wz = 0.0
    c = np.uint64(i)
    for e in range(np.uint64(ring_offsets[i]), np.uint64(ring_offsets[i + 1])):
        b = np.uint64(ring_next[e, 0])
        if b != c:
            wx, wy, wz = vertices[b, 0] - x, vertices[b, 1] - y, vertices[b, 2] - z
        ux, uy, uz = wx, wy, wz
        c = np.uint64(ring_next[e, 1])
        wx, wy, wz = vertices[c, 0] - x, vertices[c, 1] - y, vertices[c, 2] - z
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
