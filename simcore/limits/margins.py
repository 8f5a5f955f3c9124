"""What metrics are compared with, and what a value leaves of it (Eq. L1)."""

from collections.abc import Callable
from dataclasses import dataclass

from simcore.limits.pressure_time import linder_ganz_pressure, reswick_rogers_pressure
from simcore.limits.table import limits, limits_of

COMPARATIVE = (
    "Pressures and margins compare designs with one another; they never tell whether a patient"
    " comes to harm. Supports that redistribute pressure have not succeeded in reducing the"
    " prevalence of pressure ulcers (Boyle et al. 2020, PLoS ONE,"
    " doi 10.1371/journal.pone.0227064)."
)
"""To be shown wherever a margin is."""

PRESSURES = {"peak_pressure": "margin", "region_peak_pressure": "region_margin"}
"""Metrics that are compared with every limit of a pressure → how the names of margins begin."""

SINGLE_NUMBERS = {
    "neck_moment": "moment of the neck",
    "lifting_speed": "lifting speed",
}
"""Metrics that are compared with the one limit of their own name, and that limit in words."""


@dataclass(frozen=True)
class Bound:
    """A limit as one metric meets it.

    Attributes
    ----------
    name : str
        Of the margin to it.
    metric : str
        What is compared with it.
    title : str
        The limit in words.
    value, units
        In SI, as the metric.
    verified : bool
        Whether every number behind it was read in its source.
    source : str
    exposure : float or None
        How long it is for [s]; None for any time.
    extrapolated : bool
        Whether that is shorter than any in the data behind it.
    """

    name: str
    metric: str
    title: str
    value: float
    units: str
    verified: bool
    source: str
    exposure: float | None = None
    extrapolated: bool = False


@dataclass(frozen=True)
class Curve:
    """A pressure–time curve [s → Pa], and where in the table its numbers are."""

    title: str
    pressure: Callable
    condition: str
    shortest: str


CURVES = {
    "linder_ganz": Curve(
        "pressure in rat muscle", linder_ganz_pressure, "rat muscle", "pressure_time_shortest",
    ),
    "reswick_rogers": Curve(
        "pressure on bony prominences", reswick_rogers_pressure, "bony prominences",
        "pressure_time_product_shortest",
    ),
}


def margin(value, bound: float):
    """Return 1 − value/bound: 1 without load, 0 at the limit, negative beyond it."""
    return 1 - value / bound


def bounds(exposure: float) -> tuple[Bound, ...]:
    """Return every limit that a metric is compared with.

    Parameters
    ----------
    exposure : float
        How long the pressures last [s], above 0.
    """
    found = []
    for metric, prefix in PRESSURES.items():
        for name, curve in CURVES.items():
            rows = [row for row in limits().values() if row.condition == curve.condition]
            found.append(
                Bound(
                    f"{prefix}_{name}", metric, curve.title, float(curve.pressure(exposure)), "Pa",
                    all(row.verified for row in rows),
                    "; ".join(dict.fromkeys(row.source for row in rows)),
                    exposure, exposure < limits()[curve.shortest, curve.condition].value,
                )
            )
        for limit in limits_of("capillary_closing"):
            end = limit.condition.split()[0]
            found.append(
                _plain(
                    f"{prefix}_capillary_closing_{end}", metric,
                    f"capillary closing, {limit.condition}", limit,
                )
            )
    for metric, title in SINGLE_NUMBERS.items():
        (limit,) = limits_of(metric)
        found.append(_plain(f"margin_{metric}", metric, title, limit))
    return tuple(found)


def _plain(name, metric, title, limit) -> Bound:
    """Return a limit that is one number, whatever the exposure."""
    return Bound(name, metric, title, limit.value, limit.units, limit.verified, limit.source)
