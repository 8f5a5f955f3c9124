"""The shipped sling against a quarter of its steps: where the pelvis is, and what carries it.

A body in a sling swings chaotically: how far two runs are apart is a draw (docs/sling.md). So
several are made, with noise far below anything that matters.
"""

from dataclasses import replace

import numpy as np

from simcore.bench import case_scene
from simcore.recorder import Trajectory
from simcore.scene import Scene
from simcore.simulate import simulate

SHARE = 4
"""Steps of the body, exchanges and sub-steps of the reference are so many times shorter."""

DRAWS, NOISE = 5, 1e-9
"""Runs, and the greatest speed of the sheet's vertices at the start of each [m/s]."""


def measure() -> dict:
    """Return greatest distances of the pelvis [m], and supports over weight in the hold."""
    scene = case_scene("sling")
    method = scene.method
    steps = method.adaptive_step.model_dump()
    fine_scene = case_scene("sling", {
        **{f"method.adaptive_step.{name}": value / SHARE for name, value in steps.items()},
        "method.sheet.step_s": method.sheet.step_s / SHARE,
        "method.sheet.solver.substep_s": scene.sling.solver.substep / SHARE,
    })
    runs = [simulate(_nudged(scene, draw)) for draw in range(DRAWS)]
    fine = simulate(fine_scene)
    return {
        "steps": [method.sheet.step_s, scene.sling.solver.substep],
        "pelvis": [_apart(run, fine) for run in runs],
        "support": [_support(scene, run) for run in runs],
        "support_fine": _support(fine_scene, fine),
    }


def table(entry: dict) -> list[list[str]]:
    """Return the rows of an entry, the header first."""
    step, substep = (1e3 * each for each in entry["steps"])
    apart, support = 1e3 * np.array(entry["pelvis"]), entry["support"]
    return [
        ["sling", f"steps up to {step:g} and {substep:.2g} ms", f"a {SHARE}th of both"],
        [f"pelvis, at the worst of all times, median of {len(apart)} runs",
         f"{np.median(apart):.1f} ({apart.min():.1f} to {apart.max():.1f}) mm off", "0"],
        ["mean support in the hold over weight", f"{min(support):.4f} to {max(support):.4f}",
         f"{entry['support_fine']:.4f}"],
    ]


def _nudged(scene: Scene, draw: int) -> Scene:
    """Return the scene with noise on the sheet's vertices; draw 0 as it is."""
    start = scene.sling.start
    noise = NOISE * np.random.default_rng(draw).uniform(-1, 1, start.velocity.shape)
    if draw:
        start = replace(start, velocity=start.velocity + noise)
    return replace(scene, sling=replace(scene.sling, start=start))


def _apart(run: Trajectory, fine: Trajectory) -> float:
    """Return how far the pelvis is from where the other has it, at the worst of all times [m]."""
    start, end = max(run.time[0], fine.time[0]), min(run.time[-1], fine.time[-1])
    at = run.time[(run.time >= start) & (run.time <= end)]
    way = [np.interp(at, run.time, run.q[:, a]) - np.interp(at, fine.time, fine.q[:, a])
           for a in range(3)]
    return float(np.linalg.norm(way, axis=0).max())


def _support(scene: Scene, run: Trajectory) -> float:
    """Return the mean vertical support of the last three seconds, over the weight carried."""
    held = run.time > run.time[-1] - scene.method.hold_s
    weight = scene.body.mass + scene.sling.solver.sheet.net.mass.sum()
    gravity = -scene.sling.solver.sheet.gravity[2]
    return float(run.support_force[held, 2].mean() / (weight * gravity))
