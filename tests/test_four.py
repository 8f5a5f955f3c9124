"""Vectors of four against numpy, to the bit, and the kernels that use them against plain loops."""

import ctypes
import mmap

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numba.core.errors import NumbaError

from simcore.body.skin_listed import (
    blend_listed,
    blend_motion_listed,
    blend_velocity_listed,
    wrench_listed,
)
from simcore.compiled import compiled
from simcore.contact.normals import FARTHEST, normal_and_bend, vertex_normal, write_normals
from simcore.four import first_three, four_of, put_four, put_three, spread, three_of, turned

seeds = st.integers(0, 2**32 - 2)
varied = settings(max_examples=50, deadline=None)
numbers = arrays(np.float64, (5, 4), elements=st.floats(width=64))


@compiled
def all_operations(rows, added, taken, times, parts, spread_out):
    left, right = four_of(rows, 0), four_of(rows, 1)
    put_four(left + right, added, 0)
    put_four(left - right, taken, 0)
    put_four(left * right, times, 0)
    put_four(left / right, parts, 0)
    put_four(spread(rows[2, 3]), spread_out, 0)


@compiled
def product_and_sum(rows, out):
    put_four(four_of(rows, 0) * four_of(rows, 1) + four_of(rows, 2), out, 0)


@compiled
def copy_three(rows, out, row):
    put_three(three_of(rows, row), out, row)


@compiled
def whole_three(rows, row, out):
    put_four(three_of(rows, row), out, 0)


@compiled
def cross(rows):
    u, w = three_of(rows, 0), three_of(rows, 1)
    return first_three(turned(u * turned(w) - turned(u) * w))


@compiled
def normals_of(vertices, ring_offsets, ring_next, normals):
    for i in range(len(normals)):
        normals[i] = vertex_normal(vertices, i, ring_offsets, ring_next)


def same(ours, right):
    """Return whether all bits are, but for those of what is not a number."""
    ours, right = np.asarray(ours), np.asarray(right)
    return np.array_equal(ours, right, equal_nan=True) and np.array_equal(
        np.signbit(ours)[~np.isnan(right)], np.signbit(right)[~np.isnan(right)]
    )


@varied
@given(numbers)
def test_operations_are_those_of_numbers(rows):
    ours = np.empty((5, 1, 4))
    all_operations(rows, *ours)
    with np.errstate(all="ignore"):
        right = rows[0] + rows[1], rows[0] - rows[1], rows[0] * rows[1], rows[0] / rows[1]
    assert same(ours[:, 0], [*right, np.full(4, rows[2, 3])])


@varied
@given(seeds)
def test_product_and_sum_are_each_rounded(seed):
    rows, ours = np.random.default_rng(seed).normal(size=(3, 4)), np.empty((1, 4))
    product_and_sum(rows, ours)
    assert same(ours[0], rows[0] * rows[1] + rows[2])


@varied
@given(seeds)
def test_cross_product_is_that_of_plain_arithmetic(seed):
    u, w = rows = np.random.default_rng(seed).normal(size=(2, 3))
    right = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]]
    assert same(cross(rows), right)


@pytest.mark.parametrize("row", range(3))
def test_three_are_read_and_written_alone(row):
    rows, ours, four = np.arange(1.0, 10).reshape(3, 3), np.zeros((3, 3)), np.empty((1, 4))
    copy_three(rows, ours, row)
    assert same(ours[row], rows[row])
    assert not np.delete(ours, row, axis=0).any()
    whole_three(rows, row, four)
    assert same(four[0], [*rows[row], 0.0])


def test_nothing_is_read_behind_the_last_row():
    """It ends at a page of memory that nobody may read: to touch it would end the process."""
    pages = mmap.mmap(-1, 2 * mmap.PAGESIZE)
    last = np.frombuffer(pages, np.float64, 3, mmap.PAGESIZE - 24).reshape(1, 3)
    last[:] = [[1, 2, 3]]
    second, protect = last.ctypes.data + 24, ctypes.CDLL(None).mprotect
    protect.argtypes = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
    assert protect(second, mmap.PAGESIZE, 0) == 0
    four = np.empty((1, 4))
    whole_three(last, 0, four)
    protect(second, mmap.PAGESIZE, mmap.PROT_READ | mmap.PROT_WRITE)
    assert same(four[0], [1, 2, 3, 0])


def test_rows_that_are_apart_in_memory_are_refused():
    with pytest.raises((NumbaError, AssertionError)):
        copy_three(np.zeros((3, 6))[:, ::2], np.zeros((3, 3)), 0)


