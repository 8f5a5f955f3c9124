"""Put the tables of all jobs together on the axes of the study."""

import signal
from pathlib import Path

from simcore.certificate import with_certificates
from simcore.config import load_study
from simcore.dataset import collect, read_tables, write_dataset

signal.signal(signal.SIGINT, signal.SIG_DFL)  # an exception amid a write can hang NetCDF

study = load_study(snakemake.input.study)
tables = [Path(path) for path in snakemake.input.rows]
ds = with_certificates(collect(study, tables), study, read_tables(tables))
write_dataset(ds, Path(snakemake.output[0]))
