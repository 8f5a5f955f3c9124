"""Pictures against closed forms: where points appear, what is lit, what covers what."""

import numpy as np
import pytest
import trimesh

from simcore.pressure_scale import UNLOADED_COLOUR, pressure_colours
from simcore.report.render import Mesh, frame_points, project, render, vertex_normals


def sphere(centre, radius, colour) -> Mesh:
    ball = trimesh.creation.icosphere(4, radius)
    return Mesh(ball.vertices + centre, ball.faces, np.tile(colour, (len(ball.vertices), 1)))


@pytest.mark.parametrize("towards_eye", [(1, 1, 0.5), (-1, 0, -0.6), (0.2, -1, 0)])
def test_camera_is_the_closest_that_sees_every_point(towards_eye):
    points = np.random.default_rng(1).normal(size=(200, 3)) * [1, 2, 0.5]
    camera = frame_points(points, np.array(towards_eye), 300, 200, border=0.05)
    pixels = project(camera, points)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    border = 0.05 * np.array([300, 200])
    assert (low >= border - 1e-6).all() and (high <= [300, 200] - border + 1e-6).all()
    touched = np.isclose(low, border) & np.isclose(high, [300, 200] - border)
    assert touched.any()
    up = project(camera, np.array([[0, 0, 0.1], [0, 0, -0.1]]))
    assert up[0, 1] < up[1, 1] and up[0, 0] == pytest.approx(up[1, 0], abs=2)


def test_rendered_sphere_has_its_outline_and_is_lit_from_above():
    ball = sphere([0, 0, 0], 0.5, (0.8, 0.8, 0.8))
    camera = frame_points(ball.vertices, np.array([1.0, 0, 0]), 120, 100, border=0.1)
    picture = render([ball], camera)
    assert picture.shape == (100, 120, 4) and picture.dtype == np.uint8
    covered = (picture[..., 3] / 255).sum()
    distance = np.linalg.norm(camera.eye)
    # A sphere of radius r at distance d fills a disc of radius r/√(d² − r²) on the image plane.
    radius = 0.5 / np.sqrt(distance**2 - 0.25) / camera.half_extent[1] * 50
    assert covered == pytest.approx(np.pi * radius**2, rel=0.01)
    assert picture[0, 0, 3] == 0
    assert int(picture[30, 60, 0]) > int(picture[75, 60, 0]) + 40
    assert (render([ball], camera) == picture).all()  # the same bytes every time


def test_nearer_mesh_covers_and_casts_a_shadow():
    red, blue = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9)
    floor = trimesh.creation.box((4, 4, 0.1)).subdivide().subdivide().subdivide()
    colour = np.tile(blue, (len(floor.vertices), 1))
    ground = Mesh(floor.vertices - [0, 0, 0.6], floor.faces, colour)
    ball = sphere([0, 0, 0], 0.4, red)
    camera = frame_points(floor.vertices, np.array([1.0, 0, 0.8]), 120, 100)
    alone, both = render([ground], camera), render([ground, ball], camera)
    column, row = project(camera, np.zeros((1, 3)))[0].astype(int)
    assert both[row, column, 0] > 100 > both[row, column, 2]
    still_ground = (both[..., 2] > 1.5 * both[..., 0]) & (alone[..., 3] == 255)
    darker = still_ground & (both[..., 2].astype(int) < alone[..., 2].astype(int) - 60)
    assert darker.sum() > 100


def test_vertex_normals_of_a_sphere_point_outwards():
    ball = sphere([1, 2, 3], 0.5, (1, 1, 1))
    normals = vertex_normals(ball.vertices, ball.faces)
    assert np.einsum("ij,ij->i", normals, (ball.vertices - [1, 2, 3]) / 0.5).min() > 0.999


def test_pressure_colours_run_from_unloaded_over_the_scale_and_saturate():
    colours = pressure_colours(np.array([0.0, 50e3, 100e3, 900e3]), 100e3)
    assert colours[0] == pytest.approx(UNLOADED_COLOUR)
    assert colours[1] == pytest.approx(np.array([33, 145, 140]) / 255, abs=0.02)  # viridis at 0.5
    assert colours[2] == pytest.approx(colours[3])
