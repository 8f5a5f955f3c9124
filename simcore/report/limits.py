"""Dataset → what each candidate leaves of the limits that it is compared with."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr

from simcore.dynamics.joint_angles import joint_ranges
from simcore.report.quantities import QUANTITIES, axes_of, coordinates_at, place_text
from simcore.report.verdicts import MARKS, verdicts_of

ROUNDING = 1e-6
"""A limit is exceeded by more than this: a lift at the very limit is not over it."""

ROWS_MAX = 1000
"""Candidates of the table; more are left to the dataset."""

MARGIN = QUANTITIES["joint_range_margin"]


@dataclass(frozen=True, eq=False)
class Limit:
    """A limit, and what the candidates of a study leave of it.

    Attributes
    ----------
    title, value, known, source : str
        The limit in words, its value with unit, how sure it is, and where it is from.
    margin : xr.DataArray
        On the axes of the study.
    parts : xr.DataArray or None
        The same by body region or joint, whose least it is.
    """

    title: str
    value: str
    known: str
    source: str
    margin: xr.DataArray
    parts: xr.DataArray | None

    @property
    def per(self) -> str:
        """What the parts are: "region" or "joint", or nothing."""
        return self.parts.dims[-1] if self.parts is not None else ""

    def worst_part(self, index: tuple[int, ...]) -> str:
        """Return the part of least margin of the candidate at an index of the grid, in words.

        Empty where there is none.
        """
        if self.parts is None or np.isnan(self.margin.values[index]):
            return ""
        worst = np.nanargmin(self.parts.values[index])
        return str(self.parts[self.per].values[worst]).replace("_", " ")


@dataclass(frozen=True)
class Line:
    """A limit as shown: what it is, how many candidates are over it, and where most."""

    title: str
    value: str
    known: str
    source: str
    over: str
    least: str
    where: str


@dataclass(frozen=True)
class Row:
    """A candidate as shown: its margins in the order of `columns_of`, and which are negative."""

    place: tuple[str, ...]
    verdict: str
    mark: str
    figures: tuple[str, ...]
    flags: tuple[bool, ...]


def limits_of(ds: xr.Dataset) -> list[Limit]:
    """Return the limits that any candidate is compared with."""
    found = [
        _limit(margin, ds.get(f"region_{name}"))
        for name, margin in ds.data_vars.items()
        if "limit" in margin.attrs and margin.dims == ds["candidate"].dims
    ]
    joints = ds["joint_range_margin"]
    ranges = joint_ranges().values()
    read = "read" if all(each.confidence == "R" for each in ranges) else "unverified in part"
    found.append(
        Limit("Range of each joint", "its ends", read, "docs/physics.md, passive joints",
              joints.min("joint"), joints)
    )
    return [limit for limit in found if limit.margin.notnull().any()]


def over_counts(ds: xr.Dataset) -> xr.DataArray:
    """Return how many limits each candidate is over, on the axes of the study."""
    none = xr.zeros_like(ds["fall_margin"], dtype=int)
    return sum((_over(limit) for limit in limits_of(ds)), none)


def lines_of(ds: xr.Dataset) -> list[Line]:
    """Return each limit as shown."""
    return [_line(ds, limit) for limit in limits_of(ds)]


def columns_of(ds: xr.Dataset) -> list[tuple[str, ...]]:
    """Return heading, limit and doubts of each figure of `rows_of`."""
    columns = []
    for limit, last in _with_ends(limits_of(ds)):
        columns.append((limit.title, limit.value, *[limit.known] * (limit.known != "read")))
        if last:
            columns.append((f"{limit.per.capitalize()} of the least",))
    return columns


def rows_of(ds: xr.Dataset) -> list[Row]:
    """Return a row for each candidate, at most `ROWS_MAX`, in the order of the study."""
    axes, verdicts, limits = axes_of(ds), verdicts_of(ds), _with_ends(limits_of(ds))
    rows = []
    for index in list(np.ndindex(verdicts.shape))[:ROWS_MAX]:
        place = coordinates_at(ds, index)
        verdict = verdicts.values[index]
        figures, flags = [], []
        for limit, last in limits:
            value = limit.margin.values[index]
            figures.append(MARGIN.text(value))
            flags.append(bool(value < -ROUNDING))
            if last:
                figures.append(limit.worst_part(index))
                flags.append(False)
        rows.append(
            Row(tuple(axis.text(place[axis.name]) for axis in axes), verdict, MARKS[verdict],
                tuple(figures), tuple(flags))
        )
    return rows


def _limit(margin: xr.DataArray, parts: xr.DataArray | None) -> Limit:
    told = margin.attrs
    title = told["limit"][0].upper() + told["limit"][1:]
    if "exposure_s" in told:
        title += f", {told['exposure_s'] / 60:g} min"
    known = told["verified"] + ", extrapolated" * (told["extrapolated"] == "yes")
    value = QUANTITIES[told["metric"]].text(told["limit_value"])
    return Limit(title, value, known, told["source"], margin, parts)


def _line(ds: xr.Dataset, limit: Limit) -> Line:
    values = limit.margin.values
    index = np.unravel_index(np.nanargmin(values), values.shape)
    place = coordinates_at(ds, index)
    alike = values.size > 1 and np.nanmax(values) - np.nanmin(values) < ROUNDING
    where = ["all alike" if alike else place_text(axes_of(ds), place), limit.worst_part(index)]
    return Line(
        limit.title, limit.value, limit.known, limit.source,
        f"{int(_over(limit).sum())} of {int(np.isfinite(values).sum())}",
        MARGIN.text(values[index]), ": ".join(filter(None, where)),
    )


def _over(limit: Limit) -> xr.DataArray:
    return limit.margin < -ROUNDING


def _with_ends(limits: list[Limit]) -> list[tuple[Limit, bool]]:
    """Return each limit, and whether it is the last of those with the same kind of parts."""
    kinds = [*(limit.per for limit in limits), ""]
    return [
        (limit, bool(kind) and kind != after)
        for limit, (kind, after) in zip(limits, pairwise(kinds), strict=True)
    ]
