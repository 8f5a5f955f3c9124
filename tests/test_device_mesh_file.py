"""Surfaces from CAD files, and the files that are refused."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from simcore.config.robotic_lift import MeshSurface
from simcore.device.mesh_file import surface_from_file
from simcore.errors import DesignError

SIZE = np.array([0.5, 0.4, 0.1])
AREA = 2 * (0.5 * 0.4 + 0.5 * 0.1 + 0.4 * 0.1)


def read(folder, name="seat.stl", unit="m", count=2000):
    design = MeshSurface(shape="mesh", file=name, unit=unit, recline_deg=20, vertex_count=count)
    return surface_from_file(design, folder)


def write_box(folder, scale=1.0, name="seat.stl"):
    trimesh.creation.box(scale * SIZE).export(folder / name)


@pytest.mark.parametrize(("unit", "scale"), [("m", 1), ("cm", 100), ("mm", 1000)])
@pytest.mark.parametrize("name", ["seat.stl", "seat.obj", "seat.ply"])
def test_every_unit_and_format_gives_the_same_box(tmp_path, unit, scale, name):
    write_box(tmp_path, scale, name)
    surface = read(tmp_path, name, unit)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.extents == pytest.approx(SIZE, rel=1e-6)
    assert mesh.volume == pytest.approx(0.02, rel=1e-6)  # corners joined, winding outward
    assert len(mesh.vertices) == 8
    assert surface.recline == pytest.approx(np.radians(20))


@pytest.mark.parametrize("count", [500, 3000])
def test_contact_points_cover_the_surface_evenly(tmp_path, count):
    write_box(tmp_path)
    surface = read(tmp_path, count=count)
    points = surface.contact_points
    assert len(points) == pytest.approx(count, rel=0.05)
    assert points.flags.c_contiguous
    assert np.abs(np.abs(points) / (SIZE / 2)).max(axis=1) == pytest.approx(1, abs=1e-6)
    spacing = np.sqrt(AREA / count)
    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    assert nearest.min() > 0.5 * spacing  # random points would come arbitrarily near
    box = trimesh.creation.box(SIZE)
    hole = cKDTree(points).query(trimesh.sample.sample_surface(box, 5000, seed=3)[0])[0]
    assert hole.max() < 1.5 * spacing


def test_reading_twice_gives_the_same_points(tmp_path):
    write_box(tmp_path)
    assert np.array_equal(read(tmp_path).contact_points, read(tmp_path).contact_points)


def one_line(folder, **wanted):
    with pytest.raises(DesignError) as caught:
        read(folder, **wanted)
    message = str(caught.value)
    assert "\n" not in message
    assert wanted.get("name", "seat.stl") in message
    return message


@pytest.mark.parametrize(("unit", "scale"), [("m", 1000), ("mm", 1), ("cm", 1e4)])
def test_wrong_unit_is_told_with_the_size_it_would_have(tmp_path, unit, scale):
    write_box(tmp_path, scale)
    message = one_line(tmp_path, unit=unit)
    assert "surface.unit" in message
    assert f" in {unit}" in message


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("seat.stl", b""),
        ("seat.stl", b"solid nothing\nendsolid nothing\n"),
        ("seat.stl", b"solid broken\nfacet normal 0 0 1\nouter loop\nvertex 1 2\n"),
        ("seat.stl", bytes(range(256)) * 3),
        ("seat.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
        ("seat.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("seat.ply", b"ply\nformat ascii 1.0\nelement vertex 1\n"),
        ("seat.xyz_unknown", b"whatever"),
        ("seat.stl", None),
    ],
    ids=["empty", "no-facets", "cut", "noise", "no-faces", "index", "cut-ply", "format", "none"],
)
def test_files_that_hold_no_mesh_are_refused(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert "surface.file" in one_line(tmp_path, name=name)


def test_triangles_with_corners_that_are_no_numbers_are_left_out(tmp_path):
    (tmp_path / "seat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 nan 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n")
    surface = read(tmp_path, name="seat.obj")
    assert len(surface.faces) == 1
    assert np.isfinite(surface.vertices).all()
    assert np.isfinite(surface.contact_points).all()


def test_flat_triangles_without_area_are_refused(tmp_path):
    (tmp_path / "seat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0.5 0 0\nf 1 2 3\n")
    assert "surface.file" in one_line(tmp_path, name="seat.obj")
