"""Segment parameters of de Leva (1996), J. Biomech. 29, 1223, Table 4.

Read in third-party code that transcribes the table; not checked against the article.
Masses are shares of body mass; centres of mass and radii of gyration are shares of segment length,
the radii about the anterior-posterior, mediolateral and long axes.  Limbs are per side, measured
from the proximal end (foot: from the heel).
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class SegmentShare:
    """One row of the table.

    Attributes
    ----------
    mass : float
        Share of body mass.
    com : float
        Distance of the centre of mass from the proximal end, share of the length.
    radii : (float, float, float)
        Radii of gyration about the x (forward), y (left) and long axes, share of the length.
    """

    mass: float
    com: float
    radii: tuple[float, float, float]


def _row(mass, com, x, y, long):
    return SegmentShare(mass / 100, com / 100, (x / 100, y / 100, long / 100))


SHARES = {
    "male": {
        "head": _row(6.94, 59.76, 36.2, 37.6, 31.2),
        "thoracic": _row(15.96, 29.99, 71.6, 45.4, 65.9),
        "lumbar": _row(16.33, 45.02, 48.2, 38.3, 46.8),
        "pelvis": _row(11.17, 61.15, 61.5, 55.1, 58.7),
        "upper_arm": _row(2.71, 57.72, 28.5, 26.9, 15.8),
        "forearm": _row(1.62, 45.74, 27.6, 26.5, 12.1),
        "hand": _row(0.61, 79.00, 62.8, 51.3, 40.1),
        "thigh": _row(14.16, 40.95, 32.9, 32.9, 14.9),
        "shank": _row(4.33, 44.59, 25.5, 24.9, 10.3),
        "foot": _row(1.37, 44.15, 25.7, 24.5, 12.4),
    },
    "female": {
        "head": _row(6.68, 58.94, 33.0, 35.9, 31.8),
        "thoracic": _row(15.45, 20.77, 74.6, 50.2, 71.8),
        "lumbar": _row(14.65, 45.12, 43.3, 35.4, 41.5),
        "pelvis": _row(12.47, 49.20, 43.3, 40.2, 44.4),
        "upper_arm": _row(2.55, 57.54, 27.8, 26.0, 14.8),
        "forearm": _row(1.38, 45.59, 26.1, 25.7, 9.4),
        "hand": _row(0.56, 74.74, 53.1, 45.4, 33.5),
        "thigh": _row(14.78, 36.12, 36.9, 36.4, 16.2),
        "shank": _row(4.81, 44.16, 27.1, 26.7, 9.3),
        "foot": _row(1.29, 40.14, 29.9, 27.9, 13.9),
    },
}

# The table's segment lengths relative to stature (1.741 m men, 1.735 m women) [m/m].  Used where
# the table's end points differ from the skeleton's joint centres.
LENGTHS = {
    "male": {"head": 0.203 / 1.741, "thoracic": 0.171 / 1.741, "lumbar": 0.216 / 1.741,
             "pelvis": 0.146 / 1.741, "hand": 0.086 / 1.741, "foot": 0.258 / 1.741},
    "female": {"head": 0.200 / 1.735, "thoracic": 0.143 / 1.735, "lumbar": 0.205 / 1.735,
               "pelvis": 0.182 / 1.735, "hand": 0.078 / 1.735, "foot": 0.228 / 1.735},
}
