"""Placing a body on a device."""

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from simcore.body.segments import INDEX
from simcore.errors import SimulationError
from simcore.scene import build_scene, posed_skin, segment_of_vertex

LOCK = {"posture.placement.approach": ()}
"""The body stays where it is put."""


def bounding_tree(vertices, faces):
    tree = coal.BVHModelOBBRSS()
    tree.beginModel(len(faces), len(vertices))
    tree.addVertices(np.asarray(vertices, dtype=float))
    tree.addTriangles(np.asarray(faces, dtype=np.int32))
    tree.endModel()
    return tree


def distance(scene, shift=(0, 0, 0)):
    """Distance of the two surfaces, shift in the device frame [m]; negative where they cross."""
    start = scene.motion(0.0)
    skin = (posed_skin(scene.body, scene.configuration) - start.position) @ start.rotation + shift
    trees = (
        bounding_tree(skin, scene.body.skin.faces),
        bounding_tree(scene.surface.vertices, scene.surface.faces),
    )
    here = coal.Transform3s.Identity()
    return coal.distance(
        trees[0], here, trees[1], here, coal.DistanceRequest(), coal.DistanceResult()
    )


@pytest.mark.parametrize(
    "changes",
    [{}, {"recline_deg": 30, "support_angle_deg": 20}, {"recline_deg": -5, "dish_depth_m": 0.0}],
    ids=["shipped", "reclined", "upright"],
)
def test_start_touches_nothing_and_leaves_a_small_gap(scene_with, changes):
    """By an exact search over both surfaces, triangles against triangles."""
    scene = scene_with(**changes)
    assert 0 < distance(scene) <= 1e-3
    assert distance(scene, (-2e-3, 0, 0)) <= 0  # the last approach went back, as far as it could


def test_narrow_bar_meets_the_skin_between_its_vertices(design_with, tmp_path):
    """A bar far thinner than the skin's triangles stops at their faces."""
    trimesh.creation.box((0.3, 0.004, 0.2)).export(tmp_path / "bar.stl")
    bar = {"shape": "mesh", "file": "bar.stl", "unit": "m", "recline_deg": 0, "vertex_count": 4000}
    design = design_with({
        "device.surface": bar, "posture.placement.approach": ((0, 0, -1),),
        "posture.placement.pelvis_m": (0.0, 0.09, 0.9),  # under the left thigh
    }, skin_vertices=2000, support_angle_deg=0)
    scene = build_scene(design, "man", tmp_path)
    skin = trimesh.Trimesh(
        posed_skin(scene.body, scene.configuration), scene.body.skin.faces, process=False
    )
    points = scene.surface.contact_points
    assert not skin.contains(points).any()
    assert skin.contains(points + np.array([0, 0, 2e-3])).any()


def placements(scene):
    """Segment rotations in the device frame."""
    data = scene.body.model.createData()
    pin.forwardKinematics(scene.body.model, data, scene.configuration)
    turn = scene.motion(0.0).rotation
    return [turn.T @ each.rotation for each in data.oMi[1:]]


def test_trunk_reclines_with_the_device_and_thighs_do_not(scene_with):
    upright, reclined = (placements(scene_with(recline_deg=angle)) for angle in (0, 25))
    back = Rotation.from_euler("y", -25, degrees=True).as_matrix()  # z towards −x
    assert (back @ [0, 0, 1])[0] < 0
    for name in ("pelvis", "lumbar", "thoracic", "head", "upper_arm_left"):
        assert np.abs(reclined[INDEX[name]] - back @ upright[INDEX[name]]).max() < 1e-12, name
    for name in ("thigh_left", "thigh_right", "shank_left", "foot_right"):
        assert np.abs(reclined[INDEX[name]] - upright[INDEX[name]]).max() < 1e-12, name


