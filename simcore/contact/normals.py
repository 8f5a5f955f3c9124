"""Normals of skin vertices, one at a time, and how far they can turn."""

import numpy as np

from simcore.compiled import compiled, inlined

FARTHEST = 0.010
"""Bounds of how far normals turn hold for so much motion [m]."""


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
