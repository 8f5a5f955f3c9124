"""Body, sheet and bed of a coarse sling lift: who gives what to whom, and how runs end."""

import dataclasses
import re
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from sling_scenes import (
    EXPLICIT,
    PENALTY,
    Steps,
    no_bed,
    sling_scene,
    watched,
)

from simcore.body.segments import INDEX
from simcore.body.skin import wrench_on_segments
from simcore.contact.tangential import Impulses
from simcore.errors import SimulationError
from simcore.metrics import compute_metrics, skin_pressure
from simcore.sheet import ExplicitSolver
from simcore.simulate import simulate
from simcore.sling_interaction import SlingInteraction

STRAPS = {
    # from a bar over the sheet, of little slack, so that the fall into them is short
    f"device.hanging.attachments.{i}.{key}": value
    for i, (x, y) in enumerate([(0.02, 0.45), (0.02, -0.45), (0.92, 0.45), (0.92, -0.45)])
    for key, value in {
        "bar_point_m": (x - 0.62, 1.3 * y, 0.4), "strap_length_m": 0.43,
    }.items()
}


def falling_scene(changes=None):
    """A man who falls into a sheet on straps, the bed away."""
    return sling_scene(no_bed() | STRAPS | (changes or {}))


@cache
def scene(**changes):
    return sling_scene(changes)


@cache
def falling():
    """Steps of the falling man until the straps hold him, and what the sheet felt.

    In double precision: bounds are those of rounding.
    """
    scene = falling_scene()
    exact = ExplicitSolver(scene.sling.solver.sheet, precision=float)
    seen, solver = watched(
        dataclasses.replace(scene, sling=dataclasses.replace(scene.sling, solver=exact)))
    steps = Steps(seen)
    for _ in range(200):
        steps.step()
    return steps, solver


@cache
def lying():
    """The reclined sling on the bed until it rests, its straps slack."""
    seen, solver = watched(sling_scene({
        "duration_min_s": 1.2, "duration_max_s": 2.0, "record_rate_hz": 500,
    }))
    return seen, simulate(seen), solver


def test_what_the_sheet_gives_it_loses():
    """Sum over skin of what arrives on segments against the sum over sheet; explicit, for an
    implicit step takes less (below)."""
    seen, solver = watched(falling_scene(EXPLICIT))
    steps = Steps(seen)
    for _ in range(200):
        steps.step()
    received = steps.segment_wrench[:, :3].sum(axis=0)
    given_up = -solver.of_skin()[-1]
    assert np.abs(given_up[2]) > 300
    assert received == pytest.approx(given_up, abs=1e-9)
    straps = steps.interaction.strap_force.sum(axis=0)
    assert steps.support_force == pytest.approx(straps, abs=1e-9)


def test_forces_on_skin_vertices_arrive_as_wrenches_on_segments():
    """Against the readable path over all vertices, moments included, at the present pose."""
    steps, solver = falling()
    interaction = steps.interaction
    interaction.acceleration(steps.bar, steps.q, steps.v)
    force = interaction._on_skin.skin_force
    data = steps.model.createData()
    pin.forwardKinematics(steps.model, data, steps.q)
    rotations = np.array([each.rotation for each in data.oMi[1:]])
    expected = wrench_on_segments(steps.scene.body.skin, rotations, force)
    assert interaction.segment_wrench == pytest.approx(expected, abs=1e-6)
    contact = solver.reactions[-1].contact
    on_mat, on_skin = Impulses.zero(len(contact.force)), Impulses.zero(len(force))
    slipping = interaction.add_mat_impulses(1.0, on_mat)
    _, on_sheet, along_sheet = on_mat
    friction = steps.scene.method.contact.friction_coefficient
    assert on_sheet == pytest.approx(contact.normal_force)
    size = np.linalg.norm(along_sheet, axis=1)
    assert np.hypot(on_sheet, size) == pytest.approx(np.linalg.norm(contact.force, axis=1))
    assert np.all(size <= friction * on_sheet * (1 + 1e-9))
    assert 0 < slipping < on_sheet.sum()
    interaction.share_impulses(on_mat, on_skin)
    _, normal, tangential = on_skin
    assert normal.sum() == pytest.approx(contact.normal_force.sum())
    assert tangential.sum(axis=0) == pytest.approx(-along_sheet.sum(axis=0), abs=1e-9)
    assert np.all(normal >= 0)
    assert np.all(normal[np.linalg.norm(force, axis=1) > 0] > 0)
    assert not tangential[normal == 0].any()


