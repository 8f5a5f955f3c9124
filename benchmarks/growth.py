"""How cost grows with the size of skin and device, and with the number of candidates.

`python -m benchmarks growth` measures, fits exponents and draws docs/images/growth.svg.
"""

import tempfile
import time as clock
from collections.abc import Callable
from pathlib import Path

import numpy as np

from simcore.bench import case_design, case_scene, steady_run
from simcore.config import load_study
from simcore.dataset import collect, write_dataset, write_rows
from simcore.device.build import build_surface
from simcore.device.distance import device_distance
from simcore.simulate import simulate, step_ladder
from simcore.sweep import simulate_missing
from simcore.validation.table import Curve, Plot

ROOT = Path(__file__).parents[1]
SKIN_VERTICES = (7_000, 14_000, 28_000, 56_000)
DEVICE_VERTICES = (5_000, 10_000, 20_000, 40_000, 80_000)
CANDIDATES = (10, 100, 1_000)
REPEATS = 5
EXPONENT_MAX = 1.1

SHORT_RUN = {
    "method.settling.duration_min_s": 1.0,
    "method.settling.duration_max_s": 1.0,
    "method.hold_s": 0.0,
    "device.motion.keyframes": [
        {"time_s": 0.0, "translation_m": 0.0, "rotation_deg": 0.0},
        {"time_s": 1.0, "translation_m": 0.1, "rotation_deg": 0.0},
    ],
}
"""The lift's first two seconds: the body comes to rest on it and is raised."""

TINY_STUDY = """\
title: Growth with the number of candidates
devices: [robotic_lift]
bodies: [male_172_70]
posture: seated
method: production
set:
  skin_vertices: 2000
  surface.vertex_count: 500
  duration_min_s: 0
  duration_max_s: 0.004
  keyframes.1.time_s: 0.004
  keyframes.1.translation_m: 0
  keyframes.2.time_s: 0.008
  keyframes.2.translation_m: 0
  keyframes.2.rotation_deg: 0
  hold_s: 0
axes:
  friction_coefficient: {{start: 0.3, stop: 0.6, count: {count}}}
"""
"""Candidates of three steps, so that what each costs beside them is seen."""

SERIES = {
    "skin": "step, by skin vertices",
    "device": "step, by device vertices",
    "grid": "distance grid of a device, once a design, by its vertices",
    "candidates": "sweep beside the simulations, by candidates",
}
"""Key → what is timed [CPU s], by what."""


def measure() -> dict:
    """Return sizes, CPU times [s] and the exponent of each of `SERIES`."""
    found = {
        "skin": [_step_of("body.skin_vertices", count) for count in SKIN_VERTICES],
        "device": [_step_of("device.surface.vertex_count", count) for count in DEVICE_VERTICES],
        "grid": [_grid_of(count) for count in DEVICE_VERTICES],
        "candidates": [(count, _overhead_of(count)) for count in (2, *CANDIDATES)][1:],
    }
    series = {}
    for name, pairs in found.items():
        sizes, seconds = zip(*pairs, strict=True)
        series[name] = {
            "sizes": sizes, "seconds": seconds, "exponent": exponent(sizes, seconds)
        }
    return {"series": series}


def exponent(sizes, seconds) -> float:
    """Return the slope of a straight line through the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def plot(values: dict) -> Plot:
    """Return the measured times over those at the smallest size, both as powers of two."""
    curves = []
    for name, series in values["series"].items():
        sizes, seconds = np.log2(series["sizes"]), np.log2(series["seconds"])
        curves.append(Curve(name, sizes - sizes[0], seconds - seconds[0]))
    return Plot(
        "growth", "Cost by size, each from its smallest size on", "doublings of the size",
        "doublings of the cost", tuple(curves),
    )


def _step_of(key: str, count: int) -> tuple[int, float]:
    """Return how many vertices there are, and the CPU time of a step [s]."""
    scene = case_scene("lift", SHORT_RUN | {key: count})
    simulate(scene)  # compiles, or loads what was compiled
    runs = [steady_run(scene)[1:] for _ in range(REPEATS)]
    cost = float(np.median([spent / simulated for simulated, spent in runs]))
    size = scene.body.skin.vertex_count if "skin" in key else len(scene.surface.contact_points)
    return size, cost * step_ladder(scene).longest


def _grid_of(count: int) -> tuple[int, float]:
    design = case_design("lift", {"device.surface.vertex_count": count}).device.surface
    surface = build_surface(design, ROOT)
    return len(surface.contact_points), _median_time(lambda: device_distance(design, surface))


def _overhead_of(count: int) -> float:
    """Return the CPU time [s] of a sweep, from YAML to dataset, beside that of its simulations."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "config").mkdir()
        (root / "designs").symlink_to(ROOT / "designs")
        path = root / "config" / "growth.yaml"
        path.write_text(TINY_STUDY.format(count=count), encoding="utf-8")
        begin = clock.process_time()
        study = load_study(path)
        write_rows(simulate_missing(study, list(study.candidates)), root / "rows.nc")
        ds = collect(study, [root / "rows.nc"])
        write_dataset(ds, root / "dataset.nc")
        return clock.process_time() - begin - float(ds.cpu_time.sum())


def _median_time(task: Callable[[], object]) -> float:
    times = []
    for _ in range(REPEATS):
        begin = clock.process_time()
        task()
        times.append(clock.process_time() - begin)
    return float(np.median(times))
