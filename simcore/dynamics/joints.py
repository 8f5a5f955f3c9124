"""Joint torques that keep a posture: Eq. 2 with the sign of the damping mended."""

import numpy as np
import pinocchio as pin


class PostureControl:
    """Proportional–derivative torques towards a reference configuration.

    τ = k_P (θ_ref ⊖ θ) − k_D θ̇, where ⊖ is the difference on the joint's manifold: for a
    spherical joint the shortest-arc logarithm log(Rᵀ R_ref), in the axes of θ̇.

    Parameters
    ----------
    model : pin.Model
    reference : (nq,) float64
        Configuration at rest.
    stiffness, damping : (nv,) float64
        k_P [N·m/rad] and k_D [N·m·s/rad], zero for the root.
    """

    def __init__(
        self,
        model: pin.Model,
        reference: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ):
        self._model = model
        self._reference = reference
        self._stiffness = stiffness
        self._damping = damping

    def torque(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return τ_joint (nv,) [N·m]."""
        error = pin.difference(self._model, q, self._reference)
        return self._stiffness * error - self._damping * v

    def stored_energy(self, q: np.ndarray) -> float:
        """Return k_P ‖θ_ref ⊖ θ‖² / 2 of all joints [J].

        The potential of τ where a joint has one k_P for all its degrees of freedom.
        """
        error = pin.difference(self._model, q, self._reference)
        return float(self._stiffness @ error**2) / 2