def test_the_body_gets_the_impulse_that_the_sheet_gave():
    """Over 0.4 s and at every step, to the error of the integrator; explicit, the bed is away."""
    seen, solver = watched(falling_scene(EXPLICIT))
    steps = Steps(seen)
    weight = seen.body.mass * seen.body.model.gravity.linear
    impulse, before = np.zeros(3), steps.momentum()
    for _ in range(200):
        steps.step()
        impulse += steps.h * (weight - solver.of_skin()[-1])
        assert steps.momentum() - before == pytest.approx(impulse, abs=2e-3)
    given_up = seen.sling.step * np.abs(solver.of_skin().sum(axis=0))
    assert given_up[2] > 50  # N s


@pytest.mark.parametrize("law", ["foundation", "penalty"])
def test_what_an_implicit_step_did_not_take_is_given_back(law):
    """At every exchange of a fall into the straps; what Eq. I2 leaves out goes with the step."""
    changes = {} if law == "foundation" else {"method.sheet.contact": PENALTY}
    errors = []
    for step in (0.002, 0.001):
        seen, solver = watched(
            falling_scene(changes | {"time_step_s": step, "method.sheet.step_s": 2 * step})
        )
        steps = Steps(seen)
        weight = seen.body.mass * seen.body.model.gravity.linear
        impulse, before, given_back = np.zeros(3), steps.momentum(), np.zeros(3)
        errors.append(0.0)
        for count in range(round(0.4 / step)):
            momentum, received = steps.momentum() - before, impulse.copy()
            steps.step()
            if count % 2 == 0:  # began with an exchange
                given_back += steps.interaction._on_skin.given_back
                error = np.abs(momentum - (received - given_back)).max()
                errors[-1] = max(errors[-1], error)
            impulse += step * (weight - solver.of_skin()[-1])
        given_up = seen.sling.step * np.abs(solver.of_skin().sum(axis=0)).max()
        assert errors[-1] < 1e-3 * given_up
        assert np.abs(given_back).max() > 10 * errors[-1]
    assert errors[1] < 0.75 * errors[0]


def test_the_sheet_keeps_momentum_to_rounding():
    """Springs give none; what else acts is told by the reaction. Without drag."""
    plain = falling_scene()
    sheet = dataclasses.replace(plain.sling.solver.sheet, drag_rate=0.0)
    explicit = ExplicitSolver(sheet, precision=float)
    still = dataclasses.replace(plain, sling=dataclasses.replace(plain.sling, solver=explicit))
    seen, solver = watched(still)
    steps = Steps(seen)
    impulse = np.zeros(3)
    for step in range(160):
        steps.step()
        impulse += steps.interaction._on_skin.given_back * (step % 2 == 0)
    weight = sheet.net.mass.sum() * sheet.gravity
    for reaction in solver.reactions:
        outer = reaction.strap_force.sum(axis=0)
        outer = outer + reaction.contact.force.sum(axis=0) + reaction.bed_force
        impulse += seen.sling.step * (weight + outer)
    momentum = explicit.inertia.momenta(steps.interaction.sheet.velocity).sum(axis=0)
    assert np.abs(seen.sling.step * solver.of_skin().sum(axis=0)).max() > 10
    assert momentum == pytest.approx(impulse, abs=1e-10)


