"""A project folder whose candidates simulate in under a second."""

import shutil
from pathlib import Path

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
device: tiny
bodies: [tiny]
posture: seated
method: tiny
axes:
  support_angle_deg: [0, 7]
"""


def make_project(folder: Path) -> Path:
    """Write designs/ and config/tiny.yaml under a folder; return the study's path."""
    shutil.copytree(ROOT / "designs", folder / "designs")
    (folder / "config").mkdir()
    designs = folder / "designs"
    (designs / "bodies" / "tiny.yaml").write_text(BODY, encoding="utf-8")
    _derive(
        designs / "devices", "robotic_lift",
        {"vertex_count: 20000": "vertex_count: 1000", "time_s: 3": "time_s: 0.3",
         "time_s: 6": "time_s: 0.6"},
    )
    _derive(
        designs / "methods", "paper",
        {"hold_s: 1.0": "hold_s: 0.1", "duration_min_s: 0.5": "duration_min_s: 0.1",
         "duration_max_s: 3.0": "duration_max_s: 0.2",
         # A twentieth of the contact points, so each must be stiffer.
         "stiffness_n_per_m: 1000 ": "stiffness_n_per_m: 8000 "},
    )
    study = folder / "config" / "tiny.yaml"
    study.write_text(STUDY, encoding="utf-8")
    return study


def _derive(folder: Path, shipped: str, changes: dict[str, str]) -> None:
    text = (folder / f"{shipped}.yaml").read_text(encoding="utf-8")
    for old, new in changes.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "tiny.yaml").write_text(text, encoding="utf-8")
