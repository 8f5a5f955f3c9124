"""Inertia of a sheet: what sub-steps need, kept off the motion of the sheet as a whole."""

import numpy as np

from simcore.compiled import compiled
from simcore.four import put_three, spread, three_of

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

    def kick(self, velocity: np.ndarray, kicked: np.ndarray, impulse: np.ndarray) -> float:
        """Add M⁻¹ J to velocities (n, 3) for impulses J (k, 3) [N s] on vertices (k,), each once.

        Returns the energy given [J].
        """
        return _kick(self.local, self.spread, self.coupling, velocity, kicked, impulse)


@compiled
def _kick(local, carried, coupling, velocity, kicked, impulse):
    """Implement `Inertia.kick`: all vertices move with the whole, those that are kicked beside."""
    taken = np.zeros((MODES, 3))
    for e in range(kicked.size):
        for k in range(MODES):
            for axis in range(3):
                taken[k, axis] += carried[kicked[e], k] * impulse[e, axis]
    given, energy = coupling @ taken, 0.0
    for e in range(kicked.size):
        i = kicked[e]
        for axis in range(3):
            alone = with_whole = impulse[e, axis] / local[i]
            for k in range(MODES):
                with_whole += carried[i, k] * given[k, axis]
            energy += impulse[e, axis] * (velocity[i, axis] + 0.5 * with_whole)
            velocity[i, axis] += alone
    first, second = three_of(given, np.uint64(0)), three_of(given, np.uint64(1))
    third, fourth = three_of(given, np.uint64(2)), three_of(given, np.uint64(3))
    for each in range(local.size):
        i = np.uint64(each)
        shift = (spread(carried[i, 0]) * first + spread(carried[i, 1]) * second) + (
            spread(carried[i, 2]) * third + spread(carried[i, 3]) * fourth)
        put_three(three_of(velocity, i) + shift, velocity, i)
    return energy


def whole_modes(rest_position: np.ndarray) -> np.ndarray:
    """Return the modes P (n, 4) in which a sheet moves as a whole.

    Bilinear over the bounding box of the flat sheet (n, 2) [m]: translations, and what turns,
    stretches, shears and twists it evenly.
    """
    low, high = rest_position.min(axis=0), rest_position.max(axis=0)
    x, y = ((rest_position - low) / (high - low)).T
    return np.stack([(1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y], axis=1)
