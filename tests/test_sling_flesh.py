"""The flesh under a sheet: its law, and how thick it is."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from sling_scenes import sling_scene

from simcore.body.build import build_body, posed_skin
from simcore.body.flesh import THICKNESS_SHARE, limb_depth
from simcore.body.inscribed import inscribed_radius
from simcore.body.skin import vertex_normals
from simcore.body.through import LONGEST, way_through
from simcore.contact.layer import SHEAR_SHARE, STRAIN_MAX
from simcore.contact.skin_planes import press_flesh


def flesh_force(gap, area, modulus, thickness, at=None, stiffening=True):
    """Normal force at a gap by the plane that is given to a vertex at that gap, or at another."""
    gap, count = np.atleast_1d(np.asarray(gap, float)), np.size(gap)
    plane = {name: np.zeros(count) for name in ("k", "c", "k_t", "c_t", "offset")}
    press_flesh(
        np.arange(count), np.zeros(count, np.int64), gap if at is None else np.full(count, at),
        np.array([thickness]), np.full(count, area), np.array([modulus]), stiffening, 0.02,
        plane["k"], plane["c"], plane["k_t"], plane["c_t"], plane["offset"],
    )
    return np.maximum(plane["k"] * (plane["offset"] - gap), 0), plane


flesh = {
    "area": st.floats(1e-5, 1e-2), "modulus": st.floats(1e3, 1e6),
    "thickness": st.floats(0.005, 0.1),
}


@settings(max_examples=60, deadline=None)
@given(strain=st.floats(0, STRAIN_MAX), **flesh)
def test_flesh_gives_the_force_of_the_law_and_its_slope(strain, area, modulus, thickness):
    """N = A E ε/(1 − ε); k is dN/dd, by differences of the law itself."""
    force, plane = flesh_force(-strain * thickness, area, modulus, thickness)
    assert force == pytest.approx(area * modulus * strain / (1 - strain), rel=1e-9, abs=1e-9)
    h = 1e-6 * (1 - strain)
    rise = (strain + h) / (1 - strain - h) - (strain - h) / (1 - strain + h)
    assert plane["k"] == pytest.approx(area * modulus * rise / (2 * h * thickness), rel=1e-6)
    at_rest = area * modulus / thickness
    assert plane["k_t"] == pytest.approx(SHEAR_SHARE * at_rest)
    assert plane["c"] == pytest.approx(0.02 * plane["k"])
    linear, plane = flesh_force(-strain * thickness, area, modulus, thickness, stiffening=False)
    assert linear == pytest.approx(area * modulus * strain, rel=1e-9, abs=1e-12)
    assert plane["k"] == pytest.approx(at_rest)


@settings(max_examples=60, deadline=None)
@given(beyond=st.floats(0, 0.5), **flesh)
def test_flesh_is_linear_beyond_the_greatest_strain(beyond, area, modulus, thickness):
    """Value and slope are continuous there, and the slope stays."""
    edge = -STRAIN_MAX * thickness
    gaps = edge - thickness * np.array([-1e-9, 0.0, 1e-9, beyond])
    force, plane = flesh_force(gaps, area, modulus, thickness)
    assert force[:3] == pytest.approx(force[1], rel=1e-6)
    assert plane["k"] == pytest.approx(plane["k"][1], rel=1e-6)
    assert force[3] == pytest.approx(force[1] + plane["k"][1] * beyond * thickness, rel=1e-9)


@settings(max_examples=30, deadline=None)
@given(clearance=st.floats(1e-6, 0.05), **flesh)
def test_flesh_that_is_not_touched_gives_nothing(clearance, area, modulus, thickness):
    assert flesh_force(clearance, area, modulus, thickness)[0] == 0
    touch, plane = flesh_force(-1e-4 * thickness, area, modulus, thickness, at=clearance)
    assert touch == pytest.approx(1e-4 * area * modulus, rel=1e-6)
    assert np.all(plane["k"] > 0)


def ball_points(radius):
    normal = np.array(trimesh.creation.icosphere(3).vertices)
    return radius * normal, normal, np.ones(len(normal), bool)


def tube_points(radius):
    along, turn = np.meshgrid(np.linspace(-4, 4, 65), np.linspace(0, 2 * np.pi, 41)[:-1])
    normal = np.stack([0 * turn, np.cos(turn), np.sin(turn)], axis=-1).reshape(-1, 3)
    points = radius * (normal + np.outer(along.ravel(), [1, 0, 0]))
    return points, normal, np.abs(along.ravel()) < 2


def plate_points(radius):
    x, y = (each.ravel() for each in np.meshgrid(*2 * [np.linspace(-4, 4, 49)]))
    normal = np.repeat([[0, 0, 1.0], [0, 0, -1.0]], len(x), axis=0)
    middle = np.tile((np.abs(x) < 2) & (np.abs(y) < 2), 2)
    return radius * (np.tile(np.stack([x, y, 0 * x], 1), (2, 1)) + normal), normal, middle


@pytest.mark.parametrize("shape", [ball_points, tube_points, plate_points])
@pytest.mark.parametrize("share", [0.3, 0.97, 1.5, 4.0])
def test_inscribed_balls_of_simple_shapes(shape, share):
    """Of ball and tube the radius, of a plate half its thickness; never more than asked."""
    radius = 0.06
    points, normal, middle = shape(radius)
    found = inscribed_radius(cKDTree(points), points, 3 * normal, share * radius)
    assert found.max() <= share * radius
    assert np.allclose(found[middle], min(1, share) * radius, rtol=0.01)


@pytest.mark.parametrize("shape", ["ball", "tube", "plate"])
def test_way_through_simple_shapes(shape):
    """Of ball and tube the diameter, of a plate its thickness; never more than is looked for."""
    half = 0.05
    mesh = {
        "ball": lambda: trimesh.creation.icosphere(4, half),
        "tube": lambda: trimesh.creation.cylinder(half, 0.6, sections=96).subdivide(),
        "plate": lambda: trimesh.creation.box((0.6, 0.6, 2 * half)).subdivide().subdivide(),
    }[shape]()
    x, y, z = mesh.vertices.T
    side = {"ball": z > -1, "tube": np.abs(z) < 0.2, "plate": np.maximum(abs(x), abs(y)) < 0.25}
    normal = {"ball": mesh.vertices / half, "tube": mesh.vertices * (1, 1, 0) / half,
              "plate": np.sign(mesh.vertices) * (0, 0, 1)}[shape]
    for scale in (1.0, 2 * LONGEST / half):
        surface = scale * mesh.vertices
        way = way_through(surface, normal, surface, mesh.faces)[side[shape]]
        assert way == pytest.approx(np.full(len(way), min(2 * half * scale, LONGEST)), rel=0.01)


def test_depth_of_limbs_does_not_depend_on_the_mesh(design_with):
    """Twice the vertices leave the median of every region as it is, to 3 %."""
    found = []
    for count in (14000, 28000):
        body = build_body(design_with(skin_vertices=count).body, "man")
        depth, area = limb_depth(body), body.skin.vertex_area
        medians = []
        for region in range(len(body.region_names)):
            here = np.flatnonzero(body.vertex_region == region)
            here = here[np.argsort(depth[here])]
            share = np.cumsum(area[here]) / area[here].sum()
            medians.append(depth[here][np.searchsorted(share, 0.5)])
        found.append(medians)
    assert np.allclose(found[0], found[1], rtol=0.03)


def test_flesh_is_never_thicker_than_the_law_or_the_middle_of_a_limb():
    """Straight below the skin, twice its thickness is hardly on the other side of a limb.

    Where the limb changes within 2 cm it may be: the depth is a mean over so much skin.
    """
    seen = sling_scene()
    rest = posed_skin(seen.body, seen.body.rest_configuration)
    normals = vertex_normals(seen.body.skin, rest)
    thickness, law = seen.flesh.thickness, seen.method.contact.flesh.thickness_m
    assert thickness.max() <= law * (1 + 1e-12)
    assert 0.1 < np.mean(thickness < 0.99 * law) < 0.9
    assert thickness.min() > 0
    way = way_through(rest, normals, rest, seen.body.skin.faces)
    assert np.mean(2 * thickness / THICKNESS_SHARE < 1.05 * way) > 0.9
    fine = sling_scene({"method.contact.flesh.thickness_m": 0.02})
    assert fine.flesh.thickness == pytest.approx(np.minimum(thickness, 0.02), rel=1e-6)
