"""The neighbour lists, updated step by step, against a search over all pairs."""

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from simcore.body.skeleton import segment_placements
from simcore.body.skin import blend, build_skin, vertex_normals
from simcore.body.skin_listed import blend_listed, edge_change_rate, segment_balls, skin_parts
from simcore.contact import neighbours
from simcore.contact.device_patches import device_points
from simcore.contact.neighbours import Neighbours
from simcore.contact.penalty import find_contacts
from simcore.contact.reference import Penetration, find_penetration
from simcore.contact.segment_motion import write_relative
from simcore.contact.skin_kinds import skin_kinds
from simcore.scene import posed_skin

RADIUS = 0.03


def lists_of(device, skin, rest, segment_count, radius):
    parts = skin_parts(skin, segment_count, 0.12)
    rings = skin.ring_offsets, skin.ring_next
    return Neighbours(
        device, skin_kinds(skin.influence_offsets, parts.of_influence, *rings),
        (parts.offsets, parts.centre, parts.radius), rings,
        edge_change_rate(skin, rest, parts.of_influence, parts.radius), radius,
    )


def contacts_of(lists, device, skin, vertices, radius):
    """Return what contact finds with the lists, by device point."""
    outward = np.full_like(vertices, np.nan)
    point, vertex, depth, touched = find_contacts(
        lists.patches, lists.first, lists.last, lists.near, device.patches.points,
        device.patches.vertex, vertices, skin.ring_offsets, skin.ring_next, radius, outward,
    )
    assert np.array_equal(np.sort(touched), np.unique(vertex))
    order = np.argsort(point)
    return Penetration(point[order], vertex[order], depth[order], outward[vertex[order]])


def assert_same(ours, found):
    assert np.array_equal(ours.device_vertex, found.device_vertex)
    assert np.array_equal(ours.skin_vertex, found.skin_vertex)
    assert np.abs(ours.depth - found.depth).max(initial=0) < 1e-12
    assert np.abs(ours.normal - found.normal).max(initial=0) < 1e-9


class Pair:
    """A body and a device that are moved at will."""

    def __init__(self, scene, radius=RADIUS):
        self.model, self.skin = scene.body.model, scene.body.skin
        self.data = self.model.createData()
        self.points = scene.surface.contact_points
        self.radius = radius
        rest = posed_skin(scene.body, scene.body.rest_configuration)
        self.device = device_points(self.points)
        self.lists = lists_of(self.device, self.skin, rest, 18, radius)
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
        segments = np.empty((len(positions), 3, 4))
        write_relative(rotations, positions, self.rotation, self.position, segments)
        rotations, positions = segments[:, :, :3].copy(), segments[:, :, 3].copy()

        def pose(poses, indices):
            blend_listed(
                indices, self.skin.influence_offsets, self.skin.influence_segment,
                self.skin.influence_weight, self.skin.influence_point, poses[:, :, :3],
                poses[:, :, 3], self.vertices,
            )

        self.lists.update(segments, pose, self.vertices)
        self.vertices[:] = np.nan  # only what is listed may be needed
        pose(segments, self.lists.listed)
        ours = contacts_of(self.lists, self.device, self.skin, self.vertices, self.radius)

        skin = blend(self.skin, rotations, positions)
        found = find_penetration(skin, vertex_normals(self.skin, skin), self.points, self.radius)
        assert_same(ours, found)
        return len(found.depth)


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


@pytest.mark.parametrize("ahead, most", [(0.0, 12), (neighbours.AHEAD, 8)])
def test_lists_made_ahead_last_longer(scene, monkeypatch, ahead, most):
    monkeypatch.setattr(neighbours, "AHEAD", ahead)
    pair, steady = Pair(scene), np.zeros(scene.body.model.nv)
    steady[0] = 2e-4
    for _ in range(200):
        pair.move(steady)
        pair.check()
    # Lists live for 20 updates from where they are made for, the first for less.
    assert most - 3 < pair.lists.rebuilds[0] <= most


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
    device = device_points(points)
    lists = lists_of(device, skin, np.array(stone.vertices), 1, radius)
    centre, _ = segment_balls(skin, 1)
    vertices = np.zeros_like(skin.influence_point)
    turn, seen = np.eye(3), set()
    for _ in range(60):
        spin = rng.normal(size=3)
        turn = Rotation.from_rotvec(4e-3 * spin / np.linalg.norm(spin)).as_matrix() @ turn
        posed = (skin.influence_point - centre) @ turn.T + centre
        position = (centre - centre @ turn.T).reshape(1, 3)

        def pose(poses, indices):
            points = skin.influence_point[indices]
            vertices[indices] = points @ poses[0, :, :3].T + poses[0, :, 3]

        lists.update(np.concatenate([turn[None], position[..., None]], axis=2), pose, vertices)
        vertices[:] = np.nan
        vertices[lists.listed] = posed[lists.listed]
        found = find_penetration(posed, vertex_normals(skin, posed), points, radius)
        assert_same(contacts_of(lists, device, skin, vertices, radius), found)
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
