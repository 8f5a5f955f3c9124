"""Figures of joints and of the program that moves them, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_metrics import still

from simcore.config.motion import Keyframe, MotionProgram
from simcore.device.motion import Motion
from simcore.dynamics.joint_angles import CONE_AXIS
from simcore.joint_metrics import joint_range_margin, lifting_speed, neck_moment
from simcore.metrics import JOINTS, compute_metrics

BENT = 50  # a frame of `still` while supported


@pytest.fixture(scope="module")
def anatomical(scene_with):
    """A scene whose joints have passive structures and so ranges."""
    return scene_with(passive="anatomical")


def bent(scene, segment, value, frame=BENT):
    """A still body, one joint of which is set in one frame: an angle [rad] or a quaternion."""
    trajectory = still(scene)
    joint = scene.body.model.joints[scene.body.model.getJointId(segment)]
    q = trajectory.q.copy()
    q[frame, joint.idx_q : joint.idx_q + joint.nq] = value
    return replace(trajectory, q=q)


def supported(trajectory):
    return trajectory.time >= 0


def neck_of(scene, trajectory):
    return neck_moment(scene, trajectory, supported(trajectory))


def margins(scene, trajectory):
    found = joint_range_margin(scene, trajectory, supported(trajectory))
    return dict(zip(JOINTS, found, strict=True))


def neck_angle(scene):
    """Where the posture has the neck [rad]."""
    joint = scene.body.model.joints[scene.body.model.getJointId("head")]
    return scene.configuration[joint.idx_q]


@settings(max_examples=20, deadline=None)
@given(st.floats(-1.0, 1.0))
def test_a_bent_neck_bears_the_torque_of_its_spring(scene, angle):
    stiffness = scene.method.joints.neck.stiffness_nm_per_rad
    found = neck_of(scene, bent(scene, "head", neck_angle(scene) + angle))
    assert found == pytest.approx(stiffness * abs(angle), abs=1e-9)


def test_a_turning_neck_bears_the_torque_of_its_damper(scene):
    trajectory = still(scene)
    v = trajectory.v.copy()
    v[BENT, scene.body.model.joints[scene.body.model.getJointId("head")].idx_v] = -0.7
    found = neck_of(scene, replace(trajectory, v=v))
    assert found == pytest.approx(0.7 * scene.method.joints.neck.damping_nms_per_rad)


@pytest.mark.parametrize("end", [70, -55])
def test_at_the_end_of_its_range_a_neck_bears_5_nm_more(anatomical, end):
    """What Eq. J2 has there; the posture's spring pulls the same way."""
    angle = np.radians(end)
    spring = anatomical.method.joints.neck.stiffness_nm_per_rad
    found = neck_of(anatomical, bent(anatomical, "head", angle))
    expected = 5 + spring * abs(angle - neck_angle(anatomical))
    assert found == pytest.approx(expected, abs=1e-3)


def test_only_supported_frames_count(anatomical):
    settling = bent(anatomical, "head", np.radians(80.0), frame=3)
    assert settling.time[3] < 0
    undisturbed = still(anatomical)
    assert neck_of(anatomical, settling) == neck_of(anatomical, undisturbed)
    assert margins(anatomical, settling) == margins(anatomical, undisturbed)


@pytest.mark.parametrize(
    ("segment", "joint", "degrees", "margin"),
    [
        ("head", "neck", 70, 0), ("head", "neck", -55, 0), ("head", "neck", 83, -13 / 62.5),
        ("shank_left", "knee_left", 133, 0), ("shank_left", "knee_left", -13.3, -0.2),
        ("shank_right", "knee_right", 33.25, 0.5),
        ("toe_right", "toe_right", 80, 0),
    ],
)  # fmt: skip
def test_range_margin_of_a_hinge(anatomical, segment, joint, degrees, margin):
    """1 − |θ − middle| over half the range, ranges as printed: neck −55 to 70, knee 0 to 133."""
    found = margins(anatomical, bent(anatomical, segment, np.radians(degrees)))
    assert found.pop(joint) == pytest.approx(margin, abs=1e-9)
    others = margins(anatomical, still(anatomical))
    others.pop(joint)
    assert found == others


