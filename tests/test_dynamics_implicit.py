"""The linearly implicit step, and contact impedances projected to the joints."""

import numpy as np
import pinocchio as pin
import pytest
from sling_scenes import shipped_body

from simcore.body.segments import PARENTS, SEGMENTS
from simcore.dynamics.impedance import (
    PACKED,
    add_pair_impedance,
    add_point_impedance,
    project_blocks,
)
from simcore.dynamics.implicit import IMPLICITNESS, implicit_step, velocity_change
from simcore.dynamics.pinocchio_views import view_segments

MAN = "male_172_70"


@pytest.fixture(scope="module")
def body():
    return shipped_body(MAN)


def tree(model):
    joints = [model.joints[j + 1] for j in range(len(SEGMENTS))]
    return (np.array(PARENTS), np.array([each.idx_v for each in joints]),
            np.array([each.nv for each in joints]))


def tumbling(model, seed, size=1.0):
    rng = np.random.default_rng(seed)
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-0.6, 0.6, model.nv))
    return q, size * rng.uniform(-1, 1, model.nv)


def point_jacobian(model, data, joint, point):
    """Of a world point that moves with a joint (3, nv), by Pinocchio's frame Jacobian."""
    spatial = pin.getJointJacobian(model, data, int(joint), pin.LOCAL_WORLD_ALIGNED)
    return spatial[:3] - pin.skew(point - data.oMi[int(joint)].translation) @ spatial[3:]


@pytest.mark.parametrize("seed", range(3))
def test_impedances_are_those_of_the_points_jacobians(body, seed):
    """Points on one segment, and on two at once: Σ Jᵀ Z J, joint by joint."""
    model, data = body.model, body.model.createData()
    q, _ = tumbling(model, seed)
    view = view_segments(model, data)
    pin.forwardKinematics(model, data, q)
    pin.computeJointJacobians(model, data)
    rng = np.random.default_rng(seed)
    count, m = 30, len(SEGMENTS)
    segments = np.array([rng.choice(m, 2, replace=False) for _ in range(count)])
    weights = rng.dirichlet([1, 1], count)
    weights[:5] = [1.0, 0.0]
    points, normals = rng.uniform(-1, 1, (count, 3)), rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    along, across = rng.uniform(0, 3, (2, count))
    blocks, matrix = np.zeros((m, m, PACKED)), np.zeros((model.nv, model.nv))
    add_point_impedance(
        np.arange(count), 2 * np.arange(count + 1), segments.ravel(), weights.ravel(), points,
        normals, along, across, blocks,
    )
    project_blocks(blocks, view.jacobian, *tree(model), matrix)
    expected = np.zeros_like(matrix)
    for i in range(count):
        jacobian = sum(
            w * point_jacobian(model, data, s + 1, points[i])
            for s, w in zip(segments[i], weights[i], strict=True)
        )
        normal = np.outer(normals[i], normals[i])
        z = along[i] * normal + across[i] * (np.eye(3) - normal)
        expected += jacobian.T @ z @ jacobian
    assert matrix == pytest.approx(expected, abs=1e-10)
    assert matrix == pytest.approx(matrix.T, abs=1e-12)
    assert np.linalg.eigvalsh(matrix).min() > -1e-10


