"""The seat and backrest as a mesh: closed, even, and of the shape its design says."""

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from simcore.config.robotic_lift import SeatAndBackrest
from simcore.device.surface import seat_and_backrest

SLAB = {
    "shape": "seat_and_backrest", "seat_depth_m": 0.4, "backrest_height_m": 0.5, "width_m": 0.46,
    "recline_deg": 8.0, "fillet_radius_m": 0.06, "thickness_m": 0.04, "dish_depth_m": 0.0,
    "vertex_count": 6000,
}


def slab(**changes):
    return SeatAndBackrest(**SLAB | changes)


def mesh_of(design):
    surface = seat_and_backrest(design)
    return trimesh.Trimesh(surface.vertices, surface.faces, process=False)


def length_between(low, high):
    return st.floats(low, high).map(lambda x: round(x, 3))


@st.composite
def designs(draw, dish=0.0, recline=(-10, 85)):
    radius = draw(length_between(0.03, 0.12))
    values = SLAB | {
        "seat_depth_m": draw(length_between(0.25, 0.7)),
        "backrest_height_m": draw(length_between(0.25, 0.9)),
        "width_m": draw(length_between(0.3, 0.7)),
        "recline_deg": draw(st.floats(*recline)),
        "fillet_radius_m": radius,
        "thickness_m": draw(length_between(0.02, max(0.021, 0.9 * radius))),
        "dish_depth_m": draw(length_between(0, dish * radius)) if dish else 0.0,
        "vertex_count": draw(st.integers(4000, 9000)),
    }
    try:
        return SeatAndBackrest(**values)
    except ValidationError:
        assume(False)


varied = settings(max_examples=25, deadline=None)


@varied
@given(designs(dish=0.7))
def test_closed_with_outward_winding(design):
    mesh = mesh_of(design)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2
    assert mesh.volume > 0
    assert mesh.area_faces.min() > 0
    assert mesh.volume == pytest.approx(
        design.thickness_m * design.width_m * (design.seat_depth_m + design.backrest_height_m),
        rel=0.35,
    )


@varied
@given(designs(dish=0.7))
def test_as_many_vertices_as_asked_and_evenly(design):
    mesh = mesh_of(design)
    assert len(mesh.vertices) == pytest.approx(design.vertex_count, rel=0.05)
    spacing = np.sqrt(mesh.area / len(mesh.vertices))
    # Each grid line is even along its own curve; fillets and dish compress or stretch by a share.
    edges = np.sort(np.linalg.norm(np.diff(
        mesh.vertices[mesh.faces[:, [0, 1, 2, 0]]], axis=1), axis=2), axis=1)
    assert np.median(edges[:, :2]) == pytest.approx(spacing, rel=0.2)
    assert edges[:, 1].max() < 3 * spacing  # without diagonals
    assert len(np.unique(mesh.vertices.round(9), axis=0)) == len(mesh.vertices)


@varied
@given(designs())
def test_area_and_volume_of_a_flat_slab(design):
    """The lower side runs at radius r − t under the front edge and r + t behind the corner."""
    r, t, width = design.fillet_radius_m, design.thickness_m, design.width_m
    turn = np.pi / 2 - design.recline_rad
    tangent = r * np.tan(turn / 2)
    straight = design.seat_depth_m - r + design.backrest_height_m - 2 * tangent
    upper = straight + r * (np.pi / 2 + turn)
    lower = straight + (r - t) * np.pi / 2 + (r + t) * turn
    side = t * (upper + lower) / 2
    mesh = mesh_of(design)
    # A chord of length s on radius r is short by (s/r)²/24; grid lines may also cut where an arc
    # meets a line, by half of one cell's turn.
    step = 1.1 * np.sqrt(mesh.area / len(mesh.vertices))
    share = (step / r) ** 2
    assert mesh.area == pytest.approx(width * (upper + lower) + 2 * side + 2 * width * t, rel=share)
    assert mesh.volume == pytest.approx(width * side, rel=share)
    assert np.ptp(mesh.vertices[:, 1]) == pytest.approx(width, abs=1e-12)


