"""Eqs. 6 and 7 against closed forms on a plate, and their symmetries on a sphere."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from simcore.body.skin import build_skin
from simcore.contact.device_patches import build_patches
from simcore.contact.penalty import SIDEWAYS, find_contacts, penalty_forces
from simcore.contact.reference import find_penetration

K, C, F_C, EPSILON, RADIUS = 1000.0, 5.0, 0.5, 0.1, 0.03
seeds = st.integers(0, 2**32 - 2)


@dataclass(frozen=True)
class Touch:
    """A skin and a device in contact, every skin vertex a candidate of every device vertex."""

    vertices: np.ndarray
    faces: np.ndarray
    velocities: np.ndarray
    points: np.ndarray
    rotation: np.ndarray
    position: np.ndarray
    linear: np.ndarray
    angular: np.ndarray
    law: tuple = (K, C, F_C, EPSILON)

    def __call__(self):
        """Return force (n, 3), normal force (n,), count, greatest depth, its vertex."""
        n, patches = len(self.vertices), build_patches(self.points)
        skin = build_skin(
            self.vertices, self.faces, np.ones((n, 1)), np.zeros((1, 3)), np.eye(3)[None]
        )
        count = len(patches.vertex)
        outward = np.full((n, 3), np.nan)
        point, vertex, depth, touched = find_contacts(
            np.arange(count), np.zeros(count, np.int64), np.full(count, n), np.arange(n),
            patches.points, patches.vertex, (self.vertices - self.position) @ self.rotation,
            skin.ring_offsets, skin.ring_next, RADIUS, outward,
        )
        force, normal = np.zeros((n, 3)), np.zeros(n)
        force[touched], normal[touched] = np.nan, np.nan
        on_point, deepest, fastest = penalty_forces(
            point, vertex, depth, touched, self.velocities @ self.rotation, outward, self.points,
            self.rotation, self.linear, self.angular, *self.law, force, normal, np.zeros((n, 3)),
        )
        assert on_point.sum() == pytest.approx(normal.sum(), rel=1e-12, abs=1e-12)
        told = (depth[deepest], vertex[deepest]) if len(point) else (0.0, -1)
        return force, normal, len(point), *told, fastest


def touch(mesh, points, **changes):
    vertices = np.array(mesh.vertices)
    still = {
        "velocities": np.zeros_like(vertices), "rotation": np.eye(3), "position": np.zeros(3),
        "linear": np.zeros(3), "angular": np.zeros(3),
    }
    return Touch(
        vertices, mesh.faces.astype(np.int32), points=np.atleast_2d(points).astype(float),
        **still | changes,
    )


@pytest.fixture(scope="module")
def plate():
    """The underside of a body at z = 0: 5 × 5 vertices 10 mm apart, normals down."""
    x, y = np.meshgrid(np.arange(5.0) * 0.01, np.arange(5.0) * 0.01, indexing="ij")
    index = np.arange(25).reshape(5, 5)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, c, b), (a, d, c))])
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(25)])
    return trimesh.Trimesh(vertices, faces, process=False)


MIDDLE = 12
UNDER = np.array([0.021, 0.019])
"""Nearest to the plate's middle vertex."""


def under(z):
    return [*UNDER, z]


def moving(plate, velocity):
    return np.tile(velocity, (len(plate.vertices), 1)).astype(float)


def random_touch(seed):
    """A sphere dented by a cloud of device vertices, everything in motion."""
    rng = np.random.default_rng(seed)
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    unit = rng.normal(size=(30, 3))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    turn, shift = Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3)
    world = rng.uniform(0.08, 0.11, size=(30, 1)) * unit
    return touch(
        sphere, (world - shift) @ turn, rotation=turn, position=shift,
        velocities=rng.normal(scale=0.2, size=(len(sphere.vertices), 3)),
        linear=rng.normal(scale=0.2, size=3), angular=rng.normal(size=3),
    )


# Eq. 6


@pytest.mark.parametrize("depth", [1e-6, 0.004, 0.019])
def test_penalty_pushes_the_skin_out_of_the_device(plate, depth):
    force, normal, count, depth_max, deepest, fastest = touch(plate, under(depth))()
    expected = np.zeros((25, 3))
    expected[MIDDLE, 2] = K * depth  # up, into the body, away from the device below
    assert np.abs(force - expected).max() < 1e-12
    assert normal[MIDDLE] == pytest.approx(K * depth, rel=1e-12)
    assert (count, deepest, fastest) == (1, MIDDLE, 0.0)
    assert depth_max == pytest.approx(depth, rel=1e-12)


@pytest.mark.parametrize("z", [0.0, -1e-9, -0.01, 0.0301, 0.5])
def test_no_force_outside_or_beyond_the_search_radius(plate, z):
    force, normal, *told = touch(plate, under(z))()
    assert not force.any()
    assert not normal.any()
    assert told == [0, 0.0, -1, 0.0]


@pytest.mark.parametrize("speed", [-0.3, -0.01, 0.01, 0.3])
def test_normal_damping_resists_and_never_pulls(plate, speed):
    """The skin sinks on to the device with `speed` < 0 or rises from it."""
    force, normal, *_ = touch(
        plate, under(0.001), velocities=moving(plate, [0, 0, speed])
    )()
    expected = max(K * 0.001 - C * speed, 0)
    assert normal[MIDDLE] == pytest.approx(expected, abs=1e-12)
    assert np.abs(force[MIDDLE] - [0, 0, expected]).max() < 1e-12


