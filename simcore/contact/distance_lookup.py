"""Signed distances from a regular grid, for use inside other kernels (Eqs. D2 and D3)."""

import numpy as np

from simcore.compiled import compiled, inlined

AT_ONCE = 584
"""Points that are looked up at a time: what belongs to them stays in the second-level cache. An odd
number of cache lines, so that not all rows fall on the same places of the first-level one."""


@inlined
def distance_and_gradient(values, origin, spacing, x, y, z):
    """Return the signed distance at a point [m] and its gradient (d, gx, gy, gz).

    Inside the grid it is trilinear between the nodes, and the gradient is the exact derivative of
    the interpolant, so that a force along it, −K(d) ∇d, is that of a potential and gives back the
    energy it took. Its length is about 1 but not exactly; for a direction alone, as of friction,
    divide by it.

    Outside, with c the nearest point of the grid's box, the distance is √(‖x − c‖² + φ(c)²), or
    ‖x − c‖ where the solid ends with the box: as it lies in there, and boxes are convex, not
    greater than the true one where φ(c) is not. The gradient is given as zero: nothing touches
    there. A point that is none has no distance.

    Parameters
    ----------
    values : (nx, ny, nz) float32, row by row
        Signed distances at the nodes [m].
    origin : (3,) float64
        Of the grid [m].
    spacing : float
        [m]
    x, y, z : float
        [m], in the frame of the grid.
    """
    nx, ny, nz = values.shape
    per = 1.0 / spacing
    u, v, w = per * (x - origin[0]), per * (y - origin[1]), per * (z - origin[2])
    if not u + v + w < np.inf:
        return np.nan, 0.0, 0.0, 0.0
    a = min(max(u, 0.0), nx - 1.0)
    b = min(max(v, 0.0), ny - 1.0)
    c = min(max(w, 0.0), nz - 1.0)
    i, j, k = min(int(a), nx - 2), min(int(b), ny - 2), min(int(c), nz - 2)
    r, s, t = a - i, b - j, c - k
    v000, v001 = values[i, j, k], values[i, j, k + 1]
    v010, v011 = values[i, j + 1, k], values[i, j + 1, k + 1]
    v100, v101 = values[i + 1, j, k], values[i + 1, j, k + 1]
    v110, v111 = values[i + 1, j + 1, k], values[i + 1, j + 1, k + 1]
    z00, z01, z10, z11 = v001 - v000, v011 - v010, v101 - v100, v111 - v110
    d00, d01, d10, d11 = v000 + t * z00, v010 + t * z01, v100 + t * z10, v110 + t * z11
    y0, y1 = d01 - d00, d11 - d10
    d0, d1 = d00 + s * y0, d10 + s * y1
    z0, z1 = z00 + s * (z01 - z00), z10 + s * (z11 - z10)
    distance = d0 + r * (d1 - d0)
    if u != a or v != b or w != c:
        outside = spacing * spacing * ((u - a) ** 2 + (v - b) ** 2 + (w - c) ** 2)
        return np.sqrt(outside + max(distance, 0.0) ** 2), 0.0, 0.0, 0.0
    return distance, per * (d1 - d0), per * (y0 + r * (y1 - y0)), per * (z0 + r * (z1 - z0))


@compiled
def look_up(values, origin, spacing, points, last, out):
    """Write what `distance_and_gradient` returns for many points, to the bit.

    Three loops: the first and the last have no branch, so that compilers vectorise them, and in the
    second nothing waits for what was read: many reads are under way at once.

    Parameters
    ----------
    points : (3, N) float64
        [m], in the frame of the grid.
    last : uint64
        Columns before this one are asked.
    out : (4, N) float64
        Distance [m] and gradient.
    """
    room = points.shape[1]
    place, cell = np.empty((4, room)), np.empty(room, np.int64)
    corners = np.empty((8, room), values.dtype)
    _find_cells(points, origin, spacing, values.shape, last, place, cell)
    _, ny, nz = values.shape
    flat, x, y = values.reshape(values.size), ny * nz, nz
    for p in range(np.uint64(0), last):
        i = cell[p]
        corners[0, p], corners[1, p] = flat[i], flat[i + 1]
        corners[2, p], corners[3, p] = flat[i + y], flat[i + y + 1]
        corners[4, p], corners[5, p] = flat[i + x], flat[i + x + 1]
        corners[6, p], corners[7, p] = flat[i + x + y], flat[i + x + y + 1]
    _interpolate(corners, place, spacing, last, out)


