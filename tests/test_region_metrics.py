"""Shear, contact area, load and slip by region, against closed forms and sums of forces."""

from dataclasses import replace
from functools import cache
from math import atan, cos, radians, sin
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from sling_scenes import DESIGNS, PENALTY, sling_scene
from test_metrics import CELL_EDGE, cells_of, end_of, figures, still

from simcore.config import Design, Method, read_design
from simcore.contact.tangential import Impulses, add_parts
from simcore.dynamics.implicit import IMPLICITNESS
from simcore.interaction import Interaction
from simcore.metrics import METRICS, compute_metrics, skin_pressure
from simcore.pressure import SensorCells
from simcore.region_metrics import CONTACT_PRESSURE
from simcore.scene import build_scene
from simcore.sheet.solver import GRAVITY
from simcore.simulate import simulate
from simcore.validation.incline import INCLINE_FRICTION
from simcore.validation.skin_friction import PITCH, SLIDE_TIME, Block

ROOT = Path(__file__).parents[1]
SHORT = {
    "device.motion.keyframes": [
        {"time_s": 0, "translation_m": 0, "rotation_deg": 0},
        {"time_s": 0.2, "translation_m": 0.01, "rotation_deg": 3},
    ],
    "support_angle_deg": 10, "hold_s": 0.6,
}


@pytest.fixture(autouse=True)
def in_the_root(monkeypatch):
    monkeypatch.chdir(ROOT)


# What the parts are


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 2), st.floats(0, 1))
def test_parts_put_together_are_the_force(seed, friction):
    """F = Nn + T with T across n, whatever part of the points is listed; others are left."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    across = np.cross(normals, rng.normal(size=(50, 3)))
    load = rng.uniform(0.1, 9, 50)
    size = np.linalg.norm(across, axis=1)
    slips = rng.random(50) < 0.5  # those bear all that they can, the others four fifths
    across *= (np.where(slips, 1.0, 0.8) * friction * load / size)[:, None]
    listed = rng.permutation(50)[:30]
    impulses = Impulses.zero(50)
    slipping = add_parts(
        listed, load[:, None] * normals + across, load, normals, friction, 0.5, *impulses
    )
    acted_on, normal, tangential = impulses
    assert normal[listed] == pytest.approx(0.5 * load[listed])
    assert tangential[listed] == pytest.approx(0.5 * across[listed], abs=1e-12)
    left = np.setdiff1d(np.arange(50), listed)
    assert acted_on[listed].all() and not acted_on[left].any()
    assert not normal[left].any() and not tangential[left].any()
    if friction > 1e-6:
        assert slipping == pytest.approx(0.5 * load[listed][slips[listed]].sum())


def test_friction_without_a_coefficient_has_no_slip():
    impulses = Impulses.zero(1)
    slipping = add_parts(
        np.arange(1), np.ones((1, 3)), np.ones(1), np.array([[0, 0, 1.0]]), -1.0, 1.0, *impulses
    )
    assert np.isnan(slipping)
    assert impulses.tangential[0] == pytest.approx([1, 1, 0])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 2))
def test_impulses_are_taken_once(seed):
    """Who bore a normal force is told, with both parts; friction without one is gone as well."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 40))
    impulses, expected = Impulses.zero(count), np.zeros((count, 4))
    for _ in range(3):
        points = rng.permutation(count)[: int(rng.integers(0, count + 1))]
        normals, along = np.tile([0, 0, 1.0], (count, 1)), rng.normal(size=(count, 3))
        load = rng.uniform(0.1, 9, count) * (rng.random(count) < 0.5)
        along[:, 2] = 0
        add_parts(points, load[:, None] * normals + along, load, normals, -1.0, 0.5, *impulses)
        expected[points] += 0.5 * np.c_[load, along][points]
    bore, normal, tangential = impulses.take(0.2)
    assert np.array_equal(bore, np.flatnonzero(expected[:, 0]))
    assert np.c_[normal, tangential] == pytest.approx(expected[bore] / 0.2)
    assert not any(part.any() for part in impulses)
    assert not len(impulses.take(1.0)[0])


# A block on an incline


def parts_of(block):
    impulses = Impulses.zero(len(block.rest))
    slipping = add_parts(
        np.arange(len(block.rest)), block.force, block.normal_force, block.normals,
        block.friction, 1.0, *impulses,
    )
    return impulses.normal, impulses.tangential, slipping


def shear_of(block, tangential):
    skin_normals = np.tile([0, 0, -1.0], (len(block.rest), 1))
    return shear(SensorCells(block.rest, skin_normals, block.area, CELL_EDGE), tangential)


