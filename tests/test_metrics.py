"""Figures of made-up trajectories whose answers are known."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from simcore.metrics import JOINTS, METRICS, compute_metrics, skin_pressure
from simcore.pressure import SensorCells
from simcore.recorder import FALL_DISPLACEMENT, Trajectory
from simcore.region_metrics import CONTACT_PRESSURE

BEGIN, RATE = -1.0, 20
CELL_EDGE = 0.025  # [m]


def end_of(scene):
    return scene.motion.duration + scene.method.hold_s


def still(scene, **changes):
    """A body that stays in its place on the device from settling to the end of the hold."""
    time = np.linspace(BEGIN, end_of(scene), round((end_of(scene) - BEGIN) * RATE) + 1)
    states = [scene.motion(each) for each in time]
    start = scene.motion(0.0)
    q = np.tile(scene.configuration, (len(time), 1))
    for frame, state in zip(q, states, strict=True):  # carried along
        turn = state.rotation @ start.rotation.T
        frame[:3] = turn @ (frame[:3] - start.position) + state.position
        frame[3:7] = (Rotation.from_matrix(turn) * Rotation.from_quat(frame[3:7])).as_quat()
    count = len(time)
    values = {
        "time": time, "q": q, "v": np.zeros((count, 47)),
        "device_rotation": np.array([state.rotation for state in states]),
        "device_position": np.array([state.position for state in states]),
        "displacement": np.zeros(count), "segment_force": np.zeros((count, 18, 3)),
        "support_force": np.zeros((count, 3)), "mat_pressure": np.zeros((count, 2, 2), np.float32),
        "mat_x": np.zeros(2), "mat_y": np.zeros(2), "sheet_position": None, "strap_force": None,
        "normal_force": np.zeros((count, scene.body.skin.vertex_count), np.float32),
        "shear": np.zeros((count, scene.body.skin.vertex_count), np.float32),
        "slip_force": np.zeros(count),
        "contact_count": np.zeros(count, int), "depth_max": np.zeros(count),
        "energy": np.linspace(0, 100, count)[:, None] * [0, 1, 0, 0.99, 0, 0, 0, 0],
        "settled": True, "cpu_time": 1.5, "status": "ok", "reason": "",
    }
    return Trajectory(**values | changes)


def figures(scene, trajectory, pressure=None):
    if pressure is None:
        pressure = np.zeros(trajectory.normal_force.shape)
    return compute_metrics(scene, trajectory, pressure)


def falling_at(scene, fall_time, peak=0.5):
    """Still, and out of place by `peak` from a time on."""
    trajectory = still(scene)
    away = np.where(trajectory.time >= fall_time - 1e-9, peak, 0.4 * FALL_DISPLACEMENT)
    return replace(trajectory, displacement=away)


def test_every_figure_is_there_and_finite_for_a_body_at_rest(scene):
    told = figures(scene, still(scene))
    assert set(told) == set(METRICS)
    for name, value in told.items():
        # no fall, no sheet, no ranges of joints, no load
        nothing = ("fall_time", "peak_edge_distance", "peak_strap_force", "joint_range_margin",
                   "slip_share", "rest_slip_share")
        assert (np.isnan if name in nothing else np.isfinite)(value).all(), name
    assert told["fell"] == 0.0
    assert np.isnan(told["fall_time"])
    assert told["slide_distance"] < 1e-12
    assert told["fall_margin"] == 1.0
    assert told["simulated_time"] == pytest.approx(end_of(scene) - BEGIN)
    assert told["cpu_time"] == 1.5
    assert np.abs(told["joint_excursion"]).max() < 1e-7


@pytest.mark.parametrize("time", [-0.5, 0.0, 2.0, 6.0])
def test_fall_is_told_with_its_time(scene, time):
    told = figures(scene, falling_at(scene, time))
    assert told["fell"] == 1.0
    assert told["fall_time"] == pytest.approx(time)
    assert np.isnan(told["contact_area"])
    assert np.isnan(told["support_force_ratio"])


def test_margin_falls_with_displacement_and_then_with_the_time_missing(scene):
    trajectory, end = still(scene), end_of(scene)
    size = np.ones(len(trajectory.time)) * FALL_DISPLACEMENT
    held = [figures(scene, replace(trajectory, displacement=share * size))["fall_margin"]
            for share in (0.0, 0.3, 0.9, 1 - 1e-9)]
    assert held == pytest.approx([1, 0.7, 0.1, 1e-9], abs=1e-12)
    fell = [figures(scene, falling_at(scene, time))["fall_margin"]
            for time in (end, end - 1, 1.0, 0.0, BEGIN)]
    assert fell[0] == pytest.approx(0, abs=1e-12)  # continuous: a fall at the very end
    assert fell[-1] == pytest.approx(-1)
    assert np.all(np.diff(fell) < 0)
    assert fell[2] == pytest.approx((1.0 - BEGIN) / (end - BEGIN) - 1)


@settings(max_examples=25, deadline=None)
@given(st.floats(0, 3), st.floats(BEGIN, 7))
def test_margin_has_the_sign_of_the_verdict(scene, share, time):
    told = figures(scene, falling_at(scene, time, share * FALL_DISPLACEMENT))
    assert -1 <= told["fall_margin"] <= 1
    if told["fall_margin"] != 0:  # both sides meet there
        assert (told["fall_margin"] < 0) == bool(told["fell"])


def test_slide_is_seen_from_the_device_and_only_while_supported(scene):
    """30 and 40 mm along a support that rises and turns: 50 mm; height is no slide."""
    trajectory = still(scene)
    q = trajectory.q.copy()
    late = trajectory.time > 4
    q[late, :3] += trajectory.device_rotation[late] @ [-0.03, 0.04, 0.5]
    settling = trajectory.time < -1e-9
    q[settling, :3] += [0.2, 0.1, 0]  # before the device moves nothing counts as a slide
    told = figures(scene, replace(trajectory, q=q))
    assert told["slide_distance"] == pytest.approx(0.05, abs=1e-12)
    away = np.where(trajectory.time > 3, 1.0, 0.0)
    told = figures(scene, replace(trajectory, q=q, displacement=away))
    assert told["slide_distance"] == pytest.approx(0, abs=1e-12)


def test_load_at_rest(scene):
    """Area and force over the last half second only; others are zero or absurd before."""
    trajectory, body = still(scene), scene.body
    late = trajectory.time > end_of(scene) - 0.55
    force, normal = trajectory.support_force.copy(), trajectory.normal_force
    weight = body.mass * 9.81
    force[~late] = 1e6
    force[late, 2], force[late, 0] = 0.95 * weight, 55.0
    pressure = np.zeros(normal.shape)
    pressure[late] = 0.5 * CONTACT_PRESSURE  # less than a mat reads
    pressure[late, 100:300] = 2 * CONTACT_PRESSURE
    pressure[~late] = 1e6
    told = figures(scene, replace(trajectory, support_force=force), pressure)
    assert told["support_force_ratio"] == pytest.approx(0.95, rel=1e-3)
    assert told["contact_area"] == pytest.approx(body.skin.vertex_area[100:300].sum())


def test_peaks_by_region_and_only_while_supported(scene):
    trajectory = still(scene)
    regions = scene.body.vertex_region
    pressure = np.zeros(trajectory.normal_force.shape)
    heel, sacrum = (scene.body.region_names.index(name) for name in ("heel_left", "sacrum"))
    at_heel, at_sacrum = np.flatnonzero(regions == heel)[0], np.flatnonzero(regions == sacrum)[-1]
    frame = {time: np.abs(trajectory.time - time).argmin() for time in (-0.5, 1.0, 2.0, 6.5)}
    pressure[frame[1.0], at_heel] = 5e3
    pressure[frame[2.0], at_sacrum] = 9e3
    pressure[frame[-0.5], at_heel] = 1e6  # while settling
    pressure[frame[6.5], at_sacrum] = 2e4  # after a fall, below
    depth = np.where(trajectory.time < 0, 9.0, 0.001 * np.maximum(trajectory.time, 0))
    trajectory = replace(trajectory, depth_max=depth)
    told = figures(scene, trajectory, pressure)
    assert told["peak_pressure"] == 2e4
    assert told["max_penetration"] == pytest.approx(0.001 * end_of(scene))
    fallen = replace(trajectory, displacement=np.where(trajectory.time > 6, 1.0, 0))
    told = figures(scene, fallen, pressure)
    assert told["peak_pressure"] == 9e3
    assert told["region_peak_pressure"][heel] == 5e3
    assert told["region_peak_pressure"][sacrum] == 9e3
    assert np.delete(told["region_peak_pressure"], [heel, sacrum]).max() == 0
    assert told["max_penetration"] < 0.007


def test_joint_excursion_is_the_angle_from_the_posture(scene):
    model, trajectory = scene.body.model, still(scene)
    q = trajectory.q.copy()
    knee = model.joints[model.getJointId("shank_left")].idx_q
    hip = model.joints[model.getJointId("thigh_right")].idx_q
    q[50, knee] -= 0.3
    turn = Rotation.from_rotvec([0.3, -0.4, 0.0])  # 0.5 rad about one axis
    q[60, hip : hip + 4] = (Rotation.from_quat(q[60, hip : hip + 4]) * turn).as_quat()
    told = dict(zip(JOINTS, figures(scene, replace(trajectory, q=q))["joint_excursion"],
                    strict=True))
    assert told.pop("knee_left") == pytest.approx(0.3)
    assert told.pop("hip_right") == pytest.approx(0.5)
    assert max(told.values()) < 1e-7


def tipped(scene, angle):
    """The body leant forward about its lateral axis; the device is not."""
    trajectory = still(scene)
    q = trajectory.q.copy()
    for frame, rotation in zip(q, trajectory.device_rotation, strict=True):
        lean = Rotation.from_rotvec(angle * rotation[:, 1])
        frame[3:7] = (lean * Rotation.from_quat(frame[3:7])).as_quat()
    return replace(trajectory, q=q)


def test_topple_margin_is_the_angle_that_is_left(scene):
    """Leaning forward by that angle puts the upper body's mass over the hips."""
    margin = figures(scene, still(scene))["topple_margin"]
    assert 0 < margin < 0.6
    for angle in (-0.3, 0.1, margin, margin + 0.2):
        told = figures(scene, tipped(scene, angle))["topple_margin"]
        assert told == pytest.approx(margin - angle, abs=1e-9)


