"""A study → the jobs that simulate it. Imports little: every start of the sweep waits for it."""

from simcore.config import Candidate, Study

JOBS, JOB_SIZE_MAX = 8, 50
"""A study is cut into about so many jobs, enough to keep two cores busy to the end, unless a job
would then hold more candidates than this: its table is written when all of them are done."""


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
