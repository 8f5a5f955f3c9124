"""The net against its outline, the fabric it stands for and the laws of motion."""

from dataclasses import replace

import numpy as np
import pytest

from simcore.errors import DesignError
from simcore.sheet import (
    STILL_BAR,
    ExplicitSolver,
    FabricSheet,
    HangingDesign,
    PaperSheet,
    PolygonOutline,
    RectangleOutline,
    SheetDesign,
    UShapeOutline,
    build_net,
    build_straps,
    lay_flat,
    make_sheet,
)

E_W = 2.0e4
DUMBBELL = PolygonOutline(
    ((0, 0), (0.4, 0), (0.4, 0.2), (0.6, 0.2), (0.6, 0), (1, 0),
     (1, 0.4), (0.6, 0.4), (0.6, 0.201), (0.4, 0.201), (0.4, 0.4), (0, 0.4))
)  # fmt: skip


def net_of(outline, material=None, count=4000):
    return build_net(SheetDesign(outline, material or FabricSheet(E_W), count))


def free_sheet(net, pinned=None):
    return make_sheet(net, build_straps(net, HangingDesign(())), pinned)


def face_areas(net):
    a, b, c = np.moveaxis(net.rest_position[net.faces], 1, 0)
    (ux, uy), (wx, wy) = (b - a).T, (c - a).T
    return (ux * wy - uy * wx) / 2


@pytest.mark.parametrize(
    "outline, area, tolerance",
    [
        (RectangleOutline(1.3, 0.8), 1.04, 1e-12),
        (RectangleOutline(1.0, 0.8, 0.2, 0.4), 0.88, 0.02),
        (UShapeOutline(1.3, 0.8, 0.5, 0.3), 0.89, 0.02),
        (PolygonOutline(((0, 0), (1, 0.3), (1, 0.8), (0, 1))), 0.75, 0.02),
    ],
)
def test_net_covers_its_outline(outline, area, tolerance):
    net = net_of(outline)
    assert len(net.mass) == pytest.approx(4000, rel=0.05)
    assert net.vertex_area.sum() == pytest.approx(area, rel=tolerance)
    assert net.mass.sum() == pytest.approx(0.3 * net.vertex_area.sum())
    assert net.spacing[0] == pytest.approx(net.spacing[1], rel=0.02)
    assert (face_areas(net) > 0).all()
    assert face_areas(net).sum() == pytest.approx(net.vertex_area.sum())
    assert len(np.unique(np.sort(net.spring_vertices, axis=1), axis=0)) == len(net.stiffness)


def test_paper_sheet_has_one_stiffness_and_its_mass():
    net = net_of(RectangleOutline(1.3, 0.8), PaperSheet(1000.0, 10.0))
    assert (net.stiffness[net.spring_kind < 2] == 1000.0).all()
    assert net.mass.sum() == pytest.approx(10.0)


@pytest.mark.parametrize(
    "outline, material, words",
    [
        (PolygonOutline(((0, 0), (1, 1), (1, 0), (0, 1))), FabricSheet(), "crosses itself"),
        (PolygonOutline(((0, 0), (1, 0))), FabricSheet(), "three corners"),
        (RectangleOutline(1.0, 0.0), FabricSheet(), "width_m"),
        (UShapeOutline(1.0, 0.8, 1.2, 0.2), FabricSheet(), "leg_length_m"),
        (UShapeOutline(1.0, 0.8, 0.5, 0.9), FabricSheet(), "gap_width_m"),
        (DUMBBELL, FabricSheet(), "falls apart where it is narrower than a cell"),
        (RectangleOutline(1.0, 0.8), FabricSheet(0.0), "stiffness_per_width_n_per_m"),
        (RectangleOutline(1.0, 0.8), PaperSheet(-1.0), "stiffness_n_per_m"),
        (RectangleOutline(1.0, 0.8), FabricSheet(1e4, 0.0), "areal_density"),
    ],
)
def test_impossible_sheets_are_refused(outline, material, words):
    with pytest.raises(DesignError, match=words) as error:
        net_of(outline, material)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("count", [500, 4000])
