"""Simple meshes that stand for what a simulation has no surface of."""

import numpy as np

TUBE_SIDES = 12

MATTRESS_THICKNESS = 0.12
"""As drawn [m]; nothing touches a mattress from below."""

STRAP_RADIUS, BAR_RADIUS = 0.007, 0.018
"""As drawn [m]."""


def unit_tube() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices, normals (n, 3) and faces of a closed tube of radius 1 from z = 0 to 1."""
    angle = 2 * np.pi * np.arange(TUBE_SIDES) / TUBE_SIDES
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(TUBE_SIDES)])
    up = np.array([0.0, 0.0, 1.0])
    vertices = np.concatenate([ring, ring + up, ring, ring + up])  # wall, then both ends
    caps = np.repeat([-up, up], TUBE_SIDES, axis=0)
    normals = np.concatenate([ring, ring, caps])
    here = np.arange(TUBE_SIDES)
    after = np.roll(here, -1)
    low, high = here[1:-1] + 2 * TUBE_SIDES, here[1:-1] + 3 * TUBE_SIDES
    faces = np.concatenate([
        np.column_stack([here, after, after + TUBE_SIDES]),
        np.column_stack([here, after + TUBE_SIDES, here + TUBE_SIDES]),
        np.column_stack([np.full_like(low, 2 * TUBE_SIDES), low + 1, low]),
        np.column_stack([np.full_like(high, 3 * TUBE_SIDES), high, high + 1]),
    ])
    return vertices, normals, faces


def box(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices, normals (24, 3) and faces (12, 3) of a box between two corners (3,)."""
    vertices, normals, faces = [], [], []
    for axis in range(3):
        across, along = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            corners = np.zeros((4, 3))
            corners[:, axis] = side
            corners[[1, 2], across] = 1
            corners[[2, 3], along] = 1
            first = 4 * len(vertices)
            order = [[0, 1, 2], [0, 2, 3]] if side else [[0, 2, 1], [0, 3, 2]]
            faces += (first + np.array(order)).tolist()
            vertices.append(low + corners * (high - low))
            normals.append(np.tile((2 * side - 1) * np.eye(3)[axis], (4, 1)))
    return np.concatenate(vertices), np.concatenate(normals), np.array(faces)


def mattress(top: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the box under the upper side (n, 3) of a bed [m]: vertices, normals, faces."""
    low, high = top.min(axis=0), top.max(axis=0)
    return box(low - [0, 0, MATTRESS_THICKNESS], high)


def tube_placements(ends: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return translation (…, 3), rotation (…, 4) x y z w and scale (…, 3) of tubes.

    They take `unit_tube` to the lines between both ends (…, 2, 3) [m]; of all rotations the
    shortest from +z.
    """
    along = ends[..., 1, :] - ends[..., 0, :]
    length = np.maximum(np.linalg.norm(along, axis=-1), 1e-6)
    x, y, z = np.moveaxis(along / length[..., None], -1, 0)
    # (z × d, 1 + z·d), halfway between; 1 + z would lose its digits downwards, and straight down
    # it is any half turn.
    halfway = np.where(z > 0, 1 + z, (x**2 + y**2) / (1 - np.minimum(z, 0)))
    rotation = np.stack([-y, x, np.zeros_like(x), halfway], axis=-1)
    rotation[np.abs(rotation).max(axis=-1) < 1e-12] = [1, 0, 0, 0]
    rotation /= np.linalg.norm(rotation, axis=-1, keepdims=True)
    scale = np.stack([np.full_like(length, radius)] * 2 + [length], axis=-1)
    return ends[..., 0, :], rotation, scale


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit normals (n, 3), the area-weighted mean of the faces around each vertex."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    face = np.cross(b - a, c - a)
    total = np.zeros_like(vertices)
    for i in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(faces[:, i], face[:, axis], len(vertices))
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)
