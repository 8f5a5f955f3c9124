"""Dataset → certificates as shown: what changed at half the step and on twice the mesh."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from simcore.certificate import (
    ABSOLUTE,
    FIGURES,
    change_text,
    figures_of,
    passes,
    tolerance_text,
)
from simcore.config import VARIANTS
from simcore.metrics import METRICS, STATUS
from simcore.report.quantities import NOT_KNOWN, QUANTITIES, axes_of, coordinates_at, place_text
from simcore.report.verdicts import MARKS, verdicts_of

CERTIFICATES_MAX = 100
"""Certificates that the page shows; more are left to the dataset."""

VARIANT_TITLES = {
    "half_step": "Half the step",
    "twice_skin": "Twice the skin",
    "twice_device": "Twice the device",
}

WORDS = {"fell": ("Body fell", ("no", "yes")), "settled": ("Settled", ("no", "yes"))}
"""Metrics that are shown as words, and their titles."""


@dataclass(frozen=True)
class Line:
    """A metric of a certificate: its value, and a change with its mark for each variant."""

    title: str
    value: str
    changes: tuple[str, ...]
    flags: tuple[bool, ...]
    tolerance: str


@dataclass(frozen=True)
class Certificate:
    """The certificate of one candidate as shown; no reason where it passed."""

    place: str
    verdict: str
    mark: str
    reason: str
    lines: tuple[Line, ...]


def certificates_of(ds: xr.Dataset) -> list[Certificate]:
    """Return the certificates of a study in its order, at most `CERTIFICATES_MAX`."""
    axes, verdicts = axes_of(ds), verdicts_of(ds)
    certified = np.argwhere(ds["certified"].notnull().values)[:CERTIFICATES_MAX]
    certificates = []
    for index in map(tuple, certified.tolist()):
        figures = ds.isel(dict(zip(verdicts.dims, index, strict=True)))
        verdict = verdicts.values[index]
        certificates.append(
            Certificate(
                place_text(axes, coordinates_at(ds, index)),
                verdict,
                MARKS[verdict],
                doubt_of(figures),
                tuple(_line(figures, name) for name in figures_of(figures, figures)
                      if name in QUANTITIES or name in WORDS),
            )
        )
    return certificates


def doubt_of(figures: xr.Dataset) -> str:
    """Return why the certificate of one candidate failed; empty if it passed or there is none."""
    reason = figures["certificate_reason"].item()
    for name in (*VARIANTS, *FIGURES, *STATUS):  # a failure's own words may name keys
        reason = reason.replace(name, name.replace("_", " "))
    return reason


def certificate_tile(ds: xr.Dataset) -> tuple:
    """Return the figure of trust of all certificates: title, value, note, and if all passed."""
    certified = ds["certified"].values[ds["certified"].notnull().values]
    total, passed = certified.size, int(certified.sum())
    left = ds["certified"].size - total
    if not total:
        note = "this study asks for none (its key certify)"
        return "Certificates passed", NOT_KNOWN, note, None
    note = "at half the step, twice the skin and twice the device's mesh" + (
        f"; {left} candidates have no certificate" if left else ""
    )
    return "Certificates passed", f"{passed} of {total}", note, passed == total


def _line(figures: xr.Dataset, name: str) -> Line:
    value = figures[name].item()
    changes = figures["change"].sel(metric=name).values.tolist()
    return Line(
        _title(name),
        WORDS[name][1][int(value)] if name in WORDS else QUANTITIES[name].text(value),
        tuple(_shown(name, change) for change in changes),
        tuple(not passes(name, change) for change in changes),
        tolerance_text(name),
    )


def _shown(name: str, change: float) -> str:
    """Return a change as read, in the unit of the value where it is a difference."""
    quantity = QUANTITIES.get(name)
    if quantity and METRICS[name].units in ABSOLUTE and quantity.unit and np.isfinite(change):
        text = quantity.text(change)
        if quantity.unit == "%":  # of the energy, the load: not of the value
            text = text.replace("%", "points")
        nothing = round(quantity.factor * change, quantity.digits) == 0
        return text.removeprefix("−") if nothing else f"{'+' * (change > 0)}{text}"
    return change_text(name, change)


def _title(name: str) -> str:
    return WORDS[name][0] if name in WORDS else QUANTITIES[name].title
