"""Adaptive steps against short fixed ones, on the shipped lift: what they change of the figures."""

from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from simcore.bench import with_values
from simcore.config import load_study
from simcore.metrics import compute_metrics, skin_pressure
from simcore.recorder import FALL_DISPLACEMENT, Trajectory
from simcore.scene import build_scene
from simcore.simulate import simulate

SHORT = 0.001
"""Fixed step to compare with [s]."""

MAN, WOMAN = "male_172_70", "female_142_40"
PRODUCTION, PAPER = Path("config/lift_angle.yaml"), Path("benchmarks/paper.yaml")
FRICTION = "method.contact.friction_force_n"

RUNS = [
    *((PRODUCTION, MAN, angle, {}) for angle in (0, 3, 6, 7, 8, 10, 12)),
    *((PRODUCTION, WOMAN, angle, {}) for angle in (0, 4, 7, 8, 9, 10, 11)),
    *((PAPER, MAN, angle, {}) for angle in (0, 2, 4, 6, 7, 8, 10)),
    *((PAPER, MAN, 7, {FRICTION: force}) for force in (0.1, 2.0, 5.0)),
    (PAPER, MAN, 0, {FRICTION: 2.0}),
    *((PAPER, WOMAN, angle, {}) for angle in (0, 4, 7, 8, 9, 10, 11)),
]
"""Study, body, support angle [°] and changes of each."""


def measure() -> dict:
    """Return of each run how it ends with adaptive and with short steps, and how far apart."""
    return {"runs": [_compare(*run) for run in RUNS]}


def table(entry: dict) -> list[list[str]]:
    """Return the rows of an entry, the header first."""
    rows = []
    for run in entry["runs"]:
        ours, theirs, force = run["adaptive"], run["short"], run["friction_force"]
        name = f"{run['method']}, {run['body']}, {run['angle']}°"
        rows.append([
            f"{name}, {force:g} N" if force else name,
            _verdict(ours), _verdict(theirs),
            f"{1e3 * run['apart']:.2f}",
            f"{ours['peak'] / 1e3:.1f} ({100 * (ours['peak'] / theirs['peak'] - 1):+.1f} %)",
            f"{1e3 * ours['slide']:.1f} ({1e3 * (ours['slide'] - theirs['slide']):+.1f})",
        ])
    return [
        ["run", "adaptive steps", f"steps of {1e3 * SHORT:g} ms", "pelvis off by [mm]",
         "peak pressure [kPa]", "slide [mm]"],
        *rows,
    ]


def _verdict(figures: dict) -> str:
    fall = figures["fall_time"]
    return "held" if fall is None else f"falls at {fall:.2f} s"


def _compare(study: Path, body: str, angle: float, changes: dict) -> dict:
    steps = "method.adaptive_step."
    fixed = {steps + "longest_s": SHORT, steps + "shortest_s": SHORT}
    adaptive, ours = _run(study, body, angle, changes)
    short, theirs = _run(study, body, angle, changes | fixed)
    return {
        "method": "paper" if study == PAPER else "production", "body": body, "angle": angle,
        "friction_force": changes.get(FRICTION), "adaptive": ours, "short": theirs,
        "apart": _apart(adaptive, short),
    }


def _run(study: Path, body: str, angle: float, changes: dict) -> tuple[Trajectory, dict]:
    loaded = load_study(study, {"body": body, "support_angle_deg": angle})
    (candidate,) = loaded.candidates
    scene = build_scene(with_values(candidate.design, changes), body, loaded.root)
    run = simulate(scene)
    figures = compute_metrics(scene, run, skin_pressure(scene, run))
    fall = float(figures["fall_time"])
    return run, {
        # From the start of settling, which may take longer with one of them.
        "fall_time": None if np.isnan(fall) else fall - float(run.time[0]),
        "peak": float(figures["peak_pressure"]),
        "slide": float(figures["slide_distance"]),
    }


def _apart(run: Trajectory, other: Trajectory) -> float:
    """Return how far apart the two have the pelvis on the device, up to a fall [m].

    While both settle, and while the device moves: how long settling takes is not compared.
    """
    apart = 0.0
    ways = [_on_device(each) for each in (run, other)]
    for begin in (run.time[0], 0.0):
        clocks = [each.time - (each.time[0] if begin else 0.0) for each in (run, other)]
        ends = [
            clock[fallen.argmax()] if (fallen := each.displacement > FALL_DISPLACEMENT).any()
            else clock[-1]
            for each, clock in zip((run, other), clocks, strict=True)
        ]
        if begin:
            ends += [-run.time[0], -other.time[0]]
        seen = (clocks[0] >= 0) & (clocks[0] < min(ends))
        if seen.any():
            there = CubicSpline(clocks[1], ways[1])(clocks[0][seen])
            apart = max(apart, np.linalg.norm(ways[0][seen] - there, axis=1).max())
    return float(apart)


def _on_device(run: Trajectory) -> np.ndarray:
    """Return the pelvis as seen from the device (T, 3) [m]."""
    return np.einsum("tij,ti->tj", run.device_rotation, run.q[:, :3] - run.device_position)
