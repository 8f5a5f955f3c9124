"""Finished bodies: surface quality, inertia, cache and output."""

import dataclasses
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from simcore.body import build_body, check_body, construct, describe_body, write_glb
from simcore.body.build import Body
from simcore.body.construct import construct_body, family_of
from simcore.body.describe import posed_vertices, segment_masses
from simcore.body.inertia import interior_points
from simcore.body.phenotype import BODY_DENSITY, fit_phenotype
from simcore.body.piercing import piercing_faces
from simcore.body.remesh import remesh
from simcore.config.designs import BodyDesign
from simcore.config.yaml_file import read_yaml, validate
from simcore.errors import DesignError

DESIGNS = sorted((Path(__file__).parents[1] / "designs" / "bodies").glob("*.yaml"))
MAN = BodyDesign(sex="male", age_years=45, stature_m=1.72, mass_kg=70)


COARSE = MAN.model_copy(update={"skin_vertices": 4000})  # quick to build


@pytest.fixture(scope="module", params=DESIGNS, ids=lambda path: path.stem)
def built(request) -> tuple[Body, BodyDesign]:
    design = validate(BodyDesign, read_yaml(request.param), request.param)
    return build_body(design, request.param.stem), design


def skin_mesh(body):
    vertices = posed_vertices(body, body.rest_configuration)
    return trimesh.Trimesh(vertices, body.skin.faces, process=False)


def test_stature_and_mass_hold_on_the_simulated_skin(built):
    body, design = built
    mesh = skin_mesh(body)
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(design.stature_m, abs=1e-3)
    assert body.stature == pytest.approx(design.stature_m, abs=1e-3)
    assert mesh.volume * BODY_DENSITY == pytest.approx(design.mass_kg, abs=0.1)
    assert body.mass == pytest.approx(design.mass_kg, abs=1e-6)
    assert pin.computeTotalMass(body.model) == pytest.approx(design.mass_kg, abs=1e-6)


def test_skin_is_closed_and_even(built):
    body, design = built
    assert_closed_and_even(skin_mesh(body), design.skin_vertices)


def assert_closed_and_even(mesh, vertex_count):
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.euler_number == 2
    assert mesh.volume > 0
    assert len(mesh.vertices) == pytest.approx(vertex_count, rel=0.02)
    edges = mesh.edges_unique_length
    assert edges.std() / edges.mean() < 0.12
    assert edges.max() < 1.7 * edges.mean()
    assert edges.min() > 0.25 * edges.mean()
    assert np.degrees(mesh.face_angles.min()) > 10


# These two bodies' toes and fingers are the thinnest beside the edge.
@pytest.mark.parametrize("name, seed", [("male_187_110", 0), ("male_172_70", 7)])
def test_remesh_is_sound_however_its_source_is_rounded(name, seed):
    """Every rounding takes the remesh another way: splits and collapses hang on comparisons."""
    path = next(path for path in DESIGNS if path.stem == name)
    design = validate(BodyDesign, read_yaml(path), path)
    whole = family_of(design.sex, design.age_years)
    source = whole.surface_vertices(fit_phenotype(whole, name, design.stature_m, design.mass_kg))
    source *= 1 + 1e-12 * np.random.default_rng(seed).standard_normal(source.shape)
    result = remesh(source, whole.faces, design.skin_vertices)
    points = np.einsum("nk,nkc->nc", result.barycentric,
                       source[whole.faces[result.source_faces]])
    mesh = trimesh.Trimesh(points, result.faces, process=False)
    assert_closed_and_even(mesh, design.skin_vertices)
    assert len(piercing_edges(mesh)) == 0
    assert not piercing_faces(points, result.faces).any()


