"""Local/global iteration against Newton's method on the same backward Euler step."""

import numpy as np
import pytest

from simcore.config.sling_lift import (
    Fabric,
    HangingDesign,
    LoopAttachment,
    PaperMaterial,
    RectangleOutline,
    SheetDesign,
)
from simcore.errors import DesignError
from simcore.sheet import (
    STILL_BAR,
    LiuSolver,
    PlaneContact,
    build_net,
    build_straps,
    lay_flat,
    make_sheet,
)

H = 2e-3
FLOOR, FLOOR_STIFFNESS = -0.002, 400.0
PAPER = PaperMaterial(kind="paper", stiffness_n_per_m=1000.0, mass_kg=1.0)
FABRIC = Fabric(kind="fabric", stiffness_per_width_n_per_m=2e3, areal_density_kg_per_m2=1.0)


def hanging_sheet(material):
    outline = RectangleOutline(shape="rectangle", length_m=0.4, width_m=0.3)
    net = build_net(
        SheetDesign(outline=outline, material=material, vertex_count=90, pelvis_x_m=0.2)
    )
    loops = tuple(
        LoopAttachment(
            kind="loop", name=str(i), sheet_point_m=(x, y), bar_point_m=(x, y, 0.2),
            strap_length_m=0.201,
        )
        for i, (x, y) in enumerate([(0, 0.15), (0, -0.15), (0.4, 0.15), (0.4, -0.15)])
    )
    hanging = HangingDesign(
        attachments=loops, strap_stiffness_n_per_m=2e3, strap_damping_ns_per_m=0.0
    )
    return make_sheet(net, build_straps(net, hanging))


def newton_step(sheet, start, velocity):
    """Return the exact backward Euler step with a floor at FLOOR: dense Newton, line search."""
    net, straps = sheet.net, sheet.straps
    n = len(net.mass)
    held = 1 + H * sheet.drag_rate
    free = start + (H * velocity + H**2 * sheet.gravity) / held
    share = np.where(net.spring_kind < 2, net.compression_share, 1.0)
    patch = np.zeros((len(straps.length), n))
    for s in range(len(straps.length)):
        part = slice(straps.patch_start[s], straps.patch_start[s + 1])
        patch[s, straps.patch_vertex[part]] = straps.patch_weight[part]
    ties = np.zeros((len(net.stiffness), n))
    rows = np.arange(len(net.stiffness))
    ties[rows, net.spring_vertices[:, 1]], ties[rows, net.spring_vertices[:, 0]] = 1, -1
    # Springs and straps alike: d = A x + b, energy ½ κ (‖d‖ − r)².
    matrix = np.concatenate([ties, patch])
    shift = np.concatenate([np.zeros((len(rows), 3)), -straps.bar_point])
    rest = np.concatenate([net.rest_length, straps.length])
    stiffness = np.concatenate([net.stiffness, straps.stiffness])
    # Beyond this length a spring buckles, a strap is slack.
    limit = rest.copy()
    limit[: len(rows)] *= 1 - net.buckling_strain
    share = np.concatenate([share, np.zeros(len(straps.length))])
    inertia = net.mass * held / H**2

    def pull(length):
        """Return the tension of each spring, and its derivative."""
        beyond = np.minimum(length - limit, 0)
        return (
            stiffness * (length - rest - (1 - share) * beyond),
            stiffness * np.where(beyond < 0, share, 1.0),
        )

    def energy(x):
        length = np.linalg.norm(matrix @ x + shift, axis=1)
        beyond = np.minimum(length - limit, 0)
        depth = np.maximum(FLOOR - x[:, 2], 0)
        return (
            (inertia[:, None] * (x - free) ** 2).sum() / 2
            + (stiffness * ((length - rest) ** 2 - (1 - share) * beyond**2)).sum() / 2
            + FLOOR_STIFFNESS * (depth**2).sum() / 2
        )

    x = start + H * velocity
    for _ in range(60):
        d = matrix @ x + shift
        length = np.linalg.norm(d, axis=1)
        tension, kept = pull(length)
        depth = np.maximum(FLOOR - x[:, 2], 0)
        gradient = inertia[:, None] * (x - free)
        gradient += matrix.T @ ((tension / length)[:, None] * d)
        gradient[:, 2] -= FLOOR_STIFFNESS * depth
        if np.abs(gradient).max() < 1e-11:
            break
        unit = d / length[:, None]
        along = unit[:, :, None] * unit[:, None, :]
        across = np.maximum(tension / length, 0)[:, None, None] * (np.eye(3) - along)
        blocks = kept[:, None, None] * along + across
        hessian = np.einsum("si,sab,sj->iajb", matrix, blocks, matrix, optimize=True)
        i = np.arange(n)
        for axis in range(3):
            hessian[i, axis, i, axis] += inertia
        hessian[i, 2, i, 2] += FLOOR_STIFFNESS * (depth > 0)
        step = np.linalg.solve(hessian.reshape(3 * n, 3 * n), -gradient.ravel()).reshape(n, 3)
        length = 1.0
        while energy(x + length * step) > energy(x) + 1e-15 and length > 1e-6:
            length /= 2
        x = x + length * step
    return x


@pytest.mark.parametrize("material", [PAPER, FABRIC])
@pytest.mark.parametrize("window", [0, 6])
def test_local_global_step_is_newtons(material, window):
    sheet = hanging_sheet(material)
    solver = LiuSolver(sheet, step=H, tolerance=1e-7, window=window)
    state = lay_flat(sheet.net, np.zeros(3))
    state.velocity += np.random.default_rng(2).normal(scale=0.3, size=state.velocity.shape)
    floor = PlaneContact.empty(len(sheet.net.mass))
    floor.active[:], floor.normal[:, 2] = True, 1.0
    floor.offset[:], floor.stiffness[:] = FLOOR, FLOOR_STIFFNESS
    for _ in range(4):
        start = state.position.copy()
        exact = newton_step(sheet, start, state.velocity.copy())
        floor.offset[:] = FLOOR
        reaction = solver.advance(state, H, floor, STILL_BAR)
        error = np.linalg.norm(state.position - exact) / np.linalg.norm(exact - start)
        assert error < 1e-4
    assert reaction.contact.normal_force.sum() == pytest.approx(
        FLOOR_STIFFNESS * np.maximum(FLOOR - exact[:, 2], 0).sum(), rel=1e-3
    )


def test_steps_and_tolerances_are_checked():
    sheet = hanging_sheet(PAPER)
    with pytest.raises(DesignError, match=r"method\.sheet\.step_s: is 0"):
        LiuSolver(sheet, step=0.0)
    with pytest.raises(DesignError, match=r"method\.sheet\.solver\.tolerance: is -1"):
        LiuSolver(sheet, tolerance=-1.0)
