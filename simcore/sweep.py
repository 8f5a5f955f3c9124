"""Simulate candidates one after another: a failure is a row, never the end."""

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from simcore.config import Candidate, Study
from simcore.dataset import (
    candidate_dataset,
    candidate_path,
    has_current_result,
    read_row,
    row,
    trajectory_dataset,
    write_dataset,
)
from simcore.errors import SimulationError
from simcore.metrics import compute_metrics, skin_pressure
from simcore.recorder import Trajectory
from simcore.scene import build_scene
from simcore.simulate import Progress, simulate

JOBS, JOB_SIZE_MAX = 8, 50
"""A study is cut into about so many jobs, enough to keep two cores busy to the end, unless a job
would then hold more candidates than this: a job reports only when all of them are done."""


def jobs_of(study: Study) -> dict[str, list[Candidate]]:
    """Return the candidates of each job, neighbours in the grid together, by the job's name.

    A job skips what is already simulated, so that it costs nothing when a new value shifts
    candidates from one job to the next.
    """
    size = study.file.candidates_per_job or min(-(-len(study.candidates) // JOBS), JOB_SIZE_MAX)
    starts = range(0, len(study.candidates), size)
    return {
        f"{number:04d}": list(study.candidates[start : start + size])
        for number, start in enumerate(starts)
    }


def simulate_missing(
    study: Study,
    candidates: list[Candidate],
    report: Callable[[Candidate, xr.Dataset], None] | None = None,
) -> list[xr.Dataset]:
    """Return the figures of candidates, simulating those that the present code has not yet."""
    folder = study.folder / "candidates"
    rows = []
    for candidate in candidates:
        if not has_current_result(folder, candidate):
            figures, frames, _ = run_candidate(candidate, study.root)
            ds = candidate_dataset(candidate, figures, frames)
            write_dataset(ds, candidate_path(folder, candidate))
        rows.append(read_row(folder, candidate))
        if report:
            report(candidate, rows[-1])
    return rows


def run_candidate(
    candidate: Candidate, root: Path, progress: Progress | None = None
) -> tuple[xr.Dataset, xr.Dataset | None, Trajectory | None]:
    """Simulate one candidate; return its figures, its frames and its trajectory.

    The frames are None where it failed before the first one.
    """
    try:
        scene = build_scene(candidate.design, candidate.coordinates["body"], root)
    except SimulationError as error:
        return row(candidate, error.status, error.reason, None), None, None
    trajectory = simulate(scene, progress)
    pressure = skin_pressure(scene, trajectory)
    figures = row(
        candidate, trajectory.status, trajectory.reason,
        compute_metrics(scene, trajectory, pressure),
    )
    return figures, trajectory_dataset(trajectory, pressure), trajectory


def describe_row(candidate: Candidate, figures: xr.Dataset) -> str:
    """Return one line that says how a candidate came out."""
    place = ", ".join(f"{name} {value}" for name, value in candidate.coordinates.items())
    if figures.status.item() != "ok":
        return f"{place}: {figures.status.item()}: {figures.reason.item()}"
    verdict = "fell" if figures.fell.item() else "held"
    return (
        f"{place}: {verdict}, margin {figures.fall_margin.item():.2f}, "
        f"peak {figures.peak_pressure.item() / 1000:.1f} kPa"
    )
