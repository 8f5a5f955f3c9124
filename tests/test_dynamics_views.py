"""The shared-memory views against Pinocchio's own accessors."""

import gc

import numpy as np
import pinocchio as pin
import pytest

from simcore.dynamics.pinocchio_views import view_segments


def assert_current(model, data, views):
    for j in range(1, model.njoints):
        assert np.array_equal(views.rotations[j - 1], data.oMi[j].rotation)
        assert np.array_equal(views.positions[j - 1], data.oMi[j].translation)
        assert np.array_equal(views.velocities[j - 1], data.v[j].vector)
    assert np.array_equal(views.jacobian, data.J)


def test_views_follow_every_call(coarse_body):
    model, rng = coarse_body.model, np.random.default_rng(0)
    data = model.createData()
    other = model.createData()
    views = view_segments(model, data)
    before = None
    for _ in range(5):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-2, 2, model.nv))
        v = rng.normal(size=model.nv)
        pin.forwardKinematics(model, data, q, v)
        pin.computeJointJacobians(model, data)
        pin.forwardKinematics(model, other, pin.neutral(model), np.zeros(model.nv))
        assert_current(model, data, views)
        pin.aba(model, data, q, v, np.zeros(model.nv))
        pin.centerOfMass(model, data, q, False)
        assert_current(model, data, views)
        assert before is None or not np.allclose(before, views.rotations)
        before = views.rotations.copy()
    expected = pin.computeJointJacobians(model, other, q)  # from nothing
    pin.computeJointJacobians(model, data, q)
    assert np.array_equal(views.jacobian, expected)


def test_rotations_map_from_segment_to_world(coarse_body):
    """Not the transpose: a point of the segment lands where Pinocchio puts it."""
    model = coarse_body.model
    data = model.createData()
    views = view_segments(model, data)
    pin.forwardKinematics(model, data, coarse_body.rest_configuration, np.ones(model.nv))
    point = np.array([0.1, 0.2, 0.3])
    for j in range(1, model.njoints):
        assert np.allclose(
            views.rotations[j - 1] @ point + views.positions[j - 1], data.oMi[j].act(point)
        )


def test_views_keep_their_memory_alive(coarse_body):
    model = coarse_body.model
    views = [view_segments(model, model.createData()) for _ in range(20)]
    expected = [each.rotations.copy() for each in views]
    gc.collect()
    junk = [model.createData() for _ in range(20)]
    for each, right in zip(views, expected, strict=True):
        assert np.array_equal(each.rotations, right)
    assert junk


def test_views_cannot_be_written(coarse_body):
    model = coarse_body.model
    views = view_segments(model, model.createData())
    with pytest.raises(ValueError, match="read-only"):
        views.rotations[0, 0, 0] = 1