def test_support_angle_turns_gravity_and_nothing_else(scene_with):
    level, tilted = scene_with(support_angle_deg=0), scene_with(support_angle_deg=25)
    angle = np.radians(25)
    turn = tilted.motion(0.0).rotation
    down = tilted.body.model.gravity.linear / np.linalg.norm(tilted.body.model.gravity.linear)
    # The front edge is up, so that gravity draws towards the backrest.
    assert turn.T @ down == pytest.approx([-np.sin(angle), 0, -np.cos(angle)])
    seen = (posed_skin(tilted.body, tilted.configuration) - tilted.motion(0).position) @ turn
    assert np.abs(seen - posed_skin(level.body, level.configuration)).max() < 1e-12


def test_body_starts_where_the_device_does(scene_with):
    """The first keyframe may be anywhere; seen from the device the start is the same."""
    scene = scene_with()
    frames = [{"time_s": 0, "translation_m": 0.7, "rotation_deg": 130},
              {"time_s": 1, "translation_m": 0, "rotation_deg": 0}]
    other = scene_with({"device.motion.keyframes": frames})

    def seen(scene):
        start = scene.motion(0.0)
        return (posed_skin(scene.body, scene.configuration) - start.position) @ start.rotation

    assert np.abs(other.motion(0.0).position).max() > 0.5
    assert np.abs(seen(scene) - seen(other)).max() < 1e-12


@pytest.mark.parametrize(
    ("pelvis", "segment"),
    [((0.2, 0, 0.06), "thigh"), ((0.05, 0, 0.14), "pelvis"), ((-0.1, 0, 0.20), "lumbar")],
    ids=["seat", "corner", "backrest"],
)
def test_start_inside_the_device_is_refused_by_the_segments_name(scene_with, pelvis, segment):
    with pytest.raises(SimulationError, match=segment) as caught:
        scene_with(LOCK | {"posture.placement.pelvis_m": pelvis})
    assert caught.value.status == "initial_penetration"
    assert "mm inside the device" in caught.value.reason
    assert "\n" not in caught.value.reason


def test_limit_of_penetration_is_the_methods(scene_with):
    sunk = LOCK | {"posture.placement.pelvis_m": (0.2, 0, 0.07)}
    with pytest.raises(SimulationError) as caught:
        scene_with(sunk, initial_penetration_limit_m=1e-6)
    depth = float(caught.value.reason.split(" mm inside")[0].split()[-1]) / 1e3
    scene_with(sunk, initial_penetration_limit_m=depth + 1e-4)
    with pytest.raises(SimulationError):
        scene_with(sunk, initial_penetration_limit_m=depth - 1e-4)


@pytest.mark.parametrize("approach", [((0, 0, 1),), ((0, 0, -1), (0, 1, 0), (0, 0, -1))])
def test_body_that_misses_the_device_is_refused(scene_with, approach):
    """Away from it; and off its side, after which nothing is below."""
    pelvis = {"posture.placement.pelvis_m": (0.2, 0 if len(approach) == 1 else 2, 0.5)}
    with pytest.raises(SimulationError, match="misses the device") as caught:
        scene_with(pelvis | {"posture.placement.approach": approach})
    assert caught.value.status == "misses_device"


def test_without_approach_the_pelvis_stays_where_it_is_put(scene_with):
    scene = scene_with(LOCK | {"posture.placement.pelvis_m": (0.2, 0.1, 0.6)}, support_angle_deg=0)
    assert scene.configuration[:3] == pytest.approx([0.2, 0.1, 0.6])
    start = scene.motion(0.0)
    assert np.array_equal(start.rotation, np.eye(3))


def test_segment_of_a_vertex_is_where_it_lies(coarse_body):
    skin = coarse_body.skin
    standing = posed_skin(coarse_body, pin.neutral(coarse_body.model))
    assert segment_of_vertex(coarse_body, standing[:, 2].argmax()) == "head"
    assert segment_of_vertex(coarse_body, standing[:, 0].argmax()).startswith("toe")
    assert segment_of_vertex(coarse_body, standing[:, 2].argmin()).startswith(("foot", "toe"))
    assert skin.vertex_count == len(standing)