def test_one_frame_is_enough(scene):
    """What a run leaves that blows up at once: no figure at rest, and no warning."""
    whole = still(scene)
    first = {name: value[:1] for name, value in vars(whole).items() if np.ndim(value)}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told = figures(scene, replace(whole, status="blow_up", **first))
    assert np.isnan(told["support_force_ratio"])
    assert np.isnan(told["contact_area"])
    assert told["simulated_time"] == 0


def test_figures_of_a_held_body(held):
    """Against what the run's own frames say; forces of a body at rest carry its weight."""
    scene, trajectory = held
    told = compute_metrics(scene, trajectory, skin_pressure(scene, trajectory))
    assert told["fell"] == 0
    assert told["support_force_ratio"] == pytest.approx(1, abs=0.01)
    assert told["fall_margin"] == pytest.approx(
        1 - trajectory.displacement.max() / FALL_DISPLACEMENT
    )
    assert 0 < told["contact_area"] < 0.3 * scene.body.skin.vertex_area.sum()
    mean_pressure = scene.body.mass * 9.81 / told["contact_area"]
    assert mean_pressure < told["peak_pressure"] < 100 * mean_pressure
    assert told["peak_pressure"] == told["region_peak_pressure"].max()


# Pressure cells


def cells_of(mesh):
    area = np.bincount(mesh.faces.ravel(), np.repeat(mesh.area_faces / 3, 3))
    return SensorCells(mesh.vertices, mesh.vertex_normals, area, CELL_EDGE), area


