"""Runs put together by hand, as files: nothing is simulated, so that all they hold is known."""

from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from report_studies import figures
from scipy.spatial.transform import Rotation

from simcore.body import build_body
from simcore.config import BodyDesign, Design, Method, Posture, read_design
from simcore.config.designs import read_device
from simcore.dataset import candidate_dataset, row, write_dataset
from simcore.frames import trajectory_dataset
from simcore.sheet.hanging import build_straps
from simcore.sheet.net import build_net

DESIGNS = Path(__file__).parents[1] / "designs"
STEP = 0.04  # [s] between frames


@cache
def design_of_kind(kind: str) -> Design:
    """Return a coarse shipped design: "robotic_lift" or "sling_reclined", "sling_stretcher"."""
    device = read_device(DESIGNS / "devices" / f"{kind}.yaml").model_dump()
    device["surface" if kind == "robotic_lift" else "sheet"]["vertex_count"] = 900
    body = read_design(BodyDesign, DESIGNS / "bodies" / "male_172_70.yaml")
    return Design(
        device=device, body=body.model_copy(update={"skin_vertices": 3000}),
        posture=read_design(Posture, DESIGNS / "postures" / "seated.yaml"),
        method=read_design(Method, DESIGNS / "methods" / "production.yaml"),
    )


def make_run(path: Path, kind: str = "robotic_lift", count: int = 9, start: float = -0.08,
             margin: float = 0.5) -> Path:
    """Write a run of `count` frames in which every joint turns and everything moves."""
    design = design_of_kind(kind)
    body = build_body(design.body, "made_up")
    rng = np.random.default_rng(7)
    way = rng.normal(scale=3.0, size=body.model.nv)  # [rad/s]: some joints turn by over a radian
    time = start + STEP * np.arange(count)
    q = np.array([pin.integrate(body.model, body.rest_configuration, (t - start) * way)
                  for t in time])
    pressure = np.zeros((count, body.skin.vertex_count), np.float32)
    touched = rng.choice(body.skin.vertex_count, 200, replace=False)
    pressure[:, touched] = rng.uniform(0, 30e3, (count, 200)) * (rng.random((count, 200)) > 0.3)
    sheet = straps = None
    if kind != "robotic_lift":
        net = build_net(design.device.sheet)
        wave = 0.2 * np.sin(3 * net.rest_position[:, :1] + 9 * time[:, None, None])
        flat = np.column_stack([net.rest_position, np.zeros(len(net.rest_position))])
        sheet = (flat + wave * [0.1, 0.2, 1]).astype(np.float32)
        straps = rng.normal(size=(count, len(build_straps(net, design.device.hanging).names), 3))
    trajectory = SimpleNamespace(
        time=time, q=q,
        device_rotation=Rotation.from_rotvec(np.outer(time, [0, 0.3, 2])).as_matrix(),
        device_position=np.outer(time, [0.1, 0, 0.5]), displacement=0.01 * (time - start),
        support_force=rng.normal(size=(count, 3)), segment_force=rng.normal(size=(count, 18, 3)),
        contact_count=np.arange(count), depth_max=np.full(count, 0.02),
        mat_pressure=np.zeros((count, 2, 2), np.float32), mat_x=np.arange(2.0),
        mat_y=np.arange(2.0), sheet_position=sheet, strap_force=straps,
    )
    candidate = SimpleNamespace(
        id="made_up", design=design,
        coordinates={"body": "male_172_70", "support_angle_deg": 7.5},
    )
    told = figures(margin, kind != "robotic_lift")
    if margin < 0:
        told["fall_time"] = time[-2]
    write_dataset(
        candidate_dataset(
            candidate, row(candidate, "ok", "", told),
            trajectory_dataset(trajectory, pressure, told["fall_time"]),
        ),
        path,
    )
    return path
