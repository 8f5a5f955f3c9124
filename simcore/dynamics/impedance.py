"""Stiffness and damping of contact, projected to the coordinates of the joints."""

import numpy as np

from simcore.compiled import compiled


@compiled
def add_point_impedance(
    listed, offsets, segments, weights, points, normals, along, across, blocks
):
    """Add impedances at skin vertices to blocks over pairs of segments.

    A vertex x moves with Σ_j α_j (ẋ_j + ω_j × (x − x_j)); where segments blend, x is taken for the
    R_j p_j + x_j of each, which hardly differ. With the twists t_j about the world origin and
    G = [1, −[x]×] its velocity is Σ_j α_j G t_j, and an impedance Z = a_n n nᵀ + a_t (1 − n nᵀ)
    gives

        B_jl += α_j α_l Gᵀ Z G                                                        (Eq. I2)

    Parameters
    ----------
    listed : (l,) int64
        Vertices.
    offsets, segments, weights : (n + 1,), (k,), (k,)
        Influences of the skin.
    points, normals : (n, 3) float64
        x [m] and n, world axes.
    along, across : (n,) float64
        a_n and a_t [kg].
    blocks : (m, m, 6, 6) float64
        Linear, then angular; added to.
    """
    z = np.empty((3, 3))
    zg = np.empty((3, 3))  # Z (−[x]×)
    block = np.empty((6, 6))
    for i in listed:
        a, t = along[i], across[i]
        if a == 0.0 and t == 0.0:
            continue
        x0, x1, x2 = points[i, 0], points[i, 1], points[i, 2]
        for r in range(3):
            for c in range(3):
                z[r, c] = (a - t) * normals[i, r] * normals[i, c]
            z[r, r] += t
        for r in range(3):
            # −[x]× has the columns (0, −x₂, x₁), (x₂, 0, −x₀), (−x₁, x₀, 0).
            zg[r, 0] = -z[r, 1] * x2 + z[r, 2] * x1
            zg[r, 1] = z[r, 0] * x2 - z[r, 2] * x0
            zg[r, 2] = -z[r, 0] * x1 + z[r, 1] * x0
        for c in range(3):
            for r in range(3):
                block[r, c] = z[r, c]
                block[r, 3 + c] = zg[r, c]
                block[3 + c, r] = zg[r, c]
            block[3, 3 + c] = -x2 * zg[1, c] + x1 * zg[2, c]
            block[4, 3 + c] = x2 * zg[0, c] - x0 * zg[2, c]
            block[5, 3 + c] = -x1 * zg[0, c] + x0 * zg[1, c]
        for e in range(offsets[i], offsets[i + 1]):
            for f in range(offsets[i], offsets[i + 1]):
                share = weights[e] * weights[f]
                j, k = segments[e], segments[f]
                for r in range(6):
                    for c in range(6):
                        blocks[j, k, r, c] += share * block[r, c]


@compiled
def add_pair_impedance(pairs, points, normals, along, blocks):
    """Add the impedances between pairs of segments to the blocks (Eq. I2, with α = 1 and −1).

    Parameters
    ----------
    pairs : (p, 2) int64
        Segments.
    points, normals : (p, 3) float64
        Where they touch [m], and the direction of the force; world.
    along : (p,) float64
        a_n [kg].
    blocks : (m, m, 6, 6) float64
        Added to.
    """
    row = np.empty(6)
    for e in range(pairs.shape[0]):
        if along[e] == 0.0:
            continue
        x, n = points[e], normals[e]
        row[0], row[1], row[2] = n[0], n[1], n[2]
        row[3] = x[1] * n[2] - x[2] * n[1]
        row[4] = x[2] * n[0] - x[0] * n[2]
        row[5] = x[0] * n[1] - x[1] * n[0]
        i, j = pairs[e, 0], pairs[e, 1]
        for r in range(6):
            for c in range(6):
                value = along[e] * row[r] * row[c]
                blocks[i, i, r, c] += value
                blocks[j, j, r, c] += value
                blocks[i, j, r, c] -= value
                blocks[j, i, r, c] -= value


@compiled
def project_blocks(blocks, jacobian, parents, first_dof, dof_count, matrix):
    """Add Σ_jl J_jᵀ B_jl J_l to a matrix (nv, nv); the blocks are overwritten.

    The twist of segment j about the world origin is the sum of the columns of all joints on the way
    to it, so that the entry of two joints is their columns around the sum of B over the subtrees
    that they carry.

    Parameters
    ----------
    blocks : (m, m, 6, 6) float64
        Symmetric as a whole.
    jacobian : (6, nv) float64
        Joint motions in world axes about the world origin.
    parents, first_dof, dof_count : (m,) int64
        Tree of the segments, each after its parent.
    matrix : (nv, nv) float64
    """
    count = parents.size
    for j in range(count - 1, 0, -1):
        p = parents[j]
        for k in range(count):
            for r in range(6):
                for c in range(6):
                    blocks[p, k, r, c] += blocks[j, k, r, c]
    for j in range(count - 1, 0, -1):
        p = parents[j]
        for k in range(count):
            for r in range(6):
                for c in range(6):
                    blocks[k, p, r, c] += blocks[k, j, r, c]
    half = np.empty((6, 3))
    for j in range(count):
        for k in range(j, count):
            first = first_dof[k]
            # Joints of six degrees take two rounds.
            for start in range(first, first + dof_count[k], 3):
                width = min(3, first + dof_count[k] - start)
                for r in range(6):
                    for c in range(width):
                        value = 0.0
                        for e in range(6):
                            value += blocks[j, k, r, e] * jacobian[e, start + c]
                        half[r, c] = value
                for a in range(first_dof[j], first_dof[j] + dof_count[j]):
                    for c in range(width):
                        value = 0.0
                        for e in range(6):
                            value += jacobian[e, a] * half[e, c]
                        matrix[a, start + c] += value
                        if j != k:
                            matrix[start + c, a] += value
