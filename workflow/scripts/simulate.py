"""Simulate the candidates of one job; write their figures as one table."""

import os
import signal
import sys
from pathlib import Path

from simcore.config import load_study
from simcore.dataset import write_rows
from simcore.sweep import count_done, describe_row, simulate_missing

signal.signal(signal.SIGINT, signal.SIG_DFL)  # an exception amid a write can hang NetCDF


def report(candidate, row):
    """Print a line for a finished candidate; in a log, only for failures and every tenth."""
    failed = row.status.item() != "ok"
    count = count_done(study, candidate, failed)
    if failed or count.is_tenth or (sys.stdout.isatty() and "CI" not in os.environ):
        done, pace = f"{count.done}/{count.total}", count.pace and f"  ({count.pace})"
        print(f"{done:>9}  {describe_row(candidate, row)}{pace}", flush=True)


study = load_study(snakemake.params.study)
wanted = set(snakemake.params.candidates)
candidates = [each for each in study.runs if each.id in wanted]
write_rows(simulate_missing(study, candidates, report), Path(snakemake.output[0]))
