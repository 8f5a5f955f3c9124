"""Skinning, its velocity and its transpose, on the shipped 70 kg man."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.body import build_body
from simcore.body.skeleton import segment_placements, segment_velocities
from simcore.body.skin import (
    blend,
    blend_velocity,
    joint_torque,
    vertex_normals,
    wrench_on_segments,
)
from simcore.config.designs import BodyDesign

seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def body():
    return build_body(BodyDesign(sex="male", age_years=45, stature_m=1.72, mass_kg=70), "man")


def random_state(body, seed):
    """Configuration, velocity and generator; the root stays within metres of the origin."""
    rng = np.random.default_rng(seed)
    q = pin.integrate(body.model, pin.neutral(body.model), rng.uniform(-1, 1, body.model.nv))
    return q, rng.normal(size=body.model.nv), rng


def posed(body, q):
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, q)
    return blend(body.skin, *segment_placements(body.model, data))


def test_weights_of_each_vertex_sum_to_one(body):
    sums = np.add.reduceat(body.skin.influence_weight, body.skin.influence_offsets[:-1])
    assert np.abs(sums - 1).max() < 1e-14
    assert body.skin.influence_weight.min() >= 0.0099
    assert body.skin.influence_offsets[-1] == len(body.skin.influence_weight)


def test_rest_configuration_gives_the_rest_surface(body):
    """Blending agrees at rest: every influence of a vertex puts it at the same place."""
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, body.rest_configuration)
    rotations, positions = segment_placements(body.model, data)
    skin = body.skin
    placed = (
        np.einsum("kij,kj->ki", rotations[skin.influence_segment], skin.influence_point)
        + positions[skin.influence_segment]
    )
    owner = np.repeat(np.arange(skin.vertex_count), np.diff(skin.influence_offsets))
    vertices = blend(skin, rotations, positions)
    assert np.abs(placed - vertices[owner]).max() < 1e-12
    assert abs(np.ptp(vertices[:, 2]) - 1.72) < 1e-3
    assert abs(vertices[:, 2].min()) < 1e-12


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_skin_follows_a_rigid_motion_of_the_root(body, seed):
    q, _, rng = random_state(body, seed)
    motion = pin.SE3(pin.Quaternion(rng.normal(size=4)).normalized(), rng.normal(size=3))
    moved = q.copy()
    root = pin.SE3(pin.Quaternion(q[3:7]), q[:3])
    moved[:7] = pin.SE3ToXYZQUAT(motion * root)
    expected = posed(body, q) @ motion.rotation.T + motion.translation
    assert np.abs(posed(body, moved) - expected).max() < 1e-12
    normals = vertex_normals(body.skin, posed(body, q))
    assert np.abs(
        vertex_normals(body.skin, expected) - normals @ motion.rotation.T
    ).max() < 1e-9


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_skin_power_equals_joint_power(body, seed):
    """f · v̇ = τ · q̇ for any configuration, velocity and force (duality of Eqs. 11 and 12)."""
    q, v, rng = random_state(body, seed)
    forces = rng.normal(size=(body.skin.vertex_count, 3))
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, q, v)
    rotations, _ = segment_placements(body.model, data)
    velocities = blend_velocity(body.skin, rotations, *segment_velocities(body.model, data))
    skin_power = np.sum(forces * velocities)
    torque = joint_torque(body.skin, body.model, data, q, forces)
    scale = np.linalg.norm(forces) * np.linalg.norm(velocities)
    assert abs(skin_power - torque @ v) < 1e-10 * scale


@settings(max_examples=5, deadline=None)
@given(seeds)
def test_skin_velocity_is_the_derivative_of_the_skin(body, seed):
    q, v, _ = random_state(body, seed)
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, q, v)
    rotations, _ = segment_placements(body.model, data)
    velocities = blend_velocity(body.skin, rotations, *segment_velocities(body.model, data))
    step = 1e-6  # [s]
    ahead = posed(body, pin.integrate(body.model, q, step * v))
    behind = posed(body, pin.integrate(body.model, q, -step * v))
    assert np.abs((ahead - behind) / (2 * step) - velocities).max() < 1e-6


def test_wrench_of_a_force_on_one_vertex(body):
    """The segments' wrenches add up to the force and to its moment about the world origin."""
    q, _, _ = random_state(body, 3)
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, q)
    rotations, positions = segment_placements(body.model, data)
    vertices = blend(body.skin, rotations, positions)
    forces = np.zeros_like(vertices)
    forces[777] = [3.0, -1.0, 2.0]
    wrench = wrench_on_segments(body.skin, rotations, forces)
    assert np.allclose(wrench[:, :3].sum(axis=0), forces[777], atol=1e-12)
    moment = wrench[:, 3:] + np.cross(positions, wrench[:, :3])
    assert np.allclose(moment.sum(axis=0), np.cross(vertices[777], forces[777]), atol=1e-12)


def test_root_torque_is_force_in_world_axes(body):
    """The first three velocities are the root's, in world axes, however it is turned."""
    q, _, rng = random_state(body, 5)
    forces = rng.normal(size=(body.skin.vertex_count, 3))
    torque = joint_torque(body.skin, body.model, body.model.createData(), q, forces)
    assert np.allclose(torque[:3], forces.sum(axis=0), atol=1e-9)


def test_normals_point_outwards_and_rings_are_complete(body):
    vertices = posed(body, body.rest_configuration)
    normals = vertex_normals(body.skin, vertices)
    assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-12
    assert len(body.skin.ring_next) == 3 * len(body.skin.faces)
    corners = vertices[body.skin.faces]
    volume = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    inflated = vertices + 1e-4 * normals
    corners = inflated[body.skin.faces]
    grown = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert grown - volume == pytest.approx(1e-4 * body.skin.vertex_area.sum(), rel=0.02)