@pytest.mark.parametrize("what", ["fall", "lift"])
def test_impulse_of_gravity_straps_and_bed_is_the_momentum(what):
    """Newton for body and sheet from recorded frames: first order in the step."""
    changes = no_bed() | STRAPS if what == "fall" else {
        "device.motion.keyframes": [
            {"time_s": 0, "translation_m": 0, "rotation_deg": 0},
            {"time_s": 0.5, "translation_m": 0.5, "rotation_deg": 0},
        ],
    }
    errors = []
    for step in (0.004, 0.001):
        seen = sling_scene(changes | {
            "record_rate_hz": 1 / step, "time_step_s": step, "duration_min_s": 0.2,
            "duration_max_s": 0.2, "method.sheet.step_s": 2 * step,
        })
        undamped = dataclasses.replace(seen.sling.solver.sheet, drag_rate=0.0)
        seen = dataclasses.replace(
            seen, sling=dataclasses.replace(seen.sling, solver=ExplicitSolver(undamped))
        )
        trajectory = simulate(seen)
        assert trajectory.status == "ok"
        sheet, model = seen.sling.solver, seen.body.model
        velocity = np.diff(trajectory.sheet_position[::2].astype(float), axis=0) / (2 * step)
        data = model.createData()
        momentum = np.array([
            pin.computeCentroidalMomentum(model, data, q, v).linear
            for q, v in zip(trajectory.q[::2], trajectory.v[::2], strict=True)
        ])[1:]
        momentum += [sheet.inertia.momenta(v).sum(axis=0) for v in velocity]
        # Frames of one step, each of the force before its state; the first has that of the second.
        impulse = np.cumsum(step * trajectory.support_force[1:], axis=0)[1::2]
        weight = np.array([0.0, 0.0, -seen.weight])
        impulse += np.outer((np.arange(len(impulse)) + 1) * 2 * step, weight)
        count = min(len(impulse), len(momentum))
        errors.append(np.abs(impulse[:count] - momentum[:count]).max())
        assert np.abs(momentum).max() > 20 * errors[-1]
        assert errors[-1] < 2 * step * seen.weight
    assert errors[1] < 0.8 * errors[0]


def landmarks(seen):
    """Landmarks at the start, each in the frame of its segment (l, 3), and those frames."""
    interaction = SlingInteraction(seen)
    interaction.acceleration(seen.motion(0.0), seen.configuration, np.zeros(seen.body.model.nv))
    frames = [interaction.data.oMi[INDEX[name] + 1].copy() for name in ("pelvis", "thoracic")]
    return interaction.place(seen.configuration, seen.motion(0.0)), frames


def test_landmarks_lie_under_pelvis_and_chest():
    seen = scene()
    places, frames = landmarks(seen)
    assert len(places) == 2
    for place, frame in zip(places, frames, strict=True):
        world = frame.act(place)
        assert np.linalg.norm(world[:2] - frame.translation[:2]) < 0.02
        assert world[2] == pytest.approx(seen.sling.start.position[0, 2])


def test_displacement_starts_at_nothing_and_is_the_way_of_the_sheet_under_the_body():
    _, trajectory, _ = lying()
    assert trajectory.displacement[0] == 0
    assert 0 < trajectory.displacement.max() < 0.05  # sinks into flesh and bed
    seen = scene()
    interaction = SlingInteraction(seen)
    interaction.acceleration(seen.motion(0.0), seen.configuration, np.zeros(seen.body.model.nv))
    before = interaction.place(seen.configuration, seen.motion(0.0))
    interaction.sheet.position += [0.03, -0.04, 0.0]
    after = interaction.place(seen.configuration, seen.motion(0.0))
    assert np.linalg.norm(after - before, axis=1) == pytest.approx(0.05)


