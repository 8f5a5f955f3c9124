"""Certificates: does a result stand at half the step, and on twice the mesh?"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

from simcore.config import VARIANTS, Candidate, Study, variants_of
from simcore.metrics import METRICS
from simcore.simulate import Progress
from simcore.sweep import run_candidate

FIGURES = tuple(
    name for name, metric in METRICS.items() if metric.per is None and name != "cpu_time"
)
"""Metrics whose change is told: the scalar ones; what a run costs is no result."""

# Here and not among the metrics, because a tolerance judges a result and does not decide it:
# another one leaves every simulation as it is.
TOLERANCES = {
    "fell": 0.0,
    "fall_margin": 0.05,
    "peak_pressure": 0.05,
    "contact_area": 0.05,
    "support_force_ratio": 0.01,
}
"""Greatest change with which a metric passes; the others are told and not judged."""
# ASSUME: finer than the differences that designs are chosen by; no source states such bounds.

ABSOLUTE = ("1", "rad")
"""Units in which a change is a difference; any other metric's is relative to its value."""

FLAGS = ("fell", "settled")
"""Metrics that are 0 or 1."""


def change_of(name: str, value: float, refined_value: float) -> float:
    """Return the change of a metric from its value to that of a variant.

    Infinite where one of them does not exist, or it grew from nothing; 0 where neither exists.
    """
    if np.isnan(value) or np.isnan(refined_value):
        return 0.0 if np.isnan(value) and np.isnan(refined_value) else np.inf
    change = refined_value - value
    if METRICS[name].units in ABSOLUTE or change == 0:
        return float(change)
    return float(change / abs(value)) if value else float(np.copysign(np.inf, change))


def change_text(name: str, change: float) -> str:
    """Return a change as it is read: "+3.1 %", or the difference in the metric's unit.

    A dash for a variant that failed.
    """
    if np.isnan(change):
        return "–"
    if np.isinf(change):
        return "appears or vanishes"
    if name in FLAGS:
        return "changes" if change else "same"
    units = METRICS[name].units
    if units not in ABSOLUTE:
        return f"{_signed(100 * change, 1)} %"
    return f"{_signed(change, 3)}{' rad' * (units == 'rad')}"


def figures_of(figures: xr.Dataset, certificate: xr.Dataset) -> list[str]:
    """Return the metrics that exist in a candidate, or in one of its variants."""
    return [
        name for name in FIGURES
        if np.isfinite(figures[name].item())
        or np.nan_to_num(certificate["change"].sel(metric=name).values).any()
    ]  # fmt: skip


def _signed(value: float, digits: int) -> str:
    """Return a number with its sign, which 0 has none of."""
    text = f"{value:+.{digits}f}"
    return text.replace("-", "−") if float(text) else text[1:]


def tolerance_text(name: str) -> str:
    """Return the tolerance of a metric as it is read; empty without one."""
    if name not in TOLERANCES:
        return ""
    tolerance = TOLERANCES[name]
    if METRICS[name].units not in ABSOLUTE:
        return f"± {100 * tolerance:g} %"
    return f"± {tolerance:g}" if tolerance else "the same"


def passes(name: str, change: float) -> bool:
    """Return whether a change is within its tolerance; without one it always is."""
    return name not in TOLERANCES or abs(change) <= TOLERANCES[name]


