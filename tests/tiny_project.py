"""A project folder whose candidates simulate in under a second."""

import json
import shutil
from pathlib import Path

from simcore.config.yaml_file import read_yaml

ROOT = Path(__file__).parents[1]

BODY = """\
sex: male
age_years: 45
stature_m: 1.72
mass_kg: 70
inertia: de_leva      # a coarse mesh would give toes hardly any inertia
skin_vertices: 2000
"""

STUDY = """\
title: Does the line hold?
devices: [tiny]
bodies: [tiny]
posture: seated
method: tiny
axes:
  support_angle_deg: [0, 7]
"""


def make_project(folder: Path) -> Path:
    """Write designs/ and config/tiny.yaml under a folder; return the study's path."""
    designs = folder / "designs"
    shutil.copytree(ROOT / "designs", designs)
    (folder / "config").mkdir()
    (designs / "bodies" / "tiny.yaml").write_text(BODY, encoding="utf-8")

    device = read_yaml(designs / "devices" / "robotic_lift.yaml")
    device["surface"]["vertex_count"] = 1000
    for keyframe in device["motion"]["keyframes"]:
        keyframe["time_s"] /= 10
    write_yaml(designs / "devices" / "tiny.yaml", device)

    method = read_yaml(designs / "methods" / "paper.yaml")
    del method["adaptive_step"]
    method["time_step_s"] = 0.002
    method["hold_s"] = 0.1
    method["settling"] |= {"duration_min_s": 0.1, "duration_max_s": 0.2}
    method["contact"] |= {"stiffness_n_per_m": 8000, "friction_force_n": 5}  # of fewer contacts
    write_yaml(designs / "methods" / "tiny.yaml", method)

    study = folder / "config" / "tiny.yaml"
    study.write_text(STUDY, encoding="utf-8")
    return study


def write_yaml(path: Path, tree: dict) -> None:
    """Write nested values as a YAML file (JSON is YAML)."""
    path.write_text(json.dumps(tree, indent=1), encoding="utf-8")
