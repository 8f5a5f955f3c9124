"""Small studies with made-up figures, put together by the project's own dataset code."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

from simcore.body.regions import REGION_NAMES
from simcore.certificate import with_certificates
from simcore.config import Study, load_study
from simcore.dataset import (
    collect,
    open_dataset,
    read_tables,
    row,
    write_dataset,
    write_rows,
)
from simcore.metrics import JOINTS

ROOT = Path(__file__).parents[1]
BODIES = ("male_172_70", "female_142_40")
ANGLES = "{support_angle_deg: [0, 4, 7]}"
SLING = {"devices": ("sling_reclined",), "posture": "lying", "method": "production"}
"""Options of `make_study` for a study of a sling lift."""

Outcome = Callable[[dict], float | str]
"""Coordinates → fall margin, or the status of a failure; of a variant, `variant` is one of them."""


def figures(margin: float, sling: bool = False) -> dict:
    """Return the metrics of a candidate: fell where the margin is negative."""
    fell = margin < 0
    pressure = np.zeros(len(REGION_NAMES))
    pressure[REGION_NAMES.index("sacrum")] = 20e3 * (1 - margin)
    pressure[REGION_NAMES.index("heel_left")] = 10e3
    return {
        "fell": float(fell),
        "fall_time": 1.5 if fell else np.nan,
        "fall_margin": margin,
        "topple_margin": 0.1 * margin,
        "slide_distance": 0.15 * (1 - margin),
        "peak_pressure": float(pressure.max()),
        "lying_peak_pressure": 8e3,
        "region_peak_pressure": pressure,
        "peak_shear": float(0.3 * pressure.max()),
        "region_peak_shear": 0.3 * pressure,
        "contact_area": np.nan if fell else 0.1,
        "region_contact_area": (np.nan if fell else 0.1) * pressure / pressure.sum(),
        "region_load": (np.nan if fell else 700.0) * pressure / pressure.sum(),
        "slip_share": 0.12,
        "rest_slip_share": np.nan if fell else 0.034,
        "support_force_ratio": np.nan if fell else 1.001,
        "support_force_spread": np.nan if fell else 0.004,
        "peak_edge_distance": 0.12 if sling else np.nan,
        "peak_strap_force": 240.0 if sling else np.nan,
        "max_penetration": 0.005,
        "joint_excursion": np.full(len(JOINTS), 0.1),
        "joint_range_margin": np.linspace(0.5, 0.3, len(JOINTS)),
        "neck_moment": 2.0,
        "energy_residual": 0.002,
        "lifting_speed": 0.15,
        "settled": 1.0,
        "simulated_time": 9.0,
        "cpu_time": 3.0,
    }


def make_study(
    folder: Path, outcome: Outcome, axes: str = "{}", bodies=BODIES, title: str = "Which holds?",
    devices=("robotic_lift",), posture: str = "seated", method: str = "paper",
    certify: str = "none",
) -> tuple[Study, Path]:
    """Write a study and its dataset under `folder`; return both; `axes`, `certify` are YAML."""
    if not (folder / "designs").exists():
        shutil.copytree(ROOT / "designs", folder / "designs")
    (folder / "config").mkdir(exist_ok=True)
    config = folder / "config" / "made_up.yaml"
    config.write_text(
        f"title: '{title}'\ndevices: [{', '.join(devices)}]\nbodies: [{', '.join(bodies)}]\n"
        f"posture: {posture}\nmethod: {method}\naxes: {axes}\ncertify: {certify}\n",
        encoding="utf-8",
    )
    study = load_study(config)
    rows = []
    for candidate in study.runs:
        told = outcome(candidate.coordinates)
        sling = candidate.design.device.kind == "sling_lift"
        rows.append(
            row(candidate, told, "made up to fail", None)
            if isinstance(told, str)
            else row(candidate, "ok", "", figures(told, sling))
        )
    table = study.folder / "rows.nc"
    write_rows(rows, table)
    path = study.folder / "dataset.nc"
    ds = with_certificates(collect(study, [table]), study, read_tables([table]))
    write_dataset(ds, path)
    return study, path


def make_dataset(folder: Path, outcome: Outcome, **options) -> xr.Dataset:
    """Return the dataset of `make_study`."""
    return open_dataset(make_study(folder, outcome, **options)[1])
