"""Normals of skin vertices, one at a time, and how far they can turn."""

import numpy as np

from simcore.compiled import compiled, inlined
from simcore.four import first_three, put_three, spread, three_of, turned

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


@inlined
def vertex_normal(vertices, i, ring_offsets, ring_next):
    """Return the area-weighted unit normal of skin vertex i; fastest along chained rings."""
    normal, _ = _ring_sums(vertices, i, ring_offsets, ring_next)
    return first_three(normal / spread(_length(normal)))


@compiled
def write_normals(listed, vertices, ring_offsets, ring_next, normals):
    """Write `vertex_normal` of the listed vertices into `normals` (n, 3)."""
    for i in listed:
        normal, _ = _ring_sums(vertices, i, ring_offsets, ring_next)
        put_three(normal / spread(_length(normal)), normals, i)


@inlined
def normal_and_bend(vertices, i, ring_offsets, ring_next, edge_change_rate):
    """Return the unit normal of skin vertex i, and how far it turns at most per motion [1/m].

    It is that of N = Σ u × w over the ring. Where no edge changes by more than δ, N changes by at
    most ΔN = Σ δ (|u| + |w| + δ), and its direction by at most √2 ΔN/|N| if ΔN < |N|, and 2
    otherwise. δ is `edge_change_rate` times the motion, which is `FARTHEST` at most.
    """
    normal, squares = _ring_sums(vertices, i, ring_offsets, ring_next)
    length = _length(normal)
    count = ring_offsets[i + 1] - ring_offsets[i]
    change = FARTHEST * edge_change_rate
    # Σ (|u| + |w|) is at most what equal lengths would give.
    grown = (np.sqrt(2 * count * squares) + count * change) / length
    bend = edge_change_rate * grown * (np.sqrt(2.0) if change * grown < 1.0 else 2.0)
    nx, ny, nz = first_three(normal / spread(length))
    return nx, ny, nz, bend


@inlined
def _ring_sums(vertices, i, ring_offsets, ring_next):
    """Return Σ u × w over the pairs of edges of a ring, and Σ u² + w², which is free if unused."""
    c = np.uint64(i)
    own, start, end = three_of(vertices, c), ring_offsets[c], ring_offsets[c + np.uint64(1)]
    normal = w = turned_w = spread(0.0)
    squares, square_w = 0.0, (0.0, 0.0, 0.0)
    for e in range(np.uint64(start), np.uint64(end)):
        b = np.uint64(ring_next[e, 0])
        if b != c:
            w = three_of(vertices, b) - own
            turned_w, square_w = turned(w), first_three(w * w)
        u, turned_u, square_u = w, turned_w, square_w
        c = np.uint64(ring_next[e, 1])
        w = three_of(vertices, c) - own
        turned_w, square_w = turned(w), first_three(w * w)
        normal = normal + (u * turned_w - turned_u * w)
        squares += (square_u[0] + square_u[1] + square_u[2]
                    + square_w[0] + square_w[1] + square_w[2])
    return turned(normal), squares


@inlined
def _length(vector):
    x, y, z = first_three(vector)
    return np.sqrt(x * x + y * y + z * z)