def test_uniform_stretch_has_the_stiffness_of_the_fabric(count):
    """Uniaxial stress: σ_x = E_w ε along, σ_y = 0 across with ν = 1/3, on a cut of the net."""
    net = net_of(RectangleOutline(1.3, 0.8), count=count)
    strain = 0.001
    stretched = net.rest_position * (1 + strain, 1 - strain / 3)
    i, j = net.spring_vertices.T
    d = stretched[j] - stretched[i]
    length = np.linalg.norm(d, axis=1)
    force = (net.stiffness * (length - net.rest_length) / length)[:, None] * d
    stress = []
    for axis, width in ((0, 0.8), (1, 1.3)):
        cut = net.rest_position[:, axis].mean() + 0.1 * net.spacing[axis]
        sides = np.sign(net.rest_position[net.spring_vertices, axis] - cut)
        across = sides[:, 0] != sides[:, 1]
        stress.append(abs((force[across, axis] * sides[across, 1]).sum()) / width)
    assert stress[0] == pytest.approx(E_W * strain, rel=0.02)
    assert stress[1] < 0.02 * E_W * strain


def test_momenta_are_kept_to_rounding():
    net = net_of(UShapeOutline(1.3, 0.8, 0.5, 0.3), count=800)
    sheet = replace(free_sheet(net), gravity=np.zeros(3), drag_rate=0.0)
    solver, state = ExplicitSolver(sheet), lay_flat(net, np.array([0.3, -0.2, 0.1]))
    random = np.random.default_rng(0)
    state.velocity += random.normal(size=state.velocity.shape)

    def momenta():
        p = solver.inertia[:, None] * state.velocity
        return np.concatenate([p.sum(axis=0), np.cross(state.position, p).sum(axis=0)])

    before, scale = momenta(), solver.inertia.sum()
    for _ in range(50):
        solver.advance(state, 2e-3, (), STILL_BAR)
    assert np.abs(momenta() - before).max() < 1e-12 * scale


def test_sag_does_not_depend_on_the_mesh():
    """1 m² of fabric held on all edges under 600 N/m²: membrane sag at 1k, 4k and 16k vertices."""
    sags = []
    for count in (1000, 4000, 16000):
        net = net_of(RectangleOutline(1.0, 1.0), FabricSheet(E_W, 600 / 9.80665), count)
        sheet = replace(free_sheet(net, pinned=net.on_edge), drag_rate=30.0)
        solver, state = ExplicitSolver(sheet), lay_flat(net, np.zeros(3))
        solver.advance(state, 1.2, (), STILL_BAR)
        assert np.abs(state.velocity).max() < 2e-3
        sags.append(-state.position[:, 2].min())
    assert sags == pytest.approx([sags[-1]] * 3, rel=0.02)


def test_a_shallow_strip_sags_as_its_stiffness_says():
    """A strip of half length a under p: T = p a²/2w and ε = 2/3 (w/a)² give w³ = 3/4 p a⁴/E_w."""
    a, load = 0.5, 60.0
    net = net_of(RectangleOutline(2 * a, 0.1), FabricSheet(E_W, load / 9.80665), 500)
    ends = np.isin(net.rest_position[:, 0], [0.0, net.rest_position[:, 0].max()])
    sheet = replace(free_sheet(net, pinned=ends), drag_rate=20.0)
    solver, state = ExplicitSolver(sheet), lay_flat(net, np.zeros(3))
    solver.advance(state, 2.0, (), STILL_BAR)
    sag = -state.position[np.abs(net.rest_position[:, 0] - a) < 0.02, 2].mean()
    assert sag == pytest.approx((0.75 * load * a**4 / E_W) ** (1 / 3), rel=0.02)
