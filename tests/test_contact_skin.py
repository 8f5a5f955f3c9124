"""The listed-vertex path between joints and skin against the path over all vertices."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    normal_turn_rate,
    segment_balls,
    torque_of_wrenches,
    wrench_listed,
)

seeds = st.integers(0, 2**32 - 1)
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
    placed, vertices, velocities = (np.full_like(expected, 7.0) for _ in range(3))
    frames = state.rotations, state.positions
    blend_listed(state.listed, *state.influences, *frames, placed)
    blend_motion_listed(
        state.listed, *state.influences, *frames, state.local, vertices, velocities
    )
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


@pytest.mark.parametrize("posture", ["seated", "random"])
@pytest.mark.parametrize("size", [1e-4, 1e-3, 5e-3])
def test_normals_never_turn_faster_than_their_bound(scene, posture, size):
    """The inner lists rest on it; `size` is the motion of the skin [m]."""
    body, rng = scene.body, np.random.default_rng(8)
    model, skin = body.model, body.skin
    _, radius = segment_balls(skin, 18)
    rate = normal_turn_rate(skin, radius)
    joints = [model.joints[j] for j in range(1, model.njoints)]
    data, worst = model.createData(), 0.0

    def posed(q):
        pin.forwardKinematics(model, data, q)
        return blend(skin, *segment_placements(model, data))

    for trial in range(34):
        q = scene.configuration
        if posture == "random":
            q = pin.integrate(model, body.rest_configuration, rng.uniform(-0.7, 0.7, model.nv))
        v = np.zeros(model.nv)
        joint = joints[trial % 18]  # one joint in the first half, all in the second
        part = slice(joint.idx_v, joint.idx_v + joint.nv) if trial < 18 else slice(None)
        v[part] = rng.normal(size=model.nv)[part]
        before = posed(q)
        v *= size / np.linalg.norm(posed(pin.integrate(model, q, 1e-6 * v)) - before, axis=1).max()
        after = posed(pin.integrate(model, q, 1e-6 * v))
        moved = np.linalg.norm(after - before, axis=1).max()
        old, new = vertex_normals(skin, before), vertex_normals(skin, after)
        turned = 2 * np.arcsin(np.linalg.norm(new - old, axis=1) / 2)
        worst = max(worst, (turned / (rate * moved)).max())
    assert worst < 1
    assert worst > 0.02  # the motions did turn normals