@settings(max_examples=12, deadline=None)
@given(designs())
def test_profile_turns_only_as_fast_as_its_fillets(design):
    """Faces meet at box edges, at 90°, or nearly flat: no kink where arcs and lines meet."""
    mesh = mesh_of(design.model_copy(update={"vertex_count": 25_000}))
    step = 1.25 * np.sqrt(mesh.area / len(mesh.vertices))  # an edge along the profile at most
    limit = step / design.fillet_radius_m
    angles = mesh.face_adjacency_angles
    box = angles > 1.0
    assert angles[~box].max() < limit
    assert angles[box] == pytest.approx(np.pi / 2, abs=limit)


def area_in_plane(mesh, normal):
    """Area of faces in the plane through the origin with a unit normal, looking along it."""
    flat = np.abs(mesh.vertices[mesh.faces] @ normal).max(axis=1) < 1e-9
    return mesh.area_faces[flat & (mesh.face_normals @ normal > 0.999)].sum()


@varied
@given(designs(recline=(-10, 75)))
def test_seat_lies_at_zero_and_backrest_at_its_recline(design):
    """Both planes meet in the origin; each is flat up to where its fillet begins."""
    mesh, recline = mesh_of(design), design.recline_rad
    tangent = design.fillet_radius_m * np.tan((np.pi / 2 - recline) / 2)
    cells = 2.2 * np.sqrt(mesh.area / len(mesh.vertices)) * design.width_m
    seat = design.width_m * (design.seat_depth_m - design.fillet_radius_m - tangent)
    back = design.width_m * (design.backrest_height_m - tangent)
    normal = np.array([np.cos(recline), 0, np.sin(recline)])
    assert area_in_plane(mesh, np.array([0, 0, 1.0])) == pytest.approx(seat, abs=cells)
    assert area_in_plane(mesh, normal) == pytest.approx(back, abs=cells)
    upper_edge = design.backrest_height_m * np.array([-np.sin(recline), 0, np.cos(recline)])
    gap = np.linalg.norm((mesh.vertices - upper_edge)[:, [0, 2]], axis=1).min()
    assert gap < 1e-9
    assert mesh.vertices[:, 0].max() == pytest.approx(design.seat_depth_m, abs=1e-9)
    assert seat_and_backrest(design).recline == recline


@pytest.mark.parametrize("dish", [0.01, 0.05])
def test_sides_rise_by_the_dish(dish):
    design = slab(dish_depth_m=dish, fillet_radius_m=0.08)
    surface = seat_and_backrest(design)
    seat = surface.vertices[(surface.vertices[:, 0] > 0.15) & (surface.vertices[:, 0] < 0.3)]
    y, z = seat[:, 1], seat[:, 2]
    assert z[np.isclose(np.abs(y), 0.23)].max() == pytest.approx(dish, abs=1e-12)
    assert z.max() == pytest.approx(dish, abs=1e-12)
    middle = np.abs(y) < 0.23 * 0.5
    assert z[middle].max() <= dish / 16 + 1e-12  # as the fourth power
    assert z[np.abs(y) < 0.03].max() < 1e-3 * dish
    mirrored = surface.vertices * [1, -1, 1]
    found = {tuple(point) for point in surface.vertices.round(6) + 0.0}
    assert {tuple(point) for point in mirrored.round(6) + 0.0} == found
    assert surface.contact_points is surface.vertices


def inside_out(design):
    """Triangles whose outer side lies within the slab."""
    mesh = mesh_of(design)
    return int(mesh.contains(mesh.triangles_center + 1e-6 * mesh.face_normals).sum())


def test_dish_lower_than_the_fillet_does_not_fold():
    assert inside_out(slab(dish_depth_m=0.05)) == 0


def test_dish_higher_than_the_fillet_does_not_fold():
    """In the corner the sides of a dish meet at the fillet's centre, and beyond it pass through
    each other: contact points lie doubled there."""
    assert inside_out(slab(dish_depth_m=0.09)) == 0


@pytest.mark.parametrize(
    "changes",
    [
        {"fillet_radius_m": 0.3}, {"thickness_m": 0.07}, {"seat_depth_m": 0.05},
        {"width_m": 0.0}, {"recline_deg": 89.0}, {"dish_depth_m": -0.01}, {"width_m": np.inf},
    ],
)
def test_slabs_that_cannot_be_made_are_refused(changes):
    with pytest.raises(ValidationError):
        slab(**changes)
