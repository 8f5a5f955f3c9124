"""Friction of flesh on a rigid solid (Eq. C2): a block of it on an incline."""

from functools import cache
from math import cos, tan
from pathlib import Path

import numpy as np
import pinocchio as pin

from simcore.body.regions import REGION_NAMES
from simcore.body.tissue import Tissue, region_tissue
from simcore.config import Method, read_design
from simcore.contact.foundation import foundation_forces
from simcore.contact.foundation_energy import foundation_energy, foundation_power
from simcore.contact.layer import compliance
from simcore.dynamics.implicit import IMPLICITNESS, implicit_step
from simcore.energy import energy_residual
from simcore.sheet.solver import GRAVITY
from simcore.validation.energy import energy_criterion
from simcore.validation.incline import (
    CREEP_ANGLE,
    CREEP_TIME,
    INCLINE_FRICTION,
    ONSET,
    STUCK,
    measure_onset,
)
from simcore.validation.table import Check, Criterion, Measurement

METHOD = Path("designs/methods/production.yaml")

PITCH, ACROSS = 0.02, 5
"""The block's skin is a square of so many vertices a side [m, 1]."""

STEP = 0.004
"""[s]"""

PRESSURE = 5e3
"""Of the block on level ground, some of a seated person's mean [Pa]."""

SLIDE_TIME = 3.0
"""Let go with flesh that is not sheared yet, the block has come to rest by then, or slides [s]."""


@cache
def production() -> Method:
    """Return the shipped method."""
    return read_design(Method, METHOD)


def buttock() -> Tissue:
    """Return the flesh of an adult's buttock at every vertex of the block (n,)."""
    adult, region = region_tissue(), REGION_NAMES.index("buttock_left")
    return Tissue(*(np.full(ACROSS**2, each[region]) for each in (adult.thickness, adult.modulus)))


