"""One-rings of many skin vertices at a time, in a form that compilers vectorise."""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.normals import vertex_normal

RING = 8
"""Neighbours for which there is room; of the skin's vertices one in a thousand has more."""

BLOCK = 136
"""Points at a time, so that what belongs to them stays in the nearer caches; no power of two, for
then all rows would meet in the same places of these. Tuned for time."""

_MIDDLE = RING  # row of the vertex itself


@compiled
def ordered_rings(ring_offsets, ring_next):
    """Return the neighbours of each vertex in turn (n, RING): the first again where they end.

    −1 where there are too many, or they do not close to one ring.
    """
    rings = np.full((ring_offsets.size - 1, RING), -1, np.int32)
    for i in range(rings.shape[0]):
        start, end = ring_offsets[i], ring_offsets[i + 1]
        if end == start or end - start > RING:
            continue
        b = first = ring_next[start, 0]
        for k in range(end - start):
            rings[i, k] = b
            for e in range(start, end):
                if ring_next[e, 0] == b:
                    b = ring_next[e, 1]
                    break
            if b == first and k < end - start - 1:
                break
        if rings[i, end - start - 1] < 0 or b != first:
            rings[i] = -1
        else:
            rings[i, end - start :] = first
    return rings


@compiled
def walk_over_rings(
    points, chosen, vertices, ring_offsets, ring_next, rings, posed, last, vertex, square
):
    """Walk chosen points over the skin, each to the nearest of a ring until none is nearer.

    Parameters
    ----------
    points : (m, 3), vertices : (n, 3) float64
        [m]
    chosen : (c,) int64
    ring_offsets, ring_next
        Of the skin, as in `simcore.body.skin.Skin`.
    rings : (n, RING) int32
        Of `ordered_rings`.
    posed : (n,) bool
        Where `vertices` is valid.
    last : (m, 1 + RING) int32
        Of each point, a vertex and its row of `rings`, which lies in memory as points do: rows
        from all over the skin would have to be waited for. Overwritten; −1 if none is known.
    vertex : (m,) int64
        Of each point; overwritten where chosen.
    square : (m,) float64
        Squared distance from it [m²]; overwritten where chosen.

    Returns
    -------
    complete : bool
        Whether all skin that was met is posed. If not, some points have not come to their ends.
    normal : (3, c) float64
        Outward normals of these vertices.
    height : (c,) float64
        Of each point over its vertex's tangent plane [m].
    """
    normal, height = np.empty((3, chosen.size)), np.empty(chosen.size)
    around, own = np.empty((RING + 1, 3, BLOCK)), np.empty((3, BLOCK))
    least, best = np.empty(BLOCK), np.empty(BLOCK, np.int64)
    upward, over = np.empty((3, BLOCK)), np.empty(BLOCK)
    x, y, z = own[0], own[1], own[2]
    complete = True
    middle = around[_MIDDLE]
    for start in range(0, chosen.size, BLOCK):
        block = chosen[start : start + BLOCK]
        for j in range(block.size):
            p = np.uint64(block[j])
            for axis in range(3):
                own[axis, j] = points[p, axis]
            complete &= _take_ring(vertices, rings, posed, vertex[p], p, j, last, around)
        _start_at(block.size, middle[0], middle[1], middle[2], x, y, z, _MIDDLE, least, best)
        for k in range(RING):
            _take_nearer(
                block.size, around[k, 0], around[k, 1], around[k, 2], x, y, z, k, least, best)
        for j in range(block.size):
            p = block[j]
            i = vertex[p]
            if best[j] != _MIDDLE or last[p, 1] < 0:
                vertex[p], least[j], ended = _walk(
                    x[j], y[j], z[j], vertices, i, ring_offsets, ring_next, posed)
                complete &= ended
                _take_ring(vertices, rings, posed, vertex[p], p, j, last, around)
            square[p] = least[j]

        _write_heights(
            block, vertices, ring_offsets, ring_next, last, vertex, around, x, y, z, upward, over)
        for j in range(block.size):
            height[start + j] = over[j]
            for axis in range(3):
                normal[axis, start + j] = upward[axis, j]
    return complete, normal, height


