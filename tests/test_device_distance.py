"""Signed distance on a grid: against closed forms and brute force; meshes mended and refused."""

from functools import cache

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from simcore.config.robotic_lift import MeshSurface
from simcore.contact.distance_lookup import (
    distance_and_gradient,
    look_up,
    sure_clearance,
    way_to_touch,
)
from simcore.device import distance
from simcore.device.distance import BAND, device_distance, mesh_distance
from simcore.device.surface import SOLID_DEPTH, Surface
from simcore.errors import DesignError

ROUNDING = 1e-7  # of float32 at a metre [m]
SIZE = np.array([0.4, 0.3, 0.16])
RADIUS, HEIGHT = 0.12, 0.2


@pytest.fixture(autouse=True, scope="module")
def own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMCORE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def distance_at(values, origin, spacing, x, y, z):
    return distance_and_gradient(values, origin, spacing, x, y, z)[0]


def distances(field, points):
    return np.array([distance_at(field.values, field.origin, field.spacing, *p) for p in points])


def clearance(field, points):
    return np.array([sure_clearance(d, field.spacing) for d in distances(field, points)])


def nodes(field):
    grid = np.moveaxis(np.indices(field.values.shape), 0, -1)
    return (field.origin + field.spacing * grid).reshape(-1, 3)


def from_box(points):
    beyond = np.abs(points) - SIZE / 2
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)


def from_sphere(points):
    return np.linalg.norm(points, axis=1) - RADIUS


def from_capsule(points):
    axis = np.clip(points[:, 2], -HEIGHT / 2, HEIGHT / 2)
    return np.linalg.norm(points - np.column_stack([0 * axis, 0 * axis, axis]), axis=1) - RADIUS


def sphere():
    return trimesh.creation.icosphere(subdivisions=6, radius=RADIUS)


def capsule():
    mesh = trimesh.creation.capsule(radius=RADIUS, height=HEIGHT, count=[128, 128])
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


def box():
    return trimesh.creation.box(SIZE)


SHAPES = {
    # mesh, its closed form, and how far its triangles lie within it [m]
    "box": (box, from_box, 0.0),
    "sphere": (sphere, from_sphere, 1.5e-5),
    "capsule": (capsule, from_capsule, 1e-4),
}


@cache
def field_of(name):
    mesh = SHAPES[name][0]()
    return mesh_distance(mesh.vertices, mesh.faces, 0.01)


@pytest.fixture(scope="module", params=SHAPES)
def shape(request):
    return field_of(request.param), *SHAPES[request.param][1:]


def test_nodes_are_exact_inside_and_near(shape):
    field, closed_form, sag = shape
    exact, found = closed_form(nodes(field)), field.values.ravel()
    near = exact < BAND
    assert (exact < -0.05).any()
    assert np.abs(found - exact)[near].max() < sag + ROUNDING
    # Farther out never more than that, and not much less.
    assert (found - exact)[~near].max() < sag + ROUNDING
    assert (exact - found)[~near].max() < 0.017  # √(0.03² + 3/4 · 0.04²) − 0.03 at most


@pytest.mark.parametrize("make, closed_form", [(sphere, from_sphere), (capsule, from_capsule)])
def test_interpolation_converges_with_order_two_where_smooth(make, closed_form):
    mesh = make()
    random = np.random.default_rng(1).uniform(-0.3, 0.3, (20_000, 3))
    random = random[np.abs(closed_form(random)) < 0.02]
    error = []
    for spacing in (0.02, 0.01):
        field = mesh_distance(mesh.vertices, mesh.faces, spacing)
        error.append(np.sqrt(np.mean((distances(field, random) - closed_form(random)) ** 2)))
    assert np.log2(error[0] / error[1]) == pytest.approx(2, abs=0.25)
    assert error[1] < 0.01**2 / RADIUS / 4


def test_flat_faces_are_looked_up_exactly():
    field = field_of("box")
    across = np.random.default_rng(2).uniform(-0.08, 0.08, (200, 2))
    for depth in (0.02, 0.005, 0.0, -0.013, -0.04):
        points = np.column_stack([across, np.full(200, SIZE[2] / 2 + depth)])
        assert distances(field, points) == pytest.approx(depth, abs=ROUNDING)


