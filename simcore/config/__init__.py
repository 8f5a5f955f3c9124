"""YAML → validated designs → candidates. YAML is read here and nowhere else."""

from simcore.config.candidate import Candidate
from simcore.config.designs import BodyDesign, Design, DeviceDesign, Method, Posture
from simcore.config.refined import VARIANTS, refined, variants_of
from simcore.config.study import Study, load_study
from simcore.config.yaml_file import parse_scalar, read_design

__all__ = [
    "VARIANTS",
    "BodyDesign",
    "Candidate",
    "Design",
    "DeviceDesign",
    "Method",
    "Posture",
    "Study",
    "load_study",
    "parse_scalar",
    "read_design",
    "refined",
    "variants_of",
]
