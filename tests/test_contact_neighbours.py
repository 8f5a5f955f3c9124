"""The neighbour lists, updated step by step, against a search over all pairs."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from simcore.body.skeleton import segment_placements
from simcore.body.skin import blend, build_skin, vertex_normals
from simcore.body.skin_listed import blend_listed, edge_change_rate, segment_balls, skin_parts
from simcore.contact.neighbour_grid import device_points
from simcore.contact.neighbours import Neighbours
from simcore.contact.penalty import penalty_forces
from simcore.contact.reference import find_penetration
from simcore.scene import posed_skin

RADIUS = 0.03


def lists_of(points, skin, rest, segment_count, radius):
    parts = skin_parts(skin, segment_count, 0.12)
    return Neighbours(
        device_points(points), skin.influence_offsets, parts.offsets, parts.of_influence,
        parts.centre, parts.radius, skin.ring_offsets, skin.ring_next,
        edge_change_rate(skin, rest, parts.of_influence, parts.radius), radius,
    )


class Pair:
    """A body and a device that are moved at will."""

    def __init__(self, scene, radius=RADIUS):
        self.model, self.skin = scene.body.model, scene.body.skin
        self.data = self.model.createData()
        self.points = scene.surface.contact_points
        self.radius = radius
        rest = posed_skin(scene.body, scene.body.rest_configuration)
        self.lists = lists_of(self.points, self.skin, rest, 18, radius)
        self.vertices = np.zeros((self.skin.vertex_count, 3))
        start = scene.motion(0.0)
        self.rotation, self.position = start.rotation.copy(), start.position.copy()
        self.q = scene.configuration.copy()
        self.q[:3] -= 0.010 * start.rotation @ [-0.5, 0, 1]  # pressed in, so that much touches

    def dof(self, joint):
        each = self.model.joints[self.model.getJointId(joint)]
        return slice(each.idx_v, each.idx_v + each.nv)

    def move(self, v):
        self.q = pin.integrate(self.model, self.q, v)

    def carry(self, turn, shift):
        """Move body and device together."""
        self.rotation = turn @ self.rotation
        self.position = turn @ self.position + shift
        self.q[:3] = turn @ self.q[:3] + shift
        root = Rotation.from_matrix(turn) * Rotation.from_quat(self.q[3:7])
        self.q[3:7] = root.as_quat()

    def check(self):
        """Hold idx(k), contacts and depths to the reference; return the number of contacts."""
        pin.forwardKinematics(self.model, self.data, self.q)
        rotations, positions = segment_placements(self.model, self.data)

        def pose(indices):
            blend_listed(
                indices, self.skin.influence_offsets, self.skin.influence_segment,
                self.skin.influence_weight, self.skin.influence_point, rotations, positions,
                self.vertices,
            )

        device = SimpleNamespace(rotation=self.rotation, position=self.position)
        lists = self.lists
        lists.update(rotations, positions, device, pose, self.vertices)
        self.vertices[:] = np.nan  # only what is listed may be needed
        pose(lists.listed)

        skin = blend(self.skin, rotations, positions)
        world = self.points @ self.rotation.T + self.position
        found = find_penetration(skin, vertex_normals(self.skin, skin), world, self.radius)
        normals = vertex_normals(self.skin, self.vertices)
        row = np.repeat(np.arange(len(lists.rows)), np.diff(lists.offsets))
        way = self.vertices[lists.candidates] - world[lists.rows[row]]
        distance = np.linalg.norm(way, axis=1)
        order = np.lexsort((distance, row))
        first = order[lists.offsets[:-1]]  # the nearest candidate of each row
        index = lists.candidates[first]
        depth = np.einsum("ij,ij->i", normals[index], way[first])
        touch = (distance[first] <= self.radius) & (depth > 0)
        by_device = np.argsort(lists.rows[touch])
        assert np.array_equal(lists.rows[touch][by_device], found.device_vertex)
        assert np.array_equal(index[touch][by_device], found.skin_vertex)
        assert np.abs(depth[touch][by_device] - found.depth).max(initial=0) < 1e-12

        still, force = np.zeros(3), np.zeros((len(skin), 3))
        depth_sum = np.zeros(len(skin))  # the law with k = 1 and nothing else adds up depths
        on_points = np.zeros(len(self.points))
        count, depth_max, deepest, _ = penalty_forces(
            lists.rows, lists.offsets, lists.candidates, lists.listed, self.vertices,
            np.zeros_like(skin), self.skin.ring_offsets, self.skin.ring_next, self.points,
            self.rotation, self.position, still, still, 1.0, 0.0, 0.0, 1.0, self.radius, force,
            depth_sum, np.zeros_like(skin), on_points,
        )
        by_vertex = np.bincount(found.skin_vertex, found.depth, len(skin))
        assert count == len(found.depth)
        assert np.abs(depth_sum - by_vertex).max() < 1e-12
        assert np.abs(on_points[found.device_vertex] - found.depth).max(initial=0) < 1e-12
        assert on_points.sum() == pytest.approx(found.depth.sum(), abs=1e-9)
        assert depth_max == pytest.approx(found.depth.max(initial=0.0), abs=1e-12)
        assert deepest == (found.skin_vertex[found.depth.argmax()] if count else -1)
        return count


def noise(rng, pair, size):
    return size * rng.uniform(-1, 1, pair.model.nv)


def test_small_motion_is_exact_and_rarely_rebuilds(scene):
    pair, rng = Pair(scene), np.random.default_rng(1)
    drift = noise(rng, pair, 1e-4)
    counts = [pair.check()]
    for step in range(150):
        pair.move(drift * np.cos(step / 20) + noise(rng, pair, 2e-5))
        counts.append(pair.check())
    assert min(counts) > 50
    outer, inner = pair.lists.rebuilds
    assert 1 <= outer <= 8
    assert outer < inner < 50  # the inner lists were used up, and yet lived several steps


def test_body_at_rest_never_rebuilds_however_the_device_carries_it(scene):
    pair, rng = Pair(scene), np.random.default_rng(2)
    first = pair.check()
    for _ in range(40):
        pair.carry(Rotation.from_rotvec(rng.normal(size=3)).as_matrix(), rng.normal(size=3))
        assert pair.check() == first
    assert pair.lists.rebuilds.tolist() == [1, 1]


@pytest.mark.parametrize("seed", range(4))
def test_violent_steps_are_exact(scene, seed):
    pair, rng = Pair(scene), np.random.default_rng(seed)
    start, counts = pair.q, []
    for _ in range(30):
        pair.q = start
        pair.move(noise(rng, pair, 10 ** rng.uniform(-4, -0.3)))
        turn = Rotation.from_rotvec(rng.normal(scale=0.03, size=3)).as_matrix()
        pair.rotation = turn @ pair.rotation
        pair.position = pair.position + rng.normal(scale=0.01, size=3)
        counts.append(pair.check())
    assert max(counts) > 30


@pytest.mark.parametrize("direction", [(0, 0, 1), (0.3, 1, 0), (-1, 0, 0)])
def test_leaving_and_coming_back_is_exact(scene, direction):
    """Lifted away, or pulled through the device, to far outside every grid, and back."""
    pair, unit = Pair(scene), np.array(direction) / np.linalg.norm(direction)
    start, first = pair.q.copy(), pair.check()
    gone = 0
    for way in [*np.geomspace(2e-4, 3, 40), 5, *np.geomspace(3, 2e-4, 40), 0]:
        pair.q = start.copy()
        pair.q[:3] += way * unit
        gone += pair.check() == 0
    assert gone > 5
    assert pair.check() == first > 0


def test_swinging_limbs_leave_the_lists_of_the_trunk(scene):
    """A hand in the air may go far before any list is made again."""
    pair = Pair(scene)
    still = pair.q
    pair.check()
    for angle in np.linspace(0, 0.3, 31):
        v = np.zeros(pair.model.nv)
        v[pair.dof("head")] = angle
        pair.q = pin.integrate(pair.model, still, v)
        pair.check()
    assert pair.lists.rebuilds.max() <= 5
    for step in range(60):  # arms through the whole device
        v = np.zeros(pair.model.nv)
        v[pair.dof("upper_arm_left")] = 1.5 * np.sin(np.array([0.2, 0.31, 0.17]) * step)
        v[pair.dof("thigh_right")] = 0.8 * np.sin(np.array([0.13, 0.3, 0.2]) * step)
        pair.q = pin.integrate(pair.model, still, v)
        pair.check()


@pytest.mark.parametrize("radius", [0.02, 0.2])
def test_every_accepted_search_radius_is_exact(scene, radius):
    pair, rng = Pair(scene, radius), np.random.default_rng(5)
    for _ in range(25):
        pair.move(noise(rng, pair, 10 ** rng.uniform(-4, -1.5)))
        pair.check()


def test_slow_creep_uses_up_every_allowance(scene):
    """One joint after another bends at the seat in steps just below the inner allowance."""
    pair, rng = Pair(scene), np.random.default_rng(6)
    for joint in ("pelvis", "lumbar", "thigh_left", "shank_right", "thoracic"):
        v = np.zeros(pair.model.nv)
        v[pair.dof(joint)] = rng.normal(size=pair.dof(joint).stop - pair.dof(joint).start)
        v *= 1e-3 / np.linalg.norm(v)
        for sign in (1, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1):
            pair.move(sign * v)
            pair.check()
    assert pair.lists.rebuilds[0] < pair.lists.rebuilds[1]


@pytest.mark.parametrize("radius", [0.02, 0.2])
@pytest.mark.parametrize("roughness", [0.0, 0.25])
def test_stone_that_rolls_in_place_is_exact(roughness, radius):
    """One rigid segment turns about the centre of its ball, which stays where it is.

    On a rough stone n is far from v − p, and d = 0 far from the skin: contacts come and go by the
    turn of normals alone.
    """
    rng = np.random.default_rng(11)
    stone = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    stone.vertices *= 1 + roughness * rng.uniform(-1, 1, (len(stone.vertices), 1))
    skin = build_skin(
        np.array(stone.vertices), stone.faces, np.ones((len(stone.vertices), 1)),
        np.zeros((1, 3)), np.eye(3)[None],
    )
    points = rng.uniform(-0.25, 0.25, (3000, 3))
    lists = lists_of(points, skin, np.array(stone.vertices), 1, radius)
    centre, _ = segment_balls(skin, 1)
    vertices = np.zeros_like(skin.influence_point)
    device = SimpleNamespace(rotation=np.eye(3), position=np.zeros(3))
    turn, seen = np.eye(3), set()
    for _ in range(60):
        spin = rng.normal(size=3)
        turn = Rotation.from_rotvec(4e-3 * spin / np.linalg.norm(spin)).as_matrix() @ turn
        posed = (skin.influence_point - centre) @ turn.T + centre
        position = (centre - centre @ turn.T).reshape(1, 3)

        def pose(indices, posed=posed):
            vertices[indices] = posed[indices]

        lists.update(turn[None], position, device, pose, vertices)
        found = find_penetration(posed, vertex_normals(skin, posed), points, radius)
        assert np.isin(found.device_vertex, lists.rows).all()
        at = {k: row for row, k in enumerate(lists.rows)}
        for k, i in zip(found.device_vertex, found.skin_vertex, strict=True):
            row = at[k]
            assert i in lists.candidates[lists.offsets[row] : lists.offsets[row + 1]]
        seen.add(tuple(found.skin_vertex))
    assert lists.rebuilds[1] < 60
    assert len(seen) > 3


def test_far_contacts_see_normals_turn(scene):
    """200 mm away, d grows by what the normal turns while the skin hardly moves."""
    pair, rng = Pair(scene, 0.2), np.random.default_rng(7)
    pair.q[2] += 0.03
    for _ in range(8):
        axis, start = rng.normal(size=3), pair.q
        for angle in np.linspace(0, 3e-3, 8):
            v = np.zeros(pair.model.nv)
            v[3:6] = angle * axis / np.linalg.norm(axis)
            pair.q = pin.integrate(pair.model, start, v)
            pair.check()
