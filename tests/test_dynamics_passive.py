"""Passive moments of the joints: published figures, and a slow path that shares no kernel."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from passive_reference import (
    DOWN,
    SEGMENT_OF,
    any_pose,
    dofs,
    pose,
    shortest_turn,
    slow_angles,
    slow_moments,
    slow_torque,
    wild_pose,
)
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from simcore.body import joint_angles
from simcore.body.posture import TURNS
from simcore.body.segments import SEGMENTS, kind_of
from simcore.config import Posture, read_design
from simcore.dynamics.joint_angles import ANGLES, CONE_AXIS, joint_ranges
from simcore.dynamics.passive import PassiveJoints
from simcore.dynamics.passive_moments import limit_of

POSTURES = Path(__file__).parents[1] / "designs" / "postures"
seeds = st.integers(0, 2**32 - 2)
SINGLE = [segment for segment in SEGMENTS[1:] if segment.joint != "spherical"]


@pytest.fixture(scope="module")
def body(coarse_body):
    return coarse_body


@pytest.fixture(scope="module")
def passive(body):
    return PassiveJoints(body.model)


def evaluate(passive, q):
    torque, stiffness = np.zeros(47), np.zeros((47, 47))
    passive.add_torque(q, np.zeros(47), torque, stiffness)
    return torque, stiffness


def moment_of(body, passive, joint, angle, degrees):
    """Moment of a first angle, whose axis is the joint's own while the other two are zero."""
    start = dofs(body, joint)[1].start
    turn = TURNS[kind_of(joint)][0]
    assert turn.name == angle
    torque = evaluate(passive, pose(body, degrees))[0]
    single = SEGMENT_OF[joint].joint != "spherical"
    return torque[start] if single else turn.sign * torque[start + turn.axis]


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_angles_are_those_of_the_slow_path(body, passive, seed):
    q = any_pose(body, seed)
    slow = slow_angles(body, q)
    assert set(passive.names) == set(slow)
    np.testing.assert_allclose(
        passive.angles(q), [slow[name] for name in passive.names], atol=1e-7
    )


def test_angles_are_those_of_postures(body, passive):
    assert {joint: turns for joint, turns in ANGLES.items() if joint != "shoulder"} == {
        joint: tuple((turn.name, turn.axis, turn.sign, turn.mirrored) for turn in turns)
        for joint, turns in TURNS.items() if joint != "shoulder"
    }
    q = any_pose(body, 1)
    posture = joint_angles(body, q)
    for (joint, angle), value in zip(passive.names, passive.angles(q), strict=True):
        if not joint.startswith("shoulder"):
            assert value == pytest.approx(posture[joint][angle], abs=1e-9)


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_torque_does_the_work_of_the_moments(body, passive, seed):
    """τ·v = Σ m θ̇ for each velocity alone, with moments, angles and rates of the slow path."""
    q = any_pose(body, seed)
    torque = evaluate(passive, q)[0]
    scale = 1 + np.abs(torque).max()
    np.testing.assert_allclose(torque, slow_torque(body, q), atol=1e-6 * scale)


@pytest.mark.parametrize(
    ("hip", "knee", "expected"),
    [(0, 0, (8.6, 10.4, 6.4)), (90, 90, (0.3, -3.5, -0.1)), (90, 0, (-51.4, 47.0, 6.4))],
)
@pytest.mark.parametrize("side", ["left", "right"])
def test_moments_of_the_leg_are_riener_and_edrichs(body, passive, side, hip, knee, expected):
    degrees = {"hip": {"flexion": hip}, "knee": {"flexion": knee}}
    told = (
        moment_of(body, passive, f"hip_{side}", "flexion", degrees),
        moment_of(body, passive, f"knee_{side}", "flexion", degrees),
        -moment_of(body, passive, f"ankle_{side}", "dorsiflexion", degrees),
    )
    assert told == pytest.approx(expected, abs=0.2)


def test_muscles_over_two_joints_pull_at_both(body, passive):
    """Hamstrings: hip flexion bends a straight knee. Calf: a bent knee frees the foot."""
    def knee(hip):
        return moment_of(body, passive, "knee_left", "flexion", {"hip": {"flexion": hip}})

    def foot(knee):
        return moment_of(body, passive, "ankle_left", "dorsiflexion",
                         {"knee": {"flexion": knee}, "ankle": {"dorsiflexion": 15}})

    assert knee(90) > knee(45) > knee(0) > 0
    assert foot(0) < foot(60) < 0


