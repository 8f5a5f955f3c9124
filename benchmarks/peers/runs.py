"""Runs of the peers, and of simcore on the same scenes."""

import time as clock
from collections.abc import Iterator
from dataclasses import asdict, dataclass

import mujoco
import numpy as np

from benchmarks.peers.mujoco_body import GRAVITY, MujocoBody
from benchmarks.peers.scenes import hulls_on_cloth, hulls_on_lift, skin_on_lift
from simcore.bench import case_scene, steady_run
from simcore.body.build import posed_skin
from simcore.body.skin import vertex_normals
from simcore.metrics import skin_pressure
from simcore.pressure import SensorCells
from simcore.scene import Scene
from simcore.simulate import simulate

STEP = 0.004  # [s]
LIFT_TIME, CLOTH_TIME = 1.5, 1.0  # [s] simulated
WINDOW = 10  # last steps, over which forces are averaged: a recorded frame of simcore

STIFF = (0.02, 1.0), (0.9, 0.95)
"""MuJoCo's default contact."""

SOFT = (-500.0, -10.0), (0.5, 0.5)
"""As soft as the height field bears. Softer contact lets triangles sink between its prisms, whose
sides then push against each other."""

FABRIC = 2e4  # [N/m] of designs/devices/sling_reclined.yaml


@dataclass(frozen=True)
class Peer:
    """What one engine made of one scene.

    Attributes
    ----------
    engine, device, scene : str
        `device` is lift or sling.
    simulated : float
        [s].
    real_time_factor : float
        Simulated s per CPU s.
    contacts : int
        At the end.
    support_ratio : float
        Vertical force on the body over its weight, mean over the last `WINDOW` steps.
    normal_ratio : float
        Sum of all normal forces over weight, whatever their direction.
    peak_pressure : float or None
        Highest over a cell of 25 mm on the skin (Eq. P1) [Pa]; None where forces have no area.
    """

    engine: str
    device: str
    scene: str
    simulated: float
    real_time_factor: float
    contacts: int
    support_ratio: float
    normal_ratio: float
    peak_pressure: float | None = None

    def as_dict(self) -> dict:
        """Return all values for JSON."""
        return asdict(self)


def all_peers() -> Iterator[Peer]:
    """Run everything, simcore last on each scene."""
    lift = case_scene("lift", _standing_still())
    yield _run(hulls_on_lift(lift, STEP), lift, "18 convex hulls", LIFT_TIME)
    for name, contact in (("default", STIFF), ("soft", SOFT)):
        body = skin_on_lift(lift, STEP, *contact)
        yield _run(body, lift, f"skin as a flex, {name} contact", LIFT_TIME)
    yield _simcore(lift, "skin on the lift")
    sling = case_scene("sling")
    yield _run(
        hulls_on_cloth(sling, STEP, FABRIC), sling, "18 convex hulls on a cloth of 64 × 64",
        CLOTH_TIME,
    )
    yield _simcore(sling, "skin in the sling of 4,000 vertices, from bed to hold")


def _standing_still() -> dict:
    """Return changes by which a lift holds still: settling takes the whole time."""
    still = {"translation_m": 0.0, "rotation_deg": 0.0}
    return {
        "method.settling.duration_min_s": LIFT_TIME,
        "method.settling.duration_max_s": LIFT_TIME,
        "method.hold_s": 0.0,
        "device.motion.keyframes": [{"time_s": time, **still} for time in (0.0, STEP)],
    }


def _run(body: MujocoBody, scene: Scene, name: str, duration: float) -> Peer:
    model = body.model
    data = body.data_at(scene.configuration, np.zeros(scene.body.model.nv))
    skin_force = np.zeros(scene.body.skin.vertex_count)
    support, normal, spent = [], [], 0.0
    steps = round(duration / STEP)
    for step in range(steps):
        begin = clock.process_time()
        mujoco.mj_step(model, data)
        spent += clock.process_time() - begin
        if step >= steps - WINDOW:
            # The root's first three velocities are the world's, and nothing else constrains them.
            support.append(data.qfrc_constraint[2])
            force = data.efc_force[np.maximum(data.contact.efc_address, 0)]
            force *= data.contact.efc_address >= 0
            normal.append(force.sum())
            if scene.sling is None and model.nflex:
                _add_to_vertices(model, data, force / WINDOW, skin_force)
    weight = scene.body.mass * GRAVITY
    return Peer(
        engine=f"MuJoCo {mujoco.__version__}",
        device="sling" if scene.sling else "lift",
        scene=name,
        simulated=steps * STEP,
        real_time_factor=steps * STEP / spent,
        contacts=data.ncon,
        support_ratio=float(np.mean(support) / weight),
        normal_ratio=float(np.mean(normal) / weight),
        peak_pressure=float(_cells(scene).pressure(skin_force).max()) if skin_force.any() else None,
    )


def _simcore(scene: Scene, name: str) -> Peer:
    """Run the whole of a scene; forces are those of its last recorded frame."""
    simulate(scene)  # compiles, or loads what was compiled
    trajectory, simulated, spent = steady_run(scene)
    weight = scene.body.mass * GRAVITY
    sheet = scene.sling.solver.sheet.net.mass.sum() * GRAVITY if scene.sling else 0.0
    return Peer(
        engine="simcore",
        device="sling" if scene.sling else "lift",
        scene=name,
        simulated=simulated,
        real_time_factor=simulated / spent,
        contacts=int(trajectory.contact_count[-1]),
        support_ratio=float(trajectory.support_force[-1, 2] / (weight + sheet)),
        normal_ratio=float(trajectory.normal_force[-1].sum() / weight),
        peak_pressure=float(skin_pressure(scene, trajectory)[-1].max()),
    )


def _cells(scene: Scene) -> SensorCells:
    skin = scene.body.skin
    rest = posed_skin(scene.body, scene.body.rest_configuration)
    return SensorCells(
        rest, vertex_normals(skin, rest), skin.vertex_area, scene.method.sensor_pitch_m
    )


def _add_to_vertices(model, data, force: np.ndarray, skin_force: np.ndarray) -> None:
    """Share contact forces (c,) among the corners of their triangles, as their points lie."""
    corners = model.flex_elem.reshape(-1, 3)[data.contact.elem.max(axis=1)]
    a, b, c = np.moveaxis(data.flexvert_xpos[corners], 1, 0)
    u, v, w = b - a, c - a, data.contact.pos - a
    uu, uv, vv = ((x * y).sum(axis=1) for x, y in ((u, u), (u, v), (v, v)))
    uw, vw = (u * w).sum(axis=1), (v * w).sum(axis=1)
    second = (vv * uw - uv * vw) / (uu * vv - uv * uv)
    third = (uu * vw - uv * uw) / (uu * vv - uv * uv)
    shares = np.clip(np.column_stack([1 - second - third, second, third]), 0.0, 1.0)
    shares /= shares.sum(axis=1, keepdims=True)
    np.add.at(skin_force, corners, shares * force[:, None])