def test_no_mouth_nose_or_eye_socket_is_left(built):
    """From every vertex of the head at least a tenth of all directions is free."""
    body, _ = built
    mesh = skin_mesh(body)
    head = np.flatnonzero(body.vertex_region == body.region_names.index("head"))
    directions = trimesh.creation.icosphere(subdivisions=2).vertices
    starts = mesh.vertices[head] + 2e-4 * mesh.vertex_normals[head]
    blocked = mesh.ray.intersects_any(
        np.repeat(starts, len(directions), axis=0), np.tile(directions, (len(head), 1))
    ).reshape(len(head), -1)
    assert blocked.mean(axis=1).max() < 0.9


def test_skin_does_not_pierce_itself_at_rest(built):
    body, _ = built
    assert len(piercing_edges(skin_mesh(body))) == 0


def test_piercing_is_seen_where_there_is_some():
    """The arms of the 150 kg man sink into his trunk when they hang straight down."""
    path = next(path for path in DESIGNS if path.stem == "male_175_150")
    body = build_body(validate(BodyDesign, read_yaml(path), path), path.stem)
    mesh = trimesh.Trimesh(posed_vertices(body, pin.neutral(body.model)), body.skin.faces,
                           process=False)
    edges = mesh.edges_unique[piercing_edges(mesh)]
    assert len(edges) > 10
    flagged = mesh.faces[piercing_faces(mesh.vertices, body.skin.faces)]
    assert np.isin(edges, flagged).all()


