"""Studies whose candidates have runs put together by hand: a body that stands still, pressed."""

from pathlib import Path

import numpy as np
from report_studies import BODIES, figures, make_study

from simcore.config import Study
from simcore.dataset import candidate_dataset, candidate_path, row, write_dataset
from simcore.frames import trajectory_dataset
from simcore.recorder import Trajectory
from simcore.scene import build_scene


def still(scene) -> tuple[Trajectory, np.ndarray]:
    """Return a run of four frames, in which the body stands still, and its pressures (4, n)."""
    time = np.array([-0.5, 0.0, 1.0, 2.0])
    skin_count = scene.body.skin.vertex_count
    pressure = np.zeros((4, skin_count))
    pressure[:, :400] = [[90e3], [20e3], [34e3], [90e3]]  # settles, held or falling, fallen
    low, high = scene.mat.points.min(axis=0), scene.mat.points.max(axis=0)
    mat_x, mat_y = (np.arange(*ends, 0.025) + 0.0125 for ends in zip(low, high, strict=True))
    reading = np.zeros((4, len(mat_x), len(mat_y)), np.float32)
    reading[:, 8, 4] = [60e3, 5e3, 24e3, 16e3]
    start, sling = scene.motion(0.0), scene.sling
    trajectory = Trajectory(
        time=time,
        q=np.tile(scene.configuration, (4, 1)),
        v=np.zeros((4, scene.body.model.nv)),
        device_rotation=np.tile(start.rotation, (4, 1, 1)),
        device_position=np.tile(start.position, (4, 1)),
        displacement=np.zeros(4),
        segment_force=np.zeros((4, 18, 3)),
        support_force=np.zeros((4, 3)),
        normal_force=np.zeros((4, skin_count), np.float32),
        shear=np.zeros((4, skin_count), np.float32),
        slip_force=np.zeros(4),
        mat_pressure=reading, mat_x=mat_x, mat_y=mat_y,
        sheet_position=np.tile(sling.start.position, (4, 1, 1)) if sling else None,
        strap_force=np.zeros((4, len(sling.solver.sheet.straps.length), 3)) if sling else None,
        contact_count=np.zeros(4, int),
        depth_max=np.zeros(4),
        energy=np.full((4, 8), np.nan),
        settled=True, cpu_time=1.0, status="ok", reason="",
    )
    return trajectory, pressure


def simulate_still(folder, outcome, frames=True, **options) -> tuple[Study, Path]:
    """Return a study and its dataset; every candidate has a run that is `still`.

    With its frames, or their summary alone.
    """
    study, dataset = make_study(folder, outcome, **{"bodies": BODIES[:1]} | options)
    for candidate in study.candidates:
        scene = build_scene(candidate.design, candidate.coordinates["body"], folder)
        trajectory, pressure = still(scene)
        told = row(candidate, "ok", "", figures(outcome(candidate.coordinates), bool(scene.sling)))
        write_dataset(
            candidate_dataset(
                candidate, told,
                trajectory_dataset(trajectory, pressure, told["fall_time"].item()), frames,
            ),
            candidate_path(study.folder / "candidates", candidate),
        )
    return study, dataset
