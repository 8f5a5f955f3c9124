"""Passive elastic torque of all joints: ligaments, capsules and muscles at rest (Eqs. J1–J5)."""

import numpy as np
import pinocchio as pin

from simcore.compiled import compiled
from simcore.dynamics.joint_angles import (
    HINGE,
    joint_ranges,
    lay_out_angles,
    measure_angles,
    without_side,
)
from simcore.dynamics.passive_moments import evaluate_moments, lay_out_limits


class PassiveJoints:
    """Elastic moments of the anatomical angles, as torques of the joints.

    Parameters
    ----------
    model : pin.Model
        With the joints of `simcore.body.segments`, each named as the segment it carries.

    Attributes
    ----------
    names : tuple of (joint, angle)
        Of all n angles, joints with their side: ("hip_left", "flexion").
    low, high : (n,) float64
        Ends of their ranges [rad].
    """

    def __init__(self, model: pin.Model):
        layout = lay_out_angles(model)
        self.names = layout.names
        ranges = [joint_ranges()[without_side(joint), angle] for joint, angle in self.names]
        self.low = np.array([each.low for each in ranges])
        self.high = np.array([each.high for each in ranges])
        self._layout = (layout.joints, layout.cones, layout.signs, layout.centres)
        self._limits, self._legs = lay_out_limits(self.names)
        count = len(self.names)
        self._measured = (np.empty(count), np.empty((count, 3)), np.empty(count))
        self._moments = (np.empty(count), np.empty(count))

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Return the anatomical angles (n,) [rad] of a configuration q (nq,), as `names`."""
        measure_angles(q, *self._layout, *self._measured)
        return self._measured[0].copy()

    def add_torque(
        self, q: np.ndarray, v: np.ndarray, torque: np.ndarray, stiffness: np.ndarray
    ) -> None:
        """Add the passive torque and how it stiffens the joints (Eq. J5).

        Parameters
        ----------
        q : (nq,) float64
        v : (nv,) float64
            Not used: the moments are elastic, and damping is the method's.
        torque : (nv,) float64
            Added to: τ [N·m], nothing on the root.
        stiffness : (nv, nv) float64
            Added to: about −∂τ/∂q in the tangent of the joints [N·m/rad]; symmetric, positive
            semidefinite, and one block a joint: the couplings of hip, knee and ankle are left out.
        """
        angles, rows, fades = self._measured
        measure_angles(q, *self._layout, angles, rows, fades)
        evaluate_moments(angles, self._limits, self._legs, *self._moments)
        _add_to_joints(*self._moments, rows, fades, self._layout[0], torque, stiffness)


# The three steps are called one by one: numba's cache does not see that a kernel which it has
# compiled into another file's has changed.
@compiled
def _add_to_joints(moments, slopes, rows, fades, joints, torque, stiffness):
    """Eq. J5."""
    last = joints.shape[0] - 1
    for j in range(joints.shape[0]):
        at = joints[j, 2]
        size = 1 if joints[j, 0] == HINGE else 3
        end = joints[j + 1, 3] if j < last else moments.shape[0]
        for n in range(joints[j, 3], end):
            moment, slope = fades[n] * moments[n], fades[n] * slopes[n]
            for a in range(size):
                torque[at + a] += moment * rows[n, a]
                for b in range(size):
                    stiffness[at + a, at + b] += slope * (rows[n, a] * rows[n, b])
