"""Dataset → figures that tell whether the results can be trusted, candidate by candidate."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from simcore.body.regions import REGION_NAMES
from simcore.certificate import FIGURES
from simcore.errors import DesignError
from simcore.metrics import JOINTS, METRICS
from simcore.report.certificates import certificate_tile, doubt_of
from simcore.report.physics import device_kinds
from simcore.report.quantities import NOT_KNOWN, QUANTITIES, axes_of, coordinates_at
from simcore.report.verdicts import FAILED, HELD, MARKS, verdicts_of

SUPPORT_RATIO = (0.99, 1.01)
"""At rest the support carries the weight, within these bounds."""

SPREAD_MAX = 0.02
"""At rest the support force hardly changes: so much of the weight, as a standard deviation."""

ENERGY_MAX = 0.01
"""Energy that no account explains stays below so much of the energy exchanged."""

ROWS_MAX = 1000
"""Rows of the table; more are left to the dataset."""


@dataclass(frozen=True)
class Row:
    """One candidate, every figure as shown.

    Attributes
    ----------
    place : tuple of str
        Coordinates in the order of the axes.
    verdict, mark : str
    figures : tuple of str
        In the order of `columns_of`.
    flags : tuple of bool
        Which of the figures are out of bounds.
    doubt : str
        Why its certificate failed; empty without that.
    note : str
    """

    place: tuple[str, ...]
    verdict: str
    mark: str
    figures: tuple[str, ...]
    flags: tuple[bool, ...]
    doubt: str
    note: str

    @property
    def empty(self) -> bool:
        """Whether there is no figure at all, so that the note can stand in their place."""
        return set(self.figures) == {NOT_KNOWN}


METRIC_COLUMNS = {
    "fall_margin": "Fall margin",
    "peak_pressure": "Peak pressure",
    "lying_peak_pressure": "Peak before the start",
    "peak_shear": "Peak shear",
    "slip_share": "Load that slips",
    "peak_edge_distance": "Peak from the edge",
    "peak_strap_force": "Strap tension",
    "slide_distance": "Slide",
    "support_force_ratio": "Support force / weight",
    "support_force_spread": "Unsteady by",
    "max_penetration": "Deepest penetration",
    "energy_residual": "Energy unexplained",
}
"""Metrics of the table and their headings; left out where no candidate has one."""

OTHER_COLUMNS = ("Settled", "Real-time factor")


def columns_of(ds: xr.Dataset) -> tuple[str, ...]:
    """Return the headings of the figures of `trust_rows`."""
    return (*(METRIC_COLUMNS[name] for name in _metrics_of(ds)), *OTHER_COLUMNS)


def fill_missing(ds: xr.Dataset) -> tuple[xr.Dataset, list[str]]:
    """Return a dataset with all that this version has, and in words what it lacked: that is NaN.

    Raises
    ------
    DesignError
        It has no verdicts.
    """
    absent = [name for name in ("status", "reason", "candidate", "fell") if name not in ds]
    if absent:
        raise DesignError(f"dataset: has no {absent[0]}; run the sweep again")
    dims, told = ds["candidate"].dims, []
    parts = {"region": REGION_NAMES, "joint": JOINTS}
    ds = ds.assign_coords({dim: list(names) for dim, names in parts.items() if dim not in ds.dims})
    for name, metric in METRICS.items():
        if name not in ds:
            wanted = (*dims, metric.per) if metric.per else dims
            ds[name] = (wanted, np.full([ds.sizes[dim] for dim in wanted], np.nan))
            told.append(metric.long_name)
    if "metric" in ds.dims:  # of certificates: of metrics since added, no change is known
        ds = ds.reindex(metric=list(FIGURES))
    if "certified" not in ds:
        shape = [ds.sizes[dim] for dim in dims]
        ds["certified"] = (dims, np.full(shape, np.nan))
        ds["certificate_reason"] = (dims, np.full(shape, "", dtype=object))
        told.append("certificates")
    if not any("limit" in each.attrs for each in ds.data_vars.values()):
        told.append("margins to limits")
    return ds, told


def trust_rows(ds: xr.Dataset) -> list[Row]:
    """Return a row for each candidate, at most `ROWS_MAX`, in the order of the study."""
    axes, verdicts, metrics = axes_of(ds), verdicts_of(ds), _metrics_of(ds)
    rows = []
    for index in np.ndindex(verdicts.shape):
        if len(rows) == ROWS_MAX:
            break
        figures = ds.isel(dict(zip(verdicts.dims, index, strict=True)))
        coordinates = coordinates_at(ds, index)
        verdict = verdicts.values[index]
        status, reason = figures["status"].item(), figures["reason"].item()
        rows.append(
            Row(
                tuple(axis.text(coordinates[axis.name]) for axis in axes),
                verdict,
                MARKS[verdict],
                *_figures(figures, metrics),
                doubt_of(figures),
                f"{status.replace('_', ' ')}: {reason}" if status != "ok" else "",
            )
        )
    return rows


def trust_summary(ds: xr.Dataset) -> list[dict]:
    """Return the study's figures of trust: title, value, what is expected, and if it is so."""
    verdicts = verdicts_of(ds)
    good, held = verdicts != FAILED, verdicts == HELD
    ratio = _values(ds["support_force_ratio"].where(held))
    outside = int(((ratio < SUPPORT_RATIO[0]) | (ratio > SUPPORT_RATIO[1])).sum())
    spread = _values(ds["support_force_spread"].where(held))
    steady = int((spread <= SPREAD_MAX).sum())
    has_sheet = "sling_lift" in device_kinds(ds)
    counted = "; the sheet's weight counted" if has_sheet else ""
    depth, settled = _values(ds["max_penetration"].where(good)), _values(ds["settled"].where(good))
    speed = _values((ds["simulated_time"] / ds["cpu_time"]).where(good))
    energy = _values(ds["energy_residual"].where(good))
    balanced = int((energy <= ENERGY_MAX).sum())
    failed = int((~good).sum())
    tiles = [
        ("Support force over weight, at rest", _range(ratio, "support_force_ratio"),
         f"{len(ratio) - outside} of {len(ratio)} held candidates within "
         f"{SUPPORT_RATIO[0]}–{SUPPORT_RATIO[1]}{counted}", outside == 0 and len(ratio) > 0),
        ("Unsteadiness of the support force", _range(spread, "support_force_spread"),
         f"standard deviation in time over weight, at rest; {steady} of {len(spread)} held "
         f"candidates up to {SPREAD_MAX}", steady == len(spread) > 0),
        ("Deepest penetration", _range(depth, "max_penetration"),
         f"of {'bed or sheet' if has_sheet else 'the device'} into the skin, while supported",
         None),
        ("Energy unexplained", _range(energy, "energy_residual"),
         f"of the energy exchanged; {balanced} of {len(energy)} candidates up to "
         f"{ENERGY_MAX:.0%}" if len(energy) else "explicit steps keep no accounts of energy",
         balanced == len(energy) if len(energy) else None),
        ("Settled before the device moved", f"{int(settled.sum())} of {len(settled)}",
         "the rest still moved when the device started", bool(len(settled) and settled.all())),
        ("Failed simulations", f"{failed} of {verdicts.size}",
         "listed below with the reason" if failed else "every simulation ran to its end",
         failed == 0),
        ("Real-time factor", f"{np.median(speed):.2f}" if len(speed) else "–",
         "simulated seconds per processor second, median", None),
        certificate_tile(ds),
    ]
    return [dict(zip(("title", "value", "note", "good"), tile, strict=True)) for tile in tiles]


