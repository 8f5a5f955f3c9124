"""Put the tables of all jobs together on the axes of the study."""

import signal
from pathlib import Path

from simcore.config import load_study
from simcore.dataset import collect, write_dataset

signal.signal(signal.SIGINT, signal.SIG_DFL)  # an exception amid a write can hang NetCDF

study = load_study(snakemake.input.study)
ds = collect(study, [Path(path) for path in snakemake.input.rows])
write_dataset(ds, Path(snakemake.output[0]))
