"""A flat bed under a sheet: Eq. 14 for every vertex, implicit on the vertex."""

from dataclasses import dataclass

import numpy as np

from simcore.compiled import compiled


@dataclass(frozen=True, eq=False)
class BedContact:
    """A springy half space below z = 0 under a rectangle about the origin.

    Attributes
    ----------
    half_length, half_width : float
        Of the rectangle, along x and y [m].
    stiffness, damping : (n,) float64
        Of the bed under each sheet vertex [N/m, N s/m].
    friction_coefficient : float
        µ.
    friction_force : float
        Friction of a vertex beside µ N, as in Eq. 7 [N].
    slip_speed : float
        Below it friction is viscous [m/s].
    """

    half_length: float
    half_width: float
    stiffness: np.ndarray
    damping: np.ndarray
    friction_coefficient: float
    friction_force: float
    slip_speed: float


@compiled
def push_from_bed(
    x, y, z, u, v, w, other_x, other_y, other_z, mobility, stiffness, damping, half_length,
    half_width, friction, friction_force, slip_speed, h, impulse_x, impulse_y, impulse_z,
):
    """Add to velocities what the bed does to them within a sub-step of length h [s].

        N = max((k d − (h k + c) ż) / (1 + h (h k + c)/m), 0),  d = −z > 0;
        F = −γ ẋ_t / (1 + h γ/m),  γ = (µ N + F_c) / max(‖ẋ_t‖, ε)               (Eqs. S5, S7)

    at the velocities that all other forces give. What the other contact of a vertex will do is
    taken from the sub-step before; solved in turn, the two have converged where they rest.

    Parameters
    ----------
    x, y, z, u, v, w : (N,) float64
        Positions [m] and velocities [m/s]; the latter are added to.
    other_x, other_y, other_z : (N,) float64
        Force of the other contact in the sub-step before [N].
    mobility : (N,) float64
        1/m [1/kg].
    stiffness, damping : (N,) float64
        k and c; zero where there is no vertex.
    impulse_x, impulse_y, impulse_z : (N,) float64
        On the vertices; added to [N s].
    """
    for p in range(x.size):
        rate = h * mobility[p]
        up = w[p] + rate * other_z[p]
        along, aside = u[p] + rate * other_x[p], v[p] + rate * other_y[p]
        gain = h * stiffness[p] + damping[p]
        normal = max(-(stiffness[p] * z[p] + gain * up) / (1.0 + rate * gain), 0.0)
        over = z[p] < 0.0 and abs(x[p]) < half_length and abs(y[p]) < half_width
        normal = normal if over else 0.0
        viscosity = (friction * normal + friction_force) / max(
            np.sqrt(along * along + aside * aside), slip_speed
        )
        viscosity = viscosity if normal > 0.0 else 0.0
        hold = -viscosity / (1.0 + rate * viscosity)
        along *= hold
        aside *= hold
        u[p] += rate * along
        v[p] += rate * aside
        w[p] += rate * normal
        impulse_x[p] += h * along
        impulse_y[p] += h * aside
        impulse_z[p] += h * normal
