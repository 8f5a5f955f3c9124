"""Posture control: Eq. 2 with its sign mended."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from simcore.dynamics.integrators import rk4_step
from simcore.dynamics.joints import PostureControl
from simcore.joint_torque import joint_gains

seeds = st.integers(0, 2**32 - 2)


@pytest.fixture(scope="module")
def controlled(scene):
    """Model, reference, gains by degree of freedom, and the control."""
    model, reference = scene.body.model, scene.configuration
    gains = joint_gains(model, scene.method.joints)
    return model, reference, *gains, PostureControl(model, reference, *gains)


def dofs(model, name):
    joint = model.joints[model.getJointId(name)]
    return slice(joint.idx_q, joint.idx_q + joint.nq), slice(joint.idx_v, joint.idx_v + joint.nv)


def test_no_torque_in_the_posture_at_rest(controlled):
    model, reference, _, _, control = controlled
    assert np.abs(control.torque(reference, np.zeros(model.nv))).max() < 1e-12


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_no_torque_on_the_root_wherever_it_goes(controlled, seed):
    model, reference, _, _, control = controlled
    rng = np.random.default_rng(seed)
    q = pin.integrate(model, reference, rng.normal(size=model.nv))
    torque = control.torque(q, rng.normal(size=model.nv))
    assert not torque[:6].any()
    assert np.all(torque[6:] != 0)
    moved = q.copy()
    moved[:3] += rng.normal(size=3)
    moved[3:7] = Rotation.random(random_state=seed).as_quat()
    v = rng.normal(size=model.nv)
    other = v.copy()
    other[:6] = rng.normal(size=6)
    assert np.array_equal(control.torque(q, v), control.torque(moved, other))


@settings(max_examples=30, deadline=None)
@given(seeds, st.floats(1e-6, 3.1))
def test_spherical_joint_turns_back_about_the_axis_it_left_by(controlled, seed, angle):
    """Away by R_ref exp(φ) the torque is −k φ in the joint's own axes, for any |φ| < π."""
    model, reference, stiffness, _, control = controlled
    axis = np.random.default_rng(seed).normal(size=3)
    turn = angle * axis / np.linalg.norm(axis)
    in_q, in_v = dofs(model, "thigh_left")
    for sign in (1, -1):  # q and −q are the same rotation
        q = reference.copy()
        q[in_q] = sign * (Rotation.from_quat(q[in_q]) * Rotation.from_rotvec(turn)).as_quat()
        torque = control.torque(q, np.zeros(model.nv))
        assert torque[in_v] == pytest.approx(-stiffness[in_v] * turn, abs=1e-7)
        torque[in_v] = 0
        assert np.abs(torque).max() < 1e-12


def test_hinge_pulls_back_and_damps(controlled):
    model, reference, stiffness, damping, control = controlled
    in_q, in_v = dofs(model, "shank_right")
    q, v = reference.copy(), np.zeros(model.nv)
    q[in_q] += 0.4
    v[in_v] = 3.0
    expected = -0.4 * stiffness[in_v] - 3.0 * damping[in_v]
    assert control.torque(q, v)[in_v] == pytest.approx(expected)
    assert expected < 0


def test_gains_go_to_their_joints(controlled, design_with):
    model, _, stiffness, damping, _ = controlled
    assert not stiffness[:6].any()
    assert not damping[:6].any()
    changed = design_with(
        {f"method.joints.{name}.{gain}": 10.0 * (i + 1) + (gain[0] == "d")
         for i, name in enumerate(("hip", "knee", "neck", "wrist"))
         for gain in ("stiffness_nm_per_rad", "damping_nms_per_rad")}
    )
    stiffness, damping = joint_gains(model, changed.method.joints)
    for i, name in enumerate(("thigh", "shank", "head", "hand")):
        for side in ("_left", "_right") if name != "head" else ("",):
            _, in_v = dofs(model, name + side)
            assert np.all(stiffness[in_v] == 10 * (i + 1))
            assert np.all(damping[in_v] == 10 * (i + 1) + 1)


def swing(model, control, q, v, duration, steps):
    """Move freely under the control alone; return q, v."""
    data = model.createData()

    def acceleration(_, q, v):
        return pin.aba(model, data, q, v, control.torque(q, v))

    for _ in range(steps):
        q, v, _ = rk4_step(
            model, acceleration, 0.0, q, v, acceleration(0, q, v), duration / steps
        )
    return q, v


def energy(model, reference, stiffness, q, v):
    """Kinetic energy and ½ Σ k |log(R_refᵀ R)|²."""
    turn = pin.difference(model, reference, q)
    return (
        pin.computeKineticEnergy(model, model.createData(), q, v) + stiffness @ turn**2 / 2
    )


@pytest.fixture(scope="module")
def bent(controlled):
    model, reference, stiffness, damping, _ = controlled
    model = model.copy()
    model.gravity.linear = np.zeros(3)
    rng = np.random.default_rng(9)
    q = pin.integrate(model, reference, np.r_[np.zeros(6), rng.uniform(-0.8, 0.8, model.nv - 6)])
    # Even damping over light and heavy joints would be too stiff for an explicit step.
    return model, reference, stiffness, damping, q


def test_stiffness_alone_conserves_energy(bent):
    """k log(R_refᵀ R) is the gradient of ½ k |log|² only if sign, axes and shortest arc are right;
    fourth order: the drift falls by 2⁴ when the step is halved."""
    model, reference, stiffness, _, q = bent
    control = PostureControl(model, reference, stiffness, np.zeros(model.nv))
    start = energy(model, reference, stiffness, q, np.zeros(model.nv))
    drift = []
    for steps in (50, 100):
        end = swing(model, control, q, np.zeros(model.nv), 0.1, steps)
        assert pin.computeKineticEnergy(model, model.createData(), *end) > 0.02 * start
        drift.append(abs(energy(model, reference, stiffness, *end) - start))
    assert drift[1] < 1e-5 * start
    assert np.log2(drift[0] / drift[1]) > 3.5, drift


def test_damping_takes_energy_all_the_way(bent):
    model, reference, stiffness, damping, q = bent
    control = PostureControl(model, reference, stiffness, damping)
    state, energies = (q, np.zeros(model.nv)), []
    for _ in range(10):
        energies.append(energy(model, reference, stiffness, *state))
        state = swing(model, control, *state, 0.02, 20)
    assert np.all(np.diff(energies) < 0)
