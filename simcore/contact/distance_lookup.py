"""Signed distances from a regular grid, for use inside other kernels (Eqs. D2 and D3)."""

import numpy as np

from simcore.compiled import inlined


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
    values : (nx, ny, nz) float32
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