def test_range_margin_of_a_hip_is_that_of_its_worst_angle(anatomical):
    """45° of abduction are the end of that range, whatever the flexion."""
    turn = np.radians(45)
    for sine in (1, -1):
        left = bent(anatomical, "thigh_left", [sine * np.sin(turn / 2), 0, 0, np.cos(turn / 2)])
        found = margins(anatomical, left)["hip_left"]
        # abduction on the left is a turn about x: 45° is its end, adduction goes to 30° only
        assert found == pytest.approx(0 if sine == 1 else -15 / 37.5, abs=1e-9)


def test_an_arm_along_its_cone_is_far_from_the_end_of_its_reach(anatomical):
    """Reach is 0 there and 60° for a hanging arm; the middle of the rotation is at 2.5°."""
    axis = np.append(np.cross([0, 0, -1.0], CONE_AXIS), 1 - CONE_AXIS[2])
    along = margins(anatomical, bent(anatomical, "upper_arm_left", axis / np.linalg.norm(axis)))
    hanging = margins(anatomical, bent(anatomical, "upper_arm_left", [0, 0, 0, 1]))
    rest = margins(anatomical, still(anatomical))["shoulder_left"]
    assert hanging["shoulder_left"] == pytest.approx(min(1 - 60 / 108.5, rest))
    assert along["shoulder_left"] == rest < 1 - 2.5 / 102.5


def test_joints_without_ranges_have_no_margin(scene):
    assert np.isnan(list(margins(scene, still(scene)).values())).all()


def test_all_are_among_the_metrics(anatomical):
    trajectory = bent(anatomical, "head", np.radians(70))
    told = compute_metrics(anatomical, trajectory, np.zeros(trajectory.normal_force.shape))
    assert told["joint_range_margin"][JOINTS.index("neck")] == pytest.approx(0, abs=1e-9)
    assert told["neck_moment"] == neck_of(anatomical, trajectory)
    assert told["lifting_speed"] == lifting_speed(anatomical)


def moved(scene, *keyframes, axis=(0, 0, 1), rotation_axis=(0, 0, 1), point=(0, 0, 0)):
    """The scene with another program: (time [s], way [m], angle [°])."""
    frames = tuple(
        Keyframe(time_s=time, translation_m=way, rotation_deg=angle)
        for time, way, angle in keyframes
    )
    program = MotionProgram(
        translation_axis=axis, rotation_axis=rotation_axis, rotation_point_m=point, keyframes=frames
    )
    return replace(scene, motion=Motion(program, 0.0))


@settings(max_examples=20, deadline=None)
@given(st.floats(0.05, 2.0), st.floats(0.5, 20.0))
def test_a_lift_from_rest_to_rest_is_fastest_halfway(scene, height, time):
    """A cubic from rest to rest has at most 3/2 of its mean speed."""
    found = lifting_speed(moved(scene, (0, 0, 0), (time, height, 0)))
    assert found == pytest.approx(1.5 * height / time, rel=2e-6)


def test_only_upward_speed_is_lifting(scene):
    assert lifting_speed(moved(scene, (0, 0, 0), (2, -0.4, 0))) == 0
    assert lifting_speed(moved(scene, (0, 0, 0), (2, 0.4, 0), axis=(1, 0, 0))) == 0
    assert lifting_speed(moved(scene, (0, 0, 0), (2, 0, 90))) == 0
    slanted = moved(scene, (0, 0, 0), (2, 0.5, 0), axis=(3, 0, 4))
    assert lifting_speed(slanted) == pytest.approx(0.8 * 1.5 * 0.5 / 2, rel=2e-6)


def test_a_tilting_support_lifts_the_hips(scene):
    """Height of the hips about a pivot behind and below them, by differences."""
    pivot, angle, time = np.array([-0.3, 0, -0.1]), np.radians(30), 2.0
    tilted = moved(scene, (0, 0, 0), (time, 0, 30), rotation_axis=(0, -1, 0), point=tuple(pivot))
    x, _, z = scene.configuration[:3] - pivot
    share = np.linspace(0, 1, 20_001)
    turn = angle * share**2 * (3 - 2 * share)
    height = z * np.cos(turn) + x * np.sin(turn)
    fastest = np.diff(height).max() / (time * share[1])
    assert lifting_speed(tilted) == pytest.approx(fastest, rel=1e-5)


def test_the_shipped_lift_is_at_the_limit(scene):
    """Its file says so: at most 0.15 m/s."""
    assert lifting_speed(scene) == pytest.approx(0.15, rel=1e-5)
