"""Points of skin on a solid whose distance is known, pressed into it by hand or by a block."""

from math import cos, sin

import numpy as np

from simcore.contact.foundation import foundation_forces, write_late_forces
from simcore.contact.foundation_energy import foundation_energy, foundation_power
from simcore.contact.layer import compliance

E, D, AREA = 5.0e4, 0.04, 2.0e-4
G = 9.80665


def half_space(normal=(0.0, 0.0, 1.0)):
    """Distance grid of the half space under a plane through the origin, ± 0.3 m about it."""
    spacing = 0.02
    axis = np.arange(-0.3, 0.3 + spacing / 2, spacing)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    values = normal[0] * x + normal[1] * y + normal[2] * z
    return values.astype(np.float32), np.full(3, axis[0]), spacing


class Skin:
    """Points on a solid that may be turned and moving."""

    def __init__(self, points, field=None, rotation=None, origin=(0.0, 0.0, 0.0),
                 stiffening=False, damping=0.0, friction=0.5, give=0.0):
        self.points = np.array(points, float)
        self.n = len(self.points)
        self.velocities = np.zeros((self.n, 3))
        self.field = field or half_space()
        self.rotation = np.eye(3) if rotation is None else rotation
        self.origin = np.array(origin, float)
        self.linear, self.turn = np.zeros(3), np.zeros(3)
        area = np.full(self.n, AREA)
        tissue = np.full(self.n, E), np.full(self.n, D)
        self.tissue = area, area / compliance(*tissue, give), *tissue
        self.damping, self.give = np.full(self.n, damping), give
        self.stiffening, self.friction, self.motion = stiffening, friction, np.inf
        self.anchor, self.closed = np.zeros((self.n, 3)), np.zeros(self.n, bool)
        self.force, self.normals = np.zeros((2, self.n, 3))
        self.normal, self.along, self.across, self.depths, self.steepness = np.zeros((5, self.n))
        self.sticks, self.stretch = np.zeros(self.n, bool), np.zeros((self.n, 3))
        self.slid, self.pressed = np.zeros(1), np.empty(0, int)

    @property
    def flesh(self):
        return *self.tissue, self.give, self.stiffening, self.damping

    def evaluate(self, lag=0.0):
        """Count, greatest depth and its vertex."""
        *told, self.pressed, self.pace = foundation_forces(
            np.arange(self.n), self.points, self.velocities, *self.field, self.rotation,
            self.origin, self.linear, self.turn, *self.flesh, self.friction, lag, self.motion,
            self.anchor, self.closed, self.force, self.normal, self.normals, self.along,
            self.across, self.depths, self.steepness, self.sticks, self.stretch, self.slid,
        )
        return tuple(told)

    def energy(self):
        """What the flesh holds where it is [J]."""
        return foundation_energy(
            np.arange(self.n), self.points, *self.field, self.rotation, self.origin,
            *self.flesh[:6], self.anchor, self.closed,
        )

    def tell_late(self, mean, step):
        """Make of the forces what a step had of them that all points take with a mean (3,)."""
        write_late_forces(
            self.pressed, self.velocities, np.tile(mean, (self.n, 1)), step, self.friction,
            self.normals, self.along, self.across, self.force, self.normal,
        )

    def power(self, mean, lag, step):
        """Heat and implicit part [W] of a step that all points take with a mean velocity (3,)."""
        return foundation_power(
            self.pressed, self.points, self.velocities, np.tile(mean, (self.n, 1)), self.origin,
            self.linear, self.turn, *self.flesh, lag, step, self.depths,
            self.steepness, self.normals, self.normal, self.along, self.sticks,
        )


class Block:
    """Four points of skin under a mass, on an incline, by the step of Eq. I1."""

    def __init__(self, angle=0.0, depth=0.0, step=2e-3, mass=0.5, **law):
        self.down = G * np.array([sin(angle), 0.0, -cos(angle)])
        self.mass, self.step, self.lag = mass, step, 0.55 * step
        corners = [[x, y, -depth] for x in (-0.01, 0.01) for y in (-0.01, 0.01)]
        self.skin, self.v = Skin(corners, **law), np.zeros(3)
        self.stiffness = 4 * AREA * E / D
        self.flows, self.rows = np.zeros(5), []
        self.wrong = np.ones(5)  # factors of what the accounts see
        self.note()

    @property
    def place(self):
        return self.skin.points.mean(axis=0)

    def note(self):
        kinetic = self.mass * self.v @ self.v / 2
        potential = -self.mass * self.down @ self.place
        self.rows.append([kinetic, potential, self.skin.energy(), *self.flows])

    def advance(self, seconds):
        skin, h = self.skin, self.step
        for _ in range(round(seconds / h)):
            skin.points += h / 2 * self.v
            skin.velocities[:] = self.v
            skin.slid[0] = 0.0
            skin.evaluate(self.lag)
            z = np.diag([skin.across.sum(), skin.across.sum(), skin.along.sum()])
            force = skin.force.sum(axis=0) + self.mass * self.down
            change = np.linalg.solve(self.mass * np.eye(3) + z, h * force)
            mean = self.v + change / 2
            heat, implicit = skin.power(mean, self.lag, h)
            skin.tell_late(mean, h)
            self.told = skin.force.sum(axis=0), skin.normal.sum()
            late = mean @ z @ change
            self.flows += self.wrong * [0, 0, h * heat, skin.slid[0], late - h * implicit]
            self.v = self.v + change
            skin.points += h / 2 * self.v
            self.note()
        return np.array(self.rows)
