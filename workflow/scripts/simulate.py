"""Simulate the candidates of one job; write their figures as one table."""

from pathlib import Path

from simcore.config import load_study
from simcore.dataset import write_rows
from simcore.sweep import describe_row, simulate_missing

study = load_study(snakemake.params.study)
wanted = set(snakemake.params.candidates)
candidates = [each for each in study.candidates if each.id in wanted]
rows = simulate_missing(
    study, candidates, lambda candidate, row: print(describe_row(candidate, row), flush=True)
)
write_rows(rows, Path(snakemake.output[0]))