def piercing_edges(mesh):
    """Edges that cross a triangle they share no corner with."""
    edges, margin = mesh.edges_unique, 1e-5  # [m]
    start, end = mesh.vertices[edges[:, 0]], mesh.vertices[edges[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    along = (end - start) / length[:, None]
    points, ray, triangle = mesh.ray.intersects_location(start + margin * along, along)
    corners, ends = mesh.faces[triangle], edges[ray]
    touching = (corners[:, :, None] == ends[:, None, :]).any(axis=(1, 2))
    distance = np.linalg.norm(points - start[ray], axis=1)
    return np.unique(ray[(distance < length[ray] - margin) & ~touching])


def test_every_region_has_skin_and_sides_match(built):
    body, _ = built
    areas = {name: body.skin.vertex_area[body.vertex_region == index].sum()
             for index, name in enumerate(body.region_names)}
    assert min(areas.values()) > 0.003  # [m²]
    for name, area in areas.items():
        if name.endswith("_left"):
            assert areas[name.replace("left", "right")] == pytest.approx(area, rel=0.1)


@pytest.mark.parametrize(
    "design",
    [MAN, COARSE.model_copy(update={"inertia": "de_leva"}),
     *(validate(BodyDesign, read_yaml(path), path) for path in DESIGNS)],
    ids=lambda d: f"{d.inertia}-{d.mass_kg:g}",
)
def test_inertias_are_physical(design):
    body = build_body(design, "man")
    for name in body.segment_names:
        inertia = body.model.inertias[body.model.getJointId(name)]
        moments = np.linalg.eigvalsh(inertia.inertia)
        assert inertia.mass > 0.01
        assert moments.min() > 0
        assert moments.max() < moments.sum() - moments.max()  # triangle inequality
        assert np.linalg.norm(inertia.lever) < 0.35
    # MakeHuman's surface is symmetric, and so are the voxels; the remesh is not, and has no part.
    for name in body.segment_names:
        if name.endswith("_left"):
            left = body.model.inertias[body.model.getJointId(name)]
            right = body.model.inertias[body.model.getJointId(name.replace("left", "right"))]
            assert left.mass == pytest.approx(right.mass, rel=0.005)
            assert np.allclose(left.lever, right.lever * [1, -1, 1], atol=5e-4)


def test_masses_of_an_average_man_are_near_de_levas():
    rows = {row.part: row for row in segment_masses(build_body(MAN, "man"), MAN)}
    for part in ("head", "trunk", "arms", "legs"):
        assert abs(rows[part].deviation) < 0.13, part
    assert sum(rows[part].share for part in ("head", "trunk", "arms", "legs")) == pytest.approx(1)


def test_centre_of_mass_of_an_average_man():
    """At 55 to 58 % of stature above the soles when standing (men, textbook range)."""
    body = build_body(MAN, "man")
    q = pin.neutral(body.model)
    height = pin.centerOfMass(body.model, body.model.createData(), q)[2]
    assert 0.54 < (height - posed_vertices(body, q)[:, 2].min()) / body.stature < 0.59


def test_de_leva_option_gives_the_tables_masses():
    design = COARSE.model_copy(update={"inertia": "de_leva"})
    for row in segment_masses(build_body(design, "man"), design):
        assert row.deviation == pytest.approx(0, abs=0.002), row.part  # the table sums to 1.0000


def test_voxels_fill_a_sphere():
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=0.1)
    points = interior_points(sphere.vertices, sphere.faces, 0.005)
    assert len(points) * 0.005**3 == pytest.approx(sphere.volume, rel=0.01)
    assert np.linalg.norm(points, axis=1).max() < 0.1


def test_remesh_keeps_genus_and_stays_on_the_surface():
    torus = trimesh.creation.torus(0.2, 0.07, major_sections=48, minor_sections=24)
    result = remesh(torus.vertices, torus.faces.astype(np.int32), 1500)
    points = np.einsum("nk,nkc->nc", result.barycentric,
                       torus.vertices[torus.faces[result.source_faces]])
    mesh = trimesh.Trimesh(points, result.faces, process=False)
    assert mesh.is_watertight
    assert mesh.euler_number == 0
    assert mesh.volume == pytest.approx(torus.volume, rel=0.02)
    assert len(points) == pytest.approx(1500, rel=0.03)
    assert result.barycentric.min() > -1e-12
    assert np.abs(result.barycentric.sum(axis=1) - 1).max() < 1e-12


def test_second_build_reads_the_cache(monkeypatch):
    body = build_body(MAN, "man")
    monkeypatch.setattr(construct, "construct_body", lambda *_: pytest.fail("it is built again"))
    again = build_body(MAN, "other name")
    assert again.name == "other name"
    for field in dataclasses.fields(body.skin):
        assert np.array_equal(getattr(body.skin, field.name), getattr(again.skin, field.name))
    assert np.array_equal(body.rest_configuration, again.rest_configuration)


def test_out_of_range_designs_fail_before_anything_is_built():
    with pytest.raises(DesignError, match="mass_kg 250"):
        check_body(MAN.model_copy(update={"mass_kg": 250.0}))
    with pytest.raises(DesignError, match=r"stature_m 1\.2"):
        check_body(MAN.model_copy(update={"stature_m": 1.2}))
    check_body(MAN)


def test_description_and_glb(tmp_path):
    body = build_body(MAN, "man")
    rows = describe_body(body, MAN)
    assert [row[0] for row in rows][:2] == ["head", "trunk"]
    path = tmp_path / "folder" / "man.glb"
    write_glb(body, path)
    mesh = trimesh.load(path, force="mesh")
    assert mesh.extents[1] == pytest.approx(1.72, abs=1e-3)  # glTF is y up
    assert len(mesh.faces) == len(body.skin.faces)


def test_last_bits_of_a_fit_do_not_decide_about_the_mesh(monkeypatch):
    """They go by the processor and its libraries; every machine is to have the same triangles."""
    plain = construct_body(COARSE, "man")

    def as_elsewhere(*arguments):
        found = fit_phenotype(*arguments)
        return dataclasses.replace(
            found, weight=found.weight * (1 + 1e-9), muscle=found.muscle - 1e-9
        )

    monkeypatch.setattr("simcore.body.construct.fit_phenotype", as_elsewhere)
    other = construct_body(COARSE, "man")
    assert np.array_equal(plain["faces"], other["faces"])
    assert np.array_equal(plain["ring_next"], other["ring_next"])
    assert not np.array_equal(plain["influence_point"], other["influence_point"])
    assert np.abs(plain["influence_point"] - other["influence_point"]).max() < 1e-7
