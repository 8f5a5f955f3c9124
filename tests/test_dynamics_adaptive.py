"""Steps as long as motion and stability allow (Eqs. I3 to I5)."""


import numpy as np
import pinocchio as pin
import pytest
from conftest import MAN, ROOT
from hypothesis import given
from hypothesis import strategies as st
from pressed_skin import Skin
from scipy.spatial.transform import Rotation

from simcore.body.build import posed_skin
from simcore.body.skin_listed import segment_balls
from simcore.config import Design, Method, read_design
from simcore.contact.segment_motion import skin_speeds
from simcore.device.motion import STILL, DeviceState
from simcore.dynamics.adaptive import SAFETY, StepLadder, stable_step
from simcore.dynamics.integrators import rk4_step
from simcore.dynamics.pinocchio_views import view_segments
from simcore.scene import build_scene
from simcore.simulate import simulate


@given(pace=st.floats(0, 0.1), last=st.integers(1, 8))
def test_steps_are_the_longest_that_are_allowed(pace, last):
    ladder = StepLadder(0.008, 0.001)
    for _ in range(4):
        before = ladder.choose(lambda: last * 0.001 * (1 + 1e-9))
    ticks = ladder.choose(lambda: pace)
    assert before == last and 1 <= ticks <= min(8, 2 * last)
    assert ticks == 1 or ticks * 0.001 <= pace * (1 + 1e-9)
    assert ticks == min(8, 2 * last) or (ticks + 1) * 0.001 > pace * (1 - 1e-9)


def test_no_pace_at_all_allows_the_longest():
    ladder = StepLadder(0.008, 0.001)
    assert ladder.choose(lambda: np.inf) == 8
    assert ladder.choose(lambda: 0.0) == 1


def test_one_length_is_kept_without_asking():
    ladder = StepLadder(0.004, 0.004)
    assert [ladder.choose(None) for _ in range(5)] == [1] * 5


@pytest.mark.parametrize(("longer", "grows"), [(SAFETY, False), (0.99, False), (1.02, True)])
@pytest.mark.parametrize(("stiffness", "damping"), [(0.0, 0.3), (40.0, 0.0)])
def test_joints_set_the_longest_stable_step(coarse_body, stiffness, damping, longer, grows):
    """The fastest motion of springs or dampers alone, about a posture, dies away or grows."""
    model, data = coarse_body.model, coarse_body.model.createData()
    mass = pin.crba(model, data, coarse_body.rest_configuration)
    mass = np.triu(mass) + np.triu(mass, 1).T
    joints = np.r_[np.zeros(6), np.ones(model.nv - 6)]
    spring, damper = stiffness * joints, damping * joints
    step = longer / SAFETY * stable_step(mass, spring, damper)
    rate = np.linalg.eigvals(np.linalg.solve(mass, np.diag(spring + damper)))
    assert step * max(abs(rate)) ** (0.5 if stiffness else 1.0) == pytest.approx(
        longer * 2.8, rel=0.02
    )
    free = pin.Model()
    for _ in range(model.nv):
        free.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), f"{free.njoints}")
    q = v = np.random.default_rng(2).normal(size=model.nv)

    def acceleration(time, q, v):
        return -np.linalg.solve(mass, spring * q + damper * v)

    sizes = []
    for _ in range(400):
        q, v, _ = rk4_step(free, acceleration, 0.0, q, v, acceleration(0.0, q, v), step)
        sizes.append(np.abs(v).max())
    assert (sizes[-1] > 30 * sizes[0]) == grows


@pytest.mark.parametrize(("velocity", "expected"), [
    ([[0.1, 0, 0], [0, 0, -0.1], [0, 0, 0.2]], 0.005 / 0.1),  # the first, which touches
    ([[0.1, 0, 0], [0, 0.5, -4.0], [0, 0, 0.2]], 0.02 / np.hypot(0.5, 4.0)),  # will, from far
    ([[0.1, 0, 0], [0, 0, -0.1], [2, 0, -0.2]], 0.005 / np.hypot(2, 0.2)),  # will, from near
])
def test_what_touches_or_will_sets_the_pace(velocity, expected):
    """The least of max(d, φ) / speed."""
    skin = Skin([[0, 0, -0.002], [0.1, 0, 0.02], [0.2, 0, 0.001]])
    skin.velocities[:] = velocity
    skin.motion = 0.005
    skin.evaluate(0.002)
    assert skin.pace == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_no_skin_is_faster_than_its_bound(seed, coarse_body):
    """Against differences of all of the skin, seen from a device that moves and turns."""
    rng = np.random.default_rng(seed)
    model, skin = coarse_body.model, coarse_body.skin
    data = model.createData()
    views = view_segments(model, data)
    q, v = pin.randomConfiguration(model, -np.ones(model.nq), np.ones(model.nq)), rng.normal(
        size=model.nv
    )
    device = DeviceState(np.eye(3), rng.normal(size=3), rng.normal(size=3), rng.normal(size=3))
    pin.forwardKinematics(model, data, q, v)
    told, still = np.empty((2, len(views.positions)))
    for moved, speed in ((device, told), (STILL, still)):
        skin_speeds(
            views.rotations, views.positions, views.velocities, moved.position,
            moved.linear_velocity, moved.angular_velocity, *segment_balls(skin, len(speed)), speed,
        )

    def seen(time):
        turn = Rotation.from_rotvec(time * device.angular_velocity)
        place = posed_skin(coarse_body, pin.integrate(model, q, time * v))
        return turn.inv().apply(place - device.position - time * device.linear_velocity)

    speed = np.linalg.norm(seen(1e-6) - seen(-1e-6), axis=1) / 2e-6
    owner = np.repeat(np.arange(skin.vertex_count), np.diff(skin.influence_offsets))
    alone = np.diff(skin.influence_offsets)[owner] == 1
    of, vertex = skin.influence_segment[alone], owner[alone]
    assert np.all(speed[vertex] <= told[of] * (1 + 1e-6))
    for segment in np.unique(of):  # and the bound is not idle
        assert told[segment] < 4 * speed[vertex[of == segment]].max()
    assert not np.allclose(still, told)