class Skin:
    """Random influences of 60 vertices by 5 segments in random frames, and rings around them."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.offsets = np.concatenate([[0], rng.integers(0, 5, 60).cumsum()]).astype(np.int32)
        count = self.offsets[-1]
        self.segments, self.weights = rng.integers(0, 5, count).astype(np.int32), rng.random(count)
        self.points = rng.normal(size=(count, 3))
        self.influences = self.offsets, self.segments, self.weights, self.points
        self.rotations, self.positions = rng.normal(size=(5, 3, 3)), rng.normal(size=(5, 3))
        self.motions, self.force = rng.normal(size=(5, 6)), rng.normal(size=(60, 3))
        self.force[rng.random(60) < 0.3] = 0.0
        self.listed = rng.permutation(60)[: rng.integers(61)]
        self.vertices = rng.normal(size=(60, 3))
        self.ring_offsets = np.arange(0, 601, 10, dtype=np.int32)
        self.ring_next = rng.integers(0, 60, (600, 2)).astype(np.int32)
        self.ring_next[1::2, 0] = self.ring_next[::2, 1]  # half of them are chained

    def of(self, i):
        """Yield segment, weight and p_ij of the influences of a vertex."""
        for k in range(self.offsets[i], self.offsets[i + 1]):
            yield self.segments[k], self.weights[k], self.points[k]


def times(rotation, x):
    return rotation[:, 0] * x[0] + rotation[:, 1] * x[1] + rotation[:, 2] * x[2]


def crossed(u, w):
    return np.array([
        u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]
    ])


@varied
@given(seeds)
def test_skin_is_posed_and_moved_to_the_bit_in_the_order_of_its_influences(seed):
    skin = Skin(seed)
    placed, vertices, velocities, alone = np.zeros((4, 60, 3))
    frames = skin.rotations, skin.positions
    blend_listed(skin.listed, *skin.influences, *frames, placed)
    blend_motion_listed(
        skin.listed, *skin.influences, *frames, skin.motions, vertices, velocities)
    blend_velocity_listed(skin.listed, *skin.influences, skin.rotations, skin.motions, alone)
    right, velocity = np.zeros((2, 60, 3))
    for i in skin.listed:
        for j, weight, p in skin.of(i):
            right[i] += weight * (times(skin.rotations[j], p) + skin.positions[j])
            linear, (a, b, c) = skin.motions[j, :3], skin.motions[j, 3:]
            own = np.array([
                linear[0] + b * p[2] - c * p[1], linear[1] + c * p[0] - a * p[2],
                linear[2] + a * p[1] - b * p[0],
            ])
            velocity[i] += weight * times(skin.rotations[j], own)
    assert same(placed, right)
    assert same(vertices, right)
    assert same(velocities, velocity)
    assert same(alone, velocity)


@varied
@given(seeds)
def test_wrenches_are_summed_to_the_bit_in_the_order_of_the_list(seed):
    skin, ours, right = Skin(seed), np.full((5, 6), np.nan), np.zeros((5, 6))
    wrench_listed(skin.listed, *skin.influences, skin.rotations, skin.force, ours)
    for i in skin.listed:
        if skin.force[i].any():
            for j, weight, p in skin.of(i):
                right[j, :3] += weight * skin.force[i]
                right[j, 3:] += weight * crossed(times(skin.rotations[j], p), skin.force[i])
    assert same(ours, right)


@varied
@given(seeds, st.floats(0, 100))
def test_normals_and_their_bends_are_those_of_plain_arithmetic_to_the_bit(seed, rate):
    """Of rings that are chained in part, and may hold the vertex itself."""
    skin, ours = Skin(seed), np.empty((60, 3))
    normals_of(skin.vertices, skin.ring_offsets, skin.ring_next, ours)
    for i in range(60):
        normal, squares = np.zeros(3), 0.0
        for b, c in skin.ring_next[skin.ring_offsets[i] : skin.ring_offsets[i + 1]]:
            u, w = skin.vertices[b] - skin.vertices[i], skin.vertices[c] - skin.vertices[i]
            normal += crossed(u, w)
            uu, ww = u * u, w * w
            squares += uu[0] + uu[1] + uu[2] + ww[0] + ww[1] + ww[2]
        x, y, z = normal
        length = np.sqrt(x * x + y * y + z * z)
        grown = (np.sqrt(2 * 10 * squares) + 10 * (FARTHEST * rate)) / length
        bend = rate * grown * (np.sqrt(2) if FARTHEST * rate * grown < 1 else 2)
        assert same(ours[i], normal / length)
        *again, bound = normal_and_bend(
            skin.vertices, i, skin.ring_offsets, skin.ring_next, rate)
        assert same(again, normal / length)
        assert same(bound, bend)


@varied
@given(seeds)
def test_normals_of_listed_vertices_are_written_and_others_are_left(seed):
    skin, ours, right = Skin(seed), np.full((60, 3), 7.0), np.empty((60, 3))
    normals_of(skin.vertices, skin.ring_offsets, skin.ring_next, right)
    write_normals(skin.listed, skin.vertices, skin.ring_offsets, skin.ring_next, ours)
    right[np.setdiff1d(np.arange(60), skin.listed)] = 7.0
    assert same(ours, right)