def beside(y_low, x_low=-0.3):
    """Changes that lay a sheet from x_low to 0.3 m about the pelvis, left of y_low."""
    corners = [(x_low, y_low), (0.3, y_low), (0.3, 0.5), (x_low, 0.5)]
    strap = {"kind": "loop", "name": "a", "sheet_point_m": (0.2, 0.4),
             "bar_point_m": (0.2, 0.4, 0.1), "strap_length_m": 0.5}
    return {
        "device.sheet.outline": {"shape": "polygon", "corners_m": corners}, "pelvis_x_m": 0.0,
        "device.hanging.attachments": [strap],
    }


def test_a_part_that_is_beside_the_sheet_has_no_landmark():
    assert len(landmarks(sling_scene(beside(y_low=-0.5, x_low=-0.1)))[0]) == 1
    assert len(landmarks(sling_scene(beside(y_low=-0.5, x_low=-0.5)))[0]) == 2


def test_a_sheet_under_neither_pelvis_nor_chest_is_refused():
    with pytest.raises(SimulationError, match="neither the pelvis nor the chest") as caught:
        simulate(sling_scene(beside(y_low=0.2)))
    assert caught.value.status == "misses_device"


def test_a_settled_body_is_carried_by_its_weight_and_straps_stay_slack():
    seen, trajectory, _ = lying()
    assert trajectory.status == "ok"
    assert trajectory.settled
    figures = compute_metrics(seen, trajectory, skin_pressure(seen, trajectory))
    assert figures["support_force_ratio"] == pytest.approx(1, abs=0.01)
    assert figures["support_force_spread"] < 0.02
    assert not trajectory.strap_force.any()
    assert figures["peak_strap_force"] == 0
    assert not figures["fell"]
    assert seen.weight > seen.body.mass * 9.8 + 1  # the sheet counts


def test_straps_only_pull():
    """Towards their points of the bar, and not at all where they are not stretched."""
    steps, solver = falling()
    straps = solver.sheet.straps
    force = np.array([reaction.strap_force for reaction in solver.reactions])
    to_bar = straps.bar_point + steps.bar.position - straps.patch_centres(
        steps.interaction.sheet.position
    )
    unit = to_bar / np.linalg.norm(to_bar, axis=1, keepdims=True)
    along = np.einsum("sc,sc->s", force[-1], unit)
    assert np.all(along > 50)
    assert force[-1] == pytest.approx(along[:, None] * unit, abs=0.05 * along.max())
    assert np.all(np.einsum("tsc,sc->ts", force, unit) >= -1e-9)


def test_the_mat_reads_the_normal_force_of_the_skin_on_the_sheet():
    """Frames of one step, of which the second has what the first has; two make an exchange."""
    seen, trajectory, solver = lying()
    on_mat = trajectory.mat_pressure.sum(axis=(1, 2)) * seen.method.sensor_pitch_m**2
    of_sheet = [each.contact.normal_force.sum() for each in solver.reactions]
    of_steps = np.repeat(of_sheet, 2)[: len(on_mat) - 1]
    assert np.allclose(on_mat[1:], of_steps, rtol=1e-5, atol=1e-4)
    assert on_mat[-1] > 100
    skin = trajectory.normal_force.sum(axis=1)
    assert np.all(skin >= on_mat * (1 - 1e-5))  # the bed carries the rest


def joint_place(scene, name):
    """Where a joint is at the start, world (3,) [m]."""
    data = scene.body.model.createData()
    pin.forwardKinematics(scene.body.model, data, scene.configuration)
    return data.oMi[INDEX[name] + 1].translation.copy()


