"""The listed-vertex path between joints and skin against the path over all vertices."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.body import build_body
from simcore.body.segments import PARENTS
from simcore.body.skeleton import segment_placements, segment_velocities
from simcore.body.skin import (
    blend,
    blend_velocity,
    joint_torque,
    vertex_normals,
    wrench_on_segments,
)
from simcore.body.skin_listed import (
    blend_listed,
    blend_motion_listed,
    blend_velocity_listed,
    edge_change_rate,
    segment_balls,
    skin_parts,
    torque_of_wrenches,
    wrench_listed,
)
from simcore.contact.normals import normal_and_bend
from simcore.scene import posed_skin

seeds = st.integers(0, 2**32 - 2)
varied = settings(max_examples=15, deadline=None)


class Moving:
    """The body in a random state, and a random list of its vertices."""

    def __init__(self, body, seed):
        rng = np.random.default_rng(seed)
        self.model, self.skin, self.rng = body.model, body.skin, rng
        self.data = self.model.createData()
        self.q = pin.integrate(
            self.model, pin.neutral(self.model), rng.uniform(-1.5, 1.5, self.model.nv)
        )
        self.v = rng.normal(size=self.model.nv)
        pin.forwardKinematics(self.model, self.data, self.q, self.v)
        self.rotations, self.positions = segment_placements(self.model, self.data)
        self.local = np.array([each.vector for each in self.data.v[1:]])
        n = self.skin.vertex_count
        self.listed = np.flatnonzero(rng.random(n) < rng.random() ** 2)
        self.others = np.setdiff1d(np.arange(n), self.listed)
        self.influences = (
            self.skin.influence_offsets, self.skin.influence_segment, self.skin.influence_weight,
            self.skin.influence_point,
        )

    def forces(self):
        """Random forces on the listed vertices, zero elsewhere."""
        forces = np.zeros((self.skin.vertex_count, 3))
        forces[self.listed] = self.rng.normal(size=(len(self.listed), 3))
        return forces

    def torque(self, forces):
        wrench = np.full((18, 6), np.nan)
        wrench_listed(self.listed, *self.influences, self.rotations, forces, wrench)
        joints = [self.model.joints[j] for j in range(1, self.model.njoints)]
        torque = np.full(self.model.nv, np.nan)
        torque_of_wrenches(
            wrench, self.positions, pin.computeJointJacobians(self.model, self.data, self.q),
            np.array(PARENTS), np.array([j.idx_v for j in joints]),
            np.array([j.nv for j in joints]), torque,
        )
        return wrench, torque


@varied
@given(seeds)
def test_listed_vertices_move_as_all_do_and_others_are_left(coarse_body, seed):
    state = Moving(coarse_body, seed)
    expected = blend(state.skin, state.rotations, state.positions)
    velocity = blend_velocity(
        state.skin, state.rotations, *segment_velocities(state.model, state.data)
    )
    placed, vertices, velocities, alone = (np.full_like(expected, 7.0) for _ in range(4))
    frames = state.rotations, state.positions
    blend_listed(state.listed, *state.influences, *frames, placed)
    blend_motion_listed(
        state.listed, *state.influences, *frames, state.local, vertices, velocities
    )
    blend_velocity_listed(state.listed, *state.influences, state.rotations, state.local, alone)
    assert np.array_equal(alone, velocities)
    for seen, right in ((placed, expected), (vertices, expected), (velocities, velocity)):
        assert np.abs(seen - right)[state.listed].max(initial=0) < 1e-12
        assert np.all(seen[state.others] == 7.0)


@varied
@given(seeds)
def test_listed_forces_give_the_wrenches_torques_and_power_of_all(coarse_body, seed):
    """f · v̇ = τ · q̇, whatever was in the wrench and torque before."""
    state = Moving(coarse_body, seed)
    forces = state.forces()
    forces_read = forces.copy()
    forces_read[state.others] = np.nan  # not to be read
    wrench, torque = state.torque(forces_read)
    scale = np.abs(forces).sum() + 1
    assert np.abs(
        wrench - wrench_on_segments(state.skin, state.rotations, forces)
    ).max() < 1e-13 * scale
    assert np.abs(
        torque - joint_torque(state.skin, state.model, state.data, state.q, forces)
    ).max() < 1e-12 * scale
    velocity = blend_velocity(
        state.skin, state.rotations, *segment_velocities(state.model, state.data)
    )
    power = np.sum(forces * velocity)
    size = np.linalg.norm(forces) * np.linalg.norm(velocity[state.listed]) + 1e-12
    assert abs(power - torque @ state.v) < 1e-10 * size
    assert np.abs(wrench[:, :3].sum(axis=0) - forces.sum(axis=0)).max() < 1e-12 * scale


def test_balls_hold_the_skin_of_their_segment(coarse_body):
    skin = coarse_body.skin
    centre, radius = segment_balls(skin, 18)
    arm = skin.influence_point - centre[skin.influence_segment]
    assert np.all(np.linalg.norm(arm, axis=1) <= radius[skin.influence_segment] + 1e-15)


def test_parts_are_short_and_hold_the_skin_of_their_segment(coarse_body):
    skin = coarse_body.skin
    parts = skin_parts(skin, 18, 0.12)
    segment = np.repeat(np.arange(18), np.diff(parts.offsets))
    assert np.array_equal(segment[parts.of_influence], skin.influence_segment)
    arm = skin.influence_point - parts.centre[parts.of_influence]
    assert np.all(np.linalg.norm(arm, axis=1) <= parts.radius[parts.of_influence] + 1e-15)
    for j in range(18):
        own = skin.influence_point[skin.influence_segment == j]
        axis = np.ptp(own, axis=0).argmax()
        for part in range(parts.offsets[j], parts.offsets[j + 1]):
            assert np.ptp(skin.influence_point[parts.of_influence == part][:, axis]) <= 0.12


def worst_turn(body, configurations, rng, size):
    """Largest move of a vertex normal over what its bound allows, over random motions.

    The motion of the skin is the bound that the neighbour lists spend: of any point in the ball of
    any segment that moves the vertex or its one-ring.
    """
    model, skin = body.model, body.skin
    centre, radius = segment_balls(skin, 18)
    rest = posed_skin(body, body.rest_configuration)
    rate = edge_change_rate(skin, rest, skin.influence_segment, radius)
    owner = np.repeat(np.arange(skin.vertex_count), np.diff(skin.influence_offsets))
    middle = np.repeat(np.arange(skin.vertex_count), np.diff(skin.ring_offsets))
    data, worst = model.createData(), 0.0

    def posed(q):
        pin.forwardKinematics(model, data, q)
        return segment_placements(model, data)

    for trial, q in enumerate(configurations):
        joint = model.joints[1 + trial // 2 % 18]  # one joint and all of them in turn
        part = slice(joint.idx_v, joint.idx_v + joint.nv) if trial % 2 else slice(None)
        v = np.zeros(model.nv)
        v[part] = rng.normal(size=model.nv)[part]
        before = posed(q)
        skin_before = blend(skin, *before)
        nudge = blend(skin, *posed(pin.integrate(model, q, 1e-6 * v))) - skin_before
        v *= 1e-6 * size / np.linalg.norm(nudge, axis=1).max()
        after = posed(pin.integrate(model, q, v))
        turn, shift = after[0] - before[0], after[1] - before[1]
        of_segment = np.linalg.norm(np.einsum("jab,jb->ja", turn, centre) + shift, axis=1)
        of_segment += np.linalg.norm(turn, axis=(1, 2)) / np.sqrt(2) * radius
        of_vertex = np.full(skin.vertex_count, 1e-15)
        np.maximum.at(of_vertex, owner, of_segment[skin.influence_segment])
        motion = of_vertex.copy()
        np.maximum.at(motion, middle, of_vertex[skin.ring_next[:, 0]])
        old, new = (vertex_normals(skin, each) for each in (skin_before, blend(skin, *after)))
        moved = np.linalg.norm(new - old, axis=1)
        bound = [
            motion[i]
            * normal_and_bend(skin_before, i, skin.ring_offsets, skin.ring_next, rate[i])[3]
            for i in range(skin.vertex_count)
        ]
        worst = max(worst, (moved / bound)[motion > 1e-9].max())
    return worst


@pytest.mark.parametrize("size", [1e-4, 1e-3, 5e-3])
def test_normals_of_a_seated_body_turn_within_their_bound(scene, size):
    """The inner lists rest on it; `size` is the motion of the skin [m]."""
    worst = worst_turn(scene.body, [scene.configuration] * 36, np.random.default_rng(8), size)
    assert 0.02 < worst < 1  # and the motions did turn normals


def test_normals_of_a_bent_fine_skin_turn_within_their_bound(design_with):
    body = build_body(design_with(skin_vertices=14_000).body, "fine")
    model, rng = body.model, np.random.default_rng(5)
    bent = [
        pin.integrate(model, body.rest_configuration, rng.uniform(-1.5, 1.5, model.nv))
        for _ in range(36)
    ]
    assert worst_turn(body, bent, rng, 1e-3) < 1
