"""Even remesh of a closed surface by local operations, with every vertex on the original surface.

The operations are those of Botsch and Kobbelt (2004), "A remeshing approach to multiresolution
modeling": split long edges, collapse short ones, flip for valence 6, relax in the tangent plane,
project back.  None of them can open the surface or change its genus, but relaxing and projecting
can turn a thin part inside out: edges are shorter there, and the rounds end on a sound surface.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from simcore.body.inscribed import inscribed_radius
from simcore.body.piercing import piercing_faces
from simcore.body.remesh_operations import (
    MAX_VALENCE,
    collapse_short,
    fill_incident,
    flip_for_valence,
    relax,
    split_long,
)
from simcore.body.scalar_product import dot
from simcore.compiled import compiled

ITERATIONS, MOST_ITERATIONS = 10, 40
# A toe or finger of three edges around folds at the next collapse.  Where the largest ball inside
# has radius r the target edge is at most 1.4 r, 4.5 edges around, but not below 0.7 of the others'.
EDGE_PER_RADIUS, SMALLEST_SHARE = 1.4, 0.7
# A surface is sound within these: smallest angle [rad], edge lengths over their mean.
SOUND_ANGLE, SOUND_EDGES = np.radians(13.0), (0.3, 1.6)
CANDIDATE_VERTICES = 10  # nearest source vertices whose triangles are searched for a projection


@dataclass(frozen=True, eq=False)
class Remesh:
    """Triangles over points of a source surface.

    Attributes
    ----------
    faces : (f, 3) int32
    source_faces : (n,) int32
        Triangle of the source that carries each vertex.
    barycentric : (n, 3) float64
        Coordinates in that triangle; rows sum to 1.
    """

    faces: np.ndarray
    source_faces: np.ndarray
    barycentric: np.ndarray


def remesh(vertices: np.ndarray, faces: np.ndarray, vertex_count: int) -> Remesh:
    """Remesh a closed surface (vertices (n, 3) [m], faces (f, 3)) to about `vertex_count`.

    Vertices are in z-order.  The rounds go on until the remesh is sound.  One too coarse for its
    thinnest parts may never be: then it is the last of MOST_ITERATIONS.
    """
    triangles = vertices[faces]
    area = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    ).sum() / 2
    edge = np.sqrt(2 * area / (np.sqrt(3) * vertex_count))  # of equilateral triangles
    points, triangulation = vertices, faces
    source = _Source(vertices, faces, edge)
    for iteration in range(MOST_ITERATIONS):
        sizes = edge * source.edge_share(points)
        points, triangulation = _one_iteration(points, triangulation, sizes)
        points, source_faces, barycentric = source.project(points, triangulation)
        if iteration + 1 >= ITERATIONS and _is_sound(points, triangulation):
            break
        edge *= np.sqrt(len(points) / vertex_count)
    order = _z_order(points)
    place = np.empty(len(order), triangulation.dtype)
    place[order] = np.arange(len(order))
    renamed = place[triangulation]
    return Remesh(
        renamed[np.argsort(renamed.min(axis=1), kind="stable")], source_faces[order],
        barycentric[order],
    )


def _z_order(points: np.ndarray) -> np.ndarray:
    """Return the order of points (n, 3) along Morton's curve through 1024³ cells.

    Neighbours on the skin come to lie near each other in memory: whole lifts take an eighth less.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    cells = ((points - low) / (high - low).max() * 1023).astype(np.int64)
    key = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            key |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(key, kind="stable")


def _is_sound(points: np.ndarray, faces: np.ndarray) -> bool:
    """Whether no triangle is a sliver, no edge far off the mean and no triangle pierces another."""
    corners = points[faces]
    spans = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(spans, axis=2)
    directions = spans / lengths[:, :, None]
    cosines = -np.einsum("fkc,fkc->fk", directions, np.roll(directions, 1, axis=1))
    shortest, longest = np.array(SOUND_EDGES) * lengths.mean()
    return bool(
        cosines.max() < np.cos(SOUND_ANGLE)
        and lengths.min() > shortest
        and lengths.max() < longest
        and not piercing_faces(points, faces).any()
    )


