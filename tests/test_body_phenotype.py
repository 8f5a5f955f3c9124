"""The MakeHuman data, its closed surface and the fit of stature and mass."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.body.construct import family_of
from simcore.body.makehuman import load_template
from simcore.body.phenotype import (
    Phenotype,
    body_family,
    fit_phenotype,
    reachable_masses,
    reachable_statures,
)
from simcore.body.reach import check_body
from simcore.body.segments import SEGMENT_NAMES, SEGMENTS, segment_of_bone
from simcore.body.surface import enclosed_volume
from simcore.config.designs import BodyDesign
from simcore.errors import DesignError

MAN = BodyDesign(sex="male", age_years=45, stature_m=1.72, mass_kg=70)


@pytest.fixture(scope="module")
def men():
    return family_of(MAN.sex, MAN.age_years)


def test_skeleton_has_the_papers_47_degrees_of_freedom():
    freedoms = {"free": 6, "spherical": 3, "flexion": 1, "extension": 1}
    assert len(SEGMENTS) == 18
    assert sum(freedoms[segment.joint] for segment in SEGMENTS) == 47


@pytest.mark.parametrize(
    ("bone", "segment"),
    [("root", "pelvis"), ("spine05", "pelvis"), ("breast.L", "thoracic"), ("neck02", "head"),
     ("upperleg02.R", "thigh_right"), ("toe3-2.L", "toe_left"), ("metacarpal1.R", "hand_right"),
     ("shoulder01.L", "thoracic")],
)
def test_bones_merge_into_their_segment(bone, segment):
    assert SEGMENT_NAMES[segment_of_bone(bone)] == segment


def test_merged_weights_are_a_partition_of_unity():
    weights = load_template().segment_weights
    assert np.abs(weights.sum(axis=1) - 1).max() < 1e-12
    assert (weights > 0).sum(axis=1).mean() == pytest.approx(1.42, abs=0.01)  # of the data


def test_closed_surface_is_one_outward_sphere(men):
    vertices = men.surface_vertices(Phenotype(0.5, 0.5, 0.5))
    mesh = trimesh.Trimesh(vertices, men.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2
    assert mesh.volume == pytest.approx(enclosed_volume(vertices, men.faces))
    assert mesh.volume > 0


def test_closing_moves_only_the_cavities_of_the_head(men):
    middle = Phenotype(0.5, 0.5, 0.5)
    closed = men.surface_vertices(middle)
    moved = np.linalg.norm(closed - men.vertices(middle)[: len(closed)], axis=1) > 1e-9
    assert 900 < moved.sum() < 1300
    weights = load_template().segment_weights
    assert weights[moved, SEGMENT_NAMES.index("head")].min() > 0.5


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1.2), st.floats(0, 1))
def test_bodies_are_linear_in_each_axis_between_anchors(men, height, weight, share):
    """One axis moved alone moves the vertices in a straight line."""
    ends = [men.surface_vertices(Phenotype(height, weight, end)) for end in (0.0, 0.5)]
    between = men.surface_vertices(Phenotype(height, weight, 0.5 * share))
    assert np.abs((1 - share) * ends[0] + share * ends[1] - between).max() < 1e-12


@settings(max_examples=5, deadline=None)
@given(st.sampled_from(["male", "female"]), st.floats(18, 90), st.floats(1.5, 1.9),
       st.floats(19, 33))
def test_fit_meets_stature_and_mass(sex, age, stature, mass_index):
    """Body mass indices of 19 to 33 kg/m² are in reach of adults of 1.5 to 1.9 m."""
    mass = mass_index * stature**2
    family = family_of(sex, age)
    found = fit_phenotype(family, "someone", stature, mass)
    assert family.stature(found) == pytest.approx(stature, abs=1e-4)
    assert family.mass(found) == pytest.approx(mass, abs=1e-2)
    assert found.muscle <= (0.5 if age >= 60 else 1.0)


@pytest.mark.parametrize(
    ("stature", "mass", "words"),
    [(2.6, 90, ["stature_m 2.6", "1.3", "2.4"]), (1.72, 25, ["mass_kg 25", "1.72 m", "44", "kg"]),
     (1.72, 240, ["mass_kg 240", "1.72 m", "147", "kg"])],
)
def test_targets_out_of_reach_name_the_range(stature, mass, words):
    design = SimpleNamespace(sex="male", age_years=45, stature_m=stature, mass_kg=mass)
    with pytest.raises(DesignError) as error:
        check_body(design, "giant")
    assert all(word in str(error.value) for word in ["giant", *words])


@settings(max_examples=8, deadline=None)
@given(st.sampled_from(["male", "female"]), st.floats(18, 90), st.floats(0.1, 0.9))
def test_table_of_reach_is_that_of_the_data(sex, age, share):
    """Between its nodes the table is within 0.3 kg; towards the ends builds drop out in jumps."""
    family = family_of(sex, age)
    shortest, tallest = reachable_statures(family)
    stature = (1 - share) * shortest + share * tallest
    for mass, beyond in zip(reachable_masses(family, stature), (-1, 1), strict=True):
        design = SimpleNamespace(sex=sex, age_years=age, stature_m=stature, mass_kg=mass)
        design.mass_kg = mass - 0.3 * beyond
        check_body(design)
        design.mass_kg = mass + 0.3 * beyond
        with pytest.raises(DesignError, match="mass_kg"):
            check_body(design)


def test_check_of_a_body_loads_nothing_slow():
    """The range must be told within a second, and the libraries of a body take longer."""
    code = (
        "import sys; from simcore.body import check_body; from simcore.config import BodyDesign;"
        "check_body(BodyDesign(sex='male', age_years=45, stature_m=1.72, mass_kg=70));"
        "print({'numba', 'pinocchio', 'scipy', 'trimesh'} & set(sys.modules))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "set()"


@pytest.mark.parametrize(("sex", "age"), [("other", 40), ("male", 0.5), ("male", 150)])
def test_unknown_sex_and_age_are_design_errors(men, sex, age):
    with pytest.raises(DesignError, match=r"sex|age_years"):
        body_family(sex, age, men.operator, men.faces)