def test_impedance_of_a_pair_is_that_of_their_relative_motion(body):
    model, data = body.model, body.model.createData()
    q, _ = tumbling(model, 5)
    view = view_segments(model, data)
    pin.forwardKinematics(model, data, q)
    pin.computeJointJacobians(model, data)
    rng, m = np.random.default_rng(5), len(SEGMENTS)
    pairs = np.array([[3, 11], [6, 9], [2, 14]])
    points, normals = rng.uniform(-1, 1, (3, 3)), rng.normal(size=(3, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    along = np.array([2.0, 0.0, 0.7])
    blocks, matrix = np.zeros((m, m, PACKED)), np.zeros((model.nv, model.nv))
    add_pair_impedance(pairs, points, normals, along, blocks)
    project_blocks(blocks, view.jacobian, *tree(model), matrix)
    expected = np.zeros_like(matrix)
    for e, (i, j) in enumerate(pairs):
        between = normals[e] @ (
            point_jacobian(model, data, i + 1, points[e])
            - point_jacobian(model, data, j + 1, points[e])
        )
        expected += along[e] * np.outer(between, between)
    assert matrix == pytest.approx(expected, abs=1e-10)
    assert np.abs(matrix[:6]).max() < 1e-10  # nothing from outside


def fly(body, q, v, seconds, step, force=None):
    """Steps under gravity, and under a torque with its impedance (lag, v) → (τ, Z) if given."""
    model, data = body.model, body.model.createData()
    nothing = np.zeros(model.nv), np.zeros((model.nv, model.nv))
    for _ in range(round(seconds / step)):
        q, v = implicit_step(
            model, data,
            lambda _, q, v: force(IMPLICITNESS * step, q, v) if force else nothing,
            0.0, q, v, step,
        )
    return q, v


def test_a_fall_without_turning_is_exact(body):
    """Both halves of the drift with the mean velocity: x = g t²/2 at any step."""
    model = body.model
    q = body.rest_configuration
    end, v = fly(body, q, np.zeros(model.nv), 0.2, 0.02)
    gravity = model.gravity.linear
    assert v[:3] == pytest.approx(0.2 * gravity, abs=1e-12)
    assert end[:3] - q[:3] == pytest.approx(0.02 * gravity, abs=1e-12)


def test_a_tumbling_body_is_followed_at_first_order(body):
    """Velocity-dependent forces are taken at the start of a step."""
    q, v = tumbling(body.model, 1, size=2.0)
    exact, _ = fly(body, q, v, 0.1, 0.1 / 1024)
    errors = [
        np.linalg.norm(pin.difference(body.model, exact, fly(body, q, v, 0.1, step)[0]))
        for step in (0.005, 0.0025, 0.00125)
    ]
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 0.9
    assert errors[0] < 0.03


@pytest.mark.parametrize("rate", [50.0, 5e3])
def test_stiff_springs_do_not_limit_the_step(body, rate):
    """Springs of all joints, up to 25 times what an explicit step could hold, do not grow."""
    model, step = body.model, 0.01
    reference = body.rest_configuration
    free = model.copy()
    free.gravity.linear = np.zeros(3)
    resting = type(body)(**{**vars(body), "model": free})
    stiffness = np.full(model.nv, 0.02 * rate**2)
    stiffness[:6] = 0.0

    def springs(lag, q, v):
        torque = stiffness * pin.difference(model, q, reference)
        return torque, np.diag(lag * lag * stiffness)

    q = pin.integrate(model, reference, np.where(stiffness > 0, 1e-3, 0.0))
    end, v = fly(resting, q, np.zeros(model.nv), 1.0, step, springs)
    assert np.abs(pin.difference(model, reference, end)[6:]).max() < 1e-2
    assert np.isfinite(v).all()


@pytest.mark.parametrize("size", (1, 3, 8, 47))
def test_change_of_velocity_solves_the_equations_of_motion(size):
    """Whatever stands below the diagonal of the mass matrix; and only where it is positive."""
    rng = np.random.default_rng(size)
    root, other, bias = rng.normal(size=(size, 2 * size)), rng.normal(size=size), np.ones(size)
    mass, impedance = root @ root.T, 0.1 * np.eye(size) + np.outer(other, other)
    upper = np.asfortranarray(np.where(np.tri(size, k=-1), np.nan, mass))
    torque, step = rng.normal(size=size), 0.01
    told = velocity_change(upper, impedance, torque, bias, step)
    right = np.linalg.solve(mass + impedance, step * (torque - bias))
    assert told == pytest.approx(right, rel=1e-9, abs=1e-12)
    for worst in (-mass[-1, -1] - other[-1] ** 2 - 1, np.nan):
        spoilt = impedance.copy()
        spoilt[-1, -1] = worst
        assert np.isnan(velocity_change(upper, spoilt, torque, bias, step)).all()


def test_a_step_that_cannot_be_solved_tells_so(body):
    """A negative impedance beyond the mass: not a number, for the caller to refuse."""
    model = body.model
    _, v = fly(body, body.rest_configuration, np.zeros(model.nv), 0.01, 0.01,
               lambda lag, q, v: (np.zeros(model.nv), -1e6 * np.eye(model.nv)))
    assert np.isnan(v).all()
