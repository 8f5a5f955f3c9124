"""Dataset → pressure, shear, contact area and load by body region, left beside right."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from simcore.region_metrics import CONTACT_PRESSURE
from simcore.report.quantities import NOT_KNOWN, QUANTITIES

COLUMNS = {
    "region_peak_pressure": "peak_pressure",
    "region_peak_shear": "peak_shear",
    "region_contact_area": "contact_area",
    "region_load": "",
}
"""Figures of a region, and the same of all skin; the load of that is the sum."""


@dataclass(frozen=True)
class Line:
    """A region as shown: of each figure one cell, or those of left and right."""

    title: str
    cells: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class RegionTable:
    """The regions of a candidate that a sensor would notice.

    Attributes
    ----------
    head : tuple of str
        Figure and unit of each pair of columns.
    lines : tuple of Line
        All skin last.
    slipping : str
        Which share of the load slips, in words; empty where friction knows no µ.
    """

    head: tuple[str, ...]
    lines: tuple[Line, ...]
    slipping: str


def region_table(figures: xr.Dataset) -> RegionTable | None:
    """Return the table of one candidate; None where no region was pressed.

    Left out are regions whose pressure never reaches what counts as contact.
    """
    pressed = figures["region_peak_pressure"] > CONTACT_PRESSURE
    if not pressed.any():
        return None
    groups: dict[str, list[str]] = {}
    for name in figures["region"].values.tolist():
        groups.setdefault(name.removesuffix("_left").removesuffix("_right"), []).append(name)
    lines = [
        Line(
            title.replace("_", " ").capitalize(),
            tuple(
                tuple(_text(column, figures[column].sel(region=name).item()) for name in names)
                for column in COLUMNS
            ),
        )
        for title, names in groups.items()
        if pressed.sel(region=names).any()
    ]
    whole = (
        figures[total].item() if total else figures[column].sum(skipna=False).item()
        for column, total in COLUMNS.items()
    )
    lines.append(
        Line("All skin", tuple((_text(*each),) for each in zip(COLUMNS, whole, strict=True)))
    )
    head = tuple(QUANTITIES[column].label for column in COLUMNS)
    return RegionTable(head, tuple(lines), _slipping(figures))


def _text(column: str, value: float) -> str:
    """Return a figure without the unit, which is in the head."""
    quantity = QUANTITIES[column]
    return quantity.text(value).removesuffix(quantity.unit).rstrip()


def _slipping(figures: xr.Dataset) -> str:
    share, at_rest = figures["slip_share"].item(), figures["rest_slip_share"].item()
    if np.isnan(share):
        return ""
    text = f"{QUANTITIES['slip_share'].text(share)} of the load slipped while supported"
    rest = QUANTITIES["rest_slip_share"].text(at_rest)
    return text if rest == NOT_KNOWN else f"{text}, {rest} at rest"