def shear(cells, tangential):
    """Return what cells read in one frame of forces (n, 3)."""
    return cells.shear([np.arange(len(tangential))], [tangential])[0]


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.9, 0.97])
def test_a_block_at_rest_bears_its_weight_down_the_incline_as_shear(share):
    """m g sin α over its area in every cell, and nothing slips, up to the angle of friction."""
    angle = share * atan(INCLINE_FRICTION)
    block = Block(angle)
    block.run(SLIDE_TIME)
    normal, tangential, slipping = parts_of(block)
    weight, downhill = block.mass * GRAVITY, block.rotation[:, 0]
    assert normal.sum() == pytest.approx(weight * cos(angle), rel=1e-5)
    assert tangential.sum(axis=0) == pytest.approx(-weight * sin(angle) * downhill, abs=1e-4)
    expected = weight * sin(angle) / (len(block.rest) * PITCH**2)
    assert shear_of(block, tangential) == pytest.approx(expected, rel=1e-4, abs=0.1)
    assert slipping == 0


@pytest.mark.parametrize("beyond", [1.03, 1.2, 1.6])
def test_all_of_a_sliding_block_slips_and_shears_with_the_friction(beyond):
    angle = beyond * atan(INCLINE_FRICTION)
    block = Block(angle)
    block.run(1.0)
    normal, tangential, slipping = parts_of(block)
    assert slipping / normal.sum() == pytest.approx(1)
    expected = INCLINE_FRICTION * normal / block.area
    assert shear_of(block, tangential) == pytest.approx(expected, rel=1e-6)
    down = GRAVITY * (sin(angle) - INCLINE_FRICTION * cos(angle))
    before, time = block.speed, 12 * block.step
    block.run(time)
    # What Eq. I2 keeps of the impedance where friction is cut holds it back a little.
    assert (block.speed - before) / time == pytest.approx(down, abs=1e-3 * GRAVITY)


# Cells


def test_smooth_shear_does_not_depend_on_the_mesh():
    """A ball twisted about z, τ = τ₀ ẑ × r/R: the same at three refinements, and as it is.

    Positions on a sphere average to 1 − ⟨d²⟩/2R² of the one in the middle, ⟨d²⟩ = 3ρ²/10 in a cone.
    """
    read, radius = [], 0.15
    for subdivisions in (3, 4, 5):
        ball = trimesh.creation.icosphere(subdivisions, radius)
        cells, area = cells_of(ball)
        field = 1e4 * np.cross([0, 0, 1.0], ball.vertices) / radius
        read.append(shear(cells, field * area[:, None])[:642])
        true = np.linalg.norm(field[:642], axis=1)
    assert np.abs(read[0] - read[2]).max() < 0.03 * 1e4  # vertices 21 mm apart
    assert np.abs(read[1] - read[2]).max() < 0.01 * 1e4
    cone = 0.3 * 3 / np.pi * CELL_EDGE**2
    assert read[2] == pytest.approx(true * (1 - cone / 2 / radius**2), abs=0.001 * 1e4)


def test_opposite_shear_within_a_cell_cancels():
    points = np.array([[0.0, 0, 0], [0.004, 0, 0], [0.5, 0, 0]])
    cells = SensorCells(points, np.tile([0, 0, 1.0], (3, 1)), np.full(3, 1e-5), CELL_EDGE)
    told = shear(cells, np.array([[0, 1.0, 0], [0, -1.0, 0], [0, 1.0, 0]]))
    assert told[2] == pytest.approx(1e5)  # alone, all of it is in its cell
    assert told[0] < 0.1 * told[2]


def test_frames_are_read_each_by_itself():
    """More of them than are averaged at a time, some of which bear nothing."""
    rng = np.random.default_rng(4)
    ball = trimesh.creation.icosphere(2, 0.05)
    cells, _ = cells_of(ball)
    count = len(ball.vertices)
    bearing = [np.flatnonzero(rng.random(count) < 0.4 * (frame % 5)) for frame in range(150)]
    forces = [rng.normal(size=(len(borne), 3)) for borne in bearing]
    read = cells.shear(bearing, forces)
    for frame, (borne, force) in enumerate(zip(bearing, forces, strict=True)):
        everywhere = np.zeros((count, 3))
        everywhere[borne] = force
        assert read[frame] == pytest.approx(shear(cells, everywhere), rel=1e-6)
    assert not read[::5].any()
    assert not cells.shear([np.empty(0, int)], [np.empty((0, 3))]).any()


