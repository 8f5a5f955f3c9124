"""What a candidate leaves of each limit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simcore.limits.pressure_time import (
    linder_ganz_pressure,
    linder_ganz_time,
    reswick_rogers_pressure,
    reswick_rogers_time,
)
from simcore.limits.table import Limit, limits, limits_of

COMPARATIVE = (
    "Pressures and margins compare designs with one another; they never tell whether a patient"
    " comes to harm. Supports that redistribute pressure have not succeeded in reducing the"
    " prevalence of pressure ulcers (Boyle et al. 2020, PLoS ONE,"
    " doi 10.1371/journal.pone.0227064)."
)
"""To be shown wherever a margin is."""

EXPOSURE = 300.0
"""How long a patient is carried [s].

ASSUME: 5 min. Transfers from bed to chair were seen to take 157 s with a ceiling lift and 274 s
with a floor lift (`transfer_time` in limits.csv); the time the sling is loaded is less than that.
"""

PRESSURES = {
    "peak_pressure": "Peak pressure",
    "region_peak_pressure": "Peak pressure by region",
}
"""Metrics that are compared with every limit of a pressure."""

SINGLE_NUMBERS = {
    "neck_moment": "Moment at the neck (McGill 1994)",
    "lifting_speed": "Lifting speed (ISO 10535)",
}
"""Metrics that are compared with the one limit of their own name."""


@dataclass(frozen=True)
class LimitMargin:
    """What is left of one limit.

    Attributes
    ----------
    metric, limit : str
        Name of the metric, and of what it is compared with.
    label : str
        Both in words.
    margin : float or ndarray
        1 without load, 0 at the limit, negative beyond; of the metric's shape.
    limit_value : float or ndarray
        SI units as the metric.
    verified : bool
        Whether every number of the limit was read in its source.
    extrapolated : bool
        Whether the exposure is shorter than any in the data behind the limit.
    minutes_to_curve : float or ndarray, optional
        How long the pressure would have to last to reach a pressure–time curve [min].
    """

    metric: str
    limit: str
    label: str
    margin: np.ndarray
    limit_value: np.ndarray
    verified: bool
    extrapolated: bool = False
    minutes_to_curve: np.ndarray | None = None


@dataclass(frozen=True)
class Curve:
    """A pressure–time curve [s → Pa], its inverse, and the quantities it is made of."""

    title: str
    pressure: Callable
    time: Callable
    condition: str
    shortest: str


CURVES = {
    "linder_ganz": Curve(
        "pressure–time curve of rat muscle (Linder-Ganz 2006)", linder_ganz_pressure,
        linder_ganz_time, "rat muscle", "pressure_time_shortest",
    ),
    "reswick_rogers": Curve(
        "pressure–time curve of Reswick and Rogers (1976)", reswick_rogers_pressure,
        reswick_rogers_time, "bony prominences", "pressure_time_product_shortest",
    ),
}


def margin(value, limit):
    """Return 1 − value/limit: 1 without load, 0 at the limit, negative beyond it."""
    return 1 - np.asarray(value, float) / limit


def range_margin(angle, low, high):
    """Return the margin of an angle within its range: 1 in the middle, 0 at either end.

    Parameters
    ----------
    angle, low, high : array_like
        Of any shapes that broadcast [rad]; low < high.
    """
    middle, half = (np.add(high, low)) / 2, np.subtract(high, low) / 2
    return margin(np.abs(angle - middle), half)


def limit_margins(
    metrics: Mapping[str, np.ndarray],
    exposure: float = EXPOSURE,
    region_names: Sequence[str] = (),
) -> tuple[LimitMargin, ...]:
    """Return the margin to every limit that the metrics can be compared with.

    Parameters
    ----------
    metrics : mapping
        Any of these; others are ignored, and NaN gives NaN. Each may have further axes in front.

        - `peak_pressure` (...), `region_peak_pressure` (..., r) [Pa]
        - `neck_moment` (...) [N m], its magnitude
        - `lifting_speed` (...) [m/s]
        - `region_squeeze_force` (..., r) [N]: on a region that is squeezed between two parts,
          never the support of a region
        - `joint_angle`, `joint_angle_min`, `joint_angle_max` (..., n) [rad]: angles and the ends
          of their ranges, the caller's
    exposure : float
        How long the pressures last [s], above 0.
    region_names : sequence of str
        Names of the regions (r,); needed for `region_squeeze_force` only.
    """
    found = []
    for metric, title in PRESSURES.items():
        if metric in metrics:
            found += _pressure_margins(metric, title, metrics[metric], exposure)
    for metric, title in SINGLE_NUMBERS.items():
        if metric in metrics:
            (limit,) = limits_of(metric)
            found.append(_plain(metric, metric, title, metrics[metric], limit))
    if "region_squeeze_force" in metrics:
        found.append(_force_margin(metrics["region_squeeze_force"], region_names))
    if "joint_angle" in metrics:
        low, high = metrics["joint_angle_min"], metrics["joint_angle_max"]
        found.append(
            LimitMargin(
                "joint_angle", "joint_range", "Joint angle within its range",
                range_margin(metrics["joint_angle"], low, high),
                np.stack(np.broadcast_arrays(low, high)), verified=False,
            )
        )
    return tuple(found)


def minutes_to_curve(pressure):
    """Return how long a steady pressure [Pa] lasts until the rat-muscle curve is reached [min]."""
    return linder_ganz_time(pressure) / 60


def _pressure_margins(metric, title, pressure, exposure) -> list[LimitMargin]:
    found = []
    for name, curve in CURVES.items():
        rows = [row for row in limits().values() if row.condition == curve.condition]
        shortest = limits()[curve.shortest, curve.condition].value
        allowed = curve.pressure(exposure)
        found.append(
            LimitMargin(
                metric, name, f"{title}, {curve.title}, {exposure / 60:g} min",
                margin(pressure, allowed), allowed, all(row.verified for row in rows),
                exposure < shortest, curve.time(pressure) / 60,
            )
        )
    return found + [
        _plain(
            metric, f"capillary_closing_{limit.condition.split()[0]}",
            f"{title}, capillary closing pressure at the {limit.condition}", pressure, limit,
        )
        for limit in limits_of("capillary_closing")
    ]


def _plain(metric, name, label, value, limit: Limit) -> LimitMargin:
    """Return the margin to a limit that is one number."""
    return LimitMargin(
        metric, name, label, margin(value, limit.value), limit.value, limit.verified
    )


def _force_margin(force, region_names) -> LimitMargin:
    """Return the margin to the force on each region; NaN where the standard has none."""
    rows = limits_of("quasi_static_force")
    by_region = {region: row for row in rows for region in row.regions}
    allowed = np.array(
        [
            by_region[base].value if base in by_region else np.nan
            for base in (name.removesuffix("_left").removesuffix("_right") for name in region_names)
        ]
    )
    return LimitMargin(
        "region_squeeze_force", "quasi_static_force",
        "Force that squeezes a region (ISO/TS 15066)", margin(force, allowed), allowed,
        all(row.verified for row in rows),
    )
