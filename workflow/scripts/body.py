"""Build a body into the cache and write it as glTF."""

import signal
from pathlib import Path

from simcore.body import build_body, write_glb
from simcore.config import BodyDesign

signal.signal(signal.SIGINT, signal.SIG_DFL)  # an exception amid a write can hang NetCDF

name = snakemake.wildcards.body
design = BodyDesign.model_validate_json(snakemake.params.design)
write_glb(build_body(design, name), Path(snakemake.output[0]))
