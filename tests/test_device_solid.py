"""The solid behind a seat and backrest, and the shipped lift's signed distance."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from simcore.config import read_design
from simcore.config.robotic_lift import RoboticLift, SeatAndBackrest
from simcore.contact.distance_lookup import distance_and_gradient
from simcore.device.distance import device_distance
from simcore.device.surface import seat_and_backrest, support_solid

LIFT = Path(__file__).parents[1] / "designs" / "devices" / "robotic_lift.yaml"


def look_up(field, points):
    """Return distances and gradients (n, 4)."""
    return np.array([
        distance_and_gradient(field.values, field.origin, field.spacing, *p) for p in points
    ])


@pytest.fixture(scope="module")
def lift(tmp_path_factory):
    design = read_design(RoboticLift, LIFT).surface
    surface = seat_and_backrest(design)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMCORE_CACHE", str(tmp_path_factory.mktemp("cache")))
        return design, surface, device_distance(design, surface)


def carrying(design, surface):
    """The vertices that slab and solid share, and outward normals there."""
    shared = (support_solid(design).vertices == surface.vertices).all(axis=1)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    inner = shared & (np.abs(surface.vertices[:, 1]) < 0.999 * design.width_m / 2)
    return surface.vertices[inner], mesh.vertex_normals[inner]


def test_carrying_side_of_the_shipped_lift_is_at_zero(lift):
    design, surface, field = lift
    points, _ = carrying(design, surface)
    assert len(points) > 0.4 * len(surface.vertices)
    found = np.abs(look_up(field, points)[:, 0])
    assert np.median(found) < field.spacing**2 / design.fillet_radius_m / 8
    assert found.max() < 0.35 * field.spacing  # at its rims


def test_solid_is_closed_and_holds_the_slab(lift):
    design, surface, field = lift
    solid = support_solid(design)
    mesh = trimesh.Trimesh(solid.vertices, solid.faces)  # joins what meets in the front edge
    mesh.update_faces(mesh.nondegenerate_faces())
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert look_up(field, surface.vertices)[:, 0].max() < 0.5 * field.spacing  # at its corners
    # Under the front edge it leaves the room that 45° leave; above the seat it adds nothing.
    under = np.array([[design.seat_depth_m - a, 0.0, -design.fillet_radius_m - 1.1 * a]
                      for a in (0.01, 0.02, 0.05)])
    assert look_up(field, under)[:, 0].min() > 0
    above = carrying(design, surface)
    assert look_up(field, above[0] + 0.01 * above[1])[:, 0].min() > 0


@pytest.mark.parametrize(
    "changes",
    [
        {"recline_deg": 85, "vertex_count": 4000}, {"recline_deg": -10, "vertex_count": 4000},
        {"fillet_radius_m": 0.1, "seat_depth_m": 0.45, "vertex_count": 4000},
        {"dish_depth_m": 0.2, "seat_depth_m": 0.6, "recline_deg": 30, "vertex_count": 4000},
        {"thickness_m": 0.005, "dish_depth_m": 0.0, "vertex_count": 4000},
    ],
)
def test_solid_of_any_design_is_closed_and_not_folded(lift, changes):
    design = SeatAndBackrest(**lift[0].model_dump() | changes)
    solid = support_solid(design)
    mesh = trimesh.Trimesh(solid.vertices, solid.faces)
    mesh.update_faces(mesh.nondegenerate_faces())
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert not mesh.contains(mesh.triangles_center + 1e-5 * mesh.face_normals).any()
    surface = seat_and_backrest(design)
    slab = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    inner = slab.triangles_center - 1e-4 * slab.face_normals
    assert mesh.contains(inner).mean() > 0.999


@pytest.mark.parametrize("depth", [0.01, 0.02, 0.03, 0.04, 0.05])
def test_pressed_flesh_comes_out_on_the_carrying_side(lift, depth):
    """Far past the middle of a slab 4 cm thick, where the slab's own distance would turn."""
    design, surface, field = lift
    points, normals = carrying(design, surface)
    # Off the rims by more than the depth, where the sides of the solid may be nearer.
    edge = design.width_m / 2 - np.abs(points[:, 1])
    top = design.backrest_height_m - points[:, 2] / np.cos(design.recline_rad)
    middle = (edge > 2 * depth) & (top > 2 * depth) & (points[:, 0] < 0.25)
    assert middle.sum() > 1000
    found = look_up(field, points[middle] - depth * normals[middle])
    # A point that was moved from the surface is not farther from it; Eq. D3 for what is looked up.
    assert found[:, 0].min() >= -np.sqrt(depth**2 + 0.75 * field.spacing**2)
    assert np.median(found[:, 0]) == pytest.approx(-depth, abs=2e-4)
    assert found[:, 0].max() < -0.9 * depth
    along = np.einsum("ij,ij->i", found[:, 1:], normals[middle])
    assert along.min() > 0.8
