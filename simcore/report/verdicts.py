"""Dataset → which candidates held, where the threshold lies, and which design is best."""

from dataclasses import dataclass
from itertools import groupby

import numpy as np
import xarray as xr

from simcore.report.quantities import Axis, axes_of, coordinates_at

HELD, FELL, FAILED = "held", "fell", "failed"

MARKS = {HELD: "✓", FELL: "✕", FAILED: "!"}
"""Sign of each verdict, so that none is told by colour alone."""


def verdicts_of(ds: xr.Dataset) -> xr.DataArray:
    """Return "held", "fell" or "failed" for each candidate, on the axes of the study.

    A simulation that ended early has failed, whatever it had shown until then.
    """
    simulated = (ds["status"] == "ok") & ds["fell"].notnull()
    return xr.where(simulated, xr.where(ds["fell"] > 0.5, FELL, HELD), FAILED).transpose(
        *ds["candidate"].dims
    )


@dataclass(frozen=True)
class Run:
    """Neighbouring values of an axis with one verdict, failures between them left out."""

    verdict: str
    low: float
    high: float


@dataclass(frozen=True)
class Threshold:
    """Verdicts of one body along one axis, in rising order.

    Attributes
    ----------
    axis : Axis
    runs : tuple of Run
        Empty where every candidate failed.
    failed_count : int
    """

    axis: Axis
    runs: tuple[Run, ...]
    failed_count: int

    @property
    def between(self) -> tuple[float, float] | None:
        """The two values that a single threshold lies between; None without exactly one."""
        return (self.runs[0].high, self.runs[1].low) if len(self.runs) == 2 else None

    @property
    def text(self) -> str:
        """The threshold in words: "falls at 5° and below, holds from 6°"."""
        sentence = self._text()
        if self.failed_count and self.runs:
            sentence += f" ({self.failed_count} failed, not counted)"
        return sentence

    def _text(self) -> str:
        show = self.axis.text
        if not self.runs:
            return "no verdict: every simulation failed"
        if len(self.runs) == 1:
            (run,) = self.runs
            verb = "holds" if run.verdict == HELD else "falls"
            if run.low == run.high:
                return f"{verb} at {show(run.low)}, the only value with a verdict"
            return f"{verb} at every value from {show(run.low)} to {show(run.high)}"
        if self.between:
            low, high = map(show, self.between)
            if self.runs[0].verdict == FELL:
                return f"falls at {low} and below, holds from {high}"
            return f"holds up to {low}, falls from {high}"
        parts = [
            f"{'holds' if run.verdict == HELD else 'falls'} "
            + (f"at {show(run.low)}" if run.low == run.high
               else f"from {show(run.low)} to {show(run.high)}")
            for run in self.runs
        ]
        return "no single threshold: " + ", ".join(parts)


def threshold_axis(ds: xr.Dataset) -> Axis | None:
    """Return the first numeric axis with several values, or None."""
    for axis in axes_of(ds):
        if axis.numeric and len(axis.values) > 1:
            return axis
    return None


def threshold_of(ds: xr.Dataset, fixed: dict) -> Threshold | None:
    """Return the threshold along the first numeric axis, every other axis fixed by value."""
    axis = threshold_axis(ds)
    if axis is None:
        return None
    line = verdicts_of(ds).sel({name: value for name, value in fixed.items() if name != axis.name})
    pairs = sorted(zip(axis.values, line.values.tolist(), strict=True))
    told = [(value, verdict) for value, verdict in pairs if verdict != FAILED]
    runs = []
    for verdict, group in groupby(told, key=lambda pair: pair[1]):
        values = [value for value, _ in group]
        runs.append(Run(verdict, values[0], values[-1]))
    return Threshold(axis, tuple(runs), len(pairs) - len(told))


def best_design(ds: xr.Dataset) -> dict | None:
    """Return the coordinates, body left out, whose least fall margin over the bodies is largest.

    A body whose simulation failed counts as the worst. None where nothing was simulated.
    """
    margin = ds["fall_margin"].where(verdicts_of(ds) != FAILED)
    if margin.isnull().all():
        return None
    # Prefer designs that failed for no body, then the least margin.
    worst = margin.min("body").where(margin.notnull().all("body"), margin.min("body") - 1e6)
    return _place_of_least(ds, -worst)


def best_candidate(ds: xr.Dataset, body: str) -> dict | None:
    """Return the coordinates of the body's largest fall margin, or None if all failed."""
    return _extreme(ds, body, -ds["fall_margin"], FELL, HELD)


def gentlest_candidate(ds: xr.Dataset, body: str) -> dict | None:
    """Return the coordinates of the lowest peak pressure among those that held the body."""
    return _extreme(ds, body, ds["peak_pressure"], HELD)


def gentlest_design(ds: xr.Dataset) -> dict | None:
    """Return the coordinates, body left out, whose highest peak pressure over the bodies is least.

    Only designs that hold every body count. None where there is no such design.
    """
    worst = ds["peak_pressure"].max("body").where(holds_every_body(ds))
    return None if worst.isnull().all() else _place_of_least(ds, worst)


def holds_every_body(ds: xr.Dataset) -> xr.DataArray:
    """Return for each design, on the axes without body, whether it held every body."""
    return (verdicts_of(ds) == HELD).all("body")


def _extreme(ds: xr.Dataset, body: str, cost: xr.DataArray, *verdicts: str) -> dict | None:
    allowed = verdicts_of(ds).isin(verdicts) & (ds["body"] == body)
    cost = cost.where(allowed).transpose(*ds["candidate"].dims)
    if cost.isnull().all():
        return None
    return coordinates_at(ds, np.unravel_index(np.nanargmin(cost.values), cost.shape))


def _place_of_least(ds: xr.Dataset, cost: xr.DataArray) -> dict:
    """Return axis name → value (plain Python) where a cost on the axes without body is least."""
    index = np.unravel_index(np.nanargmin(cost.values), cost.shape) if cost.ndim else ()
    return {
        str(name): ds[name].values[i].item() if isinstance(ds[name].values[i], np.generic)
        else ds[name].values[i]
        for name, i in zip(cost.dims, index, strict=True)
    }