def test_a_sheet_that_comes_to_the_middle_of_a_thigh_ends_the_run():
    """A vertex under it is driven up through the skin, faster than the flesh can throw it out."""
    plain = sling_scene({"duration_min_s": 0.5, "duration_max_s": 0.5, "record_rate_hz": 500})
    middle = (joint_place(plain, "thigh_left") + joint_place(plain, "shank_left")) / 2
    start, pushed = plain.sling.start.position, 50
    vertex = int(np.linalg.norm(start[:, :2] - middle[:2], axis=1).argmin())

    def push(count, state):
        if count >= pushed:
            risen = min(2.0 * plain.sling.step * (count - pushed), middle[2])
            state.position[vertex] = start[vertex] + np.array([0, 0, risen])
            state.velocity[vertex] = (0, 0, 2.0)

    seen, _ = watched(plain, push)
    trajectory = simulate(seen)
    assert trajectory.status == "slip_through"
    assert "thigh_left" in trajectory.reason
    x, y = seen.sling.solver.sheet.net.rest_position[vertex]
    assert f"({x:.2f}, {y:.2f}) m" in trajectory.reason
    assert "\n" not in trajectory.reason
    told = float(re.search(r"([0-9.]+) s\b", trajectory.reason)[1])
    begin = pushed * plain.sling.step
    assert begin + 0.02 < told < begin + 0.06  # the way of 5 cm or more at 2 m/s
    assert len(trajectory.time) == pytest.approx(told / seen.method.time_step_s, abs=4)
    for name in ("q", "v", "sheet_position", "normal_force", "support_force", "depth_max"):
        assert np.isfinite(getattr(trajectory, name)).all(), name
    assert trajectory.depth_max[-1] > 0.03
    assert trajectory.depth_max[: pushed].max() < 0.03


def test_a_sheet_that_starts_beyond_the_flesh_is_told_as_well():
    """Within what initial_penetration_limit_m allows, but flesh is only 2 mm thick."""
    height = scene().configuration[2]
    deep = sling_scene({
        "posture.placement.approach": (), "method.contact.flesh.thickness_m": 0.002,
        "posture.placement.pelvis_m": (0.0, 0.0, float(height) - 0.006),
    })
    with pytest.raises(SimulationError) as caught:  # there is no frame to keep
        simulate(deep)
    assert caught.value.status == "slip_through"


def carried(changes, seconds=0.35):
    """Impulse that the body had from the sheet in a fall on to straps [N s]."""
    seen, solver = watched(falling_scene(changes))
    steps = Steps(seen)
    given_back = 0.0
    for step in range(round(seconds / steps.h)):
        steps.step()
        given_back += steps.interaction._on_skin.given_back[2] * (step % 2 == 0)
    impulse = -steps.scene.sling.step * solver.of_skin()[:, 2].sum() - given_back
    return impulse, steps, solver


def test_liu_and_explicit_carry_the_same_weight():
    """Impulse on the body over its fall into the sheet, with sub-steps that add little inertia."""
    impulses, heights = [], []
    for kind in ({"kind": "explicit", "substep_s": 1e-4}, {"kind": "liu", "tolerance": 1e-3}):
        impulse, steps, _ = carried({
            "method.sheet.solver": kind, "method.contact.damping_time_s": 0.02,
            "time_step_s": 0.001, "method.sheet.step_s": 0.002,
        }, seconds=0.3)
        impulses.append(impulse)
        heights.append(steps.q[2])
    assert impulses[0] == pytest.approx(impulses[1], rel=0.03)
    assert heights[0] == pytest.approx(heights[1], abs=0.003)


def test_the_papers_contact_carries_the_same_weight():
    """Springs at sheet vertices, instead of flesh: the same weight at another depth."""
    flesh, _, _ = carried({})
    springs, _, solver = carried({"method.sheet.contact": PENALTY})
    assert springs == pytest.approx(flesh, rel=0.1)
    of_skin = solver.reactions[-1].contact
    touching = of_skin.normal_force > 0
    assert touching.sum() > 20
    sliding = of_skin.force[touching] - 0.0
    assert np.all(np.linalg.norm(sliding, axis=1) <= of_skin.normal_force[touching] + 2.0 + 1e-6)