@compiled
def _write_heights(
    block, vertices, ring_offsets, ring_next, last, vertex, around, x, y, z, upward, over
):
    """Write the normals of the middles of some rings, and heights over their tangent planes."""
    middle = around[_MIDDLE]
    upward[:] = 0.0
    for k in range(RING):
        b, c = around[k], around[(k + 1) % RING]
        _add_cross(
            block.size, b[0], b[1], b[2], c[0], c[1], c[2], middle[0], middle[1], middle[2],
            upward[0], upward[1], upward[2],
        )
    for j in range(block.size):
        p = block[j]
        if last[p, 1] < 0:
            upward[0, j], upward[1, j], upward[2, j] = vertex_normal(
                vertices, vertex[p], ring_offsets, ring_next)
    _raise_over(
        block.size, upward[0], upward[1], upward[2], middle[0], middle[1], middle[2], x, y, z, over)


@compiled
def _take_ring(vertices, rings, posed, i, p, j, last, around):
    """Write vertex i of point p and its neighbours into column j; return whether they are posed.

    The vertex alone where it has no ring here: of its neighbours `_walk` knows.
    """
    if last[p, 0] != i:
        last[p, 0] = i
        for k in range(RING):
            last[p, 1 + k] = rings[i, k]
    own = np.uint64(i)
    for axis in range(3):
        around[_MIDDLE, axis, j] = vertices[own, axis]
    all_are, alone = posed[own], last[p, 1] < 0
    for k in range(RING):
        b = own if alone else np.uint64(last[p, 1 + k])
        all_are &= posed[b]
        for axis in range(3):
            around[k, axis, j] = vertices[b, axis]
    return all_are


@compiled
def _start_at(count, bx, by, bz, x, y, z, k, least, best):
    for j in range(count):
        dx, dy, dz = bx[j] - x[j], by[j] - y[j], bz[j] - z[j]
        least[j], best[j] = dx * dx + dy * dy + dz * dz, k


@compiled
def _take_nearer(count, bx, by, bz, x, y, z, k, least, best):
    """Take row k where it is nearer."""
    for j in range(count):
        dx, dy, dz = bx[j] - x[j], by[j] - y[j], bz[j] - z[j]
        square, was, at = dx * dx + dy * dy + dz * dz, least[j], best[j]
        best[j] = k if square < was else at
        least[j] = square if square < was else was


@compiled
def _walk(x, y, z, vertices, i, ring_offsets, ring_next, posed):
    """Return the vertex downhill in distance from vertex i, and its squared distance [m²].

    And whether the walk ended there, and not for want of posed skin.
    """
    least = (vertices[i, 0] - x) ** 2 + (vertices[i, 1] - y) ** 2 + (vertices[i, 2] - z) ** 2
    here = -1
    while here != i:
        here = i
        if not _is_posed(here, ring_offsets, ring_next, posed):
            return here, least, False
        for e in range(ring_offsets[here], ring_offsets[here + 1]):
            b = np.uint64(ring_next[e, 0])
            square = ((vertices[b, 0] - x) ** 2 + (vertices[b, 1] - y) ** 2
                      + (vertices[b, 2] - z) ** 2)
            if square < least:
                least = square
                i = ring_next[e, 0]
    return i, least, True


@compiled
def _is_posed(i, ring_offsets, ring_next, posed):
    """Return whether vertex i and its neighbours are."""
    all_are = posed[i]
    for e in range(ring_offsets[i], ring_offsets[i + 1]):
        all_are = all_are and posed[ring_next[e, 0]]
    return all_are


@compiled
def _add_cross(count, bx, by, bz, cx, cy, cz, ox, oy, oz, nx, ny, nz):
    """Add (b − o) × (c − o): of rings that are shorter, the last ones vanish."""
    for j in range(count):
        ux, uy, uz = bx[j] - ox[j], by[j] - oy[j], bz[j] - oz[j]
        wx, wy, wz = cx[j] - ox[j], cy[j] - oy[j], cz[j] - oz[j]
        nx[j] += uy * wz - uz * wy
        ny[j] += uz * wx - ux * wz
        nz[j] += ux * wy - uy * wx


@compiled
def _raise_over(count, nx, ny, nz, ox, oy, oz, x, y, z, height):
    """Make the normals as long as one, and write the heights."""
    for j in range(count):
        length = np.sqrt(nx[j] * nx[j] + ny[j] * ny[j] + nz[j] * nz[j])
        u, v, w = nx[j] / length, ny[j] / length, nz[j] / length
        height[j] = u * (x[j] - ox[j]) + v * (y[j] - oy[j]) + w * (z[j] - oz[j])
        nx[j], ny[j], nz[j] = u, v, w
