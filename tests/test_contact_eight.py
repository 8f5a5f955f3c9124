"""Distances of eight points at once against the same one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.compiled import compiled
from simcore.contact.device_patches import build_patches
from simcore.contact.eight import (
    EIGHT,
    freedom_of_eight,
    nearest_of_eight,
    squares_of_eight,
    within_of_eight,
)

seeds = st.integers(0, 2**32 - 2)


@compiled
def nearest(points, group, targets, near, first, last, square, index):
    nearest_of_eight(points, group, targets, near, first, last, square, index)


@compiled
def squares_of(points, targets, count, squares, least):
    squares_of_eight(points, targets, count, squares, least)


@compiled
def within(squares, target, limit):
    return within_of_eight(squares, target, limit)


@compiled
def freedom(points, group, targets, near, first, last, normals, least, free):
    freedom_of_eight(points, group, targets, near, first, last, normals, least, free)


class Case:
    """Three groups of points, the last with room for three more, and 40 targets."""

    def __init__(self, seed):
        rng = self.rng = np.random.default_rng(seed)
        self.points, self.targets = rng.normal(size=(3, 3, EIGHT)), rng.normal(size=(40, 3))
        self.points[2, :, 5:] = np.inf
        self.group = int(rng.integers(3))
        way = self.points[self.group].T[:, None] - self.targets  # point, target, coordinate
        self.squares = way[..., 0] ** 2 + way[..., 1] ** 2 + way[..., 2] ** 2
        self.there = np.isfinite(self.points[self.group, 0])


@settings(max_examples=50, deadline=None)
@given(seeds)
def test_nearest_is_that_of_plain_loops_to_the_bit(seed):
    case = Case(seed)
    near = case.rng.permutation(40)
    first, last = sorted(case.rng.integers(0, 41, 2))
    square, index = np.empty(EIGHT), np.empty(EIGHT, np.int64)
    nearest(case.points, case.group, case.targets, near, first, last, square, index)
    looked_at = near[first:last]
    for k in range(EIGHT):
        if case.there[k] and len(looked_at):
            best = looked_at[case.squares[k, looked_at].argmin()]
            assert (index[k], square[k]) == (best, case.squares[k, best])
        else:
            assert (index[k], square[k]) == (-1, np.inf)


def test_of_equals_the_first_is_nearest():
    points, targets = np.zeros((1, 3, EIGHT)), np.array([[2.0, 0, 0], [0, 1, 0], [0, 0, -1]])
    square, index = np.empty(EIGHT), np.empty(EIGHT, np.int64)
    nearest(points, 0, targets, np.array([0, 2, 1]), 0, 3, square, index)
    assert index.tolist() == [2] * EIGHT
    assert square.tolist() == [1.0] * EIGHT


@settings(max_examples=50, deadline=None)
@given(seeds)
def test_squares_are_those_of_single_precision_to_the_bit(seed):
    case = Case(seed)
    points, targets = case.points[case.group].astype(np.float32), case.targets.astype(np.float32)
    count = int(case.rng.integers(41))
    squares, least = np.full((40, EIGHT), np.nan, np.float32), np.empty(EIGHT, np.float32)
    squares_of(points, targets, count, squares, least)
    way = points.T - targets[:, None]  # target, point, coordinate
    expected = way[..., 0] ** 2 + way[..., 1] ** 2 + way[..., 2] ** 2
    assert np.array_equal(squares[:count], expected[:count])
    assert np.isnan(squares[count:]).all()
    assert np.array_equal(least, expected[:count].min(axis=0, initial=np.inf))


@settings(max_examples=50, deadline=None)
@given(seeds)
def test_within_is_one_as_soon_as_any_point_is(seed):
    rng = np.random.default_rng(seed)
    squares = rng.uniform(size=(5, EIGHT)).astype(np.float32)
    target, limit = int(rng.integers(5)), np.full(EIGHT, -1, np.float32)
    assert within(squares, target, limit) == 0
    k = int(rng.integers(EIGHT))
    limit[k] = squares[target, k]  # as near as that is within
    assert within(squares, target, limit) == 1
    limit[k] = np.nextafter(limit[k], np.float32(-1))
    assert within(squares, target, limit) == 0


@settings(max_examples=50, deadline=None)
@given(seeds)
def test_freedom_is_that_of_the_formula(seed):
    case = Case(seed)
    near = case.rng.permutation(40)
    first, last = sorted(case.rng.integers(0, 41, 2))
    normals = np.column_stack([case.rng.normal(size=(40, 3)), case.rng.uniform(0, 50, 40)])
    least, free = case.rng.uniform(0, 1, EIGHT).astype(np.float32), np.empty(EIGHT, np.float32)
    freedom(case.points, case.group, case.targets, near, first, last, normals, least, free)
    points, looked_at = case.points[case.group].T[case.there], near[first:last]
    distance = np.sqrt(case.squares[case.there][:, looked_at])
    way = case.targets[looked_at] - points[:, None]
    depth = np.einsum("pta,ta->pt", way, normals[looked_at, :3])
    until_touch = -depth / (1 + normals[looked_at, 3] * distance)
    until_nearest = (distance - least[case.there, None]) / 2
    allowed = np.maximum(until_touch, until_nearest).min(axis=1, initial=np.inf)
    assert free[case.there] == pytest.approx(allowed, rel=1e-6, abs=1e-6)


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(1, 700))
def test_patches_hold_every_point_once_in_their_balls(seed, count):
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(count, 3)) * [1, 0.3, 0.01]
    patches = build_patches(vertices)
    there = patches.vertex >= 0
    assert np.array_equal(np.sort(patches.vertex[there]), np.arange(count))
    assert there.ravel()[:count].all()  # room is left in the last one alone
    at = patches.points.transpose(0, 2, 1)
    assert np.array_equal(at[there], vertices[patches.vertex[there]])
    assert np.isinf(at[~there]).all()
    group = np.arange(len(at)) // EIGHT
    centre = patches.group_centres.transpose(0, 2, 1).reshape(-1, 3)[: len(at)]
    apart = np.linalg.norm(at - (centre + patches.group_middle[group])[:, None], axis=2)
    assert (apart[there] <= np.repeat(patches.radius, there.sum(axis=1)) + 1e-6).all()
    from_middle = np.linalg.norm(centre, axis=1)
    assert (from_middle + patches.radius <= patches.group_radius[group] + 1e-6).all()


def test_patches_of_an_even_sheet_are_small():
    """Eights of a grid of 7 mm, and eights of these, are not much larger than squares."""
    x, y = np.meshgrid(np.arange(64.0), np.arange(64.0))
    patches = build_patches(np.column_stack([x.ravel(), y.ravel(), np.zeros(64 * 64)]) * 0.007)
    assert patches.radius.max() < 0.012  # 2 × 4 points
    assert patches.group_radius.max() < 0.045  # 8 × 8 points, and the radius of a patch
