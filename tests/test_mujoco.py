"""Kinematics, dynamics and free fall of the bodies against MuJoCo."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from benchmarks.peers.mujoco_body import MujocoBody, mujoco_body
from simcore.body import build_body
from simcore.body.skeleton import segment_placements, segment_velocities
from simcore.config import BodyDesign, read_design
from simcore.dynamics.integrators import rk4_step

DESIGNS = sorted((Path(__file__).parents[1] / "designs" / "bodies").glob("*.yaml"))
TOLERANCE = 1e-8  # relative; rounding alone leaves about 1e-13
STATES = 20  # of each body
FALL = 0.5  # [s]


@dataclass(frozen=True, eq=False)
class State:
    """One body in one state, as both engines have it."""

    model: pin.Model
    data: pin.Data
    q: np.ndarray
    v: np.ndarray
    torque: np.ndarray
    other: MujocoBody
    found: mujoco.MjData


@pytest.fixture(scope="module", params=DESIGNS, ids=lambda path: path.stem)
def body(request):
    # As shipped: the cache then has them from test_body_build.py, and they cost nothing here.
    return build_body(read_design(BodyDesign, request.param), request.param.stem)


@pytest.fixture(scope="module")
def other(body):
    return mujoco_body(body.model)


@pytest.fixture(scope="module")
def states(body, other):
    """The body anywhere, in any posture, fast, with torques of any kind; MuJoCo has computed."""
    model, rng = body.model, np.random.default_rng(7)

    def state():
        q = pin.integrate(model, body.rest_configuration, rng.uniform(-2, 2, model.nv))
        v, torque = rng.uniform(-6, 6, model.nv), rng.normal(0, 20, model.nv)
        found = other.data_at(q, v)
        found.qfrc_applied = torque[other.v_order]
        mujoco.mj_forward(other.model, found)
        return State(model, model.createData(), q, v, torque, other, found)

    return [state() for _ in range(STATES)]


def mass_matrix(state):
    """Mass matrix by columns of the inverse dynamics.

    Not by `pin.crba`, which needs joints numbered depth first (Pinocchio's issue 1897); the
    arms, which come after the legs, are not.
    """
    model, data, rest = state.model, state.data, np.zeros(state.model.nv)
    weight = pin.rnea(model, data, state.q, rest, rest).copy()
    columns = [pin.rnea(model, data, state.q, rest, unit) - weight for unit in np.eye(model.nv)]
    return np.stack(columns, axis=1)


def inertia_of_dofs(state):
    """√M_ii, which makes translations and rotations, trunk and toes, of one size."""
    return np.sqrt(np.diag(mass_matrix(state)))


def test_the_bodies_are_of_both_sexes():
    assert {read_design(BodyDesign, path).sex for path in DESIGNS} == {"female", "male"}


def test_same_size_and_same_mass(body, other):
    assert (other.model.nq, other.model.nv) == (body.model.nq, body.model.nv)
    assert sorted(other.q_order) == list(range(60))
    assert sorted(other.v_order) == list(range(47))
    assert other.model.body_mass.sum() == pytest.approx(body.mass, rel=1e-14)


def test_segments_are_in_the_same_places(states):
    for state in states:
        pin.forwardKinematics(state.model, state.data, state.q)
        rotations, origins = segment_placements(state.model, state.data)
        theirs = state.found.xmat[state.other.body_ids].reshape(-1, 3, 3)
        assert np.abs(theirs - rotations).max() < 1e-12
        assert np.abs(state.found.xpos[state.other.body_ids] - origins).max() < 1e-12


def test_velocities_mean_the_same(states):
    """Segments move alike, and q moves alike along v: the maps need no Jacobian."""
    for state in states:
        model, data, other = state.model, state.data, state.other
        pin.forwardKinematics(model, data, state.q, state.v)
        ours = np.hstack(segment_velocities(model, data)[::-1])  # angular, linear; world axes
        theirs = np.zeros_like(ours)
        for each, identity in zip(theirs, other.body_ids, strict=True):
            mujoco.mj_objectVelocity(
                other.model, state.found, mujoco.mjtObj.mjOBJ_XBODY, identity, each, 0
            )
        assert np.abs(theirs - ours).max() < TOLERANCE * np.abs(ours).max()

        moved = other.data_at(state.q, state.v)
        mujoco.mj_integratePos(other.model, moved.qpos, moved.qvel, 0.2)
        q, v = other.state_of(moved)
        expected = pin.integrate(model, state.q, 0.2 * state.v)
        assert np.abs(pin.difference(model, expected, q)).max() < 1e-12
        assert np.array_equal(v, state.v)


def test_mass_matrix(states):
    for state in states:
        theirs = np.zeros((state.model.nv, state.model.nv))
        mujoco.mj_fullM(state.other.model, state.found, theirs)
        size = inertia_of_dofs(state)
        error = (state.other.from_dofs(theirs) - mass_matrix(state)) / np.outer(size, size)
        assert np.abs(error).max() < TOLERANCE


def test_bias_forces(states):
    """Coriolis, centrifugal and gravity."""
    for state in states:
        ours = pin.nonLinearEffects(state.model, state.data, state.q, state.v)
        theirs, size = state.other.from_dofs(state.found.qfrc_bias), inertia_of_dofs(state)
        assert np.abs((theirs - ours) / size).max() < TOLERANCE * np.abs(ours / size).max()


def test_forward_dynamics(states):
    for state in states:
        ours = pin.aba(state.model, state.data, state.q, state.v, state.torque)
        theirs, size = state.other.from_dofs(state.found.qacc), inertia_of_dofs(state)
        assert np.abs((theirs - ours) * size).max() < TOLERANCE * np.abs(ours * size).max()
        assert theirs == pytest.approx(ours, rel=TOLERANCE)  # each by itself


def test_centre_of_mass_and_kinetic_energy(states):
    for state in states:
        centre = pin.centerOfMass(state.model, state.data, state.q)
        assert np.abs(state.found.subtree_com[0] - centre).max() < TOLERANCE
        mujoco.mj_energyVel(state.other.model, state.found)
        energy = pin.computeKineticEnergy(state.model, state.data, state.q, state.v)
        assert state.found.energy[1] == pytest.approx(energy, rel=TOLERANCE)


def our_fall(body, q, v, steps):
    """q, v after the fall, by the integrator of the simulation."""
    model, data, limp = body.model, body.model.createData(), np.zeros(body.model.nv)

    def acceleration(time, q, v):
        return pin.aba(model, data, q, v, limp)

    for _ in range(steps):
        q, v, _ = rk4_step(model, acceleration, 0.0, q, v, acceleration(0.0, q, v), FALL / steps)
    return q, v


def their_fall(other, q, v, steps):
    data = other.data_at(q, v)
    other.model.opt.timestep = FALL / steps
    for _ in range(steps):
        mujoco.mj_step(other.model, data)
    return other.state_of(data)


def difference(body, one, another):
    """Greatest difference of any coordinate [m, rad] and any velocity [m/s, rad/s]."""
    q = pin.difference(body.model, one[0], another[0])
    return np.array([np.abs(q).max(), np.abs(one[1] - another[1]).max()])


def tumbling(body, speed):
    """A limp body with every velocity anywhere up to `speed` [m/s, rad/s]."""
    model, rng = body.model, np.random.default_rng(1)
    q = pin.integrate(model, body.rest_configuration, rng.uniform(-0.3, 0.3, model.nv))
    return q, rng.uniform(-speed, speed, model.nv)


def test_limp_fall_nears_mujocos_at_fourth_order(body, other):
    """Steps of 4, 2, 1 and 0.5 ms against MuJoCo's Runge–Kutta at 0.125 ms, whose own error is
    1/256 of the last."""
    start = tumbling(body, 2.0)
    reference = their_fall(other, *start, 4000)
    errors = np.array([
        difference(body, our_fall(body, *start, steps), reference)
        for steps in (125, 250, 500, 1000)
    ])
    assert np.log2(errors[:-1] / errors[1:]).min() > 3.5, errors
    assert errors[-1].max() < 1e-6, errors


def test_limp_fall_at_the_same_step_differs_by_rounding(body, other):
    """Both engines take Munthe-Kaas's stages, so their errors at one step are one.

    The limbs reach some 50 rad/s here, which multiplies rounding: 1e-11 is measured.
    """
    start = tumbling(body, 4.0)
    ours, theirs = our_fall(body, *start, 1000), their_fall(other, *start, 1000)
    assert difference(body, ours, theirs).max() < 1e-9
    assert difference(body, ours, start).min() > 1.0  # it did tumble
