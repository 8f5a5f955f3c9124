"""Flesh by region: the table, its laws, and its smoothing over the skin."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.special import ndtr

from simcore.body import build_body
from simcore.body.describe import posed_vertices
from simcore.body.regions import REGION_NAMES
from simcore.body.skin import vertex_normals
from simcore.body.tissue import (
    SMOOTHING_LENGTH,
    STRAIN_MAX,
    Tissue,
    as_markdown,
    linear_pressure,
    region_tissue,
    rows_of_table,
    skin_tissue,
    smoothing_operator,
    stiffening_pressure,
    vertex_tissue,
)
from simcore.config.designs import BodyDesign

DOCS = Path(__file__).parents[1] / "docs" / "limits.md"
CONFIDENCE = {"read", "transcribed", "from memory, to be confirmed", "derived", "assumed"}
FAT, MUSCLE = 26.1e3, 62.2e3
"""Isogai et al. 2022: Young's moduli of the gluteal region at 1 N and at 5 N [Pa]."""

layers = {"thickness": st.floats(0.004, 0.1), "modulus": st.floats(1e3, 1e6)}


def thickness_of(name, *arguments):
    return region_tissue(*arguments).thickness[REGION_NAMES.index(name)]


def test_every_region_has_a_row_with_sources_and_confidences():
    bases = {name.removesuffix("_left").removesuffix("_right") for name in REGION_NAMES}
    assert set(rows_of_table()) == bases
    for row in rows_of_table().values():
        assert row["note"]
        for kind in ("thickness", "modulus"):
            assert row[f"{kind}_source"], row
            assert row[f"{kind}_confidence"] in CONFIDENCE, row


def test_thickness_and_stiffness_are_those_of_flesh():
    """In metres and pascals: millimetres to centimetres; fat to the sole of a foot."""
    tissue = region_tissue()
    assert tissue.thickness.shape == tissue.modulus.shape == (len(REGION_NAMES),)
    assert tissue.thickness.min() >= 0.004 and tissue.thickness.max() <= 0.08
    assert tissue.modulus.min() >= 2e4 and tissue.modulus.max() <= 5e5


def test_flesh_over_bone_is_thinner_than_any_other():
    over_bone = {name for name, row in rows_of_table().items() if row["over_bone"] == "yes"}
    thickness = {name: float(row["thickness_m"]) for name, row in rows_of_table().items()}
    assert {"head", "sacrum", "shin", "heel"} <= over_bone
    flesh = [value for name, value in thickness.items() if name not in over_bone]
    assert max(thickness[name] for name in over_bone) <= min(flesh)
    assert thickness["buttock"] > 3 * thickness["sacrum"]


def test_moduli_are_fat_and_muscle_one_under_the_other():
    """1/E = f/E_fat + (1 − f)/E_muscle, to the two digits that are written."""
    shares = 0
    for row in rows_of_table().values():
        assert (row["modulus_source"] == "Isogai et al. 2022, in series") == bool(row["fat_share"])
        if row["fat_share"]:
            share = float(row["fat_share"])
            expected = 1 / (share / FAT + (1 - share) / MUSCLE)
            assert float(row["modulus_pa"]) == pytest.approx(expected, abs=510)
            shares += 1
    assert shares > 10


@given(st.floats(15, 50))
def test_flesh_goes_with_the_root_of_the_body_mass_index_and_bones_do_not(index):
    assert thickness_of("buttock_left", index) / thickness_of("buttock_left") == pytest.approx(
        np.sqrt(index / 23)
    )
    assert thickness_of("heel_right", index) == thickness_of("heel_right")


@given(strain=st.floats(1e-6, 1e-3), **layers)
def test_both_laws_agree_where_the_strain_is_small(strain, thickness, modulus):
    layer = Tissue(thickness, modulus)
    depth = strain * thickness
    assert linear_pressure(depth, layer) == pytest.approx(modulus * strain)
    assert stiffening_pressure(depth, layer) == pytest.approx(modulus * strain, rel=2e-3)


@given(strain=st.floats(0, STRAIN_MAX), beyond=st.floats(0, 1), **layers)
def test_stiffening_law_and_its_linear_end(strain, beyond, thickness, modulus):
    """Half-way in, p = E; at 0.8, 4 E with slope 25 E/h, which stays."""
    layer = Tissue(thickness, modulus)
    assert stiffening_pressure(0.5 * thickness, layer) == pytest.approx(modulus)
    assert stiffening_pressure((STRAIN_MAX + beyond) * thickness, layer) == pytest.approx(
        modulus * (4 + 25 * beyond)
    )
    depth = strain * thickness
    assert stiffening_pressure(depth, layer) == pytest.approx(
        modulus * depth / (thickness - depth), rel=1e-9, abs=1e-9
    )
    assert stiffening_pressure(-depth, layer) == 0


def plane(spacing, size=0.4):
    axis = np.arange(-size / 2, size / 2, spacing) + spacing / 2
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    points = np.stack([x, y, 0 * x], axis=1)
    return points, np.tile([0.0, 0, 1], (len(x), 1)), np.full(len(x), spacing**2)


