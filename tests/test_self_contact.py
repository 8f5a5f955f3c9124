"""Capsules that keep parts of a body apart: closed forms, Newton's third law, energy, fit."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from sling_scenes import BODIES, shipped_body, sling_scene

from simcore.body import configuration, joint_angles
from simcore.body.capsules import DOMINANT, TRUNK, fit_capsules
from simcore.body.segments import INDEX, PARENTS, SEGMENT_NAMES
from simcore.contact.self_contact import add_self_contact, overlaps
from simcore.device.motion import STILL
from simcore.dynamics.implicit import IMPLICITNESS
from simcore.sling_interaction import SlingInteraction

seeds = st.integers(0, 2**32 - 2)
varied = settings(max_examples=60, deadline=None)
PAIR = np.array([[0, 1]])
K = 1.0e4


class Parts:
    """Capsules, each on a segment of its own, with ends and radii in the segment's frame."""

    def __init__(self, ends, radius, pairs=PAIR):
        self.ends, self.radius = np.array(ends, float), np.array(radius, float)
        self.pairs, count = np.array(pairs), len(self.ends)
        self.rotations = np.tile(np.eye(3), (count, 1, 1))
        self.positions = np.zeros((count, 3))
        self.velocities = np.zeros((count, 6))

    @classmethod
    def random(cls, rng, count=2, tapered=True, reach=0.15):
        pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
        radius = rng.uniform(0.03, 0.1, (count, 2))
        if not tapered:
            radius[:, 1] = radius[:, 0]
        parts = cls(rng.uniform(-reach, reach, (count, 2, 3)), radius, pairs)
        parts.rotations = Rotation.random(count, rng).as_matrix()
        parts.positions = rng.uniform(-reach, reach, (count, 3))
        parts.velocities = rng.normal(size=(count, 6))
        return parts

    def overlaps(self):
        return overlaps(self.pairs, self.ends, self.radius, self.rotations, self.positions)

    def wrench(self, damping=0.0, allowed=0.0):
        """Force and moment about each segment's origin (m, 6)."""
        total = np.zeros((len(self.ends), 6))
        add_self_contact(
            self.pairs, self.ends, self.radius, np.full(len(self.pairs), allowed), self.rotations,
            self.positions, self.velocities, np.full(len(self.pairs), K),
            np.full(len(self.pairs), damping), 0.0, total, *self.met(),
        )
        return total

    def met(self):
        """Places and directions (p, 3), and impedances (p,), to be overwritten."""
        count = len(self.pairs)
        return np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)

    def energy(self):
        return K / 2 * float((np.maximum(self.overlaps(), 0) ** 2).sum())

    def points(self, part, shares):
        """Points on an axis (n, 3), world."""
        ends = self.ends[part] @ self.rotations[part].T + self.positions[part]
        return ends[0] + np.asarray(shares)[:, None] * (ends[1] - ends[0])


