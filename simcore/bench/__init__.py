"""How fast the engine is on this machine: whole runs, stages of a step, and a yardstick."""

from simcore.bench.calibration import Calibration, calibrate
from simcore.bench.cases import (
    CASES,
    Benchmark,
    bench_case,
    case_design,
    case_scene,
    steady_run,
    with_values,
)
from simcore.bench.history import append, latest, new_entry
from simcore.bench.profile import Profile, profile_scene

__all__ = [
    "CASES",
    "Benchmark",
    "Calibration",
    "Profile",
    "append",
    "bench_case",
    "calibrate",
    "case_design",
    "case_scene",
    "latest",
    "new_entry",
    "profile_scene",
    "steady_run",
    "with_values",
]