class Block:
    """A rigid block on a layer of flesh, on an incline that rises towards −x; it does not tip.

    It steps as a body on a lift does, with the shipped method's step and flesh.

    Attributes
    ----------
    force, normals : (n, 3), normal_force : (n,) float64
        Of the incline on each skin vertex, world axes, its normal part [N], and the incline's
        normal, as last evaluated.
    area : (n,) float64
        [m²]
    mass : float
        [kg]

    Parameters
    ----------
    angle : float
        [rad]
    friction : float
        µ.
    """

    def __init__(self, angle: float, friction: float = INCLINE_FRICTION):
        method, flesh, count = production(), buttock(), ACROSS**2
        law = method.contact
        self.step, self.friction = STEP, friction
        self.area = np.full(count, PITCH**2)
        self.mass = PRESSURE * self.area.sum() / GRAVITY
        self.rotation = pin.utils.rotate("y", angle)
        self.model = pin.Model()
        inertia = pin.Inertia(self.mass, np.zeros(3), np.eye(3))
        self.model.appendBodyToJoint(
            self.model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "block"),
            inertia, pin.SE3.Identity(),
        )
        self.model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
        self._data = self.model.createData()
        place = PITCH * (np.arange(ACROSS) - (ACROSS - 1) / 2)
        x, y = np.meshgrid(place, place, indexing="ij")
        self.rest = np.column_stack([x.ravel(), y.ravel(), np.zeros(count)])
        # Eq. C1 without damping, for the pressure that its weight has on the incline.
        strain = PRESSURE * cos(angle) / (flesh.modulus[0] + PRESSURE * cos(angle))
        self.q = self.rotation @ [0.0, 0.0, -strain * flesh.thickness[0]]
        self.v = np.zeros(3)
        self._skin = self.rest @ self.rotation.T
        axis = np.array([-4.0, 0.0, 4.0])  # trilinear is exact for a plane, however coarse
        self._field = (
            np.tile(axis, (3, 3, 1)).astype(np.float32), np.full(3, axis[0]), axis[2]
        )
        self._flesh = (
            self.area, self.area / compliance(flesh.modulus, flesh.thickness, 0.0),
            flesh.modulus, flesh.thickness, 0.0, law.tissue == "stiffening",
            np.full(count, law.damping_time_s),
        )
        self._still = np.zeros(3)
        self._listed = np.arange(count)
        self._anchor, self._closed = np.zeros((count, 3)), np.zeros(count, bool)
        self.force, self.normals = np.zeros((2, count, 3))
        self.normal_force, self._along, self._across = np.zeros((3, count))
        self._depths, self._steepness = np.zeros((2, count))
        self._sticks, self._stretch = np.zeros(count, bool), np.zeros((count, 3))
        self._slid, self._pressed, self._impedance = np.zeros(1), self._listed, np.zeros((3, 3))
        self._flows, self._energy = np.zeros(5), []

    def linearised(
        self, _: float, q: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return force (3,) and impedance (3, 3) for an implicit step."""
        still, self._posed = self._still, q + self._skin
        *_, self._pressed, _ = foundation_forces(
            self._listed, self._posed, np.tile(v, (len(self._skin), 1)), *self._field,
            self.rotation, still, still, still, *self._flesh, self.friction,
            IMPLICITNESS * self.step, np.inf, self._anchor, self._closed, self.force,
            self.normal_force, self.normals, self._along, self._across, self._depths,
            self._steepness, self._sticks, self._stretch, self._slid,
        )
        across, along = self._across.sum(), self._along.sum()
        normal = self.rotation[:, 2]
        self._impedance = across * np.eye(3) + (along - across) * np.outer(normal, normal)
        return self.force.sum(axis=0), self._impedance

    def run(self, duration: float) -> None:
        """Move on by a duration [s]."""
        for _ in range(round(duration / self.step)):
            before = self.v
            self.q, self.v = implicit_step(
                self.model, self._data, self.linearised, 0.0, self.q, self.v, self.step
            )
            self._account(before)

    def _account(self, before: np.ndarray) -> None:
        """Note the energy after a step that began with a velocity (3,): Eqs. E3 to E5."""
        still, count, mean = self._still, len(self.rest), (before + self.v) / 2
        heat, implicit = foundation_power(
            self._pressed, self._posed, np.tile(before, (count, 1)), np.tile(mean, (count, 1)),
            still, still, still, *self._flesh, IMPLICITNESS * self.step, self.step,
            self._depths, self._steepness, self.normals, self.normal_force, self._along,
            self._sticks,
        )
        late = mean @ self._impedance @ (self.v - before)
        self._flows[2:] += self.step * heat, self._slid[0], late - self.step * implicit
        self._slid[0] = 0.0
        elastic = foundation_energy(
            self._listed, self.q + self._skin, *self._field, self.rotation, still,
            *self._flesh[:6], self._anchor, self._closed,
        )
        kinetic = self.mass * self.v @ self.v / 2
        potential = self.mass * GRAVITY * self.q[2]
        self._energy.append([kinetic, potential, elastic, *self._flows])

    @property
    def residual(self) -> float:
        """Of the energy so far (Eq. E6)."""
        return energy_residual(np.array(self._energy))

    @property
    def way(self) -> float:
        """Downhill, from where it was let go [m]."""
        return float(self.q @ self.rotation[:, 0])

    @property
    def speed(self) -> float:
        """Downhill [m/s]."""
        return float(self.v @ self.rotation[:, 0])


def slide(angle: float) -> tuple[float, float]:
    """Let a block go on an incline [rad].

    Returns its acceleration in the second half of `SLIDE_TIME`, zero if it sticks [m/s²], and the
    residual of its energy.
    """
    block = Block(angle)
    block.run(SLIDE_TIME / 2)
    before = block.speed
    block.run(SLIDE_TIME / 2)
    sticks = abs(block.speed) < STUCK
    return 0.0 if sticks else 2 * (block.speed - before) / SLIDE_TIME, block.residual


def measure_slip() -> Measurement:
    """Find the incline at which the block lets go."""
    return measure_onset("skin_", "block of flesh", slide)


def measure_creep() -> Measurement:
    """Leave the block on an incline of nine tenths of the angle at which it lets go."""
    block = Block(CREEP_ANGLE)
    block.run(SLIDE_TIME)
    settled = block.way
    block.run(CREEP_TIME)
    return Measurement({
        "skin_creep": 1e3 * abs(block.way - settled), "skin_creep_energy": block.residual,
    })


CHECKS = (
    Check(
        (Criterion("skin_slip_onset", "incline at which a block of flesh with "
                   f"µ = {INCLINE_FRICTION} lets go", ONSET - 0.5, ONSET + 0.5, "°",
                   "atan µ ± 0.5°"),
         energy_criterion("skin_slip", "the blocks on all these inclines, greatest")),
        measure_slip,
    ),
    Check(
        (Criterion("skin_creep", f"way of the block in {CREEP_TIME:.0f} s simulated, at an incline "
                   f"of tan = {tan(CREEP_ANGLE):.3f}, after the first {SLIDE_TIME:g} s, in which "
                   "its flesh shears", 0.0, 1.0, "mm", "what sticks does not creep"),
         energy_criterion("skin_creep", "the same")),
        measure_creep,
    ),
)