@compiled
def _find_cells(points, origin, spacing, shape, last, place, cell):
    """Write the first node of each point's cell, and its place there and how far it is outside.

    The latter squared [m²], NaN of what is no point.
    """
    nx, ny, nz = shape
    per, zero = 1.0 / spacing, 0.0
    ox, oy, oz = origin[0], origin[1], origin[2]
    x, y, z = points[0], points[1], points[2]
    r, s, t, outside = place[0], place[1], place[2], place[3]
    for p in range(np.uint64(0), last):
        u, v, w = per * (x[p] - ox), per * (y[p] - oy), per * (z[p] - oz)
        is_point = u + v + w < np.inf
        u = u if is_point else zero
        v = v if is_point else zero
        w = w if is_point else zero
        a = min(max(u, 0.0), nx - 1.0)
        b = min(max(v, 0.0), ny - 1.0)
        c = min(max(w, 0.0), nz - 1.0)
        i, j, k = min(int(a), nx - 2), min(int(b), ny - 2), min(int(c), nz - 2)
        cell[p] = (i * ny + j) * nz + k
        r[p], s[p], t[p] = a - i, b - j, c - k
        way = spacing * spacing * ((u - a) ** 2 + (v - b) ** 2 + (w - c) ** 2)
        outside[p] = way if is_point else np.nan


@compiled
def _interpolate(corners, place, spacing, last, out):
    """Write distance and gradient from the values at the corners of each cell (8, N)."""
    per, zero = 1.0 / spacing, 0.0
    a000, a001, a010, a011 = corners[0], corners[1], corners[2], corners[3]
    a100, a101, a110, a111 = corners[4], corners[5], corners[6], corners[7]
    across, along, up, outside = place[0], place[1], place[2], place[3]
    phi, gx, gy, gz = out[0], out[1], out[2], out[3]
    for p in range(np.uint64(0), last):
        v000, v001, v010, v011 = a000[p], a001[p], a010[p], a011[p]
        v100, v101, v110, v111 = a100[p], a101[p], a110[p], a111[p]
        r, s, t = across[p], along[p], up[p]
        z00, z01, z10, z11 = v001 - v000, v011 - v010, v101 - v100, v111 - v110
        d00, d01, d10, d11 = v000 + t * z00, v010 + t * z01, v100 + t * z10, v110 + t * z11
        y0, y1 = d01 - d00, d11 - d10
        d0, d1 = d00 + s * y0, d10 + s * y1
        z0, z1 = z00 + s * (z01 - z00), z10 + s * (z11 - z10)
        distance = d0 + r * (d1 - d0)
        far = np.sqrt(outside[p] + max(distance, 0.0) ** 2)
        x, y, z = per * (d1 - d0), per * (y0 + r * (y1 - y0)), per * (z0 + r * (z1 - z0))
        inside = outside[p] == 0.0
        phi[p] = distance if inside else far
        gx[p] = x if inside else zero
        gy[p] = y if inside else zero
        gz[p] = z if inside else zero


@inlined
def seen_from(rotation, position, points, i):
    """Return where a point of the world is in the frame at a rotation and position [m]."""
    x, y, z = points[i, 0] - position[0], points[i, 1] - position[1], points[i, 2] - position[2]
    return (rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
            rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
            rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z)


@inlined
def sure_clearance(distance, spacing):
    """Return how far away the solid is at least [m], from a looked-up distance (Eq. D3)."""
    return np.sqrt(max(distance * abs(distance) - 0.75 * spacing * spacing, 0.0))


@inlined
def way_to_touch(distance, spacing):
    """Return how far a point must go at least until its looked-up distance is zero [m].

    Nodes differ by no more than they lie apart, so that ‖∇φ_h‖ ≤ √3; far away Eq. D3 knows more.
    """
    return max(sure_clearance(distance, spacing), distance / np.sqrt(3.0))