@pytest.mark.parametrize(
    ("first", "second", "radius", "overlap", "force"),
    [
        # parallel, side by side
        ([[0, 0, 0], [1, 0, 0]], [[0, 0, 0.15], [1, 0, 0.15]], [[0.1, 0.1], [0.1, 0.1]],
         0.05, (0, 0, 1)),
        # parallel, the other way round, and shifted along the axis
        ([[0, 0, 0], [1, 0, 0]], [[1.2, 0, 0.15], [0.4, 0, 0.15]], [[0.1, 0.1], [0.1, 0.1]],
         0.05, (0, 0, 1)),
        # crossed at a right angle
        ([[-1, 0, 0], [1, 0, 0]], [[0, -1, -0.12], [0, 1, -0.12]], [[0.1, 0.1], [0.05, 0.05]],
         0.03, (0, 0, -1)),
        # end on
        ([[0, 0, 0], [1, 0, 0]], [[1.17, 0, 0], [2, 0, 0]], [[0.1, 0.1], [0.1, 0.1]],
         0.03, (1, 0, 0)),
        # corner to corner: a triangle of 3, 4 and 5
        ([[0, 0, 0], [1, 0, 0]], [[1.03, 0.04, 0], [1.03, 1, 0]], [[0.03, 0.03], [0.03, 0.03]],
         0.01, (0.6, 0.8, 0)),
        # tapered: a quarter of the way along, 0.08 + 0.25·(0.04 − 0.08) = 0.07
        ([[0, 0, 0], [1, 0, 0]], [[0.25, -1, 0.1], [0.25, 1, 0.1]], [[0.08, 0.04], [0.05, 0.05]],
         0.02, (0, 0, 1)),
        # the other tapered: three quarters of the way along, 0.02 + 0.75·(0.06 − 0.02) = 0.05
        ([[0.75, -1, 0], [0.75, 1, 0]], [[0, 0, 0.1], [1, 0, 0.1]], [[0.07, 0.07], [0.02, 0.06]],
         0.02, (0, 0, 1)),
        # a ball beside a tapered capsule, half way
        ([[0, 0, 0], [1, 0, 0]], [[0.5, 0.1, 0], [0.5, 0.1, 0]], [[0.02, 0.06], [0.1, 0.1]],
         0.04, (0, 1, 0)),
        # two balls
        ([[0, 0, 0], [0, 0, 0]], [[0, 0.1, 0], [0, 0.1, 0]], [[0.06, 0.06], [0.05, 0.05]],
         0.01, (0, 1, 0)),
        # apart
        ([[0, 0, 0], [1, 0, 0]], [[0, 0, 0.3], [1, 0, 0.3]], [[0.1, 0.1], [0.1, 0.1]],
         -0.1, (0, 0, 0)),
    ],
    ids=["parallel", "antiparallel", "crossed", "end_on", "corner", "tapered", "other_tapered",
         "ball", "balls", "apart"],
)
def test_closed_forms(first, second, radius, overlap, force):
    parts = Parts([first, second], radius)
    assert parts.overlaps() == pytest.approx([overlap], abs=1e-9)
    wrench = parts.wrench()
    expected = K * max(overlap, 0) * np.array(force)
    assert wrench[1, :3] == pytest.approx(expected, abs=1e-4)
    assert wrench[0, :3] == pytest.approx(-expected, abs=1e-4)


def test_parallel_parts_push_each_other_where_they_lie_beside_each_other():
    """Over the common stretch from 0.4 to 1 the force has its arm."""
    parts = Parts([[[0, 0, 0], [1, 0, 0]], [[0.4, 0, 0.15], [1.2, 0, 0.15]]], np.full((2, 2), 0.1))
    wrench = parts.wrench()
    assert 0.4 <= -wrench[1, 4] / wrench[1, 2] <= 1.0  # moment about y is −x F_z


@varied
@given(seeds)
def test_forces_and_moments_cancel(seed):
    """What one part gives another receives, along one line, damping and taper included."""
    parts = Parts.random(np.random.default_rng(seed), count=5)
    wrench = parts.wrench(damping=50.0)
    force, moment = wrench[:, :3], wrench[:, 3:] + np.cross(parts.positions, wrench[:, :3])
    size = np.abs(force).max() + 1e-6
    assert np.abs(force.sum(axis=0)).max() < 1e-11 * size
    assert np.abs(moment.sum(axis=0)).max() < 1e-9 * size


def test_random_parts_do_meet():
    """So that the tests with random parts say something."""
    met = [Parts.random(np.random.default_rng(seed)).wrench().any() for seed in range(60)]
    assert 20 < sum(met) < 60


@varied
@given(seeds)
def test_overlap_is_that_of_the_nearest_points(seed):
    """Against all pairs of 401 points of each axis: too far by less than a quarter step."""
    parts = Parts.random(np.random.default_rng(seed), tapered=False)
    shares = np.linspace(0, 1, 401)
    a, b = (parts.points(part, shares) for part in (0, 1))
    sampled = np.linalg.norm(a[:, None] - b, axis=2).min()
    step = max(np.linalg.norm(a[1] - a[0]), np.linalg.norm(b[1] - b[0]))
    exact = parts.radius[:, 0].sum() - parts.overlaps()[0]
    assert exact <= sampled + 1e-9
    assert sampled <= exact + step


