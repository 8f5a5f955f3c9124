"""Build a body into the cache and write it as glTF."""

from pathlib import Path

from simcore.body import build_body, write_glb
from simcore.config import load_study

study = load_study(snakemake.params.study)
name = snakemake.wildcards.body
design = next(each.design for each in study.candidates if each.coordinates["body"] == name)
write_glb(build_body(design.body, name), Path(snakemake.output[0]))