# Figures of made-up trajectories


def test_regions_add_up_to_all_skin(scene):
    """Area and load over the last half second only; load counts below what a mat reads, too."""
    rng, trajectory, body = np.random.default_rng(5), still(scene), scene.body
    late = trajectory.time > end_of(scene) - 0.55
    shape = trajectory.normal_force.shape
    pressure = np.full(shape, 1e6)
    normal = np.full(shape, 1e3, np.float32)
    pressure[late] = rng.uniform(0, 2 * CONTACT_PRESSURE, (late.sum(), shape[1]))
    normal[late] = rng.uniform(0, 5, (late.sum(), shape[1]))
    told = figures(scene, replace(trajectory, normal_force=normal), pressure)
    assert told["region_contact_area"].sum() == pytest.approx(told["contact_area"])
    assert told["region_load"].sum() == pytest.approx(
        normal[late].sum(axis=1, dtype=float).mean()
    )
    for region in ("heel_left", "arm_right", "upper_back"):
        here = body.vertex_region == body.region_names.index(region)
        of = dict(zip(body.region_names, told["region_load"], strict=True))
        assert of[region] == pytest.approx(normal[late][:, here].mean(axis=0, dtype=float).sum())
        of = dict(zip(body.region_names, told["region_contact_area"], strict=True))
        read = (pressure[late][:, here] > CONTACT_PRESSURE) @ body.skin.vertex_area[here]
        assert of[region] == pytest.approx(read.mean())


def test_shear_peaks_by_region_and_only_while_supported(scene):
    trajectory, regions = still(scene), scene.body.vertex_region
    shear = np.zeros_like(trajectory.shear)
    left, right = (scene.body.region_names.index(f"heel_{side}") for side in ("left", "right"))
    frame = {time: np.abs(trajectory.time - time).argmin() for time in (-0.5, 1.0, 6.5)}
    shear[frame[1.0], np.flatnonzero(regions == left)[0]] = 2e3
    shear[frame[-0.5], np.flatnonzero(regions == left)[0]] = 1e6  # while settling
    shear[frame[6.5], np.flatnonzero(regions == right)[-1]] = 3e3
    told = figures(scene, replace(trajectory, shear=shear))
    assert told["peak_shear"] == 3e3
    assert (told["region_peak_shear"][left], told["region_peak_shear"][right]) == (2e3, 3e3)
    assert np.delete(told["region_peak_shear"], [left, right]).max() == 0
    away = np.where(trajectory.time > 6, 1.0, 0)
    told = figures(scene, replace(trajectory, shear=shear, displacement=away))
    assert told["peak_shear"] == 2e3


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1), st.floats(0.1, 10))
def test_slip_is_counted_with_the_load_it_bears(scene, moving, resting, heavier):
    """Shares while it moves and at rest, the load another at rest; settling does not count."""
    trajectory, end = still(scene), end_of(scene)
    rests = trajectory.time >= end - 0.5 - 1e-9
    load = np.where(rests, heavier, 1.0)
    normal = np.zeros_like(trajectory.normal_force)
    normal[:, 7] = load
    share = np.where(rests, resting, np.where(trajectory.time < -1e-9, 1.0, moving))
    run = replace(trajectory, normal_force=normal, slip_force=share * load)
    told = figures(scene, run)
    counted = trajectory.time > -1e-9
    mean = np.average(share[counted], weights=load[counted])
    assert told["slip_share"] == pytest.approx(mean, abs=1e-6)
    assert told["rest_slip_share"] == pytest.approx(resting, abs=1e-6)
    fallen = figures(scene, replace(run, displacement=np.where(trajectory.time > 2, 1.0, 0)))
    assert fallen["slip_share"] == pytest.approx(moving, abs=1e-6)
    for name in ("rest_slip_share", "contact_area", "region_contact_area", "region_load"):
        assert np.isnan(fallen[name]).all()


# Lifts and slings


def production(design_with, changes=None):
    """Return the coarse lift of the other tests under the shipped method."""
    tree = design_with(changes).model_dump()
    method = read_design(Method, DESIGNS / "methods" / "production.yaml").model_dump()
    method |= {key: tree["method"][key] for key in ("hold_s",) if changes}
    return build_scene(Design.model_validate(tree | {"method": method}), "male_172_70", ROOT)


