"""Whole runs of the shipped designs, by phase of the motion."""

import time as clock
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import numpy as np

from simcore.config import Candidate, Design, load_study
from simcore.config.paths import set_value
from simcore.recorder import Trajectory
from simcore.scene import Scene, build_scene
from simcore.simulate import simulate, step_ladder

CASES = {
    "lift": ("config/lift_angle.yaml", {"body": "male_172_70", "support_angle_deg": 10.0}),
    "fall": ("config/lift_angle.yaml", {"body": "male_172_70", "support_angle_deg": 0.0}),
    "paper": (
        "config/headline.yaml",
        {"support_angle_deg": 7, "friction_force_n": 0.5, "longest_s": 0.015},
    ),
    "paper_fall": (
        "config/headline.yaml",
        {"support_angle_deg": 0, "friction_force_n": 0.5, "longest_s": 0.015},
    ),
    "sling": (
        "config/sling_stiffness.yaml",
        {"body": "male_172_70", "device": "sling_reclined", "stiffness_per_width_n_per_m": 2e4},
    ),
}
"""Study and place in it of each case: the shipped ones, at paper size. `fall` is off the flat lift;
`paper` and `paper_fall` are the paper's method (Runge–Kutta)."""


@dataclass(frozen=True)
class Benchmark:
    """Real-time factors (simulated s per CPU s, one core, compiled code warm).

    Attributes
    ----------
    real_time_factor : float
        Over the whole run, median of the repeats.
    spread : tuple of float
        Least and greatest of the repeats.
    phases : dict
        Real-time factor of the time stepping by phase: settle from the second step on, each
        keyframe interval, hold.
    beside : dict
        CPU time before and after these [ms].
    """

    case: str
    real_time_factor: float
    spread: tuple[float, float]
    phases: dict[str, float]
    beside: dict[str, float]
    simulated_time: float
    skin_vertices: int
    device_points: int
    sheet_vertices: int
    degrees_of_freedom: int
    integrator: str
    time_step: float

    def as_dict(self) -> dict:
        """Return all values for JSON."""
        return asdict(self)


def case_scene(case: str, changes: dict | None = None) -> Scene:
    """Return the scene of a case, with values replaced by the full path of their keys."""
    candidate, root = _candidate(case)
    return build_scene(case_design(case, changes), candidate.coordinates["body"], root)


def case_design(case: str, changes: dict | None = None) -> Design:
    """Return the design of a case, likewise."""
    candidate, _ = _candidate(case)
    return with_values(candidate.design, changes or {})


def with_values(design: Design, changes: dict) -> Design:
    """Return a design with values replaced by the full path of their keys."""
    tree = design.model_dump()
    for key, value in changes.items():
        set_value(tree, key, value)
    return Design.model_validate(tree)


def _candidate(case: str) -> tuple[Candidate, Path]:
    path, point = CASES[case]
    study = load_study(Path(path), point)
    (candidate,) = study.candidates
    return candidate, study.root


def bench_case(case: str, repeats: int) -> Benchmark:
    """Time a whole run of the 70 kg man at paper size: settling, every move, and the hold."""
    scene = case_scene(case)
    simulate(scene)  # compiles, or loads what was compiled
    runs = [_timed_run(scene) for _ in range(repeats)]
    first = runs[0]
    factors = [run.simulated / run.spent for run in runs]
    return Benchmark(
        case=case,
        real_time_factor=median(factors),
        spread=(min(factors), max(factors)),
        phases={
            name: median(run.phases[name][0] / run.phases[name][1] for run in runs)
            for name in first.phases
        },
        beside={name: 1e3 * median(run.beside[name] for run in runs) for name in first.beside},
        simulated_time=first.simulated,
        skin_vertices=scene.body.skin.vertex_count,
        device_points=0 if scene.sling else len(scene.surface.contact_points),
        sheet_vertices=len(scene.sling.start.position) if scene.sling else 0,
        degrees_of_freedom=scene.body.model.nv,
        integrator=scene.method.integrator,
        time_step=step_ladder(scene).longest,
    )


def steady_run(scene: Scene) -> tuple[Trajectory, float, float]:
    """Return a run, and its simulated and CPU time [s] from the first recorded frame to the last.

    What is set up before the first step is left out, so that short runs can be compared.
    """
    stamps = []
    trajectory = simulate(scene, lambda time: stamps.append((time, clock.process_time())))
    simulated, spent = np.subtract(stamps[-1], stamps[0])
    return trajectory, float(simulated), float(spent)


@dataclass(frozen=True)
class _TimedRun:
    """Simulated and CPU time of a run [s]; of each phase both, beside them the latter."""

    simulated: float
    spent: float
    phases: dict[str, tuple[float, float]]
    beside: dict[str, float]


def _timed_run(scene: Scene) -> _TimedRun:
    """Return the times of a run, of its phases, and of what comes before and after these.

    The first frame is kept after the first step, which therefore counts as set-up.
    """
    begin, stamps = clock.process_time(), []
    trajectory = simulate(scene, lambda time: stamps.append((time, clock.process_time())))
    end = clock.process_time()
    simulated, spent = np.array(stamps).T
    start = -trajectory.time[0]
    # A fall may end the run before the device moves.
    keys = [min(start + each, simulated[-1]) for each in scene.motion.keyframe_times]
    edges = [simulated[0], *keys, simulated[-1]]
    names = ["settle", *(f"move {i}" for i in range(1, len(keys))), "hold"]
    at = np.interp(edges, simulated, spent)
    phases = {
        name: (float(edges[i + 1] - edges[i]), float(at[i + 1] - at[i]))
        for i, name in enumerate(names)
        if edges[i + 1] > edges[i]
    }
    beside = {
        "set-up and first step": float(spent[0] - begin),
        "making of the trajectory": float(end - spent[-1]),
    }
    return _TimedRun(float(simulated[-1]), end - begin, phases, beside)
