"""Points followed over closed meshes, against a search over all vertices."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.body.skin import build_skin, vertex_normals
from simcore.contact.rings import RING
from simcore.contact.tracking import MARGIN, NEAR, REACH, SurfaceTracker

seeds = st.integers(0, 2**32 - 2)
varied = settings(max_examples=25, deadline=None)
UNTURNED, ORIGIN = np.eye(3), np.zeros(3)


class Mesh:
    """One or more closed meshes as one skin."""

    def __init__(self, *parts):
        whole = trimesh.util.concatenate(parts)
        self.vertices = np.array(whole.vertices)
        self.part = np.repeat(np.arange(len(parts)), [len(each.vertices) for each in parts])
        one = np.ones((len(self.vertices), 1))
        skin = build_skin(self.vertices, whole.faces, one, np.zeros((1, 3)), np.eye(3)[None])
        self.rings = skin.ring_offsets, skin.ring_next
        self.normals = vertex_normals(skin, self.vertices)

        self.searched = self.vertices  # where the skin was at the last search

    def tracker(self, points):
        tracker = SurfaceTracker(len(points), *self.rings)
        self.update(tracker, points)
        return tracker

    def update(self, tracker, points, rotation=UNTURNED, position=ORIGIN, travelled=0.0):
        """Carry all along with a frame; skin that is not posed is not a number."""
        travelled += np.linalg.norm(self.vertices - self.searched, axis=1).max()
        posed = np.full(self.vertices.shape, np.nan)

        def pose(chosen):
            posed[chosen] = self.vertices[chosen] @ rotation.T + position

        tracker.update(points @ rotation.T + position, posed, rotation, position, travelled, pose)
        if tracker.searched:
            self.searched = self.vertices
        return np.isnan(posed[:, 0]).mean()

    def search(self, tracker, points):
        """Update as if skin could have travelled for a metre: a search is due."""
        self.update(tracker, points, travelled=1.0)

    def distances(self, points):
        """Distance of each point from each vertex, one by one (m, n) [m]."""
        return np.linalg.norm(points[:, None] - self.vertices, axis=2)


def ellipsoid(x, y, z, middle=(0.0, 0.0, 0.0), subdivisions=4):
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    mesh.apply_transform(np.diag([x, y, z, 1.0]))
    mesh.apply_translation(middle)
    return mesh


def ball(radius, middle=(0.0, 0.0, 0.0)):
    """On a ball, a vertex nearer than its neighbours is the nearest: as in linear programming."""
    return ellipsoid(radius, radius, radius, middle, subdivisions=3)


def directions(rng, count):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def hold_to_search(tracker, mesh, points):
    """Compare with a search over all pairs; return how many points are followed."""
    distance = mesh.distances(points)
    near = distance.min(axis=1) <= REACH
    assert np.array_equal(tracker.vertex >= 0, near)
    close = distance.min(axis=1) < NEAR
    assert np.array_equal(
        distance[close, tracker.vertex[close]], distance[close].min(axis=1)
    )
    followed = tracker.vertex[close]
    assert np.allclose(tracker.normal[close], mesh.normals[followed], atol=1e-12)
    above = np.einsum("ij,ij->i", points[close] - mesh.vertices[followed], mesh.normals[followed])
    assert np.allclose(tracker.gap[close], above, atol=1e-12)
    farther = near & ~close
    assert np.all(tracker.gap[farther] <= distance[farther].min(axis=1) + 1e-12)
    assert np.all(tracker.gap[farther] > 0)
    assert np.all(tracker.gap[~near] == REACH)
    return np.count_nonzero(near)


@varied
@given(seeds, st.floats(0.05, 0.5))
def test_points_outside_follow_the_nearest_vertex(seed, radius):
    mesh = Mesh(ball(radius))
    rng = np.random.default_rng(seed)
    points = rng.uniform(radius, radius + 1.5 * REACH, (200, 1)) * directions(rng, 200)
    assert 50 < hold_to_search(mesh.tracker(points), mesh, points) < 200


def test_normals_of_vertices_with_any_number_of_neighbours():
    """A globe of meridians: at its poles more of them meet than rings have room for."""
    mesh = Mesh(trimesh.creation.uv_sphere(radius=0.2, count=[16, 24]))
    points = 1.02 * mesh.vertices
    tracker = mesh.tracker(points)
    assert np.diff(mesh.rings[0]).max() > RING
    assert hold_to_search(tracker, mesh, points) == len(points)
    mesh.update(tracker, points)
    assert np.array_equal(tracker.vertex, np.arange(len(points)))


def test_skin_is_posed_only_where_points_may_touch():
    """Points that slide half around a ball, without another search."""
    mesh = Mesh(ball(0.2))
    start = np.array([[0, 0, 0.2], [0.01, 0, 0.2], [0, 0.01, 0.2]]) * (1 + NEAR)
    tracker = mesh.tracker(start)
    tracker._search, tracker._unseen[:] = None, np.inf
    unposed = []
    for angle in np.linspace(0.0, np.pi, 60):
        turn = trimesh.transformations.rotation_matrix(angle, [1, 0, 0])[:3, :3]
        points = start @ turn.T
        unposed.append(mesh.update(tracker, points))
        assert hold_to_search(tracker, mesh, points) == 3
    assert np.median(unposed) > 0.5
    assert 0.0 in unposed[1:]  # came to where it was not posed


@varied
@given(seeds)
def test_followed_points_need_no_search_on_a_convex_skin(seed):
    """Close to the skin; each point has its own vertex at all times, and no other search."""
    mesh = Mesh(ball(0.2))
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.2, 0.2 + NEAR / 2, (100, 1)) * directions(rng, 100)
    tracker = mesh.tracker(points)
    first = tracker.vertex.copy()
    tracker._search = None
    tracker._unseen[:] = np.inf
    for _ in range(40):
        points += 0.004 * directions(rng, 100) + [0.003, 0.0, 0.0]
        distance = np.linalg.norm(points, axis=1, keepdims=True)
        points *= np.clip(distance, 0.201, 0.2 + NEAR / 2) / distance
        mesh.update(tracker, points)
    assert hold_to_search(tracker, mesh, points) == 100
    assert np.count_nonzero(tracker.vertex != first) > 80


@varied
@given(seeds)
def test_skin_that_moves_is_followed_as_well(seed):
    """Only where skin and points are to each other counts; normals turn with the skin."""
    mesh = Mesh(ball(0.2))
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.2, 0.2 + NEAR / 2, (50, 1)) * directions(rng, 50)
    tracker = mesh.tracker(points)
    for _ in range(20):
        turn = trimesh.transformations.rotation_matrix(0.03, rng.normal(size=3))[:3, :3]
        mesh.vertices = np.ascontiguousarray(mesh.vertices @ turn.T)
        mesh.normals = mesh.normals @ turn.T
        mesh.update(tracker, points)
    assert hold_to_search(tracker, mesh, points) == 50


@varied
@given(seeds, st.lists(st.floats(1e-4, 0.03), min_size=20, max_size=60), st.floats(0, 1))
def test_no_point_comes_near_unseen(seed, ways, share):
    """Whatever way each takes from beyond REACH, however fast, and the skin a share of it.

    All is carried along with a frame that wanders and turns.
    """
    mesh = Mesh(ball(0.2))
    rng = np.random.default_rng(seed)
    far = 0.2 + 2 * REACH
    points = rng.uniform(0.21 + REACH, far, (60, 1)) * directions(rng, 60)
    tracker = mesh.tracker(points)
    assert np.all(tracker.vertex < 0)
    came, drift = 0, np.zeros(3)
    for longest in ways:
        inward = -points / np.linalg.norm(points, axis=1, keepdims=True)
        step = inward + rng.uniform(0, 1) * directions(rng, 60)
        way = rng.uniform(0, longest, 60)
        points += way[:, None] * step / np.linalg.norm(step, axis=1, keepdims=True)
        if rng.uniform() < share:  # the skin moves too
            turn = trimesh.transformations.rotation_matrix(longest, rng.normal(size=3))[:3, :3]
            mesh.vertices = np.ascontiguousarray(mesh.vertices @ turn.T)
        drift = drift + rng.normal(scale=0.1, size=3)
        turned = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))[:3, :3]
        mesh.update(tracker, points, turned, drift)
        nearest = mesh.distances(points).min(axis=1)
        assert np.all(nearest[tracker.vertex < 0] >= MARGIN - 1e-12)
        outside = np.linalg.norm(points, axis=1) > 0.2
        assert np.all(tracker.gap[outside] <= np.maximum(nearest[outside], REACH))
        came += np.count_nonzero(nearest < MARGIN)
        points[~outside] *= far / np.linalg.norm(points[~outside], axis=1, keepdims=True)
        if not outside.all():
            tracker, drift = mesh.tracker(points), np.zeros(3)
    assert came > 0 or sum(ways) < 1.0


def test_a_point_that_leaves_is_freed_and_found_again():
    mesh = Mesh(ball(0.2))
    heights = [0.01, 0.8 * REACH, 0.98 * REACH, 1.2 * REACH, 2 * REACH, 0.3, 0.019, -0.005]
    points = np.array([[0.0, 0.0, 0.2 + heights[0]]])
    tracker = mesh.tracker(points)
    for height in heights[1:]:
        points[0, 2] = 0.2 + height
        mesh.update(tracker, points)
        assert tracker.gap[0] <= height
        if not REACH < height < 2 * REACH:  # freed when next it is looked for, at the latest
            assert (tracker.vertex[0] >= 0) == (height < REACH)
    assert tracker.gap[0] == pytest.approx(-0.005, abs=1e-3)


@varied
@given(seeds, st.floats(0.008, 0.03))
def test_a_touching_point_keeps_its_side_of_a_thin_part(seed, half):
    """Pressed through a plate, past its middle and towards another one, with a search a step."""
    plate, other = ellipsoid(0.15, 0.15, half), ellipsoid(0.15, 0.15, half, (0, 0, -2.2 * half))
    mesh = Mesh(plate, other)
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-0.04, 0.04, (30, 2)), np.full(30, half + 0.002)])
    tracker = mesh.tracker(points)
    start, lowest = points[:, 2].copy(), rng.permutation(np.linspace(-1.7, 0.9, 30)) * half
    for share in np.linspace(0, 1, 60):
        points[:, :2] += rng.uniform(-0.001, 0.001, (30, 2))
        points[:, 2] = start + share * (lowest - start)
        mesh.search(tracker, points)
        assert np.all(mesh.part[tracker.vertex] == 0)
        assert np.all(tracker.normal[:, 2] > 0.8)
    nearest = mesh.distances(points).argmin(axis=1)
    assert np.any(mesh.part[nearest] == 1)
    assert np.any((mesh.part[nearest] == 0) & (mesh.normals[nearest, 2] < 0))
    height = half * np.sqrt(1 - (points[:, :2] ** 2).sum(axis=1) / 0.15**2)
    assert tracker.gap == pytest.approx(points[:, 2] - height, abs=0.15 * half)


def test_touching_points_slide_along_a_limb_on_their_own_side():
    """A flat limb, pressed past its middle: the point goes along it with its surface."""
    mesh = Mesh(ellipsoid(0.3, 0.06, 0.02))
    points = np.array([[-0.15, 0.0, -0.004]])  # 4 mm beyond the middle
    tracker = SurfaceTracker(1, *mesh.rings)
    above = points + np.array([0.0, 0.0, 0.03])
    mesh.search(tracker, above)
    for height in np.linspace(0.03, 0, 40):
        mesh.search(tracker, points + np.array([0.0, 0.0, height]))
    for x in np.linspace(-0.15, 0.15, 120):
        points[0, 0] = x
        mesh.search(tracker, points)
        followed = mesh.vertices[tracker.vertex[0]]
        assert followed[2] > 0 and abs(followed[0] - x) < 0.02
    assert tracker.gap[0] < -0.015


def test_a_free_point_between_two_parts_goes_to_the_nearer_with_the_next_search():
    mesh = Mesh(ball(0.1), ball(0.1, (0.24, 0.0, 0.0)))
    points = np.array([[0.11, 0.0, 0.0]])
    tracker = mesh.tracker(points)
    assert mesh.part[tracker.vertex[0]] == 0
    points[0, 0] = 0.135
    mesh.search(tracker, points)
    assert mesh.part[tracker.vertex[0]] == 1
    assert tracker.gap[0] == pytest.approx(0.005, abs=1e-3)
