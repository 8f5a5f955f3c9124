"""Whole runs of a coarse man on a coarse lift."""

import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from simcore.errors import SimulationError
from simcore.recorder import FALL_DISPLACEMENT
from simcore.simulate import SPEED_LIMIT, _Run, simulate

AWAY = {"posture.placement.approach": (), "posture.placement.pelvis_m": (0.2, 0.0, 3.0)}
SHORT = {
    "device.motion.keyframes": [
        {"time_s": 0, "translation_m": 0, "rotation_deg": 0},
        {"time_s": 0.1, "translation_m": 0.01, "rotation_deg": 3},
    ],
    "duration_min_s": 0.1, "duration_max_s": 0.3, "hold_s": 0.1, "record_rate_hz": 50,
}


def mass_centre(scene, q):
    return pin.centerOfMass(scene.body.model, scene.body.model.createData(), q).copy()


def test_held_body_is_carried_by_its_weight(held):
    """At the end of the hold the support force is the weight and nothing else."""
    scene, trajectory = held
    assert trajectory.status == "ok"
    assert trajectory.reason == ""
    assert trajectory.settled
    force = trajectory.segment_force.sum(axis=1)[trajectory.time > trajectory.time[-1] - 0.5]
    weight = scene.body.mass * 9.81
    assert force[:, 2].mean() == pytest.approx(weight, rel=0.01)
    assert np.abs(force[:, :2].mean(axis=0)).max() < 0.01 * weight
    assert trajectory.displacement.max() < FALL_DISPLACEMENT


def test_impulse_of_gravity_and_contact_is_the_momentum(held):
    """Newton over the whole run; forces are of the beginning of each step: first order, h/T."""
    scene, trajectory = held
    frame = np.diff(trajectory.time)[:, None]
    force = trajectory.segment_force.sum(axis=1)[1:]
    weight = scene.body.mass * scene.body.model.gravity.linear
    impulse = np.cumsum((force + weight) * frame, axis=0)
    data = scene.body.model.createData()
    momentum = np.array([
        pin.computeCentroidalMomentum(scene.body.model, data, q, v).linear
        for q, v in zip(trajectory.q, trajectory.v, strict=True)
    ])
    error = np.abs(impulse - (momentum[1:] - momentum[0])).max()
    assert error < 3 * scene.method.time_step_s * scene.body.mass * 9.81
    assert np.abs(momentum).max() > 5 * error


def test_frames_tell_where_the_device_is_and_time_starts_with_it(held):
    scene, trajectory = held
    assert trajectory.time[0] < -scene.method.settling.duration_min_s
    assert trajectory.time[-1] == pytest.approx(
        scene.motion.duration + scene.method.hold_s, abs=np.diff(trajectory.time)[0]
    )
    assert np.abs(trajectory.time).min() <= np.diff(trajectory.time)[0] / 2
    for time, rotation, position in zip(
        trajectory.time, trajectory.device_rotation, trajectory.device_position, strict=True
    ):
        state = scene.motion(time)
        assert np.abs(rotation - state.rotation).max() < 1e-9
        assert np.abs(position - state.position).max() < 1e-9
    still = trajectory.time <= 1e-9
    assert np.ptp(trajectory.device_position[still], axis=0).max() == 0
    assert np.ptp(trajectory.device_position, axis=0).max() > 0.2


def test_normal_forces_and_segment_forces_agree(held):
    """Friction is what is left: at most F_c for every contact, times the most contacts seen."""
    scene, trajectory = held
    total = np.linalg.norm(trajectory.segment_force.sum(axis=1), axis=1)
    normal = trajectory.normal_force.sum(axis=1)
    friction = scene.method.contact.friction_force_n * trajectory.contact_count.max()
    assert np.all(trajectory.normal_force >= 0)
    assert np.all(total <= normal + friction)
    on_mat = trajectory.mat_pressure.sum(axis=(1, 2)) * scene.method.sensor_pitch_m**2
    assert on_mat == pytest.approx(normal, rel=1e-4)
    assert np.all(trajectory.depth_max >= 0)
    assert trajectory.depth_max[-1] > 0


@pytest.mark.parametrize("rate", [1, 40, 100, 500])
def test_frames_come_at_the_recording_rate(scene_with, rate):
    scene = scene_with(SHORT | AWAY | {"record_rate_hz": rate, "time_step_s": 0.001})
    trajectory = simulate(scene)
    assert np.diff(trajectory.time) == pytest.approx(1 / rate, abs=1e-12)
    n = len(trajectory.time)
    for field in dataclasses.fields(trajectory):
        value = getattr(trajectory, field.name)
        if isinstance(value, np.ndarray) and field.name not in ("mat_x", "mat_y"):
            assert len(value) == n, field.name


