"""How fast the engine is on this machine, by phase of the motion."""

import platform
import time as clock
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import numpy as np

from simcore.config import load_study
from simcore.provenance import simulation_digest, versions
from simcore.scene import Scene, build_scene
from simcore.simulate import simulate

CASES = {
    "lift": ("config/lift_angle.yaml", {"body": "male_172_70", "support_angle_deg": 10.0}),
    "sling": (
        "config/sling_stiffness.yaml",
        {"body": "male_172_70", "device": "sling_reclined", "stiffness_per_width_n_per_m": 2e4},
    ),
}
"""Study and place in it of each case: the shipped ones, at paper size."""

CALIBRATION_SIZE, CALIBRATION_ROUNDS = 400, 5


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
        Real-time factor by phase: settle, each keyframe interval, hold.
    calibration_ms : float
        A fixed matrix product timed in the same run, by which machines can be compared.
    """

    case: str
    real_time_factor: float
    spread: tuple[float, float]
    phases: dict[str, float]
    simulated_time: float
    skin_vertices: int
    device_points: int
    sheet_vertices: int
    degrees_of_freedom: int
    integrator: str
    time_step: float
    calibration_ms: float
    machine: str
    versions: str
    source_digest: str

    def as_dict(self) -> dict:
        """Return all values for JSON."""
        return asdict(self)


def bench_case(case: str, repeats: int) -> Benchmark:
    """Time a whole run of the 70 kg man at paper size: settling, every move, and the hold."""
    path, point = CASES[case]
    study = load_study(Path(path), point)
    (candidate,) = study.candidates
    scene = build_scene(candidate.design, candidate.coordinates["body"], study.root)
    _timed_phases(scene)  # compiles, or loads what was compiled
    runs = [_timed_phases(scene) for _ in range(repeats)]
    simulated = runs[0]["whole"][0]
    factors = [run["whole"][0] / run["whole"][1] for run in runs]
    return Benchmark(
        case=case,
        real_time_factor=median(factors),
        spread=(min(factors), max(factors)),
        phases={
            name: median(run[name][0] / run[name][1] for run in runs)
            for name in runs[0]
            if name != "whole"
        },
        simulated_time=simulated,
        skin_vertices=scene.body.skin.vertex_count,
        device_points=0 if scene.sling else len(scene.surface.contact_points),
        sheet_vertices=len(scene.sling.start.position) if scene.sling else 0,
        degrees_of_freedom=scene.body.model.nv,
        integrator=scene.method.integrator,
        time_step=scene.method.time_step_s,
        calibration_ms=_calibration(),
        machine=f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}",
        versions=versions(),
        source_digest=simulation_digest(),
    )


def _timed_phases(scene: Scene) -> dict[str, tuple[float, float]]:
    """Return simulated and CPU time [s] of each phase and of the whole run."""
    stamps = [(0.0, clock.process_time())]
    trajectory = simulate(scene, lambda time: stamps.append((time, clock.process_time())))
    stamps.append((stamps[-1][0], clock.process_time()))
    simulated, spent = np.array(stamps).T
    start = -trajectory.time[0]
    keys = [start + keyframe for keyframe in scene.motion.keyframe_times]
    edges = [0.0, *keys, simulated[-1]]
    names = ["settle", *(f"move {i}" for i in range(1, len(keys))), "hold"]
    at = np.interp(edges, simulated, spent)
    phases = {
        name: (float(edges[i + 1] - edges[i]), float(at[i + 1] - at[i]))
        for i, name in enumerate(names)
        if edges[i + 1] > edges[i]
    }
    return phases | {"whole": (float(simulated[-1]), float(spent[-1] - spent[0]))}


def _calibration() -> float:
    """Return the least time of a fixed matrix product [ms]."""
    matrix = np.random.default_rng(0).standard_normal((CALIBRATION_SIZE, CALIBRATION_SIZE))
    times = []
    for _ in range(CALIBRATION_ROUNDS):
        begin = clock.perf_counter()
        matrix @ matrix
        times.append(clock.perf_counter() - begin)
    return 1e3 * min(times)