@settings(max_examples=200, deadline=None)
@given(st.tuples(*3 * [st.floats(-1.0, 1.0)]), st.sampled_from(sorted(SHAPES)))
def test_sure_clearance_never_exceeds_the_distance(point, name):
    """In the grid, at its sides and beyond; and it is of use from a few spacings on."""
    _, closed_form, sag = SHAPES[name]
    field = field_of(name)
    point = np.array([point])
    exact = closed_form(point)[0]
    bound = clearance(field, point)[0]
    assert bound <= max(exact, 0) + sag + ROUNDING
    # Beyond the grid √(e² + φ²) is not less than (e + φ)/√2.
    assert bound > exact / np.sqrt(2) - 0.011
    high = field.origin + field.spacing * (np.array(field.values.shape) - 1)
    if (point < field.origin).any() or (point > high).any():
        assert distance_and_gradient(field.values, field.origin, field.spacing, *point[0])[1:] == (
            0.0, 0.0, 0.0
        )


@settings(max_examples=100, deadline=None)
@given(
    st.tuples(*3 * [st.floats(-0.3, 0.3)]), st.tuples(*3 * [st.floats(-1.0, 1.0)]),
    st.sampled_from(sorted(SHAPES)),
)
def test_nothing_touches_before_it_has_gone_its_way(point, direction, name):
    """Along any line the looked-up distance is positive as far as was told."""
    field = field_of(name)
    point, direction = np.array(point), np.add(direction, [1e-3, 0, 0])
    way = way_to_touch(distances(field, point[None])[0], field.spacing)
    along = np.linspace(0, 0.999 * way, 20)[:, None] * direction / np.linalg.norm(direction)
    if way > 0:
        assert distances(field, point + along).min() > 0


def test_distance_is_continuous_over_the_sides_of_the_grid(shape):
    field, _, _ = shape
    high = field.origin + field.spacing * (np.array(field.values.shape) - 1)
    random = np.random.default_rng(3)
    for axis in range(3):
        points = random.uniform(field.origin, high, (100, 3))
        points[:, axis] = high[axis]
        step = 1e-9 * np.eye(3)[axis]
        assert distances(field, points + step) == pytest.approx(distances(field, points - step),
                                                              abs=1e-8)


@pytest.fixture(scope="module")
def potato():
    """A closed mesh with dents, as no formula describes it."""
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.15)
    way = mesh.vertices / 0.15
    waves = np.sin(5 * way[:, 0]) * np.cos(4 * way[:, 1] + 1) + np.sin(6 * way[:, 2])
    mesh.vertices = mesh.vertices * (1 + 0.2 * waves)[:, None]
    return mesh, mesh_distance(mesh.vertices, mesh.faces, 0.01)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31))
def test_signs_are_those_of_rays(potato, seed):
    mesh, field = potato
    points = np.random.default_rng(seed).uniform(*mesh.bounds, (50, 3))
    found = distances(field, points)
    clear = np.abs(found) > 0.9 * field.spacing  # interpolation errs by √3/2 of it at most
    assert np.array_equal(found[clear] < 0, mesh.contains(points[clear]))


def test_distances_are_those_of_brute_force(potato):
    mesh, field = potato
    fine = 0.003  # no point of the surface is farther than this over √3 from a corner
    corners, _ = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, fine)
    away = cKDTree(corners).query(nodes(field))[0]
    found = np.abs(field.values.ravel())
    assert (found - away).max() < ROUNDING
    near = (field.values.ravel() < 0) | (away < BAND)
    assert (away - np.sqrt(found**2 + fine**2 / 3))[near].max() < ROUNDING