@pytest.mark.parametrize(
    ("degrees", "joint", "component", "expected"),
    [
        # Anderson's own figures at his θ1 and θ2; the torque resists
        ({"hip": {"abduction": np.degrees(0.5)}}, "hip_left", 0, -0.03),
        ({"hip": {"abduction": np.degrees(0.5)}}, "hip_right", 0, 0.03),
        ({"hip": {"rotation": np.degrees(0.92)}}, "hip_left", 2, 0.03),
        ({"ankle": {"inversion": np.degrees(0.65)}}, "ankle_left", 0, 60.21),
        ({"ankle": {"inversion": -np.degrees(0.65)}}, "ankle_left", 0, -60.21),
        ({"toe": {"extension": np.degrees(1.134)}}, "toe_left", 0, -0.9),
        ({"toe": {"extension": 0}}, "toe_right", 0, 0.18),
        # ends of ranges without published parameters
        ({"neck": {"flexion": 70}}, "neck", 0, -5.0),
        ({"neck": {"flexion": -55}}, "neck", 0, 5.0),
        ({"elbow": {"flexion": 143.5}}, "elbow_left", 1, 3.0),
        ({"elbow": {"pronation": 78}}, "elbow_right", 2, -3.0),
        ({"wrist": {"flexion": 90}}, "wrist_left", 0, 1.0),
    ],
)
def test_limits_reach_their_figures(body, passive, degrees, joint, component, expected):
    torque = evaluate(passive, pose(body, degrees))[0][dofs(body, joint)[1]]
    assert torque[component] == pytest.approx(expected, rel=1e-2)


@pytest.mark.parametrize(
    ("angle", "axis", "at", "expected"),
    [("flexion", 1, 0.524, -0.25), ("flexion", 1, -0.17, 0.35), ("rotation", 2, 0.349, -0.25),
     ("lateral_bend", 0, 0.349, 0.25)],
)
def test_lumbar_and_thoracic_joints_are_the_trunk_in_series(
    body, passive, angle, axis, at, expected
):
    """The trunk's angle shared between both: each carries the trunk's whole moment."""
    half = {angle: np.degrees(at / 2)}
    torque = evaluate(passive, pose(body, {"lumbar": half, "thoracic": half}))[0]
    for joint in ("lumbar", "thoracic"):
        assert torque[dofs(body, joint)[1]][axis] == pytest.approx(expected, rel=1e-2)


def test_limits_are_negligible_well_inside_the_range():
    for (joint, angle), reach in joint_ranges().items():
        if reach.high - reach.low > np.radians(60):
            low, low_rate, low_at, high, high_rate, high_at = limit_of(joint, angle)
            inside = np.radians(25)
            if joint != "toe":  # whose published stop is at zero, above what clinics measure
                assert low * np.exp(-low_rate * (reach.low + inside - low_at)) < 0.2, joint
            assert high * np.exp(high_rate * (reach.high - inside - high_at)) < 0.2, (joint, angle)


@settings(max_examples=30, deadline=None)
@given(seeds, st.booleans())
def test_mirrored_poses_have_mirrored_torques(body, passive, seed, wild):
    q = wild_pose(body, seed) if wild else any_pose(body, seed)
    mirrored, expected = q.copy(), np.zeros(47)
    torque, other = evaluate(passive, q)[0], {"left": "right", "right": "left"}
    for joint in SEGMENT_OF:
        stem, _, side = joint.rpartition("_")
        twin = f"{stem}_{other[side]}" if side in other else joint
        if joint == "root":
            continue
        (at, dof), (twin_at, twin_dof) = dofs(body, joint), dofs(body, twin)
        spherical = SEGMENT_OF[joint].joint == "spherical"
        mirrored[twin_at] = q[at] * ([-1, 1, -1, 1] if spherical else [1])
        expected[twin_dof] = torque[dof] * ([-1, 1, -1] if spherical else [1])
    scale = 1 + np.abs(torque).max()
    np.testing.assert_allclose(evaluate(passive, mirrored)[0], expected, atol=1e-9 * scale)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_stiffness_is_the_slope_of_each_joints_own_moments(body, passive, seed):
    """δᵀKδ = −Σ (dθ/dε)(dm/dε) along a turn δ of one joint, of the slow path's m and θ."""
    q, step = any_pose(body, seed), 1e-6
    stiffness = evaluate(passive, q)[1]
    rng = np.random.default_rng(seed)
    for joint in SEGMENT_OF:
        if joint == "root":
            continue
        way = np.zeros(47)
        way[dofs(body, joint)[1]] = rng.normal(size=len(way[dofs(body, joint)[1]]))
        ends = [slow_angles(body, pin.integrate(body.model, q, sign * step * way))
                for sign in (1, -1)]
        moments = [slow_moments(angles) for angles in ends]
        slope = -sum(
            (ends[0][each] - ends[1][each]) * (moments[0][each] - moments[1][each])
            for each in ends[0] if each[0] == joint
        ) / (2 * step) ** 2
        assert way @ stiffness @ way == pytest.approx(slope, rel=1e-4, abs=1e-4)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_stiffness_of_a_hinge_is_the_slope_of_its_torque(body, passive, seed):
    q, step = any_pose(body, seed), 1e-6
    stiffness = evaluate(passive, q)[1]
    for segment in SINGLE:
        i = dofs(body, segment.anatomy)[1].start
        way = step * np.eye(47)[i]
        ahead, behind = (evaluate(passive, pin.integrate(body.model, q, sign * way))[0][i]
                         for sign in (1, -1))
        slope = -(ahead - behind) / (2 * step)
        assert stiffness[i, i] == pytest.approx(slope, rel=1e-4, abs=1e-5)


