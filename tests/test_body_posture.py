"""Joint angles, their signs and their inverse."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.body import build_body, configuration, joint_angles
from simcore.body.describe import posed_vertices
from simcore.body.posture import JOINTS, TURNS
from simcore.body.segments import kind_of
from simcore.config.designs import BodyDesign
from simcore.errors import DesignError


@pytest.fixture(scope="module")
def body():
    return build_body(BodyDesign(sex="male", age_years=45, stature_m=1.72, mass_kg=70), "man")


def joint_centre(body, segment, angles):
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, configuration(body, angles))
    return data.oMi[body.model.getJointId(segment)].translation


def displacement(body, segment, angles):
    """Of a segment's joint centre, from anatomical zero [m]."""
    return joint_centre(body, segment, angles) - joint_centre(body, segment, {})


@pytest.mark.parametrize(
    ("segment", "angles", "direction"),
    [
        ("shank_left", {"hip": {"flexion": 0.5}}, [1, 0, 0]),
        ("shank_left", {"hip": {"abduction": 0.5}}, [0, 1, 0]),
        ("shank_right", {"hip": {"abduction": 0.5}}, [0, -1, 0]),
        ("toe_left", {"hip": {"rotation": 0.5}}, [0, -1, 0]),
        ("toe_right", {"hip": {"rotation": 0.5}}, [0, 1, 0]),
        ("foot_left", {"knee": {"flexion": 0.5}}, [-1, 0, 0]),
        ("toe_right", {"ankle": {"dorsiflexion": 0.5}}, [0, 0, 1]),
        ("toe_right", {"ankle": {"rotation": 0.5}}, [0, 1, 0]),
        ("forearm_left", {"shoulder": {"flexion": 0.5}}, [1, 0, 0]),
        ("forearm_right", {"shoulder": {"abduction": 0.5}}, [0, -1, 0]),
        ("hand_left", {"elbow": {"flexion": 0.5}}, [1, 0, 0]),
        ("hand_right", {"elbow": {"abduction": 0.5}}, [0, -1, 0]),
        ("head", {"lumbar": {"flexion": 0.5}}, [1, 0, 0]),
        ("head", {"thoracic": {"lateral_bend": 0.5}}, [0, 1, 0]),
        ("forearm_right", {"lumbar": {"rotation": 0.5}}, [1, 0, 0]),
    ],
)
def test_positive_angles_move_the_named_way(body, segment, angles, direction):
    moved = displacement(body, segment, angles)
    assert moved @ direction > 0.02


def skin_displacement(body, region, angles):
    """Mean motion of a region's skin from anatomical zero [m]."""
    here = body.vertex_region == body.region_names.index(region)
    posed = posed_vertices(body, configuration(body, angles))
    return (posed - posed_vertices(body, pin.neutral(body.model)))[here].mean(axis=0)


@pytest.mark.parametrize(
    ("region", "angles", "direction"),
    [
        ("head", {"neck": {"flexion": 0.5}}, [1, 0, 0]),
        ("hand_left", {"wrist": {"flexion": 0.5}}, [0, -1, 0]),  # palms face the thighs
        ("hand_right", {"wrist": {"flexion": 0.5}}, [0, 1, 0]),
        ("hand_left", {"wrist": {"deviation": 0.5}}, [-1, 0, 0]),
        ("hand_right", {"wrist": {"deviation": 0.5}}, [-1, 0, 0]),
        ("heel_left", {"ankle": {"inversion": 0.5}}, [0, -1, 0]),
        ("heel_right", {"ankle": {"inversion": 0.5}}, [0, 1, 0]),
    ],
)
def test_positive_angles_move_the_skin_the_named_way(body, region, angles, direction):
    assert skin_displacement(body, region, angles) @ direction > 0.01


def test_toes_extend_upwards(body):
    q = configuration(body, {"toe": {"extension": 0.5}})
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, q)
    forward = data.oMi[body.model.getJointId("toe_left")].rotation[:, 0]
    assert forward[2] == pytest.approx(np.sin(0.5))


def test_pronation_turns_the_thumb_towards_the_body(body):
    q = configuration(body, {"elbow": {"pronation": 0.5}})
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, q)
    for side, inward in (("left", -1), ("right", 1)):
        thumbward = data.oMi[body.model.getJointId(f"hand_{side}")].rotation[:, 0]
        assert inward * thumbward[1] == pytest.approx(np.sin(0.5))


def test_anatomical_zero_stands_upright_with_level_soles(body):
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, pin.neutral(body.model))
    at = {name: data.oMi[body.model.getJointId(name)] for name in body.model.names[1:]}
    for side in ("left", "right"):
        hip, ankle = (at[f"{n}_{side}"].translation for n in ("thigh", "foot"))
        shoulder, wrist = (at[f"{n}_{side}"].translation for n in ("upper_arm", "hand"))
        assert np.allclose((ankle - hip)[:2], 0, atol=1e-3)  # hip to ankle is vertical
        assert np.allclose((wrist - shoulder)[:2], 0, atol=1e-9)
        toe = at[f"toe_{side}"].translation - ankle
        assert abs(toe[1]) < 1e-9
        assert toe[0] > 0.08
    vertices = posed_vertices(body, pin.neutral(body.model))
    soles = [vertices[body.vertex_region == body.region_names.index(f"{part}_{side}")][:, 2].min()
             for part in ("heel", "foot") for side in ("left", "right")]
    assert np.ptp(soles) < 0.01


angle = st.floats(-1.4, 1.4)
postures = st.fixed_dictionaries(
    {joint: st.fixed_dictionaries({turn.name: angle for turn in TURNS[kind_of(joint)]})
     for joint in JOINTS}
)


@settings(max_examples=50, deadline=None)
@given(postures)
def test_joint_angles_invert_configuration(body, posture):
    found = joint_angles(body, configuration(body, posture))
    assert found.keys() == posture.keys()
    for joint, angles in posture.items():
        assert found[joint] == pytest.approx(angles, abs=1e-9)


@settings(max_examples=20, deadline=None)
@given(postures)
def test_equal_angles_are_a_mirror_image(body, posture):
    """A plain joint name poses both sides so that the joint centres mirror in y."""
    both = {kind_of(joint): angles for joint, angles in posture.items() if "_left" in joint}
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, configuration(body, both))
    for name in body.segment_names:
        if name.endswith("_left"):
            left = data.oMi[body.model.getJointId(name)].translation
            right = data.oMi[body.model.getJointId(name.replace("left", "right"))].translation
            assert np.allclose(left * [1, -1, 1], right, atol=2e-4)


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        ({"hips": {"flexion": 1.0}}, ["hips", "hip", "knee"]),
        ({"knee": {"abduction": 1.0}}, ["abduction", "flexion"]),
        ({"knee": {"flexion": 1.0}, "knee_left": {"flexion": 0.5}}, ["knee_left", "twice"]),
        ({"lumbar_left": {"flexion": 1.0}}, ["lumbar_left", "lumbar"]),
    ],
)
def test_unknown_names_list_the_accepted_ones(body, angles, words):
    with pytest.raises(DesignError) as error:
        configuration(body, angles)
    assert all(word in str(error.value) for word in words)
