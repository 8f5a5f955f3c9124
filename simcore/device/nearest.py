"""Signed distances from the nodes of a grid to a triangle mesh, exact, by a tree of boxes."""

import numpy as np

from simcore.compiled import compiled

LEAF_TRIANGLES = 2  # at least, in a leaf of the tree
FACE, EDGES, CORNERS = 0, 1, 4
"""Features of a triangle (a, b, c): its face, its edges ab, bc, ca, its corners a, b, c."""


def box_tree(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a balanced tree of boxes over triangles, halved along their boxes' longest sides.

    Parameters
    ----------
    triangles : (m, 3, 3) float64
        Corners [m].

    Returns
    -------
    order : (m,) int
        Triangles in the order of the leaves.
    offsets : (L + 1,) int32
        Leaf i holds order[offsets[i]:offsets[i + 1]]; L is a power of two.
    boxes : (2 L − 1, 6) float64
        Least and greatest corner of each node [m]. The children of node i are 2i + 1 and 2i + 2,
        the last L nodes are the leaves.
    """
    levels = max(int(np.log2(len(triangles) / LEAF_TRIANGLES)), 0)
    offsets = np.linspace(0, len(triangles), 2**levels + 1).astype(np.int32)
    centres = triangles.mean(axis=1)
    order = np.arange(len(triangles))
    for level in range(levels):
        starts = offsets[: -1 : 2 ** (levels - level)]
        ordered = centres[order]
        extent = np.maximum.reduceat(ordered, starts) - np.minimum.reduceat(ordered, starts)
        group = np.repeat(np.arange(len(starts)), np.diff([*starts, len(order)]))
        key = ordered[np.arange(len(order)), extent.argmax(axis=1)[group]]
        order = order[np.lexsort((key, group))]
    sorted_corners = triangles[order]
    boxes = [np.hstack([
        np.minimum.reduceat(sorted_corners.min(axis=1), offsets[:-1]),
        np.maximum.reduceat(sorted_corners.max(axis=1), offsets[:-1]),
    ])]
    while len(boxes[0]) > 1:
        first, second = boxes[0][::2], boxes[0][1::2]
        boxes.insert(0, np.hstack([
            np.minimum(first[:, :3], second[:, :3]), np.maximum(first[:, 3:], second[:, 3:])
        ]))
    return order, offsets, np.concatenate(boxes)


@compiled
def _box_square(boxes, i, x, y, z):
    """Squared distance from a point to a box."""
    a = max(boxes[i, 0] - x, 0.0, x - boxes[i, 3])
    b = max(boxes[i, 1] - y, 0.0, y - boxes[i, 4])
    c = max(boxes[i, 2] - z, 0.0, z - boxes[i, 5])
    return a * a + b * b + c * c


@compiled
def _from_triangle(corners, i, x, y, z):
    """From the nearest point of a triangle to (x, y, z): the vector, and which feature it is on.

    By Voronoi regions (Ericson 2005, Real-Time Collision Detection, section 5.1.5).
    """
    ax, ay, az = x - corners[i, 0, 0], y - corners[i, 0, 1], z - corners[i, 0, 2]
    ux, uy, uz = (corners[i, 1, 0] - corners[i, 0, 0], corners[i, 1, 1] - corners[i, 0, 1],
                  corners[i, 1, 2] - corners[i, 0, 2])
    vx, vy, vz = (corners[i, 2, 0] - corners[i, 0, 0], corners[i, 2, 1] - corners[i, 0, 1],
                  corners[i, 2, 2] - corners[i, 0, 2])
    d1, d2 = ux * ax + uy * ay + uz * az, vx * ax + vy * ay + vz * az
    if d1 <= 0.0 and d2 <= 0.0:
        return ax, ay, az, CORNERS
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    uv = ux * vx + uy * vy + uz * vz
    d3, d4 = d1 - uu, d2 - uv
    if d3 >= 0.0 and d4 <= d3:
        return ax - ux, ay - uy, az - uz, CORNERS + 1
    d5, d6 = d1 - uv, d2 - vv
    if d6 >= 0.0 and d5 <= d6:
        return ax - vx, ay - vy, az - vz, CORNERS + 2
    over_c = d1 * d4 - d3 * d2
    if over_c <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s = d1 / (d1 - d3)
        return ax - s * ux, ay - s * uy, az - s * uz, EDGES
    over_b = d5 * d2 - d1 * d6
    if over_b <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6)
        return ax - t * vx, ay - t * vy, az - t * vz, EDGES + 2
    over_a = d3 * d6 - d5 * d4
    if over_a <= 0.0 and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return (ax - ux - t * (vx - ux), ay - uy - t * (vy - uy), az - uz - t * (vz - uz),
                EDGES + 1)
    total = over_a + over_b + over_c
    s, t = over_b / total, over_c / total
    return ax - s * ux - t * vx, ay - s * uy - t * vy, az - s * uz - t * vz, FACE


@compiled
def _nearest(corners, offsets, boxes, x, y, z, nearest, square, stack, squares):
    """Return the triangle nearer than √square, or `nearest` if there is none."""
    leaf_count = offsets.size - 1
    stack[0], squares[0] = 0, _box_square(boxes, 0, x, y, z)
    size = 1
    while size:
        size -= 1
        if squares[size] >= square:
            continue
        node = stack[size]
        while node < leaf_count - 1:
            near, far = 2 * node + 1, 2 * node + 2
            to_near, to_far = _box_square(boxes, near, x, y, z), _box_square(boxes, far, x, y, z)
            if to_far < to_near:
                near, far, to_near, to_far = far, near, to_far, to_near
            if to_far < square:
                stack[size], squares[size] = far, to_far
                size += 1
            if to_near >= square:
                break
            node = near
        else:
            leaf = node - leaf_count + 1
            for i in range(offsets[leaf], offsets[leaf + 1]):
                dx, dy, dz, _ = _from_triangle(corners, i, x, y, z)
                here = dx * dx + dy * dy + dz * dz
                if here < square:
                    square, nearest = here, i
    return nearest


@compiled
def signed_distances(
    corners, offsets, boxes, normals, borders, origin, spacing, wanted, values, at_border
):
    """Lower the values of a grid to the signed distance from one mesh, where wanted and less.

    The sign is that of the way from the nearest point along the pseudonormal there (Baerentzen and
    Aanaes 2005): exact for a closed mesh that does not cut through itself.

    Parameters
    ----------
    corners : (m, 3, 3) float64, offsets, boxes
        Triangles in the order of their tree, and the tree, by `box_tree`.
    normals : (m, 7, 3) float64
        Pseudonormals of each triangle's features.
    borders : (m, 7) bool
        Features on the mesh's border.
    origin : (3,) float64, spacing : float
        Of the grid [m].
    wanted : (nx, ny, nz) bool
    values : (nx, ny, nz) float32
        [m]; lowered.
    at_border : (nx, ny, nz) bool
        Whether the nearest point is on the border; overwritten where a value is lowered.
    """
    stack, squares = np.empty(64, np.int64), np.empty(64)
    row_start = 0
    for i in range(values.shape[0]):
        x = origin[0] + i * spacing
        for j in range(values.shape[1]):
            y = origin[1] + j * spacing
            nearest = row_start
            for k in range(values.shape[2]):
                if not wanted[i, j, k]:
                    continue
                z = origin[2] + k * spacing
                known = values[i, j, k]
                away = _box_square(boxes, 0, x, y, z)
                if away > 0.0 and (known <= 0.0 or away >= known * known):
                    continue
                # The neighbour's nearest triangle is nearly always a tight bound.
                dx, dy, dz, _ = _from_triangle(corners, nearest, x, y, z)
                nearest = _nearest(corners, offsets, boxes, x, y, z, nearest,
                                   dx * dx + dy * dy + dz * dz, stack, squares)
                if k == 0:
                    row_start = nearest
                dx, dy, dz, feature = _from_triangle(corners, nearest, x, y, z)
                distance = np.sqrt(dx * dx + dy * dy + dz * dz)
                if (dx * normals[nearest, feature, 0] + dy * normals[nearest, feature, 1]
                        + dz * normals[nearest, feature, 2] < 0.0):
                    distance = -distance
                if distance < known:
                    values[i, j, k] = distance
                    at_border[i, j, k] = borders[nearest, feature]
