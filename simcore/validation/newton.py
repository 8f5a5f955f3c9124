"""Newton's method on the backward Euler step of a small sheet: slow, dense, and exact."""

import numpy as np

from simcore.config.sling_lift import Fabric, HangingDesign, LoopAttachment, PaperMaterial
from simcore.sheet import (
    STILL_BAR,
    LiuSolver,
    PlaneContact,
    Sheet,
    build_net,
    build_straps,
    lay_flat,
    make_sheet,
)
from simcore.validation.sheet_scenes import rectangular

STEP = 2e-3
"""Of backward Euler [s]."""

FLOOR, FLOOR_STIFFNESS = -0.002, 400.0
"""Height [m], and stiffness for each vertex [N/m]."""

PAPER = PaperMaterial(kind="paper", stiffness_n_per_m=1000.0, mass_kg=1.0)
FABRIC = Fabric(kind="fabric", stiffness_per_width_n_per_m=2e3, areal_density_kg_per_m2=1.0)


def hanging_sheet(material) -> Sheet:
    """Return 0.4 m × 0.3 m on four straps, of 90 vertices."""
    net = build_net(rectangular(0.4, 0.3, material, 90))
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


def floor_of(sheet: Sheet) -> PlaneContact:
    """Return the floor under every vertex."""
    floor = PlaneContact.empty(len(sheet.net.mass))
    floor.active[:], floor.normal[:, 2] = True, 1.0
    floor.offset[:], floor.stiffness[:] = FLOOR, FLOOR_STIFFNESS
    return floor


def step_errors(sheet: Sheet, window: int = 6) -> tuple[list[float], float]:
    """Return the relative errors of four steps of `LiuSolver`, and of the load of the floor.

    Parameters
    ----------
    sheet : Sheet
        Starts flat, with random velocities.
    window : int
        Iterates that accelerate the solver; 0 for none.
    """
    solver = LiuSolver(sheet, step=STEP, tolerance=1e-7, window=window)
    state = lay_flat(sheet.net, np.zeros(3))
    state.velocity += np.random.default_rng(2).normal(scale=0.3, size=state.velocity.shape)
    floor, errors = floor_of(sheet), []
    for _ in range(4):
        start = state.position.copy()
        exact = newton_step(sheet, start, state.velocity.copy())
        floor.offset[:] = FLOOR
        reaction = solver.advance(state, STEP, floor, STILL_BAR)
        errors.append(np.linalg.norm(state.position - exact) / np.linalg.norm(exact - start))
    load = FLOOR_STIFFNESS * np.maximum(FLOOR - exact[:, 2], 0).sum()
    return errors, abs(reaction.contact.normal_force.sum() / load - 1)


class _Springs:
    """Springs and straps alike: d = A x + b, tension κ (‖d‖ − r), a share of it when shorter."""

    def __init__(self, sheet: Sheet):
        net, straps = sheet.net, sheet.straps
        count, rows = len(net.mass), np.arange(len(net.stiffness))
        ties = np.zeros((len(rows), count))
        ties[rows, net.spring_vertices[:, 1]], ties[rows, net.spring_vertices[:, 0]] = 1, -1
        patch = np.zeros((len(straps.length), count))
        for s in range(len(straps.length)):
            part = slice(straps.patch_start[s], straps.patch_start[s + 1])
            patch[s, straps.patch_vertex[part]] = straps.patch_weight[part]
        self.matrix = np.concatenate([ties, patch])
        self.shift = np.concatenate([np.zeros((len(rows), 3)), -straps.bar_point])
        self.rest = np.concatenate([net.rest_length, straps.length])
        self.stiffness = np.concatenate([net.stiffness, straps.stiffness])
        # Below this length a spring buckles, a strap is slack.
        self.limit = self.rest.copy()
        self.limit[: len(rows)] *= 1 - net.buckling_strain
        self.share = np.concatenate([
            np.where(net.spring_kind < 2, net.compression_share, 1.0), np.zeros(len(straps.length))
        ])

    def energy(self, x: np.ndarray) -> float:
        """[J] of all, at positions x (n, 3)."""
        length = np.linalg.norm(self.matrix @ x + self.shift, axis=1)
        beyond = np.minimum(length - self.limit, 0)
        square = (length - self.rest) ** 2 - (1 - self.share) * beyond**2
        return (self.stiffness * square).sum() / 2

    def gradient(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivative (n, 3) [N] of the energy, and (n, 3, n, 3) of that [N/m].

        The latter leaves out what is negative crosswise to a spring.
        """
        d = self.matrix @ x + self.shift
        length = np.linalg.norm(d, axis=1)
        beyond = np.minimum(length - self.limit, 0)
        tension = self.stiffness * (length - self.rest - (1 - self.share) * beyond)
        kept = self.stiffness * np.where(beyond < 0, self.share, 1.0)
        unit = d / length[:, None]
        along = unit[:, :, None] * unit[:, None, :]
        across = np.maximum(tension / length, 0)[:, None, None] * (np.eye(3) - along)
        blocks = kept[:, None, None] * along + across
        count = self.matrix.shape[1]
        second = np.empty((count, 3, count, 3))
        for i in range(3):
            for j in range(3):
                second[:, i, :, j] = self.matrix.T @ (blocks[:, i, j, None] * self.matrix)
        return self.matrix.T @ (tension[:, None] * unit), second


def newton_step(sheet: Sheet, start: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return the exact backward Euler step (n, 3) with the floor: dense Newton, line search.

    Parameters
    ----------
    start, velocity : (n, 3) float64
        [m], [m/s]
    """
    springs, count = _Springs(sheet), len(sheet.net.mass)
    held = 1 + STEP * sheet.drag_rate
    free = start + (STEP * velocity + STEP**2 * sheet.gravity) / held
    inertia = sheet.net.mass * held / STEP**2

    def energy(x):
        depth = np.maximum(FLOOR - x[:, 2], 0)
        moved = (inertia[:, None] * (x - free) ** 2).sum() / 2
        return moved + springs.energy(x) + FLOOR_STIFFNESS * (depth**2).sum() / 2

    x, i = start + STEP * velocity, np.arange(count)
    for _ in range(60):
        gradient, hessian = springs.gradient(x)
        depth = np.maximum(FLOOR - x[:, 2], 0)
        gradient += inertia[:, None] * (x - free)
        gradient[:, 2] -= FLOOR_STIFFNESS * depth
        if np.abs(gradient).max() < 1e-11:
            break
        for axis in range(3):
            hessian[i, axis, i, axis] += inertia
        hessian[i, 2, i, 2] += FLOOR_STIFFNESS * (depth > 0)
        matrix = hessian.reshape(3 * count, 3 * count)
        step = np.linalg.solve(matrix, -gradient.ravel()).reshape(count, 3)
        length = 1.0
        while energy(x + length * step) > energy(x) + 1e-15 and length > 1e-6:
            length /= 2
        x = x + length * step
    return x