def test_body_without_support_falls_on_a_parabola(scene_with):
    scene = scene_with(AWAY)
    trajectory = simulate(scene)
    since = trajectory.time - trajectory.time[0]
    start = mass_centre(scene, scene.configuration)
    for time, q in zip(since, trajectory.q, strict=True):
        fallen = mass_centre(scene, q) - start
        assert fallen == pytest.approx(time**2 / 2 * scene.body.model.gravity.linear, abs=1e-10)
    assert np.abs(trajectory.q[-1, 3:] - scene.configuration[3:]).max() < 1e-10
    assert trajectory.displacement == pytest.approx(9.81 / 2 * since**2, rel=1e-3, abs=1e-10)
    assert not trajectory.normal_force.any()
    assert not trajectory.contact_count.any()


def test_run_ends_after_a_fall(scene_with):
    """Falls at √(2·0.15/g) = 0.175 s; what is still shown is stop_after_fall_s and a frame."""
    trajectory = simulate(scene_with(AWAY | {"record_rate_hz": 100}))
    shown = trajectory.time[-1] - trajectory.time[0]
    assert 0.175 + 0.5 - 0.01 < shown < 0.175 + 0.5 + 0.02
    assert trajectory.status == "ok"
    assert not trajectory.settled


def test_two_runs_are_the_same_to_the_last_bit(scene_with):
    first, second = simulate(scene_with(SHORT)), simulate(scene_with(SHORT))
    assert first.contact_count.max() > 20
    for field in dataclasses.fields(first):
        if field.name != "cpu_time":
            np.testing.assert_array_equal(
                getattr(first, field.name), getattr(second, field.name), field.name
            )


def test_watching_does_not_change_the_run(scene_with):
    told = []
    scene = scene_with(SHORT)
    watched, alone = simulate(scene, told.append), simulate(scene)
    assert np.array_equal(watched.q, alone.q)
    assert len(told) == len(alone.time)
    assert np.all(np.diff(told) > 0)
    assert np.array_equal(scene.configuration, scene_with(SHORT).configuration)


def test_halving_the_step_changes_little_in_contact(scene_with):
    """Jumps of idx(k) leave first order; after the first touches limbs may fall either way."""
    paths = []
    for step in (0.002, 0.001, 0.00025):
        scene = scene_with(SHORT | {"time_step_s": step, "hold_s": 0.0})
        paths.append(simulate(scene))
    model, end = scene.body.model, 6  # 0.12 s after the start
    assert paths[-1].contact_count[end] >= 10
    coarse, fine = (
        np.linalg.norm(pin.difference(model, paths[-1].q[end], path.q[end])) for path in paths[:2]
    )
    moved = np.linalg.norm(pin.difference(model, scene.configuration, paths[-1].q[end]))
    assert coarse < 2e-3 * moved
    assert fine < 0.7 * coarse


@pytest.mark.parametrize(
    ("cause", "joint"),
    [
        ({"method.joints.toe.damping_nms_per_rad": 1e4}, "toe_"),
        ({"stiffness_n_per_m": 3e7}, "joint "),
        ({"damping_ns_per_m": 1e8}, "joint "),
        ({"time_step_s": 0.02, "method.joints.wrist.damping_nms_per_rad": 100.0}, "hand_"),
    ],
    ids=["toe", "stiffness", "damping", "step"],
)
def test_blow_up_names_a_joint_and_keeps_the_good_frames(scene_with, cause, joint):
    scene = scene_with(SHORT | cause | {"record_rate_hz": 500, "duration_min_s": 0.3})
    trajectory = simulate(scene)
    assert trajectory.status == "blow_up"
    assert joint in trajectory.reason
    assert any(f"joint {name} " in trajectory.reason for name in scene.body.model.names)
    assert "\n" not in trajectory.reason
    assert len(trajectory.time) >= 1
    for name in ("q", "v", "displacement", "segment_force", "normal_force", "depth_max"):
        assert np.isfinite(getattr(trajectory, name)).all(), name
    assert np.abs(trajectory.v).max() < SPEED_LIMIT
    assert np.all(trajectory.time <= 0)  # it never came to the device's motion


@pytest.mark.parametrize(("status", "told"), [("slip_through", "ok"), ("blow_up", "blow_up")])
def test_a_sheet_that_passes_after_the_fall_leaves_the_verdict(
    scene_with, monkeypatch, status, told
):
    step = _Run.step

    def fails_after_the_fall(run):
        if np.isfinite(run.recorder.fall_time):
            raise SimulationError(status, "as a hand is squeezed")
        return step(run)

    monkeypatch.setattr(_Run, "step", fails_after_the_fall)
    trajectory = simulate(scene_with(AWAY | {"record_rate_hz": 100}))
    assert trajectory.status == told
    assert trajectory.displacement[-1] > FALL_DISPLACEMENT
