"""Which side of a triangle mesh is outside: bodies told apart, their winding checked or mended."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from simcore.errors import DesignError

ACCEPTED = "accepted: closed bodies, or open surfaces whose normals all point to the patient"


@dataclass(frozen=True, eq=False)
class Shell:
    """A connected mesh whose triangles are counter-clockwise seen from outside.

    Attributes
    ----------
    triangles : (m, 3, 3) float64
        Corners [m]; none without area.
    normals : (m, 7, 3) float64
        Pseudonormals (Baerentzen and Aanaes 2005) of each triangle's face, edges ab, bc, ca and
        corners a, b, c: sums over the triangles there, at corners weighted by angle.
    borders : (m, 7) bool
        Which of these features are on the border.
    closed : bool
        It has no border.
    """

    triangles: np.ndarray
    normals: np.ndarray
    borders: np.ndarray
    closed: bool


def shells(vertices: np.ndarray, faces: np.ndarray, where: str) -> list[Shell]:
    """Return the connected parts of a mesh, each wound outwards.

    A closed part is mended where triangles are wound against each other or inside out. Of an open
    one only its winding can tell which side is outside: it must be consistent, and the normals of
    all must not point away from a patient, who sits above (+z) and in front (+x).

    Parameters
    ----------
    vertices : (n, 3) float64, faces : (f, 3) int
        Device frame [m]; equal vertices are joined.
    where : str
        File and key, for messages.

    Raises
    ------
    DesignError
        More than two triangles at an edge, or a winding that cannot be mended.
    """
    vertices, joined = np.unique(vertices, axis=0, return_inverse=True)
    faces = joined.reshape(-1)[faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    edges, uses = _edges(faces)
    if uses.max() > 2:
        raise DesignError(f"{where}: {(uses > 2).sum()} edges join more than two triangles; "
                          f"{ACCEPTED}")
    pair, against = _neighbours(faces, edges, uses)
    ones = np.ones(len(pair))
    graph = coo_matrix((ones, pair.T), shape=2 * (len(faces),)).tocsr()
    count, part = connected_components(graph, directed=False)
    is_open = np.bincount(part[(uses[edges] == 1).any(axis=1)], minlength=count) > 0
    if (against & is_open[part[pair[:, 0]]]).any():
        raise DesignError(f"{where}: the surface is open and {against.sum()} of its edges join "
                          f"triangles wound against each other; {ACCEPTED}")
    if against.any():
        faces = _wound_alike(faces, pair, against, part, where)
    corners = vertices[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    towards = area[is_open[part]].sum(axis=0)
    if towards[0] + towards[2] < 0:
        raise DesignError(f"{where}: the surface is open and its normals point down and back, away "
                          f"from the patient; {ACCEPTED}")
    volume = np.bincount(part, np.einsum("ij,ij->i", corners[:, 0], area), minlength=count)
    inside_out = ~is_open[part] & (volume[part] < 0)
    faces[inside_out] = faces[inside_out, ::-1]
    return [_shell(vertices, faces[part == i], not is_open[i]) for i in range(count)]


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges ab, bc, ca of each face (f, 3), and how many faces use each edge (e,)."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).astype(np.int64), axis=-1)
    _, index, uses = np.unique(
        ends[..., 0] * (ends.max() + 1) + ends[..., 1], return_inverse=True, return_counts=True
    )
    return index.reshape(faces.shape), uses


def _neighbours(faces, edges, uses) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of faces at an edge (p, 2), and which of them are wound against each other."""
    forward = (faces < np.roll(faces, -1, axis=1)).ravel()
    order = np.argsort(edges.ravel(), kind="stable")
    order = order[uses[edges.ravel()[order]] == 2].reshape(-1, 2)
    return order // 3, forward[order[:, 0]] == forward[order[:, 1]]


def _wound_alike(faces, pair, against, part, where) -> np.ndarray:
    """Return the faces with each part wound as its first face is."""
    shape = 2 * (len(faces),)
    graph = coo_matrix((np.where(against, 2, 1), pair.T), shape=shape).tocsr()
    graph = graph + graph.T
    turned = np.zeros(len(faces), dtype=bool)
    for root in np.unique(part, return_index=True)[1]:
        order, before = breadth_first_order(graph, root, directed=False)
        changes = np.asarray(graph[before[order[1:]], order[1:]]).ravel() == 2
        for face, changed in zip(order[1:], changes, strict=True):
            turned[face] = turned[before[face]] ^ changed
    if (turned[pair[:, 0]] ^ turned[pair[:, 1]] ^ against).any():
        raise DesignError(f"{where}: the surface has only one side, as a Möbius strip; {ACCEPTED}")
    return np.where(turned[:, None], faces[:, ::-1], faces)


def _shell(vertices: np.ndarray, faces: np.ndarray, closed: bool) -> Shell:
    corners = vertices[faces]
    ways = np.roll(corners, -1, axis=1) - corners  # ab, bc, ca
    doubled = np.cross(ways[:, 0], ways[:, 1])
    size = np.linalg.norm(doubled, axis=1)
    kept = size > 0
    normal = np.divide(doubled, size[:, None], where=kept[:, None], out=np.zeros_like(doubled))
    back = -np.roll(ways, 1, axis=1)  # from each corner to the one before
    angle = np.arctan2(size[:, None], np.einsum("ijk,ijk->ij", ways, back))
    edges, uses = _edges(faces)
    at_edge = np.column_stack([
        np.bincount(edges.ravel(), np.repeat(normal[:, axis], 3)) for axis in range(3)
    ])
    at_vertex = np.column_stack([
        np.bincount(faces.ravel(), (angle * normal[:, axis : axis + 1]).ravel())
        for axis in range(3)
    ])
    border_edge = uses[edges] == 1
    border_vertex = np.zeros(len(vertices), dtype=bool)
    border_vertex[faces[border_edge]] = True
    border_vertex[np.roll(faces, -1, axis=1)[border_edge]] = True
    normals = np.concatenate([normal[:, None], at_edge[edges], at_vertex[faces]], axis=1)
    borders = np.column_stack(
        [np.zeros(len(faces), dtype=bool), border_edge, border_vertex[faces]]
    )
    return Shell(corners[kept], normals[kept], borders[kept], closed)
