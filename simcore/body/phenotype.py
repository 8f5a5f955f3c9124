"""Fit of MakeHuman's height, weight and muscle axes to a stature and a mass.

Vertices are multilinear in the axes, so one body costs a product with 18 stored corners.  For a
given muscle value stature fixes `height` and mass fixes `weight`, each by a bracketed root; the
remaining freedom, muscle, is chosen by a prior.
"""

import itertools
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sparse
from scipy.optimize import brentq, minimize_scalar

from simcore.body.makehuman import load_corners
from simcore.body.surface import enclosed_volume
from simcore.errors import DesignError

# ASSUME: [kg/m³] a living, breathing body is a little lighter than water.
BODY_DENSITY = 985.0

# ASSUME: ages between MakeHuman's anchors (baby 1, child 12, young 25, old 90 years) interpolate
# linearly; beyond 90 years the body is the one of 90.
AGE_ANCHORS = np.array([1.0, 12.0, 25.0, 90.0])  # [year]
OLDEST_AGE = 110.0  # [year]
# ASSUME: muscle at most average from 60 years on; MakeHuman's old, strong bodies are unfinished.
OLD_AGE, OLD_MUSCLE = 60.0, 0.5
# ASSUME: extrapolating weight to 1.2 keeps the skin free of folds; to 1.6 it folds.
WEIGHT_RANGE = (0.0, 1.2)
HEIGHT_RANGE = (0.0, 1.0)
# ASSUME: the likeliest body has average weight and somewhat less than average muscle, and a
# deviation of 0.25 in either is equally unlikely.
LIKELY_WEIGHT, LIKELY_MUSCLE = 0.5, 0.4
STATURE_TOLERANCE = 1e-5  # [m]
ANCHOR_STEPS = 5  # grid steps over muscle in the search for reachable masses


@dataclass(frozen=True)
class Phenotype:
    """Positions on MakeHuman's axes, each 0 to 1 (weight to 1.2)."""

    height: float
    weight: float
    muscle: float


@dataclass(eq=False)
class BodyFamily:
    """All bodies of one sex and age, seen through a surface map.

    Attributes
    ----------
    corners : (3, 3, 2, 19158, 3) float64
        Vertices [m] at the corners of muscle, weight and height.
    faces : (f, 3) int32
        Triangles of the mapped surface.
    muscle_range : (float, float)
    operator : (n, 19158) sparse
        The surface map.
    surface : (3, 3, 2, n, 3) float64
        The corners after the map.
    """

    corners: np.ndarray
    faces: np.ndarray
    muscle_range: tuple[float, float]
    operator: sparse.csr_matrix
    surface: np.ndarray = field(init=False)

    def __post_init__(self):
        flat = self.corners.reshape(18, -1, 3)
        mapped = np.stack([self.operator @ corner for corner in flat])
        self.surface = mapped.reshape(*self.corners.shape[:3], -1, 3)

    def through(self, operator: sparse.csr_matrix, faces: np.ndarray) -> "BodyFamily":
        """The same bodies seen through another surface map."""
        return BodyFamily(self.corners, faces, self.muscle_range, operator)

    def vertices(self, phenotype: Phenotype) -> np.ndarray:
        """All 19158 vertices, helper geometry included [m]."""
        return _blend_corners(self.corners, phenotype)

    def surface_vertices(self, phenotype: Phenotype) -> np.ndarray:
        """Vertices (n, 3) of the mapped surface [m]."""
        return _blend_corners(self.surface, phenotype)

    def stature(self, phenotype: Phenotype) -> float:
        """Vertical extent in the rest pose [m]."""
        return float(np.ptp(_blend_corners(self.surface[..., 2], phenotype)))

    def mass(self, phenotype: Phenotype) -> float:
        """Enclosed volume times the body's density [kg]."""
        return BODY_DENSITY * enclosed_volume(self.surface_vertices(phenotype), self.faces)

    def with_stature(self, stature: float, weight: float, muscle: float) -> Phenotype | None:
        """The body of this stature, weight and muscle; None when `height` cannot reach it."""

        def excess(height):
            return self.stature(Phenotype(height, weight, muscle)) - stature

        low, high = excess(HEIGHT_RANGE[0]), excess(HEIGHT_RANGE[1])
        if low > 0 or high < 0:
            return None
        guess = HEIGHT_RANGE[0] - low / (high - low)  # exact when the extremal vertices stay
        if abs(excess(guess)) > STATURE_TOLERANCE:
            guess = brentq(excess, *HEIGHT_RANGE, xtol=1e-7)
        return Phenotype(guess, weight, muscle)

    def with_stature_and_mass(self, stature: float, mass: float, muscle: float) -> Phenotype | None:
        """The body of this stature, mass and muscle; None when it cannot be reached."""
        lightest = self.with_stature(stature, WEIGHT_RANGE[0], muscle)
        heaviest = self.with_stature(stature, WEIGHT_RANGE[1], muscle)
        if lightest is None or heaviest is None:
            return None
        if not self.mass(lightest) <= mass <= self.mass(heaviest):
            return None

        def excess(weight):
            return self.mass(self.with_stature(stature, weight, muscle)) - mass

        return self.with_stature(stature, brentq(excess, *WEIGHT_RANGE, xtol=1e-7), muscle)