def settled(design_with, name, longest, shortest, friction_force=None):
    """Return the trajectory of a coarse man under a shipped method who only settles."""
    tree = design_with({
        "device.motion.keyframes": [
            {"time_s": 0, "translation_m": 0, "rotation_deg": 0},
            {"time_s": 0.1, "translation_m": 0, "rotation_deg": 0},
        ],
    }, support_angle_deg=12).model_dump()
    method = read_design(Method, ROOT / "designs" / "methods" / f"{name}.yaml").model_dump()
    method |= {"hold_s": 1.0}
    method["adaptive_step"] |= {"longest_s": longest, "shortest_s": shortest}
    if friction_force:
        method["contact"]["friction_force_n"] = friction_force
    return simulate(build_scene(Design.model_validate(tree | {"method": method}), MAN, ROOT))


def pelvis(run):
    """Where it ends on the device [m]."""
    return run.q[-1, :3] - run.device_position[-1]


def test_adaptive_steps_end_where_short_ones_do(design_with):
    """As with steps of 1 ms: in place to 2 mm, in the force that carries him to 1 %."""
    short, adaptive = (
        settled(design_with, "production", longest, 0.001) for longest in (0.001, 0.016)
    )
    assert short.status == adaptive.status == "ok"
    assert pelvis(adaptive) == pytest.approx(pelvis(short), abs=2e-3)
    weight = [run.support_force[-10:, 2].mean() for run in (short, adaptive)]
    assert weight[1] == pytest.approx(weight[0], rel=0.01)


def before_the_device_moves(run, elapsed=1.5):
    """Where the pelvis is so long after the start of settling [m], however long that takes."""
    assert elapsed < -run.time[0]
    return np.array([np.interp(elapsed, run.time - run.time[0], run.q[:, a]) for a in range(3)])


def unrest(run):
    """Mean speed of the joints a second and more after the start of settling [rad/s]."""
    elapsed = run.time - run.time[0]
    return np.abs(run.v[(elapsed > 1.0) & (elapsed < 1.5)]).mean()


def test_friction_too_stiff_for_the_longest_steps_shortens_them(design_with, monkeypatch):
    """Ten times Table I's F_c: of friction, only Eq. I5 knows. Without, the body shakes."""
    steps = 0.012, 0.0015
    short = settled(design_with, "paper", 0.001, 0.001, friction_force=5.0)
    smooth = settled(design_with, "paper", *steps, friction_force=5.0)
    monkeypatch.setattr("simcore.simulate.smooth_step", lambda step, apart: np.inf)
    shaken = settled(design_with, "paper", *steps, friction_force=5.0)
    there = before_the_device_moves(short)
    assert before_the_device_moves(smooth) == pytest.approx(there, abs=1e-4)
    assert unrest(smooth) < 1.5 * unrest(short)
    assert unrest(shaken) > 3 * unrest(short)


def test_what_was_simulated_before_changes_no_bit(design_with):
    """Candidates share bodies, flesh and grids within a job: jobs may hold any, in any order."""
    method = read_design(Method, ROOT / "designs" / "methods" / "production.yaml").model_dump()
    method |= {"hold_s": 0.2}
    method["settling"] |= {"duration_min_s": 0.1, "duration_max_s": 0.3}

    def run(angle):
        tree = design_with({}, support_angle_deg=angle).model_dump() | {"method": method}
        return simulate(build_scene(Design.model_validate(tree), MAN, ROOT))

    first, _, again = run(12), run(2), run(12)
    for name in ("time", "q", "v", "normal_force", "shear", "mat_pressure", "energy", "depth_max"):
        assert np.array_equal(getattr(first, name), getattr(again, name)), name