@pytest.mark.parametrize("law", ["foundation", "penalty"])
def test_parts_of_all_regions_add_up_to_the_force_on_the_body(law, design_with, scene):
    """Pressed 1 cm into seat and backrest while it slides: against the wrenches on segments."""
    seen = scene if law == "penalty" else production(design_with)
    body, start = seen.body, seen.motion(0.0)
    now, q, v = Interaction(seen), seen.configuration.copy(), np.zeros(seen.body.model.nv)
    for _ in range(2):  # where it touches, and then where it has moved along the seat
        q[:3] += start.rotation @ [0.001, 0.002, -0.005]
        v[:3] = 0.1, 0.05, 0.0
        now.linearised(start, q, v, IMPLICITNESS * 0.008)
    count = body.skin.vertex_count
    on_skin = Impulses.zero(count)
    slipping = now.add_skin_impulses(1.0, on_skin)
    _, normal, tangential = on_skin
    whole = tangential + normal[:, None] * now.contact.normals
    by_region = np.array([
        whole[body.vertex_region == region].sum(axis=0)
        for region in range(len(body.region_names))
    ])
    assert np.count_nonzero(np.abs(by_region).max(axis=1)) > 3
    assert by_region.sum(axis=0) == pytest.approx(now.support_force, rel=1e-9, abs=1e-9)
    assert np.einsum("ij,ij->i", tangential, now.contact.normals) == pytest.approx(0, abs=1e-9)
    assert np.linalg.norm(tangential.sum(axis=0)) > 5
    if law == "penalty":
        assert np.isnan(slipping)
    else:
        assert 0 < slipping <= normal.sum()


@cache
def hung():
    seen = sling_scene()
    return seen, simulate(seen)


@pytest.fixture(scope="module")
def sat(design_with):
    seen = production(design_with, SHORT)
    return seen, simulate(seen)


@pytest.mark.parametrize("which", ["lift", "sling"])
def test_skin_bears_no_more_shear_than_friction_gives(which, sat):
    """s ≤ µ p in every cell and frame, for the cells weight forces and areas alike."""
    seen, trajectory = sat if which == "lift" else hung()
    assert trajectory.status == "ok"
    pressure = skin_pressure(seen, trajectory)
    limit = seen.method.contact.friction_coefficient * pressure
    assert np.all(trajectory.shear <= limit * (1 + 1e-4) + 0.01)
    assert trajectory.shear.max() > 0.1 * limit.max()
    load = trajectory.normal_force.sum(axis=1, dtype=float)
    assert np.all(trajectory.slip_force >= 0)
    assert np.all(trajectory.slip_force <= load * (1 + 1e-6))
    told = compute_metrics(seen, trajectory, pressure)
    assert 0 <= told["slip_share"] <= 1 and 0 <= told["rest_slip_share"] <= 1
    assert told["region_peak_shear"].max() == told["peak_shear"] > 500


def test_load_of_a_seated_man_is_that_of_his_seat(sat):
    """Σ N z of buttocks and thighs bears nearly all of him, alike on both sides."""
    seen, trajectory = sat
    told = compute_metrics(seen, trajectory, skin_pressure(seen, trajectory))
    of = dict(zip(seen.body.region_names, told["region_load"], strict=True))
    left, right = (
        sum(of[f"{name}_{side}"] for name in ("buttock", "upper_thigh", "lower_thigh"))
        for side in ("left", "right")
    )
    assert left == pytest.approx(right, rel=0.15)
    assert 0.75 * seen.weight < left + right < 1.05 * seen.weight
    assert of["head"] == of["heel_left"] == 0


def test_slip_is_not_told_where_friction_knows_no_coefficient(held):
    seen, trajectory = held
    told = compute_metrics(seen, trajectory, skin_pressure(seen, trajectory))
    assert np.isnan(told["slip_share"]) and np.isnan(told["rest_slip_share"])
    assert told["peak_shear"] > 500
    papers = sling_scene({"method.sheet.contact": PENALTY, "duration_max_s": 0.1})
    assert np.isnan(simulate(papers).slip_force).all()


def test_every_metric_is_defined_in_the_physics():
    text = (ROOT / "docs" / "physics.md").read_text(encoding="utf-8")
    table = text[text.index("## Metrics") :]
    assert [name for name in METRICS if f"`{name}`" not in table] == []


def test_onset_is_that_of_the_angle():
    """Just below it sticks, just above it slides: at three coefficients."""
    for friction in (0.2, 0.45, 0.8):
        speeds = []
        for off in (-0.5, 0.5):
            block = Block(atan(friction) + radians(off), friction)
            block.run(SLIDE_TIME)
            speeds.append(block.speed)
        assert abs(speeds[0]) < 1e-4 < 0.01 < speeds[1]
