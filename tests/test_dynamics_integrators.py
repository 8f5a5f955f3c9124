"""RKMK4 against closed forms, conservation laws and its own order."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from simcore.dynamics.integrators import rk4_step

GRAVITY = np.array([0, 0, -9.81])


def run(model, acceleration, q, v, duration, steps):
    """Return q, v after `steps` steps."""
    step = duration / steps
    for i in range(steps):
        q, v, _ = rk4_step(
            model, acceleration, i * step, q, v, acceleration(i * step, q, v), step
        )
    return q, v


def free(model):
    data = model.createData()
    return lambda time, q, v: pin.aba(model, data, q, v, np.zeros(model.nv))


def observed_orders(errors):
    """Orders from errors of steps that halve."""
    return np.log2(np.array(errors[:-1]) / errors[1:])


@pytest.fixture(scope="module")
def flying(coarse_body):
    """The body far from anything, every limb spinning."""
    model = coarse_body.model.copy()
    rng = np.random.default_rng(4)
    q = pin.integrate(model, coarse_body.rest_configuration, rng.uniform(-0.3, 0.3, model.nv))
    return model, q, rng.uniform(-4, 4, model.nv)


def test_fourth_order_in_free_flight(flying):
    model, q, v = flying
    assert np.allclose(model.gravity.linear, GRAVITY, rtol=1e-3)
    q_true, v_true = run(model, free(model), q, v, 0.08, 256)
    q_errors, v_errors = [], []
    for steps in (8, 16, 32):
        q_end, v_end = run(model, free(model), q, v, 0.08, steps)
        q_errors.append(np.linalg.norm(pin.difference(model, q_true, q_end)))
        v_errors.append(np.linalg.norm(v_end - v_true))
    assert observed_orders(q_errors).min() > 3.8, q_errors
    assert observed_orders(v_errors).min() > 3.8, v_errors


def test_energy_and_momentum_drift_at_fourth_order(flying):
    """Without gravity: kinetic energy, momentum, and angular momentum about the mass centre."""
    model, q, v = flying
    model = model.copy()
    model.gravity.linear = np.zeros(3)
    data = model.createData()

    def conserved(q, v):
        momentum = pin.computeCentroidalMomentum(model, data, q, v).vector
        return np.array([pin.computeKineticEnergy(model, data, q, v), *momentum])

    start = conserved(q, v)
    drift = []
    for steps in (16, 32, 64):
        end = conserved(*run(model, free(model), q, v, 0.08, steps))
        change = end - start
        drift.append([abs(change[0]), np.linalg.norm(change[1:4]), np.linalg.norm(change[4:])])
    assert np.log2(np.array(drift[:-1]) / drift[1:]).min() > 3.8, drift


def test_mass_centre_of_a_rigid_fall_is_exact(flying):
    """A body that does not bend falls on a parabola, which fourth order integrates exactly."""
    model, q, _ = flying
    data, v = model.createData(), np.zeros(model.nv)
    v[:3] = 1.0, -2.0, 3.0
    turn = pin.Quaternion(q[3:7]).toRotationMatrix()
    start, velocity = pin.centerOfMass(model, data, q, v).copy(), data.vcom[0].copy()
    assert np.linalg.norm(velocity) == pytest.approx(np.sqrt(14))  # in whichever axes of the root
    end, _ = run(model, free(model), q, v, 0.5, 50)
    expected = start + 0.5 * velocity + 0.125 * model.gravity.linear
    assert np.abs(pin.centerOfMass(model, data, end) - expected).max() < 1e-11
    assert np.abs(pin.Quaternion(end[3:7]).toRotationMatrix() - turn).max() < 1e-11


def test_mass_centre_of_a_limp_fall_errs_at_fourth_order(flying):
    model, q, v = flying
    data = model.createData()
    start, velocity = pin.centerOfMass(model, data, q, v).copy(), data.vcom[0].copy()
    expected = start + 0.08 * velocity + 0.08**2 / 2 * model.gravity.linear
    errors = []
    for steps in (16, 32, 64):
        end, _ = run(model, free(model), q, v, 0.08, steps)
        errors.append(np.linalg.norm(pin.centerOfMass(model, data, end) - expected))
    assert observed_orders(errors).min() > 3.8, errors


def rigid(joint, inertia):
    model = pin.Model()
    model.addJoint(0, joint, pin.SE3.Identity(), "only")
    model.appendBodyToJoint(1, inertia, pin.SE3.Identity())
    return model


def test_symmetric_top_in_free_flight():
    """Torque-free precession about L at |L|/A and spin by (1 − C/A) ω₃ (Landau & Lifshitz §33)."""
    a, c = 0.3, 0.1
    model = rigid(pin.JointModelFreeFlyer(), pin.Inertia(2.0, np.zeros(3), np.diag([a, a, c])))
    model.gravity.linear = np.zeros(3)
    omega, start = np.array([1.0, 2.0, 5.0]), Rotation.from_rotvec([0.3, -0.5, 0.9])
    q = np.array([0, 0, 0, *start.as_quat()])
    momentum = start.apply(np.diag([a, a, c]) @ omega)
    spin = (1 - c / a) * omega[2]
    duration = 1.0
    expected = (
        Rotation.from_rotvec(duration * momentum / a) * start
        * Rotation.from_rotvec([0, 0, duration * spin])
    )
    errors = []
    for steps in (40, 80, 160):
        end, v = run(model, free(model), q, np.array([0, 0, 0, *omega]), duration, steps)
        errors.append((expected.inv() * Rotation.from_quat(end[3:7])).magnitude())
        assert v[5] == pytest.approx(omega[2], abs=1e-12)
    assert errors[-1] < 1e-6
    assert observed_orders(errors).min() > 3.8, errors


def test_pendulum_swings_with_its_period():
    """T = 4 K(sin²(θ₀/2)) √(l/g): back where it started after one period."""
    from scipy.special import ellipk

    length, angle = 0.4, 2.0
    model = rigid(
        pin.JointModelRY(), pin.Inertia(1.5, np.array([0, 0, -length]), 1e-12 * np.eye(3))
    )
    period = 4 * ellipk(np.sin(angle / 2) ** 2) * np.sqrt(length / -model.gravity.linear[2])
    errors = []
    for steps in (100, 200, 400):
        q, v = run(model, free(model), np.array([angle]), np.zeros(1), period, steps)
        errors.append(np.hypot(q[0] - angle, v[0] / 10))
    assert errors[-1] < 1e-6
    assert observed_orders(errors).min() > 3.8, errors


def test_forcing_is_seen_at_the_stage_times():
    """v̇ = 5 t⁴ is integrated by Simpson's rule: error h⁵/24 a step."""
    model = rigid(pin.JointModelPX(), pin.Inertia(1.0, np.zeros(3), np.eye(3)))
    _, v, _ = rk4_step(
        model, lambda time, q, v: np.array([5 * time**4]), 0.0, np.zeros(1), np.zeros(1),
        np.zeros(1), 0.2,
    )
    assert v[0] - 0.2**5 == pytest.approx(0.2**5 / 24, rel=1e-12)


def test_the_evaluations_half_way_differ_as_by_their_closed_form():
    """v̇ = −λ v: h (a₃ − a₂) = −(λ h)³ v / 4."""
    model = rigid(pin.JointModelPX(), pin.Inertia(1.0, np.zeros(3), np.eye(3)))
    rate, step, v = 30.0, 0.02, np.array([0.7])
    _, _, apart = rk4_step(
        model, lambda time, q, v: -rate * v, 0.0, np.zeros(1), v, -rate * v, step
    )
    assert apart == pytest.approx(-((rate * step) ** 3) * v / 4, rel=1e-12)