class _Source:
    """The original surface, searched through points spread over it no further than half an edge."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, edge: float):
        self.vertices, self.faces = vertices, faces
        self.vertex_tree = cKDTree(vertices)
        radius = inscribed_radius(self.vertex_tree, vertices, area_normals(vertices, faces), edge)
        self.vertex_share = np.clip(EDGE_PER_RADIUS * radius / edge, SMALLEST_SHARE, 1.0)
        spacing = edge / 2
        corners = vertices[faces]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        samples, owners = [], []
        for cuts in range(1, int(np.ceil(longest.max() / spacing)) + 1):
            chosen = np.flatnonzero(np.maximum(np.ceil(longest / spacing), 1) == cuts)
            grid = [(i, j, cuts - i - j) for i in range(cuts + 1) for j in range(cuts + 1 - i)]
            # Points are drawn towards the centroid so that each belongs to one triangle.
            mix = 0.9 * np.array(grid) / cuts + 0.1 / 3
            samples.append(np.einsum("gk,fkc->fgc", mix, corners[chosen]).reshape(-1, 3))
            owners.append(np.repeat(chosen, len(grid)))
        self.tree = cKDTree(np.concatenate(samples))
        self.owners = np.concatenate(owners).astype(np.int32)

    def edge_share(self, points: np.ndarray) -> np.ndarray:
        """Share (n,) of the target edge that each point's surroundings bear, below 1 where thin."""
        return self.vertex_share[self.vertex_tree.query(points)[1]]

    def project(self, points: np.ndarray, triangulation: np.ndarray):
        """Closest surface points (n, 3), their triangles (n,) and coordinates there (n, 3)."""
        _, nearest = self.tree.query(points, k=CANDIDATE_VERTICES)
        normals = area_normals(points, triangulation)
        return _closest(points, normals, self.owners[nearest], self.vertices, self.faces)


def _one_iteration(points: np.ndarray, faces: np.ndarray, sizes: np.ndarray):
    """Split, collapse, flip and relax once; compact arrays in and out."""
    room_points = np.empty((6 * len(points) + 60000, 3))
    room_points[: len(points)] = points
    room_sizes = np.empty(len(room_points))
    room_sizes[: len(points)] = sizes
    room_faces = np.full((12 * len(points) + 120000, 3), -1, np.int32)
    room_faces[: len(faces)] = faces
    incident = np.full((len(room_points), MAX_VALENCE), -1, np.int32)
    valence = np.zeros(len(room_points), np.int32)
    fill_incident(faces, incident, valence)
    counts = np.array([len(points), len(faces)])
    split_long(room_points, room_faces, incident, valence, counts, room_sizes)
    collapse_short(room_points, room_faces, incident, valence, counts, room_sizes)
    flip_for_valence(room_points, room_faces, incident, valence, counts)
    relax(room_points, room_faces, incident, valence, counts)
    kept = room_faces[: counts[1]]
    kept = kept[kept[:, 0] >= 0]
    used = np.unique(kept)
    renumbered = np.full(counts[0], -1, np.int32)
    renumbered[used] = np.arange(len(used), dtype=np.int32)
    return room_points[used], renumbered[kept]


def area_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area-weighted vertex normals (n, 3), not normalised."""
    corners = points[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(points)
    for column in range(3):
        np.add.at(normals, faces[:, column], cross)
    return normals


@compiled
def _closest_in_triangle(p, a, b, c):
    """Barycentric coordinates of the point of triangle abc nearest p (Ericson 2005, § 5.1.5)."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0 and d2 <= 0:
        return 1.0, 0.0, 0.0
    bp = p - b
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        return 1 - d1 / (d1 - d3), d1 / (d1 - d3), 0.0
    cp = p - c
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        return 1 - d2 / (d2 - d6), 0.0, d2 / (d2 - d6)
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1 - w, w
    total = va + vb + vc
    return va / total, vb / total, vc / total


@compiled
def _closest(points, normals, candidates, vertices, faces):
    """Nearest of the candidate triangles that face the same way as the vertex normal."""
    found = np.empty_like(points)
    triangle = np.empty(len(points), np.int32)
    barycentric = np.empty_like(points)
    for i in range(len(points)):
        best = np.inf
        for same_way in (True, False):
            for f in candidates[i]:
                a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
                if same_way and dot(np.cross(b - a, c - a), normals[i]) <= 0:
                    continue
                u, v, w = _closest_in_triangle(points[i], a, b, c)
                q = u * a + v * b + w * c
                distance = dot(q - points[i], q - points[i])
                if distance < best:
                    best = distance
                    found[i] = q
                    triangle[i] = f
                    barycentric[i, 0], barycentric[i, 1], barycentric[i, 2] = u, v, w
            if best < np.inf:
                break
    return found, triangle, barycentric
