"""Where the energy goes: stored, flowing, and left unexplained (Eqs. E1 and E6)."""

import numpy as np

STORED = ("kinetic", "potential", "elastic")
"""Energies of body and sheet."""

WORK = ("device_work", "passive_work")
"""Done on them by what moves the device, and by the passive structures of the joints."""

SPENT = ("damping", "friction", "numerical")
"""Turned into heat by dashpots and by sliding, and taken out by the integration itself."""

FLOWS = WORK + SPENT
TERMS = STORED + FLOWS


def unexplained(energy: np.ndarray) -> np.ndarray:
    """Return what the balance leaves over (T,) [J]: Eq. E1.

    Parameters
    ----------
    energy : (T, 8) float64
        `TERMS`: energies, and flows since the start [J].
    """
    stored, work, spent = np.split(energy - energy[0], [3, 5], axis=1)
    return stored.sum(axis=1) - work.sum(axis=1) + spent.sum(axis=1)


def exchanged(energy: np.ndarray) -> float:
    """Return the greatest range of any term [J]: Eq. E6."""
    return float(np.ptp(energy, axis=0).max())


def energy_residual(energy: np.ndarray) -> float:
    """Return the greatest magnitude of what is left over, over the energy exchanged: Eq. E6.

    NaN where nothing was exchanged, or is not known.
    """
    most = exchanged(energy)
    return float(np.abs(unexplained(energy)).max() / most) if most > 0 else np.nan