@varied
@given(seeds, st.integers(0, 5))
def test_nearly_parallel_parts_are_as_near_as_parallel_ones(seed, power):
    """The angle goes through the switch between both cases."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(-1, 0.9)
    tilt = rng.choice([-1, 1]) * 10.0 ** -(3 + power / 2)
    parts = Parts(
        [[[0, 0, 0], [1, 0, 0]], [[low, 0, 0.15], [low + 1, 0, 0.15 + tilt]]], np.full((2, 2), 0.1)
    )
    along = np.clip(low, 0, 1)
    nearest = 0.15 + tilt * (min(1 - low, 1) if tilt < 0 else along - low)
    assert parts.overlaps()[0] == pytest.approx(0.2 - nearest, abs=2e-5)


@varied
@given(seeds)
def test_undamped_force_is_minus_the_gradient_of_the_energy(seed):
    """k δ²/2, for moves and turns of every part by finite differences; radii do not taper."""
    rng = np.random.default_rng(seed)
    parts = Parts.random(rng, count=3, tapered=False)
    parts.velocities[:] = 0
    wrench, h = parts.wrench(), 1e-6
    for part in range(3):
        slope = np.empty(6)
        for axis in range(6):
            energies = []
            for sign in (1, -1):
                moved = Parts(parts.ends, parts.radius, parts.pairs)
                moved.rotations, moved.positions = parts.rotations.copy(), parts.positions.copy()
                step = sign * h * np.eye(3)[axis % 3]
                if axis < 3:
                    moved.positions[part] += step
                else:
                    turn = Rotation.from_rotvec(step).as_matrix()
                    moved.rotations[part] = turn @ parts.rotations[part]
                energies.append(moved.energy())
            slope[axis] = (energies[1] - energies[0]) / (2 * h)
        assert wrench[part] == pytest.approx(slope, abs=0.05 + 1e-3 * np.abs(wrench).max())


@varied
@given(seeds)
def test_damping_takes_energy_and_never_pulls(seed):
    parts = Parts.random(np.random.default_rng(seed))
    way = parts.wrench()[1, :3]
    spring, damped = parts.wrench(), parts.wrench(damping=400.0)
    assert damped[1, :3] @ way >= 0  # still away from the other
    body_to_world = np.einsum("mij,mkj->mki", parts.rotations, parts.velocities.reshape(-1, 2, 3))
    power = float(((damped - spring) * body_to_world.reshape(-1, 6)).sum())
    assert power <= 1e-9


def test_approach_is_damped_with_the_speed_of_the_touching_points():
    """c δ̇: a turning rod whose end comes at 2 m/s."""
    parts = Parts([[[0, 0, 0], [1, 0, 0]], [[1, -1, 0.15], [1, 1, 0.15]]], np.full((2, 2), 0.1))
    parts.velocities[0] = [0, 0, 0, 0, -2.0, 0]  # its end at x = 1 rises with 2 m/s
    assert parts.wrench(damping=50.0)[1, 2] == pytest.approx(K * 0.05 + 50 * 2.0, rel=1e-6)
    parts.velocities[0] *= -10
    assert not parts.wrench(damping=50.0).any()  # leaves faster than the spring follows


@varied
@given(seeds, st.floats(0, 0.05))
def test_what_is_allowed_is_no_contact(seed, allowed):
    """The force starts from nothing where the overlap passes what is allowed."""
    parts = Parts.random(np.random.default_rng(seed))
    parts.velocities[:] = 0
    beyond = parts.overlaps()[0] - allowed
    force = np.linalg.norm(parts.wrench(allowed=allowed)[0, :3])
    assert force == pytest.approx(K * max(beyond, 0), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("gap", [-4e-3, -2e-3])
def test_a_hand_between_two_parts_comes_to_rest(gap):
    """Squeezed, by steps of Eq. I1 that are far too long for its springs."""
    side = 0.1 + gap
    axes = [[[0, -0.1, z], [0, 0.1, z]] for z in (0.0, side, -side)]
    parts = Parts(axes, np.full((3, 2), 0.05), [[0, 1], [0, 2]])
    mass, step, height, speed = 0.25, 0.016, 0.0, 0.3
    lag, damping = IMPLICITNESS * step, 0.02 * K
    speeds = []
    for _ in range(40):
        height += step / 2 * speed
        parts.positions[0, 2], parts.velocities[0, 2] = height, speed
        total, met = np.zeros((3, 6)), parts.met()
        add_self_contact(
            parts.pairs, parts.ends, parts.radius, np.zeros(2), parts.rotations, parts.positions,
            parts.velocities, np.full(2, K), np.full(2, damping), lag, total, *met,
        )
        speed += step * total[0, 2] / (mass + met[2].sum())
        height += step / 2 * speed
        speeds.append(abs(speed))
    assert max(speeds[-10:]) < 1e-3 * 0.3


@pytest.mark.parametrize(("speed", "near"), [(0.2, False), (0.4, True), (-0.4, True)])
def test_a_pair_that_is_apart_has_an_impedance_if_it_may_meet_in_the_step(speed, near):
    """5 mm apart, and two lags of 8 ms."""
    parts = Parts(
        [[[0, 0, 0], [0.2, 0, 0]], [[0, 0, 0.105], [0.2, 0, 0.105]]], np.full((2, 2), 0.05)
    )
    parts.velocities[0, 2], lag, damping = speed, 0.008, 30.0
    total, met = np.zeros((2, 6)), parts.met()
    add_self_contact(
        parts.pairs, parts.ends, parts.radius, np.zeros(1), parts.rotations, parts.positions,
        parts.velocities, np.array([K]), np.array([damping]), lag, total, *met,
    )
    assert not total.any()
    assert met[2] == pytest.approx(lag * (lag * K + damping) if near else 0.0)
    assert not near or met[1][0] == pytest.approx([0, 0, 1], abs=1e-9)


def test_wrenches_are_added_to():
    parts = Parts.random(np.random.default_rng(3))
    alone, total = parts.wrench(), np.ones((2, 6))
    add_self_contact(
        parts.pairs, parts.ends, parts.radius, np.zeros(1), parts.rotations, parts.positions,
        parts.velocities, np.full(1, K), np.zeros(1), 0.0, total, *parts.met(),
    )
    assert total == pytest.approx(1 + alone)


@pytest.mark.parametrize("name", BODIES)
def test_capsules_of_shipped_bodies(name):
    """As thick as a body is; what can meet is mirrored, as far as an uneven mesh is: 12 mm, 5 %."""
    capsules = fit_capsules(shipped_body(name).skin)
    assert capsules.radius.min() > 0.005
    assert capsules.radius.max() < 0.25
    for left in np.unique(capsules.pairs):
        segment = SEGMENT_NAMES[left]
        if not segment.endswith("_left"):
            continue
        right = INDEX[segment.replace("_left", "_right")]
        radius, other = capsules.radius[left], capsules.radius[right]
        ends, mirrored = capsules.ends[left], capsules.ends[right] * [1, -1, 1]
        if np.linalg.norm(ends - mirrored) > np.linalg.norm(ends - mirrored[::-1]):
            mirrored, other = mirrored[::-1], other[::-1]  # an axis has no sense
        assert np.linalg.norm(ends - mirrored, axis=1).max() < 0.012, segment
        assert radius == pytest.approx(other, rel=0.05), segment


@pytest.mark.parametrize("name", BODIES)
def test_capsules_lie_in_the_skin_that_they_stand_for(name):
    """Axes are inside; some half of the skin of a limb is nearer to its axis than its radius.

    Of either side, whose radii are means of both: were they of two limbs, neither would fit.
    """
    skin = shipped_body(name).skin
    capsules = fit_capsules(skin)
    for index in np.unique(capsules.pairs):
        mine = (skin.influence_segment == index) & (skin.influence_weight > DOMINANT)
        points = skin.influence_point[mine]
        low, high = points.min(axis=0), points.max(axis=0)
        assert np.all((low < capsules.ends[index]) & (capsules.ends[index] < high))
        if SEGMENT_NAMES[index] in TRUNK:
            continue
        axis = capsules.ends[index, 1] - capsules.ends[index, 0]
        along = np.clip((points - capsules.ends[index, 0]) @ axis / (axis @ axis), 0, 1)
        from_axis = np.linalg.norm(points - capsules.ends[index, 0] - along[:, None] * axis, axis=1)
        thick = capsules.radius[index, 0] + along * np.diff(capsules.radius[index])[0]
        assert 0.3 < np.mean(from_axis < thick) < 0.52, SEGMENT_NAMES[index]


def pairs_by_name():
    pairs = fit_capsules(shipped_body(BODIES[0]).skin).pairs
    return {(SEGMENT_NAMES[i], SEGMENT_NAMES[j]) for i, j in pairs}


def test_neighbours_in_the_skeleton_are_no_pair_but_arm_and_chest():
    for first, second in pairs_by_name():
        if {first.rpartition("_")[0], second} == {"upper_arm", "thoracic"} or (
            {first, second.rpartition("_")[0]} == {"upper_arm", "thoracic"}
        ):
            continue
        assert PARENTS[INDEX[first]] != INDEX[second], (first, second)
        assert PARENTS[INDEX[second]] != INDEX[first], (first, second)


def test_pairs_come_in_mirror_images():
    pairs = pairs_by_name()
    assert ("thigh_left", "thigh_right") in pairs
    swap = str.maketrans({"<": ">", ">": "<"})
    for pair in pairs:
        mirrored = [
            name.replace("left", "<").replace("right", ">").translate(swap)
            .replace("<", "left").replace(">", "right")
            for name in pair
        ]
        assert pair[0] != pair[1]
        assert tuple(mirrored) in pairs or tuple(mirrored[::-1]) in pairs


def accelerations(q=None):
    """Acceleration of the lying man at q, with and without self-contact."""
    found = []
    for law in (sling_scene().method.self_contact.model_dump(), None):
        scene = sling_scene({"method.self_contact": law})
        interaction = SlingInteraction(scene)
        v = np.zeros(scene.body.model.nv)
        at = scene.configuration if q is None else q
        interaction.exchange(STILL, scene.configuration, v, scene.method.time_step_s)
        found.append(interaction.acceleration(STILL, at, v))
    return found


def test_a_scene_starts_without_self_contact():
    """Parts may overlap as they do at the start: crossed arms, thighs of the obese."""
    with_contact, without = accelerations()
    assert np.array_equal(with_contact, without)


def test_thighs_that_meet_are_pushed_apart():
    """Adducting the left hip by 0.25 rad brings the thighs together, and the push abducts."""
    scene = sling_scene()
    model = scene.body.model
    joint = model.joints[model.getJointId("thigh_left")]
    angles = joint_angles(scene.body, scene.configuration)
    assert angles["hip_left"]["abduction"] > 0
    pushed = {}
    for change in (-0.25, 0.25):
        angles["hip_left"]["abduction"] += change
        q = configuration(scene.body, angles)
        q[:7] = scene.configuration[:7]
        with_contact, without = accelerations(q)
        pushed[change] = with_contact - without
        angles["hip_left"]["abduction"] -= change
    assert not pushed[0.25].any()
    step = pin.integrate(model, q, 1e-4 * pushed[-0.25])
    turned = joint_angles(scene.body, step)["hip_left"]["abduction"]
    assert turned > angles["hip_left"]["abduction"] + 0.25 + 1e-5
    assert np.abs(pushed[-0.25][joint.idx_v : joint.idx_v + joint.nv]).max() > 1.0
