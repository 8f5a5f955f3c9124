"""The neighbour lists, updated step by step, against a search over all pairs."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from simcore.body.skeleton import segment_placements
from simcore.body.skin import blend, vertex_normals
from simcore.body.skin_listed import blend_listed, normal_turn_rate, segment_balls
from simcore.contact.neighbours import Neighbours
from simcore.contact.penalty import penalty_forces
from simcore.contact.reference import find_penetration

RADIUS = 0.03


class Pair:
    """A body and a device that are moved at will."""

    def __init__(self, scene, radius=RADIUS):
        self.model, self.skin = scene.body.model, scene.body.skin
        self.data = self.model.createData()
        self.points = scene.device.surface.contact_points
        self.radius = radius
        skin, (centre, ball) = self.skin, segment_balls(self.skin, 18)
        self.lists = Neighbours(
            self.points, skin.influence_offsets, skin.influence_segment, skin.ring_offsets,
            skin.ring_next, normal_turn_rate(skin, ball), centre, ball, radius,
        )
        self.vertices = np.zeros((skin.vertex_count, 3))
        start = scene.device.motion(0.0)
        self.rotation, self.position = start.rotation.copy(), start.position.copy()
        self.q = scene.configuration.copy()
        self.q[:3] -= 0.009 * start.rotation @ [-0.5, 0, 1]  # pressed in, so that much touches

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
        expected = dict(zip(found.device_vertex, found.skin_vertex, strict=True))
        depths = dict(zip(found.device_vertex, found.depth, strict=True))
        normals = vertex_normals(self.skin, self.vertices)
        seen = {}
        for row, k in enumerate(lists.rows):
            candidates = lists.candidates[lists.offsets[row] : lists.offsets[row + 1]]
            distance = np.linalg.norm(self.vertices[candidates] - world[k], axis=1)
            i = candidates[distance.argmin()]
            depth = normals[i] @ (self.vertices[i] - world[k])
            if distance.min() <= self.radius and depth > 0:
                seen[k] = i
                assert depth == pytest.approx(depths[k], abs=1e-12)
        assert seen == expected

        still, force = np.zeros(3), np.zeros((len(skin), 3))
        depth_sum = np.zeros(len(skin))  # the law with k = 1 and nothing else adds up depths
        count, depth_max, deepest = penalty_forces(
            lists.rows, lists.offsets, lists.candidates, lists.listed, self.vertices,
            np.zeros_like(skin), self.skin.ring_offsets, self.skin.ring_next, self.points,
            self.rotation, self.position, still, still, 1.0, 0.0, 0.0, 1.0, self.radius, force,
            depth_sum,
        )
        by_vertex = np.bincount(found.skin_vertex, found.depth, len(skin))
        assert count == len(found.depth)
        assert np.abs(depth_sum - by_vertex).max() < 1e-12
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
    assert pair.lists.rebuilds.max() <= 3
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