def test_depth_on_a_sphere_is_what_the_radius_lacks():
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    vertex = sphere.vertices[[3, 17, 40]]
    force, normal, count, *_ = touch(sphere, vertex * [[0.95], [0.9], [1.01]])()
    assert count == 2
    assert normal[[3, 17, 40]] == pytest.approx([K * 0.005, K * 0.01, 0], rel=1e-3)
    inward = -force[[3, 17]] / np.linalg.norm(force[[3, 17]], axis=1)[:, None]
    assert np.abs(inward - vertex[:2] / 0.1).max() < 0.02  # a vertex normal of an icosphere
    found = find_penetration(
        sphere.vertices, sphere.vertices / 0.1, vertex * [[0.95], [0.9], [1.01]], RADIUS
    )
    assert found.skin_vertex.tolist() == [3, 17]
    assert found.depth == pytest.approx([0.005, 0.01], rel=1e-12)


# Eq. 7


@pytest.mark.parametrize("speed", [1e-6, 0.02, 0.0999, 0.1, 0.1001, 0.5, 7.0])
@pytest.mark.parametrize("sinking", [0.0, -0.1, 3.0])
def test_friction_is_linear_up_to_epsilon_and_then_constant(plate, speed, sinking):
    """Tangential only: neither magnitude nor direction sees the normal speed."""
    along = np.array([0.6, -0.8, 0])
    velocity = speed * along + [0, 0, sinking]
    force, *_ = touch(plate, under(0.002), velocities=moving(plate, velocity))()
    expected = -F_C * min(speed / EPSILON, 1) * along
    assert np.abs(force[MIDDLE, :2] - expected[:2]).max() < 1e-12
    *_, fastest = touch(plate, under(0.002), velocities=moving(plate, velocity))()
    assert fastest == pytest.approx(np.hypot(sinking, SIDEWAYS * speed), rel=1e-9)


def test_friction_drags_the_skin_with_the_device(plate):
    """A device turning about an axis through its origin drags by ω × r, and that fast."""
    force, *_, fastest = touch(plate, under(0.002), angular=np.array([0, 0, 2.0]))()
    drag = 2.0 * np.array([-UNDER[1], UNDER[0]])  # below ε
    assert fastest == pytest.approx(SIDEWAYS * np.linalg.norm(drag), rel=1e-12)
    assert np.abs(force[MIDDLE, :2] - F_C / EPSILON * drag).max() < 1e-12


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_common_rigid_motion_gives_no_friction_and_no_damping(seed):
    """The skin moves as the device's continuation does, at the contacts' own points."""
    case, rng = random_touch(seed), np.random.default_rng(seed)
    linear, angular = rng.normal(size=3), np.zeros(3)
    case = replace(case, linear=linear, angular=angular, velocities=np.tile(
        linear, (len(case.vertices), 1)))
    force, normal, *_ = case()
    still, *_ = replace(
        case, linear=np.zeros(3), velocities=np.zeros_like(case.velocities), law=(K, 0, 0, 1)
    )()
    assert np.abs(force - still).max() < 1e-10
    assert np.linalg.norm(force, axis=1) == pytest.approx(normal, abs=1e-10)


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_turning_together_gives_no_friction_at_coincident_points(seed):
    """v − p is not zero in a contact; along it a common turn moves the two apart by ω × d only."""
    case, rng = random_touch(seed), np.random.default_rng(seed)
    linear, angular = rng.normal(size=3), rng.normal(size=3)
    radius = 0.1 - 1e-7  # a hair inside every vertex
    world = case.vertices[:40] * radius / 0.1
    case = replace(
        case, points=(world - case.position) @ case.rotation, linear=linear, angular=angular,
        velocities=linear + np.cross(angular, case.vertices - case.position),
    )
    force, _, count, *_ = case()
    assert count == 40
    bound = 40 * 1e-7 * (K + np.linalg.norm(angular) * (C + F_C / EPSILON))
    assert np.abs(force).max() < bound


# Both


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_forces_turn_with_the_frame(seed):
    case, rng = random_touch(seed), np.random.default_rng(seed + 1)
    turn, shift = Rotation.random(random_state=seed + 1).as_matrix(), rng.normal(size=3)
    moved = replace(
        case, vertices=case.vertices @ turn.T + shift, velocities=case.velocities @ turn.T,
        rotation=turn @ case.rotation, position=turn @ case.position + shift,
        linear=turn @ case.linear, angular=turn @ case.angular,
    )
    force, normal, count, depth, deepest, fastest = case()
    turned, turned_normal, *told = moved()
    assert np.abs(turned - force @ turn.T).max() < 1e-9 * max(1, np.abs(force).max())
    assert turned_normal == pytest.approx(normal, abs=1e-9)
    assert told[0] == count > 0
    assert told[1] == pytest.approx(depth, abs=1e-12)
    assert told[2] == deepest
    assert told[3] == pytest.approx(fastest, abs=1e-12)


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_contacts_add_up_and_lose_energy(seed):
    """Each device vertex carries the reaction of what it does alone; drag only takes power."""
    case = random_touch(seed)
    force, normal, count, *_ = case()
    alone = [replace(case, points=case.points[k : k + 1])() for k in range(len(case.points))]
    assert np.abs(sum(each[0] for each in alone) - force).max() < 1e-10
    assert np.abs(sum(each[1] for each in alone) - normal).max() < 1e-10
    assert sum(each[2] for each in alone) == count
    for k, (each, *_) in enumerate(alone):
        dragged = each - replace(case, points=case.points[k : k + 1], law=(K, 0, 0, 1))()[0]
        arm = case.rotation @ case.points[k]
        relative = case.velocities - case.linear - np.cross(case.angular, arm)
        assert np.sum(dragged * relative) < 1e-12
