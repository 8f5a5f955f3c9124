"""Whole candidates of the shipped studies: is weight carried, and is it as the paper found?"""

from functools import cache
from pathlib import Path

import numpy as np

from simcore.config import load_study
from simcore.energy import energy_residual
from simcore.metrics import REST_WINDOW, compute_metrics, skin_pressure
from simcore.scene import build_scene
from simcore.simulate import simulate
from simcore.validation.energy import energy_criterion
from simcore.validation.table import Check, Criterion, Measurement

LIFT, SLING = Path("config/lift_angle.yaml"), Path("config/sling_stiffness.yaml")
BODY = "male_172_70"
RECLINED = {"device": "sling_reclined", "stiffness_per_width_n_per_m": 2.0e4}

CREEP_TIME, CREEP_AFTER = 600.0, 2.0
"""How long a body is held still, and when the swing of the device's stop has died away [s]."""

MOST = 100.0
"""What a ratio that is to exceed 1 may be at most: anything."""


@cache
def simulated(study: Path, **place) -> tuple[dict, np.ndarray, np.ndarray]:
    """Return a candidate's metrics, the regions of its skin and the pressure there at rest.

    What several checks look at is simulated once. Names of regions (n,), and [Pa] (n,).
    """
    loaded = load_study(study, {"body": BODY, **place})
    (candidate,) = loaded.candidates
    scene = build_scene(candidate.design, BODY, loaded.root)
    trajectory = simulate(scene)
    pressure = skin_pressure(scene, trajectory)
    rest = trajectory.time > trajectory.time[-1] - REST_WINDOW
    regions = np.array(scene.body.region_names)[scene.body.vertex_region]
    return compute_metrics(scene, trajectory, pressure), regions, pressure[rest].mean(axis=0)


def measure_lift() -> Measurement:
    """Seat the man on the flat support and on the one inclined by 7°."""
    flat, *_ = simulated(LIFT, support_angle_deg=0.0)
    inclined, *_ = simulated(LIFT, support_angle_deg=7.0)
    return Measurement({
        "lift_flat_drops": flat["fell"],
        "lift_inclined_holds": inclined["fell"],
        "lift_support": inclined["support_force_ratio"],
        "lift_energy": max(flat["energy_residual"], inclined["energy_residual"]),
    })


def measure_creep() -> Measurement:
    """Hold the man on the support inclined by 7° for ten minutes, still seated when they begin."""
    loaded = load_study(LIFT, {
        "body": BODY, "support_angle_deg": 7.0, "hold_s": CREEP_TIME, "record_rate_hz": 1.0,
    })
    (candidate,) = loaded.candidates
    scene = build_scene(candidate.design, BODY, loaded.root)
    run = simulate(scene)
    held = run.time > scene.motion.duration + CREEP_AFTER
    way = np.einsum("tji,tj->ti", run.device_rotation, run.q[:, :3] - run.device_position)[held]
    return Measurement({
        "lift_creep": 1e3 * np.linalg.norm(way - way[0], axis=1).max(),
        "lift_creep_energy": energy_residual(run.energy),
    })


def measure_sling() -> Measurement:
    """Lift the man from the bed in the reclined sling."""
    metrics, regions, pressure = simulated(SLING, **RECLINED)

    def highest(*names: str) -> float:
        return pressure[[region.startswith(names) for region in regions]].max()

    legs, trunk = highest("knee", "lower_thigh"), highest("upper_back", "buttock", "sacrum")
    return Measurement({
        "sling_support": metrics["support_force_ratio"],
        "sling_spread": metrics["support_force_spread"],
        "sling_pattern": legs / trunk,
        "sling_over_bed": metrics["peak_pressure"] / metrics["lying_peak_pressure"],
        "sling_edge": metrics["peak_edge_distance"],
        "sling_energy": metrics["energy_residual"],
    })


STATICS = "statics"
PAPER = "Yoshiyasu et al. 2015"
PETERSON = "Peterson 2015, 23 slings: suspended presses more than lying, most at seams and edges"

CHECKS = (
    Check(
        (
            Criterion("lift_flat_drops", "the 70 kg man falls from the flat support, 1 if so",
                      0.5, 1, "", PAPER),
            Criterion("lift_inclined_holds", "he falls from the support inclined by 7°, 1 if so",
                      0, 0.5, "", PAPER),
            Criterion("lift_support", "support force over weight, held at rest", 0.99, 1.01, "",
                      STATICS),
            energy_criterion("lift", "both lifts, the fall included, greater"),
        ),
        measure_lift,
    ),
    Check(
        (
            Criterion("lift_creep", f"the 70 kg man on the support inclined by 7°: way of his "
                      f"pelvis on it in {CREEP_TIME:.0f} s simulated", 0.0, 1.0, "mm",
                      "what sticks does not creep"),
            energy_criterion("lift_creep", "the same"),
        ),
        measure_creep,
    ),
    Check(
        (
            Criterion("sling_support", "the 70 kg man in the reclined sling: force of the straps "
                      "over weight, at rest", 0.99, 1.01, "", STATICS),
            Criterion("sling_spread", "the same: standard deviation over the last second", 0, 0.01,
                      "", "rest"),
            Criterion("sling_pattern", "the same: highest pressure at knees or lower thighs over "
                      "that at upper back, sacrum or buttocks", 1, MOST, "", PAPER),
            Criterion("sling_over_bed", "the same: highest pressure over that on the bed", 1, MOST,
                      "", PETERSON),
            Criterion("sling_edge", "the same: way of the highest pressure from an edge", 0, 0.03,
                      "m", PETERSON),
            energy_criterion("sling", "the same"),
        ),
        measure_sling,
    ),
)
