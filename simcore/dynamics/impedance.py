"""Stiffness and damping of contact, projected to the coordinates of the joints."""

import numpy as np

from simcore.compiled import compiled

PACKED = 21
"""Entries of the upper triangle of a symmetric 6 × 6 matrix, row by row."""


@compiled
def add_joint_impedance(stiffness, damping, lag, impedance):
    """Make of stiffness (nv, nv) what the joints add to the impedance: lag² K + lag D, in place.

    Parameters
    ----------
    stiffness, damping : (nv,) float64
        Of each degree of freedom by itself, added to the matrix [N·m/rad, N·m·s/rad].
    lag : float
        [s]
    impedance : (nv, nv) float64
        K of what couples them; overwritten.
    """
    for i in range(damping.size):
        for j in range(damping.size):
            impedance[i, j] *= lag * lag
        impedance[i, i] += lag * (lag * stiffness[i] + damping[i])


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
    blocks : (m, m, 21) float64
        B_jl for j ≤ l, linear then angular, packed; added to. Each is symmetric, and B_lj = B_jl.
    """
    block = np.empty(PACKED)
    for i in listed:
        a, t = along[i], across[i]
        if a == 0.0 and t == 0.0:
            continue
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        n0, n1, n2 = normals[i, 0], normals[i, 1], normals[i, 2]
        d = a - t
        z00, z01, z02 = d * n0 * n0 + t, d * n0 * n1, d * n0 * n2
        z11, z12, z22 = d * n1 * n1 + t, d * n1 * n2, d * n2 * n2 + t
        # W = Z (−[x]×), whose columns are those of Z turned about the axes.
        w00, w01, w02 = z02 * y - z01 * z, z00 * z - z02 * x, z01 * x - z00 * y
        w10, w11, w12 = z12 * y - z11 * z, z01 * z - z12 * x, z11 * x - z01 * y
        w20, w21, w22 = z22 * y - z12 * z, z02 * z - z22 * x, z12 * x - z02 * y
        block[0], block[1], block[2], block[3], block[4], block[5] = z00, z01, z02, w00, w01, w02
        block[6], block[7], block[8], block[9], block[10] = z11, z12, w10, w11, w12
        block[11], block[12], block[13], block[14] = z22, w20, w21, w22
        # [x]× W: the angular part, symmetric.
        block[15], block[16], block[17] = y * w20 - z * w10, y * w21 - z * w11, y * w22 - z * w12
        block[18], block[19] = z * w01 - x * w21, z * w02 - x * w22
        block[20] = x * w12 - y * w02
        last = np.uint64(offsets[i + 1])
        for e in range(np.uint64(offsets[i]), last):
            for f in range(e, last):
                share = weights[e] * weights[f]
                j = np.uint64(min(segments[e], segments[f]))
                k = np.uint64(max(segments[e], segments[f]))
                for c in range(blocks.shape[2]):  # not unrolled, and so in vectors
                    blocks[j, k, c] += share * block[c]


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
    blocks : (m, m, 21) float64
        As for `add_point_impedance`; added to.
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
        j, k = min(pairs[e, 0], pairs[e, 1]), max(pairs[e, 0], pairs[e, 1])
        c = 0
        for r in range(6):
            for s in range(r, 6):
                value = along[e] * row[r] * row[s]
                blocks[j, j, c] += value
                blocks[k, k, c] += value
                blocks[j, k, c] -= value
                c += 1


@compiled
def project_blocks(packed, jacobian, parents, first_dof, dof_count, matrix):
    """Add Σ_jl J_jᵀ B_jl J_l to a matrix (nv, nv).

    The twist of segment j about the world origin is the sum of the columns of all joints on the way
    to it, so that the entry of two joints is their columns around the sum of B over the subtrees
    that they carry.

    Parameters
    ----------
    packed : (m, m, 21) float64
        B_jl, as `add_point_impedance` leaves them.
    jacobian : (6, nv) float64
        Joint motions in world axes about the world origin.
    parents, first_dof, dof_count : (m,) int64
        Tree of the segments, each after its parent.
    matrix : (nv, nv) float64
    """
    count = parents.size
    sums, used = np.empty((count, count, PACKED)), np.empty(count, np.bool_)
    for j in range(count):
        # What nothing touches has a zero on its diagonal, and so in its row.
        used[j] = packed[j, j, 0] + packed[j, j, 6] + packed[j, j, 11] > 0.0
        for k in range(j, count):
            for c in range(PACKED):
                sums[j, k, c] = sums[k, j, c] = packed[j, k, c]
    for j in range(count - 1, 0, -1):
        if used[j]:
            p = parents[j]
            used[p] = True
            for k in range(count):
                for c in range(PACKED):
                    sums[p, k, c] += sums[j, k, c]
    for j in range(count - 1, 0, -1):
        if used[j]:
            p = parents[j]
            for k in range(p + 1):  # of the rest, the upper half is all that is read
                for c in range(PACKED):
                    sums[k, p, c] += sums[k, j, c]
    block = np.empty((6, 6))
    for j in range(count):
        for k in range(j, count):
            if used[j] and used[k]:
                _unpack(sums[j, k], block)
                _project(
                    block, jacobian, first_dof[j], dof_count[j], first_dof[k], dof_count[k], matrix
                )


@compiled
def _unpack(packed, block):
    """Write a block (6, 6) in full."""
    c = 0
    for r in range(6):
        for s in range(r, 6):
            block[r, s] = block[s, r] = packed[c]
            c += 1


@compiled
def _project(block, jacobian, row, rows, column, columns, matrix):
    """Add J_jᵀ B J_k of the degrees of freedom of two joints, and its transpose, to a matrix."""
    half = np.empty(6)
    for b in range(column, column + columns):
        for r in range(6):
            half[r] = 0.0
            for e in range(6):
                half[r] += block[r, e] * jacobian[e, b]
        for a in range(row, row + rows):
            value = 0.0
            for e in range(6):
                value += jacobian[e, a] * half[e]
            matrix[a, b] += value
            if row != column:
                matrix[b, a] += value
