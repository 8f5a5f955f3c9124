"""Pressure over depth of flesh, on what is rigid or on a mattress (Eqs. C1 and C3)."""

import numpy as np

from simcore.compiled import compiled, inlined

STRAIN_MAX = 0.8
"""Of the flesh, beyond which it is taken as linear: 25 times as stiff as at rest."""

SHEAR_SHARE = 1 / 3
"""Shear modulus over Young's modulus of what is incompressible, such as flesh.

# ASSUME: of a mattress too, whose foam is nearer to 0.4.
"""


def compliance(modulus: np.ndarray, thickness: np.ndarray, give: float) -> np.ndarray:
    """Return 1/p′(0) = D/E + c of flesh and mattress (n,) [m/Pa], parameters as below."""
    return thickness / modulus + give


@inlined
def pressure_and_slope(depth, modulus, thickness, give, stiffening):
    """Return the pressure p [Pa] at a depth d > 0 and its slope p′ [Pa/m].

    Flesh of modulus E and thickness D, in series with what gives way by c a pressure:

        d = c p + D p/E,  or stiffening  c p + D p/(E + p):  p = 2 d E/(b + √(b² + 4 c d E)),
        b = D − d + c E                                                      (Eqs. C1 and C3)

    Parameters
    ----------
    depth, modulus, thickness : float
        d [m], E [Pa] and D [m].
    give : float
        c of the mattress [m/Pa]; 0 on what is rigid.
    stiffening : bool
    """
    # All is computed and then chosen, so that a loop over many has no branch.
    soft = thickness / modulus
    even = 1.0 / (soft + give)
    left = 1.0 - STRAIN_MAX
    most = STRAIN_MAX / left * modulus
    beyond = depth - STRAIN_MAX * thickness - give * most
    steep = 1.0 / (soft * left * left + give)
    past = most + steep * beyond
    b = thickness - depth + give * modulus
    bent = 2.0 * depth * modulus / (b + np.sqrt(b * b + 4.0 * give * depth * modulus))
    left = modulus / (modulus + bent)
    slope = 1.0 / (soft * left * left + give)
    bent, slope = (past, steep) if beyond > 0.0 else (bent, slope)
    straight = even * depth
    return (bent, slope) if stiffening else (straight, even)


@compiled
def work_of_pressing(depth, pressure, modulus, thickness, give, stiffening):
    """Return ∫ p dd of flesh and mattress from 0 to a depth > 0 [J/m²], with p there: Eq. E3."""
    strain = (depth - give * pressure) / thickness if thickness > 0.0 else 0.0
    of_flesh = modulus * thickness * work_of_strain(strain, stiffening)
    return of_flesh + 0.5 * give * pressure * pressure


@compiled
def work_of_strain(strain, stiffening):
    """Return ∫ p/E dε of Eq. C1."""
    if not stiffening:
        return 0.5 * strain * strain
    bent = min(strain, STRAIN_MAX)
    beyond = strain - bent
    left = 1.0 - bent
    return -np.log(left) - bent + beyond * (bent + 0.5 * beyond / left) / left
