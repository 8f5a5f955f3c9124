"""Simulate again, for their frames, the candidates that the report shows; write their names."""

import signal
from pathlib import Path

from simcore.config import load_study
from simcore.dataset import open_dataset
from simcore.report.replays import names_shown
from simcore.sweep import simulate_again

signal.signal(signal.SIGINT, signal.SIG_DFL)  # an exception amid a write can hang NetCDF


def report(candidate, number, total):
    """Print a line for a candidate that was simulated again."""
    place = ", ".join(f"{name} {value}" for name, value in candidate.coordinates.items())
    print(f"{f'{number}/{total}':>9}  {place}: simulated again, to be shown", flush=True)


names = names_shown(open_dataset(snakemake.input.dataset))
simulate_again(load_study(snakemake.input.study), names, report)
Path(snakemake.output[0]).write_text("".join(f"{name}\n" for name in names), encoding="ascii")