def test_stiffness_of_a_ball_joint_is_near_the_slope_of_its_torque(body, passive):
    """What is left out, the turning of the angles' axes, is of the order of the moment itself."""
    q = pose(body, {"hip": {"abduction": 50, "flexion": 20}, "ankle": {"inversion": 30},
                    "elbow": {"flexion": 150}, "wrist": {"flexion": -75}})
    q[dofs(body, "shoulder_left")[0]] = Rotation.from_euler("YXZ", [-2.9, 0.3, 0.4]).as_quat()
    torque, stiffness = evaluate(passive, q)
    step = 1e-6
    slope = -np.array([
        (evaluate(passive, pin.integrate(body.model, q, step * way))[0]
         - evaluate(passive, pin.integrate(body.model, q, -step * way))[0]) / (2 * step)
        for way in np.eye(47)
    ])
    for joint in ("hip_left", "ankle_left", "elbow_left", "wrist_left", "shoulder_left"):
        at = dofs(body, joint)[1]
        symmetric = (slope[at, at] + slope[at, at].T) / 2
        left_out = np.linalg.norm(symmetric - stiffness[at, at], 2)
        assert left_out < 2 * np.linalg.norm(torque[at]), joint
        assert left_out < 0.2 * np.linalg.norm(symmetric, 2), joint


@settings(max_examples=50, deadline=None)
@given(seeds)
def test_whatever_the_state_torque_is_bounded_and_stiffness_semidefinite(body, passive, seed):
    torque, stiffness = evaluate(passive, wild_pose(body, seed))
    assert np.abs(torque).max() < 2e5  # 20 rad beyond the toe's stop at 7 kN·m/rad, and some
    assert not torque[:6].any()
    assert np.array_equal(stiffness, stiffness.T)
    assert np.linalg.eigvalsh(stiffness).min() > -1e-9 * np.abs(stiffness).max()


def test_a_quaternion_and_its_negative_are_one_pose(body, passive):
    q = any_pose(body, 5)
    other = q.copy()
    for segment in SEGMENTS[1:]:
        if segment.joint == "spherical":
            other[dofs(body, segment.anatomy)[0]] *= -1
    np.testing.assert_allclose(passive.angles(other), passive.angles(q), atol=1e-12)


@pytest.mark.parametrize("joint", ["hip", "ankle", "elbow", "wrist", "lumbar"])
@pytest.mark.parametrize("second", [np.pi / 2, -np.pi / 2])
def test_singular_angles_give_bounded_torque(body, passive, joint, second):
    """On the singularity, and within rounding of it, where a rate of an angle has no bound."""
    name = joint if joint == "lumbar" else f"{joint}_left"
    order = "".join("XYZ"[turn.axis] for turn in TURNS[joint])
    for off in (0.0, 1e-12, 1e-9, 1e-4):
        q = pin.neutral(body.model)
        turn = Rotation.from_euler(order, [0.3, second - np.sign(second) * off, 0.2])
        q[dofs(body, name)[0]] = turn.as_quat()
        torque, stiffness = evaluate(passive, q)
        assert np.isfinite(stiffness).all()
        assert 1.0 < np.linalg.norm(torque[dofs(body, name)[1]]) < 6000.0


def test_an_arm_opposite_to_its_cone_gives_bounded_torque(body, passive):
    for off in (0.0, 1e-12, 1e-9, 1e-4):
        q = pin.neutral(body.model)
        arm = -CONE_AXIS + off * np.array([0.0, 1.0, 0.0])
        turn = shortest_turn(DOWN, arm / np.linalg.norm(arm))
        q[dofs(body, "shoulder_left")[0]] = turn.as_quat()
        torque, stiffness = evaluate(passive, q)
        assert np.isfinite(stiffness).all()
        assert np.linalg.norm(torque) < 6000.0


