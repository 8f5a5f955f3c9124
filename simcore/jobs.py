"""A study → the jobs that simulate it. Imports little: every start of the sweep waits for it."""

from simcore.config import Candidate, Study

JOBS, JOB_SIZE_MAX = 8, 50
"""A study is cut into about so many jobs, enough to keep two cores busy to the end, unless a job
would then hold more candidates than this: its table is written when all of them are done."""


def jobs_of(study: Study) -> dict[str, list[Candidate]]:
    """Return the candidates of each job, neighbours in the grid together, by the job's name.

    Variants of certificates have jobs of their own. A job skips what is already simulated, so
    that it costs nothing when a new value shifts candidates from one job to the next.
    """
    size = study.file.candidates_per_job
    jobs = [*_cut(study.candidates, size), *_cut(study.variant_runs, size)]
    return {f"{number:04d}": list(job) for number, job in enumerate(jobs)}


def _cut(runs: tuple[Candidate, ...], size: int | None) -> list[tuple[Candidate, ...]]:
    size = size or max(1, min(-(-len(runs) // JOBS), JOB_SIZE_MAX))
    return [runs[start : start + size] for start in range(0, len(runs), size)]
