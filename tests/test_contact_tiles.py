"""Forces of a sheet given back to the skin under its tiles."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import shortest_path

from simcore.body.skin import build_skin
from simcore.body.skin_listed import two_rings
from simcore.contact.tangential import Impulses
from simcore.contact.tiles import spread_by_tiles, under_tiles

RADIUS = 0.1
BALL = trimesh.creation.icosphere(3, RADIUS)
PLACES = np.array(BALL.vertices)
SKIN = build_skin(
    PLACES, BALL.faces, np.ones((len(PLACES), 1)), np.zeros((1, 3)), np.eye(3)[None]
)
EDGES = shortest_path(
    trimesh.graph.edges_to_coo(BALL.edges_unique), directed=False, unweighted=True
)


def spread(normal, along, sheet, vertex, tile):
    on_skin = Impulses.zero(len(PLACES))
    spread_by_tiles(
        normal, along, sheet, PLACES, vertex, PLACES[vertex] / RADIUS, tile, *two_rings(SKIN),
        SKIN.vertex_area, *on_skin,
    )
    return on_skin


def test_two_rings_are_what_lies_within_two_edges():
    offsets, near = two_rings(SKIN)
    for i in range(len(PLACES)):
        assert set(near[offsets[i] : offsets[i + 1]]) == set(np.flatnonzero(EDGES[i] <= 2))
    assert len(near) == (EDGES <= 2).sum()


def test_what_lies_under_tiles_is_within_two_edges_of_what_is_pressed():
    pressed, vertex = np.array([1.0, 0.0, 2.0, 3.0, 4.0]), np.array([5, 9, 5, -1, 77])
    expected = np.flatnonzero((EDGES[[5, 77]] <= 2).any(axis=0))
    assert np.array_equal(under_tiles(pressed, vertex, *two_rings(SKIN)), expected)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 2), st.floats(0.012, 0.05))
def test_each_force_is_shared_by_area_and_a_cone(seed, tile):
    """Vertex by vertex: α_j ∝ A_j max(1 − s_j/R, 0), s_j beside the tile's normal."""
    rng = np.random.default_rng(seed)
    vertex = rng.integers(len(PLACES), size=12)
    sheet = PLACES[vertex] + rng.normal(0, 0.002, (12, 3))
    normal = rng.uniform(0, 5, 12) * (rng.random(12) < 0.8)
    along = rng.normal(size=(12, 3))
    expected = np.zeros((len(PLACES), 4))
    for p, i in enumerate(vertex):
        if normal[p]:
            reached = np.flatnonzero(EDGES[i] <= 2)
            apart, up = PLACES[reached] - sheet[p], PLACES[i] / RADIUS
            beside = np.linalg.norm(apart - np.outer(apart @ up, up), axis=1)
            share = SKIN.vertex_area[reached] * np.maximum(1 - beside / tile, 0)
            expected[reached] += np.outer(share / share.sum(), [normal[p], *-along[p]])
    acted_on, total, tangential = spread(normal, along, sheet, vertex, tile)
    assert np.c_[total, tangential] == pytest.approx(expected, abs=1e-12)
    assert np.array_equal(acted_on, expected[:, 0] > 0)


def test_a_tile_with_nothing_under_it_presses_its_own_vertex():
    beside = np.cross(PLACES[7], [0.3, -0.5, 0.8])
    sheet = PLACES[7] + 0.5 * beside / np.linalg.norm(beside)
    acted_on, total, tangential = spread(
        np.array([3.0]), np.array([[1.0, 2.0, 3.0]]), sheet[None], np.array([7]), 0.02
    )
    assert np.array_equal(np.flatnonzero(acted_on), [7])
    assert total[7] == pytest.approx(3.0)
    assert tangential[7] == pytest.approx([-1.0, -2.0, -3.0])


def test_what_follows_no_skin_presses_none():
    acted_on, *_ = spread(
        np.array([3.0]), np.zeros((1, 3)), PLACES[:1], np.array([-1]), 0.02
    )
    assert not acted_on.any()
