"""Simulate the candidates of one job; write their figures as one table."""

import signal
from pathlib import Path

from simcore.config import load_study
from simcore.dataset import write_rows
from simcore.sweep import count_done, describe_row, simulate_missing

signal.signal(signal.SIGINT, signal.SIG_DFL)  # an exception amid a write can hang NetCDF


def report(candidate, row):
    """Print one line for a finished candidate."""
    done = f"{count_done(study, candidate)}/{len(study.runs)}"
    print(f"{done:>9}  {describe_row(candidate, row)}", flush=True)


study = load_study(snakemake.params.study)
wanted = set(snakemake.params.candidates)
candidates = [each for each in study.runs if each.id in wanted]
write_rows(simulate_missing(study, candidates, report), Path(snakemake.output[0]))
