"""Show a dataset as one offline page."""

from pathlib import Path

from simcore.report import build_report

build_report(Path(snakemake.input[0]), Path(snakemake.output[0]))