@pytest.mark.parametrize("spacing", [0.005, 0.01, 0.02])
def test_a_straight_border_becomes_a_gaussian_step(spacing):
    """On a plane the mean of a step is Φ(x/ℓ), whatever the spacing of the vertices."""
    points, normals, area = plane(spacing)
    found = smoothing_operator(points, normals, area) @ (points[:, 0] > 0).astype(float)
    inner = np.abs(points[:, :2]).max(axis=1) < 0.2 - 3 * SMOOTHING_LENGTH
    expected = ndtr(points[inner, 0] / SMOOTHING_LENGTH)
    assert found[inner] == pytest.approx(expected, abs=0.012)  # 1 % is the cut at 3 ℓ


def test_vertices_count_by_their_area():
    """Where they lie twice as dense on one side of the border, the step is the same."""
    x = np.concatenate([np.arange(-0.198, 0, 0.004), np.arange(0.004, 0.2, 0.008)])
    width = np.where(x < 0, 0.004, 0.008)
    y = np.arange(-0.2, 0.2, 0.008) + 0.004
    points = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x)))], axis=-1).reshape(-1, 3)
    normals = np.tile([0.0, 0, 1], (len(points), 1))
    area = np.tile(width * 0.008, len(y))
    found = smoothing_operator(points, normals, area) @ (points[:, 0] > 0).astype(float)
    inner = np.abs(points[:, :2]).max(axis=1) < 0.2 - 3 * SMOOTHING_LENGTH
    expected = ndtr(points[inner, 0] / SMOOTHING_LENGTH)
    assert found[inner] == pytest.approx(expected, abs=0.012)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_means_keep_constants_and_bounds(seed):
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(3)
    area = rng.uniform(0.1, 1, len(ball.vertices))
    mean = smoothing_operator(0.06 * ball.vertices, ball.vertices, area)
    values = rng.uniform(0.005, 0.05, len(area))
    assert mean @ np.ones(len(area)) == pytest.approx(np.ones(len(area)), rel=1e-12)
    assert values.min() <= (mean @ values).min() and (mean @ values).max() <= values.max()


def test_two_sides_of_a_thin_limb_do_not_mix():
    points, normals, area = plane(0.01, 0.2)
    both = np.vstack([points, points - [0, 0, 0.015]])
    side = np.repeat([1.0, 0.0], len(points))
    mean = smoothing_operator(both, np.vstack([normals, -normals]), np.tile(area, 2))
    assert np.array_equal((mean @ side).round(12), side)


@pytest.fixture(scope="module")
def skins():
    """Flesh of one man with 7,000 and with 28,000 skin vertices, and what it lies on."""
    found = []
    for count in (7000, 28000):
        design = BodyDesign(
            sex="male", age_years=45, stature_m=1.72, mass_kg=70, skin_vertices=count
        )
        body = build_body(design, "man")
        rest = posed_vertices(body, body.rest_configuration)
        normals = vertex_normals(body.skin, rest)
        tissue = skin_tissue(body.vertex_region, rest, normals, body.skin.vertex_area)
        found.append((body, rest, normals, tissue))
    return found


def test_flesh_of_each_region_is_the_same_on_a_finer_skin(skins):
    coarse, fine = (
        [
            np.average(tissue.thickness[here], weights=body.skin.vertex_area[here])
            for here in (body.vertex_region == region for region in range(len(REGION_NAMES)))
        ]
        for body, _, _, tissue in skins
    )
    assert coarse == pytest.approx(fine, rel=0.02)


def test_flesh_at_a_place_is_the_same_on_a_finer_skin(skins):
    """But for where the border of a region falls between the vertices of either."""
    (_, rest, normals, coarse), (_, fine_rest, fine_normals, fine) = skins
    places = cKDTree(np.hstack([fine_rest, 0.01 * fine_normals]))
    _, near = places.query(np.hstack([rest, 0.01 * normals]))
    apart = np.abs(coarse.thickness - fine.thickness[near])
    assert np.sqrt(np.mean(apart**2)) < 1e-3
    assert np.quantile(apart, 0.99) < 4e-3


def test_jumps_between_neighbours_shrink_with_the_mesh_only_when_smoothed(skins):
    def largest_jump(body, values):
        return np.abs(values[body.skin.faces] - values[np.roll(body.skin.faces, 1, 1)]).max()

    raw = [largest_jump(body, vertex_tissue(body.vertex_region).thickness) for body, *_ in skins]
    smooth = [largest_jump(body, tissue.thickness) for body, _, _, tissue in skins]
    assert raw[0] == raw[1] > 0.03
    assert smooth[1] < 0.65 * smooth[0] < 0.5 * raw[0]


def test_smoothing_leaves_the_middle_of_the_sacrum_thin(skins):
    for body, _, _, tissue in skins:
        here = body.vertex_region == REGION_NAMES.index("sacrum")
        assert thickness_of("sacrum") <= tissue.thickness[here].min() < 0.0130


def test_docs_have_the_table():
    assert as_markdown() in DOCS.read_text(encoding="utf-8"), "python -m simcore.body.tissue"
