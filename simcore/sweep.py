"""Simulate candidates one after another: a failure is a row, never the end."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from simcore.config import Candidate, Study
from simcore.dataset import (
    candidate_dataset,
    candidate_path,
    has_current_result,
    read_row,
    row,
    write_dataset,
)
from simcore.errors import SimulationError
from simcore.frames import trajectory_dataset
from simcore.metrics import METRICS, compute_metrics, skin_pressure
from simcore.recorder import Trajectory
from simcore.scene import build_scene
from simcore.simulate import Progress, simulate


def simulate_missing(
    study: Study,
    candidates: list[Candidate],
    report: Callable[[Candidate, xr.Dataset], None] | None = None,
) -> list[xr.Dataset]:
    """Return the figures of candidates, simulating those that the present code has not yet.

    Also those whose frames were left out, if the study wants the frames of all. `report` is told
    each candidate that was simulated, as soon as its result is on the disk.
    """
    folder = study.folder / "candidates"
    rows = []
    for candidate in candidates:
        if _is_done(study, candidate):
            rows.append(read_row(folder, candidate))
            continue
        rows.append(_simulate_and_keep(study, candidate, study.keeps_frames))
        if report:
            report(candidate, rows[-1])
    return rows


def simulate_again(
    study: Study, names: list[str], report: Callable[[Candidate, int, int], None] | None = None
) -> None:
    """Add frames to the candidates of these ids that were left without.

    `report` is told each that was simulated again, its number, and how many there are.

    Raises
    ------
    RuntimeError
        A figure came out otherwise than before: a bug.
    """
    folder = study.folder / "candidates"
    by_name = {each.id: each for each in reversed(study.candidates)}
    wanted = [
        by_name[name] for name in names
        if not has_current_result(folder, by_name[name], with_frames=True)
    ]  # fmt: skip
    for number, candidate in enumerate(wanted, 1):
        _simulate_and_keep(study, candidate, keep_frames=True)
        if report:
            report(candidate, number, len(wanted))


def _simulate_and_keep(study: Study, candidate: Candidate, keep_frames: bool) -> xr.Dataset:
    """Simulate a candidate and write its file; return its figures."""
    folder = study.folder / "candidates"
    figures, run, _ = run_candidate(candidate, study.root)
    if has_current_result(folder, candidate):  # simulated again for its frames
        before = read_row(folder, candidate)
        _refuse_changes(candidate, before, figures)
        figures = before  # the time it took is the one that the dataset tells
    ds = candidate_dataset(candidate, figures, run, keep_frames)
    write_dataset(ds, candidate_path(folder, candidate))
    return figures


def _refuse_changes(candidate: Candidate, before: xr.Dataset, after: xr.Dataset) -> None:
    """Raise where the figures of two runs of a candidate differ in any bit."""
    for name in (*METRICS, "status", "reason"):
        if name != "cpu_time" and not before[name].equals(after[name]):
            raise RuntimeError(
                f"candidate {candidate.id}: simulated again for its frames, its {name} was "
                f"{after[name].values} instead of {before[name].values}; where neither processor "
                "nor packages have changed, this is a bug"
            )


@dataclass(frozen=True)
class Count:
    """How far a sweep is.

    Attributes
    ----------
    done, total : int
        Candidates and variants that have a result, and all.
    fresh, failed : int
        Of those done, the ones that this sweep simulated, and those among them that failed.
    seconds : float
        Since it began [s].
    """

    done: int
    total: int
    fresh: int
    failed: int
    seconds: float

    @property
    def pace(self) -> str:
        """What the console shows beside it: "1 failed, 5.3 a minute, 3 min left"."""
        rate = self.fresh / max(self.seconds, 1e-3)
        left = (self.total - self.done) / rate
        parts = [f"{self.failed} failed"] if self.failed else []
        parts += [f"{60 * rate:.1f} a minute", f"{_duration(left)} left"] if left else []
        return ", ".join(parts)

    @property
    def is_tenth(self) -> bool:
        """Whether this result completes another tenth of the sweep."""
        return self.done * 10 // self.total > (self.done - 1) * 10 // self.total


def begin_count(study: Study) -> None:
    """Note when the jobs start, and which candidates and variants have a current result then."""
    folder = study.folder / "candidates"
    done = [each.id for each in study.runs if _is_done(study, each)]
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"began {time.time():.3f}", *(f"{each} kept" for each in done)]
    _count_file(study).write_text("".join(f"{line}\n" for line in lines), encoding="ascii")


def count_done(study: Study, candidate: Candidate, failed: bool = False) -> Count:
    """Note one more finished candidate; return how far the sweep is, other jobs included."""
    with _count_file(study).open("a+", encoding="ascii") as file:  # lines this short never mix
        file.write(f"{candidate.id} {'failed' if failed else 'ok'}\n")
        file.flush()
        file.seek(0)
        noted = dict(line.split() for line in file)
    told = [noted[each.id] for each in study.runs if each.id in noted]
    return Count(
        done=len(told), total=len(study.runs), fresh=len(told) - told.count("kept"),
        failed=told.count("failed"), seconds=time.time() - float(noted["began"]),
    )


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _is_done(study: Study, candidate: Candidate) -> bool:
    wants_frames = study.file.trajectories == "all"
    return has_current_result(study.folder / "candidates", candidate, with_frames=wants_frames)


def _count_file(study: Study) -> Path:
    return study.folder / "candidates" / "done.txt"


def run_candidate(
    candidate: Candidate, root: Path, progress: Progress | None = None
) -> tuple[xr.Dataset, xr.Dataset | None, Trajectory | None]:
    """Simulate one candidate; return its figures, its run (`simcore.frames`) and its trajectory.

    The run is None where it failed before the first frame.
    """
    try:
        scene = build_scene(candidate.design, candidate.coordinates["body"], root)
        trajectory = simulate(scene, progress)
    except SimulationError as error:
        return row(candidate, error.status, error.reason, None), None, None
    pressure = skin_pressure(scene, trajectory)
    # The figures of a run that broke off would look like those of one that went well.
    metrics = compute_metrics(scene, trajectory, pressure) if trajectory.status == "ok" else None
    figures = row(candidate, trajectory.status, trajectory.reason, metrics)
    run = trajectory_dataset(trajectory, pressure, figures["fall_time"].item())
    return figures, run, trajectory


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
