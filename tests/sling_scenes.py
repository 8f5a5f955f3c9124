"""One coarse man on one coarse sling, for the tests of body and sheet together."""

from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin

from simcore.body import Body, build_body
from simcore.config.designs import BodyDesign, Design, Method, Posture, read_device
from simcore.config.paths import resolve_path, set_value
from simcore.config.yaml_file import read_design
from simcore.dynamics.implicit import IMPLICITNESS, implicit_step
from simcore.dynamics.integrators import rk4_step
from simcore.scene import Scene, build_scene
from simcore.sling_interaction import SlingInteraction

ROOT = Path(__file__).parents[1]
DESIGNS = ROOT / "designs"
MAN = "male_172_70"
COARSE = {
    "device.sheet.vertex_count": 700, "skin_vertices": 3000,
    "method.contact.flesh": {"modulus_pa": 5e4, "thickness_m": 0.05},
    "method.adaptive_step": None, "time_step_s": 0.002,
    "method.sheet.step_s": 0.004,  # two steps make an exchange
    "duration_min_s": 0.1, "duration_max_s": 0.3, "hold_s": 0.0, "record_rate_hz": 50,
    "device.motion.keyframes": [
        {"time_s": 0, "translation_m": 0, "rotation_deg": 0},
        {"time_s": 0.1, "translation_m": 0, "rotation_deg": 0},
    ],
}
PENALTY = {
    "law": "penalty", "stiffness_n_per_m": 4000.0, "damping_ns_per_m": 20.0,
    "friction_force_n": 2.0, "friction_velocity_m_per_s": 0.1,
}
EXPLICIT = {
    "method.integrator": "rk4", "method.sheet.contact": PENALTY,
    "method.contact": PENALTY | {"search_radius_m": 0.03, "initial_penetration_limit_m": 0.01},
}
"""The paper's laws and Runge–Kutta steps."""


@cache
def _shipped(device: str) -> Design:
    return Design(
        device=read_device(DESIGNS / "devices" / f"{device}.yaml"),
        body=read_design(BodyDesign, DESIGNS / "bodies" / f"{MAN}.yaml"),
        posture=read_design(Posture, DESIGNS / "postures" / "lying.yaml"),
        method=read_design(Method, DESIGNS / "methods" / "production.yaml"),
    )


def sling_design(changes: dict | None = None, device: str = "sling_reclined") -> Design:
    """Return a shipped sling, coarse and hardly moved, with values by the end of their path."""
    tree = _shipped(device).model_dump()
    for key, value in (COARSE | (changes or {})).items():
        set_value(tree, key if "." in key else resolve_path(tree, key, "test"), deepcopy(value))
    return Design.model_validate(tree)


def sling_scene(changes: dict | None = None, device: str = "sling_reclined") -> Scene:
    """Return the placed scene of `sling_design`."""
    return build_scene(sling_design(changes, device), MAN, ROOT)


BODIES = tuple(sorted(path.stem for path in (DESIGNS / "bodies").glob("*.yaml")))


@cache
def shipped_body(name: str) -> Body:
    """Return a shipped body as it is simulated."""
    return build_body(read_design(BodyDesign, DESIGNS / "bodies" / f"{name}.yaml"), name)


@cache
def no_bed() -> dict:
    """Return changes that take the bed away from under a body in its place."""
    start = sling_scene().configuration[:3]
    return {
        "device.bed.length_m": 1e-6, "device.bed.width_m": 1e-6, "posture.placement.approach": (),
        "posture.placement.pelvis_m": tuple(map(float, start)),
    }


class Watched:
    """A sheet solver that keeps what it returns, and lets a test meddle with what it leaves."""

    def __init__(self, solver, meddle=None):
        self.solver, self.sheet, self.inertia = solver, solver.sheet, solver.inertia
        self.meddle, self.damping_time = meddle, solver.damping_time
        self.reactions = []

    def advance(self, state, dt, contact, bar):
        self.reactions.append(self.solver.advance(state, dt, contact, bar))
        if self.meddle:
            self.meddle(len(self.reactions), state)
        return self.reactions[-1]

    def of_skin(self) -> np.ndarray:
        """Force of the skin on all of the sheet at each exchange (k, 3) [N]."""
        return np.array([reaction.contact.force.sum(axis=0) for reaction in self.reactions])


def watched(scene: Scene, meddle=None, **changed) -> tuple[Scene, Watched]:
    """Return the scene with a watched solver, and with other parts of its sling if given."""
    solver = Watched(scene.sling.solver, meddle)
    return replace(scene, sling=replace(scene.sling, solver=solver, **changed)), solver


class Steps:
    """Body and sheet step by step, in the order of `simulate`, the bar at its start."""

    def __init__(self, scene: Scene):
        self.scene, self.model = scene, scene.body.model
        self.interaction = SlingInteraction(scene)
        self.q, self.v = scene.configuration.copy(), np.zeros(scene.body.model.nv)
        self.bar = scene.motion(0.0)
        self.h = scene.method.time_step_s

    def acceleration(self, _, q, v):
        return self.interaction.acceleration(self.bar, q, v)

    def linearised(self, _, q, v):
        return self.interaction.linearised(self.bar, q, v, IMPLICITNESS * self.h)

    def step(self) -> np.ndarray:
        """Advance one step; return its mean acceleration."""
        self.interaction.exchange(self.bar, self.q, self.v, self.h)
        before = self.v
        if self.scene.method.integrator == "rk4":
            start = self.acceleration(0.0, self.q, self.v)
            self.q, self.v, _ = rk4_step(
                self.model, self.acceleration, 0.0, self.q, self.v, start, self.h
            )
        else:
            self.q, self.v = implicit_step(
                self.model, self.interaction.data, self.linearised, 0.0, self.q, self.v, self.h
            )
            self.interaction.conclude(self.v - before, self.h)
        self.support_force = self.interaction.support_force.copy()
        self.segment_wrench = self.interaction.segment_wrench.copy()
        return (self.v - before) / self.h

    def momentum(self) -> np.ndarray:
        """Of the body (3,) [N s]."""
        data = self.model.createData()
        return pin.computeCentroidalMomentum(self.model, data, self.q, self.v).linear.copy()