def _metrics_of(ds: xr.Dataset) -> list[str]:
    """Return the metrics that have a column: a lift without a sheet has no strap."""
    return [name for name in METRIC_COLUMNS if ds[name].notnull().any()]


def _figures(
    figures: xr.Dataset, metrics: list[str]
) -> tuple[tuple[str, ...], tuple[bool, ...]]:
    values = {name: figures[name].item() for name in metrics}
    settled, speed = (
        figures["settled"].item(), (figures["simulated_time"] / figures["cpu_time"]).item()
    )
    bounds = {
        "support_force_ratio": SUPPORT_RATIO, "support_force_spread": (0, SPREAD_MAX),
        "energy_residual": (0, ENERGY_MAX),
    }
    out_of_bounds = [
        name in bounds and np.isfinite(value)
        and not bounds[name][0] <= value <= bounds[name][1]
        for name, value in values.items()
    ]
    shown = (
        *(QUANTITIES[name].text(value) for name, value in values.items()),
        NOT_KNOWN if np.isnan(settled) else "yes" if settled else "no",
        NOT_KNOWN if np.isnan(speed) else f"{speed:.2f}",
    )
    return shown, (*out_of_bounds, settled == 0, False)


def _values(column: xr.DataArray) -> np.ndarray:
    return column.values[np.isfinite(column.values)]


def _range(values: np.ndarray, name: str) -> str:
    if not len(values):
        return "–"
    quantity = QUANTITIES[name]
    low, high = quantity.text(values.min()), quantity.text(values.max())
    return low if low == high else f"{low.removesuffix(quantity.unit).rstrip()} to {high}"