def body_family(
    sex: str, age_years: float, operator: sparse.csr_matrix, faces: np.ndarray
) -> BodyFamily:
    """All bodies of a sex and age; `operator` maps MakeHuman's vertices to those of `faces`.

    Raises
    ------
    DesignError
        If sex or age is not one the data holds.
    """
    if sex not in ("male", "female"):
        raise DesignError(f"sex: {sex!r} is not one of male, female")
    if not AGE_ANCHORS[0] <= age_years <= OLDEST_AGE:
        raise DesignError(
            f"age_years: {age_years:g} is outside {AGE_ANCHORS[0]:g} to {OLDEST_AGE:g}"
        )
    age = min(age_years, AGE_ANCHORS[-1])
    older = int(np.clip(np.searchsorted(AGE_ANCHORS, age), 1, 3))
    share = (age - AGE_ANCHORS[older - 1]) / (AGE_ANCHORS[older] - AGE_ANCHORS[older - 1])
    younger_body, older_body = load_corners(sex, older).astype(float)
    corners = (1 - share) * younger_body + share * older_body
    strongest = OLD_MUSCLE if age_years >= OLD_AGE else 1.0
    return BodyFamily(corners, faces, (0.0, strongest), operator)


def fit_phenotype(family: BodyFamily, name: str, stature: float, mass: float) -> Phenotype:
    """The likeliest body of a stature [m] and mass [kg].

    Raises
    ------
    DesignError
        If none exists.
    """
    def unlikelihood(muscle):
        found = family.with_stature_and_mass(stature, mass, muscle)
        if found is None:
            return np.inf
        return (found.weight - LIKELY_WEIGHT) ** 2 + (muscle - LIKELY_MUSCLE) ** 2

    grid = np.linspace(*family.muscle_range, 2 * ANCHOR_STEPS + 1)
    costs = [unlikelihood(muscle) for muscle in grid]
    best = int(np.argmin(costs))
    if not np.isfinite(costs[best]):
        raise DesignError(
            f"body {name}: no body of this sex and age has {stature:g} m and {mass:g} kg; accepted:"
            " other values of stature_m and mass_kg"
        )
    bounds = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    refined = minimize_scalar(unlikelihood, bounds=bounds, method="bounded",
                              options={"xatol": 1e-3, "maxiter": 12})
    muscle = refined.x if refined.fun < costs[best] else grid[best]
    return family.with_stature_and_mass(stature, mass, float(muscle))


def reachable_statures(family: BodyFamily) -> tuple[float, float]:
    """The shortest and the tallest of the bodies of a family [m]."""
    builds = _builds(family)
    return (
        min(family.stature(Phenotype(HEIGHT_RANGE[0], *build)) for build in builds),
        max(family.stature(Phenotype(HEIGHT_RANGE[1], *build)) for build in builds),
    )


def reachable_masses(family: BodyFamily, stature: float) -> tuple[float, float]:
    """The lightest and the heaviest of the bodies of a stature that some body has [kg]."""
    bodies = [family.with_stature(stature, *build) for build in _builds(family)]
    masses = [family.mass(body) for body in bodies if body is not None]
    return min(masses), max(masses)


def _builds(family: BodyFamily) -> list[tuple[float, float]]:
    """Weight and muscle of the bodies that can be a family's extremes."""
    return list(itertools.product(
        (WEIGHT_RANGE[0], 0.5, WEIGHT_RANGE[1]), np.linspace(*family.muscle_range, ANCHOR_STEPS)
    ))


def _hat(value: float, anchors: int) -> np.ndarray:
    """Piecewise-linear weights (anchors,) of a value on evenly spaced anchors from 0 to 1.

    Beyond the ends the outer piece is extrapolated.
    """
    position = value * (anchors - 1)
    lower = int(np.clip(np.floor(position), 0, anchors - 2))
    weights = np.zeros(anchors)
    weights[lower], weights[lower + 1] = lower + 1 - position, position - lower
    return weights


def _blend_corners(corners: np.ndarray, phenotype: Phenotype) -> np.ndarray:
    coefficients = np.einsum(
        "i,j,k->ijk", _hat(phenotype.muscle, 3), _hat(phenotype.weight, 3),
        _hat(phenotype.height, 2),
    ).ravel()
    # One after another: a product of matrices is summed as the processor likes, and the last bits
    # of coordinates decide about triangles of the remesh.
    blended = np.zeros(corners.shape[3:])
    for coefficient, corner in zip(coefficients, corners.reshape(18, *blended.shape), strict=True):
        if coefficient:
            blended += coefficient * corner
    return blended