@settings(max_examples=100, deadline=None)
@given(st.tuples(*3 * [st.floats(0, 1)]))
def test_gradient_is_that_of_the_interpolant(potato, share):
    _, field = potato
    grid = field.values, field.origin, field.spacing
    point = field.origin + field.spacing * (np.array(field.values.shape) - 1) * share
    step = 1e-4 * field.spacing
    cell = (point - field.origin) / field.spacing % 1
    d, *gradient = distance_and_gradient(*grid, *point)
    assert d == pytest.approx(distance_at(*grid, *point), abs=1e-9)
    for axis in np.flatnonzero((cell > 1e-3) & (cell < 1 - 1e-3)):
        side = step * np.eye(3)[axis]
        change = distance_at(*grid, *(point + side)) - distance_at(*grid, *(point - side))
        assert gradient[axis] == pytest.approx(change / (2 * step), abs=1e-4)


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**31))
def test_order_of_faces_and_corners_does_not_matter(potato, seed):
    mesh, field = potato
    random = np.random.default_rng(seed)
    faces = random.permutation(mesh.faces)
    faces = faces[np.arange(len(faces))[:, None], (random.integers(3, size=(len(faces), 1))
                                                   + np.arange(3)) % 3]
    soup = mesh.vertices[faces].reshape(-1, 3)  # as an STL has it
    other = mesh_distance(soup, np.arange(len(soup)).reshape(-1, 3), 0.01)
    assert other.values == pytest.approx(field.values, abs=ROUNDING)


@pytest.mark.parametrize("turned", [range(12), [3], [0, 4, 5, 9]])
def test_closed_meshes_are_mended(turned):
    mesh = box()
    faces = mesh.faces.copy()
    faces[list(turned)] = faces[list(turned), ::-1]
    mended = mesh_distance(mesh.vertices, faces, 0.01)
    assert np.array_equal(mended.values, mesh_distance(mesh.vertices, mesh.faces, 0.01).values)


def test_bodies_that_overlap_are_one():
    first, second = box(), box()
    second.apply_translation([0.25, 0.05, 0.05])
    both = trimesh.util.concatenate([first, second])
    field = mesh_distance(both.vertices, both.faces, 0.01)
    points = nodes(field)
    exact = np.minimum(from_box(points), from_box(points - [0.25, 0.05, 0.05]))
    near = exact < BAND
    assert field.values.ravel()[near] == pytest.approx(exact[near], abs=ROUNDING)


def plate(size=(0.4, 0.3), count=9):
    """An open sheet at z = 0 whose normals point up."""
    x, y = (np.linspace(-extent / 2, extent / 2, count) for extent in size)
    vertices = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((count, count))], axis=-1)
    index = np.arange(count**2).reshape(count, count)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (a, c, d))]
    return vertices.reshape(-1, 3), np.concatenate(faces)


def test_open_surface_has_matter_behind_it():
    vertices, faces = plate()
    field = mesh_distance(vertices, faces, 0.005)
    points = nodes(field)
    middle = np.array([0, 0, -SOLID_DEPTH / 2])
    beyond = np.abs(points - middle) - np.array([0.4, 0.3, SOLID_DEPTH]) / 2
    slab = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    near = slab < BAND
    assert np.abs(field.values.ravel() - slab)[near].max() < 1.5 * field.spacing
    assert (field.values.ravel() - slab).max() < 1.5 * field.spacing
    # Where the sheet is nearer than the matter's sides it is exact.
    over = (np.abs(points[:, :2]) < [0.12, 0.07]).all(axis=1)
    over &= (points[:, 2] < BAND) & (points[:, 2] > -0.05)
    assert field.values.ravel()[over] == pytest.approx(points[over, 2], abs=ROUNDING)


def test_open_gutter_is_exact_on_both_sides():
    """Half a tube, open upwards: a seat shell without thickness. Behind it distances grow."""
    angle = np.linspace(np.pi, 2 * np.pi, 65)
    vertices, faces = plate(count=65)
    column = np.tile(np.arange(65), 65)
    y, z = 0.2 * np.cos(angle[column]), 0.2 * np.sin(angle[column])
    vertices = np.column_stack([vertices[:, 0], y, z])
    field = mesh_distance(vertices, faces, 0.01)
    points = nodes(field)
    radius = np.hypot(points[:, 1], points[:, 2])
    over = (np.abs(points[:, 0]) < 0.1) & (points[:, 2] < -0.1) & (radius > 0.17) & (radius < 0.25)
    assert over.sum() > 500
    assert field.values.ravel()[over] == pytest.approx(0.2 - radius[over], abs=2e-4)


