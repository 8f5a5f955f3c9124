"""The motion program: where it passes, how smoothly, and what it leaves still."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.config.motion import MotionProgram
from simcore.device.motion import Motion

varied = settings(max_examples=40, deadline=None)
number = st.floats(-1, 1).map(lambda x: round(x, 3))
vectors = st.tuples(number, number, number)
axes = vectors.filter(lambda axis: np.linalg.norm(axis) > 0.1)


@st.composite
def programs(draw):
    gaps = draw(st.lists(st.floats(0.2, 3), min_size=1, max_size=5))
    frames = [
        {"time_s": time, "translation_m": draw(number), "rotation_deg": draw(st.floats(-170, 170))}
        for time in np.r_[0, np.cumsum(gaps)]
    ]
    return MotionProgram(
        translation_axis=draw(axes), rotation_axis=draw(axes), rotation_point_m=draw(vectors),
        keyframes=frames,
    )


def simple(*frames, axis=(0, 0, 1), point=(0.2, 0.1, -0.3)):
    return MotionProgram(
        translation_axis=(0, 0, 1), rotation_axis=axis, rotation_point_m=point,
        keyframes=[dict(zip(("time_s", "translation_m", "rotation_deg"), each, strict=True))
                   for each in frames],
    )


def turn_about(axis, angle):
    """Rodrigues, written with the quaternion's product instead."""
    w, (x, y, z) = np.cos(angle / 2), np.sin(angle / 2) * np.array(axis) / np.linalg.norm(axis)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def pivot_of(program, motion, time):
    state = motion(time)
    return state.rotation @ np.array(program.rotation_point_m) + state.position


def angles_of(program, motion, times):
    """Rotation about the axis since the start [rad], by the arc a vector across it describes."""
    axis = np.array(program.rotation_axis) / np.linalg.norm(program.rotation_axis)
    across = np.cross(axis, [1, 0, 0] if abs(axis[0]) < 0.9 else [0, 1, 0])
    across /= np.linalg.norm(across)
    tilt = turn_about((0, -1, 0), 0.2)
    turned = np.array([motion(time).rotation @ tilt.T @ across for time in times])
    return np.arctan2(turned @ np.cross(axis, across), turned @ across)


@varied
@given(programs())
def test_passes_its_keyframes(program):
    motion = Motion(program, 0.2)
    along = np.array(program.translation_axis) / np.linalg.norm(program.translation_axis)
    pivot = turn_about((0, -1, 0), 0.2) @ np.array(program.rotation_point_m)
    for frame in program.keyframes:
        state = motion(frame.time_s)
        turned = turn_about(program.rotation_axis, np.radians(frame.rotation_deg))
        assert np.abs(state.rotation - turned @ turn_about((0, -1, 0), 0.2)).max() < 1e-9
        # The pivot is carried by the translation alone.
        expected = pivot + frame.translation_m * along
        assert np.abs(pivot_of(program, motion, frame.time_s) - expected).max() < 1e-9


@varied
@given(programs(), st.data())
def test_reported_velocity_is_the_derivative_of_the_pose(program, data):
    motion, step = Motion(program, 0.2), 1e-5
    time = data.draw(st.floats(step, motion.duration - step))
    behind, state, ahead = motion(time - step), motion(time), motion(time + step)
    # Across a keyframe only the first derivative is continuous; error ∝ jump of the second · step.
    inside = min(abs(time - frame.time_s) for frame in program.keyframes) > step
    limit = 1e-6 if inside else 1e-2
    linear = (ahead.position - behind.position) / (2 * step)
    assert np.abs(linear - state.linear_velocity).max() < limit
    spin = (ahead.rotation - behind.rotation) / (2 * step) @ state.rotation.T
    angular = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    assert np.abs(angular - state.angular_velocity).max() < limit
    assert np.abs(state.rotation @ state.rotation.T - np.eye(3)).max() < 1e-12


@varied
@given(programs())
def test_velocity_has_no_jump_and_is_zero_at_both_ends(program):
    motion = Motion(program, 0.2)
    tiny = 1e-9
    for frame in program.keyframes:
        before, after = motion(frame.time_s - tiny), motion(frame.time_s + tiny)
        assert np.abs(before.linear_velocity - after.linear_velocity).max() < 1e-5
        assert np.abs(before.angular_velocity - after.angular_velocity).max() < 1e-5
    for time in (0.0, motion.duration):
        assert np.abs(motion(time).linear_velocity).max() < 1e-12
        assert np.abs(motion(time).angular_velocity).max() < 1e-12


@varied
@given(programs())
def test_never_overshoots_a_keyframe(program):
    motion = Motion(program, 0.2)
    along = np.array(program.translation_axis) / np.linalg.norm(program.translation_axis)
    start = pivot_of(program, motion, 0.0) - program.keyframes[0].translation_m * along
    for a, b in zip(program.keyframes, program.keyframes[1:], strict=False):
        times = np.linspace(a.time_s, b.time_s, 23)
        way = np.array([pivot_of(program, motion, time) - start for time in times]) @ along
        low, high = sorted((a.translation_m, b.translation_m))
        assert way.min() > low - 1e-9
        assert way.max() < high + 1e-9
        turned = np.degrees(angles_of(program, motion, times))
        low, high = sorted((a.rotation_deg, b.rotation_deg))
        assert turned.min() > low - 1e-6
        assert turned.max() < high + 1e-6


def test_still_before_the_start_and_after_the_end():
    motion = Motion(simple((0, 0.1, 10), (1, 0.3, 50), (2.5, -0.2, 90)), 0.2)
    assert motion.duration == 2.5
    for outside, end in ((-np.inf, 0.0), (-1.0, 0.0), (2.6, 2.5), (1e9, 2.5)):
        there, at_end = motion(outside), motion(end)
        assert np.array_equal(there.rotation, at_end.rotation)
        assert np.array_equal(there.position, at_end.position)
        assert not there.linear_velocity.any()
        assert not there.angular_velocity.any()


@pytest.mark.parametrize("angle", [-30, 0, 7, 60])
def test_inclination_lifts_the_front_edge(angle):
    state = Motion(simple((0, 0, 0), (1, 0, 0)), np.radians(angle))(0.5)
    front = state.rotation @ [1, 0, 0]
    assert np.degrees(np.arctan2(front[2], front[0])) == pytest.approx(angle)
    assert state.rotation @ [0, 1, 0] == pytest.approx([0, 1, 0])
    assert np.abs(state.position).max() < 1e-15  # about the device's own origin


def test_pure_rotation_leaves_the_pivot_fixed():
    program = simple((0, 0, 0), (1, 0, 90), (3, 0, -40), axis=(1, 2, 2))
    motion = Motion(program, 0.3)
    first = pivot_of(program, motion, 0.0)
    for time in np.linspace(0, 3, 40):
        state = motion(time)
        assert np.abs(pivot_of(program, motion, time) - first).max() < 1e-12
        arm = state.rotation @ np.array(program.rotation_point_m)
        still = state.linear_velocity + np.cross(state.angular_velocity, arm)
        assert np.abs(still).max() < 1e-12


def test_asking_again_gives_the_same_whatever_came_between():
    motion = Motion(simple((0, 0, 0), (1, 0.4, 90)), 0.1)
    first = motion(0.3)
    motion(0.7)
    again = motion(0.3)
    assert np.array_equal(first.position, again.position)
    assert np.array_equal(first.rotation, again.rotation)
