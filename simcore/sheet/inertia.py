"""Inertia of a sheet: what sub-steps need, kept off the motion of the sheet as a whole."""

import numpy as np

from simcore.compiled import compiled

MODES = 4
"""Motions of a sheet as a whole, k below; loops over them are unrolled."""


class Inertia:
    """The mass matrix of a sheet, the same along each axis (Eq. S14).

    Sub-steps need added inertia Δ against frequencies of single springs (Eq. S8). As plain mass it
    would slow the swing of the patient as well; so most of it is taken off again for the k modes P
    in which the sheet moves as a whole:

        M = D − κ Δ P G⁻¹ Pᵀ Δ,   D = diag(m + Δ),   G = Pᵀ Δ P                  (Eq. S14)
        M⁻¹ = D⁻¹ + D⁻¹ Δ P A Pᵀ Δ D⁻¹,   A = (G/κ − Pᵀ Δ D⁻¹ Δ P)⁻¹

    This is selective mass scaling (Olovsson, Simonsson and Unosson, Int. J. Numer. Meth. Engng 63,
    2005) by a matrix of rank k.

    Parameters
    ----------
    mass, added : (n,) float64
        m and Δ [kg].
    modes : (n, k) float64
        P; sums of rows are 1, so that the modes contain the translations.
    carried : float
        κ, from 0 to less than 1.

    Attributes
    ----------
    local : (n,) float64
        D: what a vertex by itself opposes to a force [kg].
    gathered, spread : (n, k) float64
        Δ P [kg] and D⁻¹ Δ P.
    coupling : (k, k) float64
        A [1/kg].
    """

    def __init__(self, mass: np.ndarray, added: np.ndarray, modes: np.ndarray, carried: float):
        self.local = mass + added
        self.gathered = added[:, None] * modes
        self.spread = self.gathered / self.local[:, None]
        self.coupling = np.zeros((modes.shape[1], modes.shape[1]))
        self._taken_off = np.zeros_like(self.coupling)  # κ G⁻¹
        if carried > 0:
            inner = modes.T @ self.gathered
            self.coupling = np.linalg.inv(inner / carried - self.gathered.T @ self.spread)
            self._taken_off = carried * np.linalg.inv(inner)

    @classmethod
    def plain(cls, mass: np.ndarray) -> "Inertia":
        """Return that of the true mass (n,) [kg]."""
        return cls(mass, np.zeros_like(mass), np.zeros((len(mass), MODES)), 0.0)

    def momenta(self, velocity: np.ndarray) -> np.ndarray:
        """Return M v (n, 3) of velocities (n, 3) [kg m/s]."""
        carried = self.gathered @ (self._taken_off @ (self.gathered.T @ velocity))
        return self.local[:, None] * velocity - carried

    def kinetic_energy(self, velocity: np.ndarray) -> float:
        """Return v·M v / 2 of velocities (n, 3) [J]."""
        carried = self.gathered.T @ velocity
        alone = self.local @ np.einsum("ij,ij->i", velocity, velocity)
        return float(alone - (carried * (self._taken_off @ carried)).sum()) / 2

    def kick(self, velocity: np.ndarray, impulse: np.ndarray) -> float:
        """Add M⁻¹ J to velocities (n, 3) for impulses J (n, 3) [N s]; return the energy given [J].
        """
        return _kick(self.local, self.spread, self.coupling, velocity, impulse)


@compiled
def _kick(local, spread, coupling, velocity, impulse):
    """Implement `Inertia.kick`; most vertices have no impulse of their own."""
    taken = np.zeros((MODES, 3))
    for i in range(local.size):
        x, y, z = impulse[i, 0], impulse[i, 1], impulse[i, 2]
        if x == 0.0 and y == 0.0 and z == 0.0:
            continue
        for k in range(MODES):
            taken[k, 0] += spread[i, k] * x
            taken[k, 1] += spread[i, k] * y
            taken[k, 2] += spread[i, k] * z
    given = coupling @ taken
    ax, ay, az = given[0, 0], given[0, 1], given[0, 2]
    bx, by, bz = given[1, 0], given[1, 1], given[1, 2]
    cx, cy, cz = given[2, 0], given[2, 1], given[2, 2]
    dx, dy, dz = given[3, 0], given[3, 1], given[3, 2]
    energy = 0.0
    for i in range(local.size):
        x, y, z = impulse[i, 0], impulse[i, 1], impulse[i, 2]
        u, v, w = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        a, b, c, d = spread[i, 0], spread[i, 1], spread[i, 2], spread[i, 3]
        if x == 0.0 and y == 0.0 and z == 0.0:
            velocity[i, 0] = u + (a * ax + b * bx + c * cx + d * dx)
            velocity[i, 1] = v + (a * ay + b * by + c * cy + d * dy)
            velocity[i, 2] = w + (a * az + b * bz + c * cz + d * dz)
            continue
        mobility = 1.0 / local[i]
        x_shift = x * mobility + a * ax + b * bx + c * cx + d * dx
        y_shift = y * mobility + a * ay + b * by + c * cy + d * dy
        z_shift = z * mobility + a * az + b * bz + c * cz + d * dz
        energy += x * (u + 0.5 * x_shift)
        energy += y * (v + 0.5 * y_shift)
        energy += z * (w + 0.5 * z_shift)
        velocity[i, 0], velocity[i, 1], velocity[i, 2] = u + x_shift, v + y_shift, w + z_shift
    return energy


def whole_modes(rest_position: np.ndarray) -> np.ndarray:
    """Return the modes P (n, 4) in which a sheet moves as a whole.

    Bilinear over the bounding box of the flat sheet (n, 2) [m]: translations, and what turns,
    stretches, shears and twists it evenly.
    """
    low, high = rest_position.min(axis=0), rest_position.max(axis=0)
    x, y = ((rest_position - low) / (high - low)).T
    return np.stack([(1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y], axis=1)