def test_torque_has_a_continuous_slope_on_to_the_tangents(body, passive):
    """Along the knee, through all tangents, steps of the slope halve with those of the grid."""
    i, at = dofs(body, "knee_left")[1].start, dofs(body, "knee_left")[0].start

    def slopes(count):
        q, told = pin.neutral(body.model), []
        for angle in np.linspace(-0.6, 3.4, count):
            q[at] = angle
            told.append(evaluate(passive, q)[0][i])
        return np.diff(told) / (4.0 / (count - 1))

    coarse, fine = (np.abs(np.diff(slopes(count))).max() for count in (4001, 8001))
    assert fine == pytest.approx(coarse / 2, rel=0.1)
    far = [evaluate(passive, pin.integrate(body.model, pin.neutral(body.model),
                                           -turn * np.eye(47)[i]))[0][i] for turn in (5, 6, 7)]
    assert far[2] - far[1] == pytest.approx(far[1] - far[0], rel=1e-9)


@pytest.mark.parametrize("hip", [-10, 0, 45, 90])
@pytest.mark.parametrize("foot", [-30, 0, 10])
def test_no_knee_bends_backwards(body, passive, hip, foot):
    """Where the passive moment holds a push of 50 N·m, either way."""
    def resists(knee, push):
        return push + moment_of(
            body, passive, "knee_left", "flexion",
            {"hip": {"flexion": hip}, "knee": {"flexion": knee}, "ankle": {"dorsiflexion": foot}},
        )

    assert -9.0 < brentq(resists, -60, 190, args=(-50.0,)) < 10.0
    assert 130.0 < brentq(resists, -60, 190, args=(50.0,)) < 155.0


@pytest.mark.parametrize("side", ["left", "right"])
def test_an_arm_may_be_lifted_anywhere_but_far_behind(body, passive, side):
    """Through 90° of abduction, where Grood and Suntay's angles are singular, nothing happens."""
    at, outward = dofs(body, f"shoulder_{side}"), 1 if side == "left" else -1

    def lifted(degrees, forward, sideways):
        q = pin.neutral(body.model)
        q[at[0]] = Rotation.from_rotvec(
            np.radians(degrees) * np.array([sideways * outward, -forward, 0.0])
        ).as_quat()
        return np.linalg.norm(evaluate(passive, q)[0][at[1]])

    for degrees in range(0, 151, 2):
        assert lifted(degrees, 1, 0) < 1.0
        assert lifted(degrees, 0, 1) < 1.0
    assert lifted(164, 1, 0) == pytest.approx(5.0, rel=0.1)
    assert lifted(50, -1, 0) < 1.0
    assert lifted(90, -1, 0) > 50.0


@pytest.mark.parametrize(
    ("shoulder", "inside"),
    [
        ({"rotation": 90}, True), ({"rotation": -90}, True),
        ({"abduction": 89, "rotation": -90}, True), ({"abduction": 89, "rotation": 70}, True),
        ({"flexion": 90, "rotation": 70}, True), ({"flexion": 160}, True),
        ({"rotation": 130}, False), ({"rotation": -130}, False),
    ],
)
def test_arms_turn_as_far_as_clinics_measure(body, passive, shoulder, inside):
    angles = passive.angles(pose(body, {"shoulder": shoulder}))
    assert ((passive.low <= angles) & (angles <= passive.high)).all() == inside


@pytest.mark.parametrize(
    ("posture", "recline", "largest"),
    [("seated", 0, 4.0), ("seated", 40, 11.0), ("lying", 90, 11.0), ("lying", 60, 17.0)],
)
def test_shipped_postures_are_inside_all_ranges_with_small_moments(
    body, passive, posture, recline, largest
):
    degrees = read_design(Posture, POSTURES / f"{posture}.yaml").angles_deg
    hip = {**degrees["hip"], "flexion": degrees["hip"]["flexion"] - recline}
    q = pose(body, {**degrees, "hip": hip})
    angles = passive.angles(q)
    for name, angle, low, high in zip(
        passive.names, angles, passive.low, passive.high, strict=True
    ):
        assert low - 1e-9 <= angle <= high + 1e-9, name
    assert np.abs(evaluate(passive, q)[0]).max() < largest


def test_torque_and_stiffness_are_added_to_what_is_there(body, passive):
    q = any_pose(body, 3)
    torque, stiffness = evaluate(passive, q)
    total, sum_of = np.ones(47), np.ones((47, 47))
    passive.add_torque(q, np.ones(47), total, sum_of)
    np.testing.assert_allclose(total, 1 + torque)
    np.testing.assert_allclose(sum_of, 1 + stiffness)


def test_every_range_has_its_source():
    for (joint, angle), reach in joint_ranges().items():
        assert reach.low < reach.high, (joint, angle)
        assert reach.source, (joint, angle)
        assert reach.confidence in ("R", "M", "A"), (joint, angle)
    assert set(joint_ranges()) == {
        (joint, turn[0]) for joint, turns in ANGLES.items() for turn in turns
    }
