"""Show a dataset as one offline page."""

import signal
from pathlib import Path

from simcore.report import build_report

signal.signal(signal.SIGINT, signal.SIG_DFL)  # an exception amid a write can hang NetCDF

build_report(Path(snakemake.input[0]), Path(snakemake.output[0]))