def refusal(vertices, faces):
    design = MeshSurface(shape="mesh", file="seat.stl", unit="m", recline_deg=0, vertex_count=500)
    surface = Surface(np.array(vertices, float), np.array(faces), np.zeros((0, 3)), 0.01, 0.0)
    with pytest.raises(DesignError) as caught:
        device_distance(design, surface)
    message = str(caught.value)
    assert message.startswith("seat.stl: device.surface.file: ")
    assert "accepted: " in message and "\n" not in message
    return message


def test_open_surface_wound_both_ways_is_refused():
    vertices, faces = plate()
    faces[7] = faces[7, ::-1]
    assert "3 of its edges" in refusal(vertices, faces)


def test_open_surface_that_faces_away_is_refused():
    vertices, faces = plate()
    assert "away from the patient" in refusal(vertices, faces[:, ::-1])


def test_three_triangles_at_an_edge_are_refused():
    vertices, faces = plate()
    fin = [[*vertices[faces[0, 0]]], [*vertices[faces[0, 1]]], [0.0, 0.0, 0.1]]
    soup = np.concatenate([vertices, fin])
    inner = faces[40]
    assert "more than two" in refusal(soup, [*faces, [inner[0], inner[2], len(soup) - 1]])


def test_moebius_strip_is_refused():
    """Closed up by a disc it has no border either, but still one side only."""
    six = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 1], [1, 2, 4], [2, 3, 5], [3, 4, 1],
           [4, 5, 2], [5, 1, 3]]  # the projective plane on six vertices
    points = np.random.default_rng(0).uniform(0, 0.3, (6, 3))
    assert "one side" in refusal(points, six)


def test_fields_are_read_from_the_cache_by_what_they_depend_on(monkeypatch):
    mesh = box()
    made = []
    sample = distance._sample
    monkeypatch.setattr(distance, "_sample", lambda *a: made.append(a) or sample(*a))
    first = mesh_distance(mesh.vertices, mesh.faces, 0.019)
    again = mesh_distance(mesh.vertices, mesh.faces, 0.019)
    assert len(made) == 1
    assert np.array_equal(first.values, again.values)
    assert np.array_equal(first.origin, again.origin)
    assert first.spacing == again.spacing == 0.019
    mesh_distance(mesh.vertices, mesh.faces, 0.018)
    mesh_distance(1.01 * mesh.vertices, mesh.faces, 0.019)
    mesh_distance(mesh.vertices, mesh.faces, 0.019, margin=0.06)
    assert len(made) == 4


def test_grids_of_too_many_nodes_are_coarser(monkeypatch):
    monkeypatch.setattr(distance, "NODE_COUNT_MAX", 20_000)
    mesh = box()
    field = mesh_distance(mesh.vertices, mesh.faces, 0.0101)
    assert field.spacing > 0.0101
    assert field.values.size == pytest.approx(20_000, rel=0.25)
    points = nodes(field)
    inside = from_box(points) < BAND
    assert field.values.ravel()[inside] == pytest.approx(from_box(points)[inside], abs=ROUNDING)


def test_a_point_that_is_none_has_no_distance():
    field = field_of("box")
    for point in ([np.nan, 0, 0], [0, np.nan, 0], [np.inf, 0, 0]):
        told = distance_and_gradient(field.values, field.origin, field.spacing, *point)
        assert np.isnan(told[0]) and told[1:] == (0, 0, 0)


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_many_are_looked_up_as_each_is(name):
    """To the bit: within the grid, on its nodes, beyond its sides, and what is no point."""
    field = field_of(name)
    grid = field.values, field.origin, field.spacing
    size = field.spacing * (np.array(field.values.shape) - 1)
    points = field.origin + size * np.random.default_rng(4).uniform(-0.3, 1.3, (500, 3))
    points[::7] = nodes(field)[:: len(nodes(field)) // 72][: len(points[::7])]
    points[[3, 211], [0, 2]] = np.nan, np.inf
    told = np.full((4, 500), 7.0)
    look_up(*grid, np.ascontiguousarray(points.T), np.uint64(499), told)
    expected = np.array([distance_and_gradient(*grid, *point) for point in points[:499]])
    assert np.array_equal(told[:, :499].T, expected, equal_nan=True)
    assert np.all(told[:, 499] == 7.0)
