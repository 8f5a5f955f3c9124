"""Do peak pressure and contact area stay where they are on finer meshes and with a smaller step?"""

from pathlib import Path

from simcore.certificate import TOLERANCES, change_of
from simcore.config import Design, load_study, refined
from simcore.metrics import compute_metrics, skin_pressure
from simcore.scene import build_scene
from simcore.simulate import simulate
from simcore.validation.energy import energy_criterion
from simcore.validation.lifts import BODY, LIFT, RECLINED, SLING, simulated
from simcore.validation.table import Check, Criterion, Measurement

FIGURES = ("peak_pressure", "contact_area")

SCENES = {
    "board": ("lying on a flat board", Path("config/transfer_board.yaml"),
              {"support_angle_deg": 0.0}),
    "lift": ("seated on the lift", LIFT, {"support_angle_deg": 7.0}),
    "sling": ("hanging in the reclined sling", SLING, RECLINED),
}
"""Key → what it is, study, and place in it."""


def figures(design: Design, root: Path) -> dict:
    """Return the metrics of a design."""
    scene = build_scene(design, BODY, root)
    trajectory = simulate(scene)
    return compute_metrics(scene, trajectory, skin_pressure(scene, trajectory))


def measure_convergence(key: str) -> Measurement:
    """Simulate a candidate as it is and refined; keep the greatest change of each figure."""
    _, path, place = SCENES[key]
    study = load_study(path, {"body": BODY, **place})
    (candidate,) = study.candidates
    coarse, *_ = simulated(path, **place)
    fine = [figures(each, study.root) for each in refined(candidate.design).values()]
    changes = {
        f"{key}_{name}": max(abs(change_of(name, coarse[name], each[name])) for each in fine)
        for name in FIGURES
    }
    residual = max(each["energy_residual"] for each in (coarse, *fine))
    return Measurement(changes | {f"{key}_refined_energy": residual})


def _check(key: str) -> Check:
    what = SCENES[key][0]
    changes = (
        Criterion(
            f"{key}_{name}", f"the 70 kg man {what}: greatest change of the {title} at half "
            "the step, on twice the skin, on twice the device", 0.0, TOLERANCES[name], "",
            "a figure that depends on the mesh is none",
        )
        for name, title in zip(FIGURES, ("peak pressure", "contact area"), strict=True)
    )
    energy = energy_criterion(f"{key}_refined", f"the 70 kg man {what}, greatest of these four")
    return Check((*changes, energy), lambda: measure_convergence(key))


CHECKS = tuple(_check(key) for key in SCENES)
