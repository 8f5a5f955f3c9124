"""Surfaces as linear maps of MakeHuman's vertices: the body with its cavities closed, its remesh.

Both maps act on any phenotype, so a body stays multilinear in the phenotype axes after remeshing.
"""

import numba
import numpy as np
import scipy.sparse as sparse
import trimesh
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from simcore.body.makehuman import BODY_VERTEX_COUNT, Template, load_corners
from simcore.body.remesh import Remesh
from simcore.body.segments import INDEX

# ASSUME: a head vertex from which less than this share of all directions is free belongs to the
# mouth, nose or eye sockets.  The three patches found hardly change between 0.03 and 0.15; from
# 0.2 on the ears begin to count.
FREE_SHARE = 0.1
SMALLEST_CAVITY = 20  # vertices; smaller patches are creases of the ears
DIRECTION_COUNT = 256
RAY_START = 2e-4  # [m] off the surface


def closing_operator(template: Template) -> sparse.csr_matrix:
    """Map (13380, 19158) from all vertices to the body surface with its cavities closed.

    Cavity vertices move to the membrane (harmonic surface with uniform weights) over their rim.
    """
    cavity = cavity_vertices(template)
    edges = trimesh.Trimesh(faces=template.faces, process=False).edges_unique
    adjacency = sparse.coo_matrix((np.ones(len(edges)), edges.T), (BODY_VERTEX_COUNT,) * 2)
    adjacency = (adjacency + adjacency.T).tocsr()
    inside, outside = np.flatnonzero(cavity), np.flatnonzero(~cavity)
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    laplacian = (sparse.diags(degree) - adjacency).tocsc()
    rim = outside[np.asarray(abs(laplacian[inside][:, outside]).sum(axis=0)).ravel() > 0]
    membrane = splu(laplacian[inside][:, inside].tocsc()).solve(
        -laplacian[inside][:, rim].toarray()
    )
    operator = sparse.identity(BODY_VERTEX_COUNT, format="lil")
    operator[inside, inside] = 0.0
    operator[np.ix_(inside, rim)] = membrane
    operator = operator.tocsr()
    operator.resize(BODY_VERTEX_COUNT, load_corners("male", 3).shape[-2])
    return operator


def cavity_vertices(template: Template) -> np.ndarray:
    """Flags (13380,) of the vertices inside mouth, nose and eye sockets."""
    # The body the patches are found on: male, between young and old, all axes at their middle.
    vertices = load_corners("male", 3)[:, 1, 1].mean(axis=(0, 1))[:BODY_VERTEX_COUNT].astype(float)
    mesh = trimesh.Trimesh(vertices, template.faces, process=False)
    head = np.flatnonzero(template.segment_weights[:, INDEX["head"]] > 0.5)
    directions = _even_directions(DIRECTION_COUNT)
    starts = vertices[head] + RAY_START * mesh.vertex_normals[head]
    blocked = mesh.ray.intersects_any(
        np.repeat(starts, DIRECTION_COUNT, axis=0), np.tile(directions, (len(head), 1))
    ).reshape(len(head), DIRECTION_COUNT)
    hidden = np.zeros(len(vertices), bool)
    hidden[head] = blocked.mean(axis=1) > 1 - FREE_SHARE
    edges = mesh.edges_unique[hidden[mesh.edges_unique].all(axis=1)]
    graph = sparse.coo_matrix((np.ones(len(edges)), edges.T), (len(vertices),) * 2)
    patch = connected_components(graph, directed=False)[1]
    return hidden & (np.bincount(patch)[patch] >= SMALLEST_CAVITY)


def remesh_operator(remesh: Remesh, faces: np.ndarray, column_count: int) -> sparse.csr_matrix:
    """Map (n, column_count) from the vertices of the source surface to those of its remesh."""
    count = len(remesh.barycentric)
    rows = np.repeat(np.arange(count), 3)
    columns = faces[remesh.source_faces].ravel()
    return sparse.csr_matrix(
        (remesh.barycentric.ravel(), (rows, columns)), shape=(count, column_count)
    )


@numba.njit(cache=True, error_model="numpy", fastmath=False)
def enclosed_volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Volume [m³] of a closed, outward-wound surface, by the divergence theorem."""
    total = 0.0
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        total += (
            a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
        )
    return total / 6.0


def _even_directions(count: int) -> np.ndarray:
    """Unit vectors (count, 3) spread over the sphere on a Fibonacci spiral."""
    step = np.arange(count) + 0.5
    turn = np.pi * (1 + np.sqrt(5)) * step
    height = 1 - 2 * step / count
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