@pytest.fixture(scope="module")
def plate():
    """A fine flat square, 0.2 m wide, with spacing 2 mm."""
    line = np.linspace(-0.1, 0.1, 101)
    x, y = np.meshgrid(line, line, indexing="ij")
    index = np.arange(101**2).reshape(101, 101)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return trimesh.Trimesh(np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), faces,
                           process=False)


def test_uniform_pressure_is_read_as_it_is(scene):
    skin = scene.body.skin
    trajectory = still(scene)
    normal = np.tile(12_345.0 * skin.vertex_area, (len(trajectory.time), 1)).astype(np.float32)
    pressure = skin_pressure(scene, replace(trajectory, normal_force=normal))
    assert pressure.shape == normal.shape
    assert pressure == pytest.approx(12_345.0, rel=1e-6)


def test_a_point_force_is_spread_over_one_cell(plate):
    """The peak of a force N on a fine mesh is N over 25 mm squared."""
    cells, area = cells_of(plate)
    force = np.zeros(len(area))
    force[len(area) // 2] = 3.0
    pressure = cells.pressure(force)
    assert pressure.max() == pytest.approx(3.0 / CELL_EDGE**2, rel=0.02)
    assert pressure.argmax() == len(area) // 2
    assert pressure @ area == pytest.approx(3.0, rel=1e-3)  # away from the rim nothing is lost
    reach = np.linalg.norm(plate.vertices[pressure > 0], axis=1).max()
    assert reach == pytest.approx(np.sqrt(3 / np.pi) * CELL_EDGE, abs=0.003)


def test_total_force_is_kept_on_a_body(scene):
    """Σ p A = Σ N, to the unevenness of the cells' areas, for any patch of load."""
    skin, trajectory = scene.body.skin, still(scene)
    rng = np.random.default_rng(3)
    normal = np.zeros_like(trajectory.normal_force[:4])
    for frame in normal:
        frame[rng.random(len(frame)) < 0.5] = rng.uniform(0, 3)
    pressure = skin_pressure(scene, replace(trajectory, normal_force=normal))
    assert pressure @ skin.vertex_area == pytest.approx(normal.sum(axis=1), rel=0.05)
    assert pressure.min() >= 0


def test_smooth_pressure_does_not_depend_on_the_mesh():
    """Refined twice, pressures at the common vertices agree, and to second order in the cell with
    the field itself: p = p₀ cos² falls by (mean r²/4)·∇²p."""
    read, radius = [], 0.15
    for subdivisions in (3, 4, 5):
        sphere = trimesh.creation.icosphere(subdivisions, radius)
        cells, area = cells_of(sphere)
        field = 1e4 * (sphere.vertices[:, 2] / radius) ** 2
        read.append(cells.pressure(field * area)[:642])
        true = field[:642]
    assert np.abs(read[1] - read[2]).max() < 0.01 * 1e4
    assert np.abs(read[0] - read[2]).max() < 0.03 * 1e4
    # A cone's mean r² is 3/10 of its radius squared; ∇² of cos² is 4/R² at the equator.
    cone = 0.3 * 3 / np.pi * CELL_EDGE**2
    equator = true.argmin()
    assert read[2][equator] - true[equator] == pytest.approx(
        1e4 * cone / 4 * 2 / radius**2, rel=0.2
    )


def test_cells_do_not_reach_through_a_thin_limb(plate):
    other = plate.copy()
    other.apply_translation([0, 0, -0.005])
    other.invert()
    both = trimesh.util.concatenate([plate, other])
    area = np.bincount(both.faces.ravel(), np.repeat(both.area_faces / 3, 3))
    normals = np.repeat([[0, 0, 1.0], [0, 0, -1.0]], 101**2, axis=0)
    pressure = SensorCells(both.vertices, normals, area, CELL_EDGE).pressure(
        np.concatenate([area[: 101**2], np.zeros(101**2)])
    )
    assert pressure[: 101**2] == pytest.approx(1.0)
    assert not pressure[101**2 :].any()