def compare(figures: xr.Dataset, variants: dict[str, xr.Dataset]) -> xr.Dataset:
    """Return the certificate of one candidate.

    Parameters
    ----------
    figures : xr.Dataset
        The candidate's row.
    variants : dict
        Rows of its variants by name; none of a candidate that is not certified.

    Returns
    -------
    xr.Dataset
        `certified` (1 passed, 0 failed, NaN not certified: nor is a candidate that failed itself),
        `certificate_reason` (why it failed), `change` (metric, variant), NaN for a variant that
        failed, and `variant_candidate` (variant), ids.
    """
    certificate = _blank({})
    if not variants or figures["status"].item() != "ok":
        return certificate
    reasons = []
    for name, row in variants.items():
        certificate["variant_candidate"].loc[name] = row["candidate"].item()
        status = row["status"].item()
        failures = [] if status == "ok" else [f"{status}: {row['reason'].item()}"]
        for metric in FIGURES if status == "ok" else ():
            change = change_of(metric, figures[metric].item(), row[metric].item())
            certificate["change"].loc[metric, name] = change
            if not passes(metric, change):
                failures.append(f"{metric} {change_text(metric, change)}")
        if failures:
            reasons.append(f"{name}: {', '.join(failures)}")
    certificate["certified"][()] = float(not reasons)
    certificate["certificate_reason"][()] = "; ".join(reasons)
    return certificate


def certify(
    candidate: Candidate,
    figures: xr.Dataset,
    root: Path,
    progress: Callable[[str], Progress] | None = None,
) -> xr.Dataset:
    """Simulate the variants of a candidate; return its certificate as `compare` does.

    Parameters
    ----------
    figures : xr.Dataset
        The candidate's row, from `simcore.sweep.run_candidate`. No variant of one that failed is
        simulated.
    progress : callable, optional
        Told the name of a variant before it is simulated, returns who is told the time.

    Raises
    ------
    DesignError
        A mesh of twice the vertices would be larger than its key accepts.
    """
    variants = variants_of(candidate, root)
    if figures["status"].item() != "ok":
        return compare(figures, {})
    return compare(
        figures,
        {
            name: run_candidate(variant, root, progress and progress(name))[0]
            for name, variant in variants.items()
        },
    )


def with_certificates(ds: xr.Dataset, study: Study, rows: xr.Dataset) -> xr.Dataset:
    """Return the dataset of a study with the certificates of its candidates.

    Parameters
    ----------
    rows : xr.Dataset
        From `simcore.dataset.read_tables`: figures of candidates and variants by id.
    """
    blank = _blank({dim: ds.sizes[dim] for dim in ds["candidate"].dims})
    ds = ds.assign_coords(blank.coords).assign(blank.data_vars)
    for candidate in study.candidates:
        variants = study.variants.get(candidate.id, {})
        if variants:
            certificate = compare(
                _row(rows, candidate), {name: _row(rows, each) for name, each in variants.items()}
            )
            for name, variable in certificate.data_vars.items():
                ds[name].loc[candidate.coordinates] = variable
    return ds


def _row(rows: xr.Dataset, candidate: Candidate) -> xr.Dataset:
    return rows.sel(row=candidate.id).rename(row="candidate")


MEANINGS = {
    "certified": "certificate passed, NaN without one",
    "certificate_reason": "variant and metric for which it failed, else empty",
    "change": "change of a metric by a variant, relative if its unit is neither 1 nor rad",
    "variant_candidate": "digest of the variant's design",
}
"""Variables of a certificate; all numbers have unit 1."""


def _blank(sizes: dict[str, int]) -> xr.Dataset:
    """Return the certificates of candidates on axes, none of which is certified."""
    coords = {"metric": list(FIGURES), "variant": list(VARIANTS)}
    sizes = sizes | {name: len(values) for name, values in coords.items()}
    axes = tuple(sizes)[: -len(coords)]
    dims = {
        "certified": axes,
        "certificate_reason": axes,
        "change": (*axes, "metric", "variant"),
        "variant_candidate": (*axes, "variant"),
    }
    ds = xr.Dataset(coords=coords)
    for name, meaning in MEANINGS.items():
        shape = [sizes[dim] for dim in dims[name]]
        if name in ("certified", "change"):
            ds[name] = dims[name], np.full(shape, np.nan), {"units": "1", "long_name": meaning}
        else:
            ds[name] = dims[name], np.full(shape, "", dtype=object), {"long_name": meaning}
    return ds
