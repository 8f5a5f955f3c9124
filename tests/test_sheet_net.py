"""The net against its outline, the fabric it stands for and the laws of motion."""

from dataclasses import replace

import numpy as np
import pytest

from simcore.config.sling_lift import (
    PaperMaterial,
    PolygonOutline,
    RectangleOutline,
    SheetDesign,
    UShapeOutline,
)
from simcore.errors import DesignError
from simcore.sheet import STILL_BAR, ExplicitSolver, build_net, lay_flat
from simcore.validation.sheet_scenes import fabric, free_sheet, untouched
from simcore.validation.sheets import membrane_sags, shake

E_W = 2.0e4


def rectangle(length, width, head_length=0.0, head_width=0.0):
    return RectangleOutline(
        shape="rectangle", length_m=length, width_m=width,
        head_length_m=head_length, head_width_m=head_width,
    )


def u_shape(length, width, leg, gap):
    return UShapeOutline(
        shape="u_shape", length_m=length, width_m=width, leg_length_m=leg, gap_width_m=gap
    )


def polygon(*corners):
    return PolygonOutline(shape="polygon", corners_m=corners)


DUMBBELL = polygon(
    (0, 0), (0.4, 0), (0.4, 0.2), (0.6, 0.2), (0.6, 0), (1, 0),
    (1, 0.4), (0.6, 0.4), (0.6, 0.201), (0.4, 0.201), (0.4, 0.4), (0, 0.4),
)  # fmt: skip


def net_of(outline, material=None, count=4000):
    return build_net(SheetDesign(
        outline=outline, material=material or fabric(), vertex_count=count, pelvis_x_m=0.5
    ))


def face_areas(net):
    a, b, c = np.moveaxis(net.rest_position[net.faces], 1, 0)
    (ux, uy), (wx, wy) = (b - a).T, (c - a).T
    return (ux * wy - uy * wx) / 2


@pytest.mark.parametrize(
    "outline, area, tolerance",
    [
        (rectangle(1.3, 0.8), 1.04, 1e-12),
        (rectangle(1.0, 0.8, 0.2, 0.4), 0.88, 0.02),
        (u_shape(1.3, 0.8, 0.5, 0.3), 0.89, 0.02),
        (polygon((0, 0), (1, 0.3), (1, 0.8), (0, 1)), 0.75, 0.02),
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
    paper = PaperMaterial(kind="paper", stiffness_n_per_m=1000.0, mass_kg=10.0)
    net = net_of(rectangle(1.3, 0.8), paper)
    assert (net.stiffness[net.spring_kind < 2] == 1000.0).all()
    assert net.mass.sum() == pytest.approx(10.0)


@pytest.mark.parametrize(
    "outline, words",
    [
        (polygon((0, 0), (1, 1), (1, 0), (0, 1)), ": crosses itself"),
        (u_shape(1.0, 0.8, 1.2, 0.2), r"\.leg_length_m: is 1.2; accepted: below length_m, 1$"),
        (u_shape(1.0, 0.8, 0.5, 0.9), r"\.gap_width_m: is 0.9; accepted: below width_m, 0.8$"),
        (rectangle(1.0, 0.8, 0.2, 0.9), r"\.head_length_m, head_width_m: .*no wider than the"),
        (rectangle(1.0, 0.8, 0.2), r"\.head_length_m, head_width_m: .*both 0, or both above 0"),
        (DUMBBELL, ": falls apart where it is narrower than a cell"),
    ],
)
def test_impossible_outlines_are_refused(outline, words):
    with pytest.raises(DesignError, match=r"^device\.sheet\.outline" + words) as error:
        net_of(outline)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("count", [500, 4000])
def test_uniform_stretch_has_the_stiffness_of_the_fabric(count):
    """Uniaxial stress: σ_x = E_w ε along, σ_y = 0 across with ν = 1/3, on a cut of the net."""
    net = net_of(rectangle(1.3, 0.8), count=count)
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


@pytest.mark.parametrize(("precision", "rounding"), [(np.float64, 1e-12), (np.float32, 1e-6)])
def test_momenta_are_kept_to_rounding(precision, rounding):
    assert shake(precision)[0] < rounding


def test_sag_does_not_depend_on_the_mesh():
    """1 m² of fabric held on all edges under 600 N/m²: membrane sag at 1k, 4k and 16k vertices."""
    sags, speed, _ = membrane_sags()
    assert speed < 2e-3
    assert sags == pytest.approx([sags[-1]] * 3, rel=0.02)


def test_a_shallow_strip_sags_as_its_stiffness_says():
    """A strip of half length a under p: T = p a²/2w and ε = 2/3 (w/a)² give w³ = 3/4 p a⁴/E_w."""
    a, load = 0.5, 60.0
    net = net_of(rectangle(2 * a, 0.1), fabric(density=load / 9.80665), 500)
    ends = np.isin(net.rest_position[:, 0], [0.0, net.rest_position[:, 0].max()])
    sheet = replace(free_sheet(net, pinned=ends), drag_rate=20.0)
    solver, state = ExplicitSolver(sheet), lay_flat(net, np.zeros(3))
    solver.advance(state, 2.0, untouched(sheet), STILL_BAR)
    sag = -state.position[np.abs(net.rest_position[:, 0] - a) < 0.02, 2].mean()
    assert sag == pytest.approx((0.75 * load * a**4 / E_W) ** (1 / 3), rel=0.02)
