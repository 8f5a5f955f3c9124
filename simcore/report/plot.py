"""Dataset → one metric for print: over one axis bodies as series, over two as heat maps."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from simcore.dataset import open_results
from simcore.drawing import Axes, Drawing, nice_ticks
from simcore.errors import DesignError
from simcore.export.whole_file import write_whole
from simcore.report.charts import DASHES, MARKERS, SERIES_COLOURS
from simcore.report.plot_maps import draw_maps
from simcore.report.quantities import (
    QUANTITIES,
    SYMBOLS,
    Axis,
    Quantity,
    axes_of,
    number_text,
    place_text,
)
from simcore.report.verdicts import FAILED, FELL, HELD, best_design, verdicts_of

WIDTH, HEIGHT = 640.0, 420.0
LEFT, RIGHT, TOP, BOTTOM = 76.0, 24.0, 72.0, 62.0
"""Margins around the axes [px]."""

LEGEND_STEP = 7.3
"""Width of a letter in the legend [px]."""

LEGEND_ROW = 20.0
"""Height of a line of the legend [px]."""

FLAT = 0.1
"""Values that differ by less than this share of the greatest are not shown from 0."""

FORMATS = {".svg": Drawing.to_svg, ".png": Drawing.to_png}


def plot_metric(
    ds: xr.Dataset, metric: str, along: Sequence[str], fixed: dict, suffix: str
) -> bytes:
    """Return a picture of a metric over one or two axes of a study.

    Parameters
    ----------
    ds : xr.Dataset
        Of a study.
    metric : str
        A variable with one figure a candidate.
    along : sequence of str
        Names of one axis for lines, of two for maps; by default, if it is empty, as in the report:
        the two of most values, or the one that has several.
    fixed : dict
        Axis → value; other axes of several values are as in the best design.
    suffix : str
        ".png" or ".svg".

    Raises
    ------
    DesignError
        No such metric, axis, value or suffix, or nothing to draw.
    """
    if suffix not in FORMATS:
        raise DesignError(f"--out: {suffix or 'no ending'}; accepted: {', '.join(FORMATS)}")
    quantity = _quantity(ds, metric)
    axes = {each.name: each for each in axes_of(ds)}
    chosen = _chosen(axes, along, fixed)
    fixed = _fixed(ds, axes, chosen, fixed)
    part = ds.sel(fixed)
    shown = part[metric].where(verdicts_of(ds).sel(fixed) != FAILED)
    if shown.isnull().all():
        raise DesignError(f"{metric}: no candidate there has it")
    where = place_text(tuple(axes.values()), fixed)
    title = quantity.title + (f", {where}" if where else "")
    draw = draw_maps if len(chosen) == 2 else _draw
    return FORMATS[suffix](draw(part, metric, quantity, *chosen, title))


def _quantity(ds: xr.Dataset, metric: str) -> Quantity:
    dims = ds["candidate"].dims
    metrics = [name for name, each in ds.data_vars.items()
               if each.dims == dims and each.dtype.kind == "f"]
    if metric not in metrics:
        raise DesignError(f"{metric}: no metric with a figure a candidate; accepted: "
                          + ", ".join(metrics))
    told = ds[metric].attrs
    title = told.get("long_name", metric.replace("_", " "))
    unit = SYMBOLS.get(told.get("units", "1"), told.get("units", "1"))
    return QUANTITIES.get(metric) or Quantity(title[:1].upper() + title[1:], unit, 1.0, 3)


def _chosen(axes: dict[str, Axis], names: Sequence[str], fixed: dict) -> list[Axis]:
    """Return the axes of the picture, the one of more values first."""
    for name in names:
        if name not in axes:
            raise DesignError(f"--axis {name}: no axis; accepted: {', '.join(axes)}")
    if len(names) > 2 or len(set(names)) < len(names):
        raise DesignError(f"--axis {' --axis '.join(names)}: accepted: one axis, or two others")
    free = [axes[name] for name in names] or [
        each for key, each in axes.items()
        if key not in fixed and key != "body" and len(each.values) > 1
    ]
    chosen = sorted(free, key=lambda each: -len(each.values))[:2]
    return chosen or [next((each for key, each in axes.items() if key not in (*fixed, "body")),
                           axes["body"])]


def _fixed(ds: xr.Dataset, axes: dict[str, Axis], chosen: list[Axis], fixed: dict) -> dict:
    shown = [each.name for each in chosen]
    for name, value in fixed.items():
        if name not in axes or name in shown:
            others = ", ".join(each for each in axes if each not in shown)
            raise DesignError(f"--set {name}: cannot be fixed; accepted: {others}")
        if value not in axes[name].values:
            raise DesignError(f"--set {name}={value}: not in the study; accepted: "
                              + ", ".join(map(str, axes[name].values)))
    best = best_design(ds) or {}
    return {
        name: fixed.get(name, best.get(name, each.values[0])) for name, each in axes.items()
        if name not in shown and (name != "body" or name in fixed)
    }


def _draw(part: xr.Dataset, metric: str, quantity: Quantity, axis: Axis, title: str) -> Drawing:
    verdicts = verdicts_of(part)
    values = quantity.factor * part[metric].where(verdicts != FAILED)
    bodies = part["body"].values.tolist() if "body" in part.dims and axis.name != "body" else [""]
    series = [
        (body, (values.sel(body=body) if body else values).values,
         (verdicts.sel(body=body) if body else verdicts).values)
        for body in bodies
    ]
    signs = [each for each in (HELD, FELL) if values.where(verdicts == each).notnull().any()]
    entries = _legend(bodies if bodies != [""] else [], signs)
    top = TOP + LEGEND_ROW * (entries[-1][1])
    drawing = Drawing(WIDTH, HEIGHT + top - TOP)
    drawing.text(LEFT, 24, title, 14, bold=True)
    scales = _draw_axes(drawing, axis, quantity, values.values, top)
    places = np.array(_places(axis)[0])
    for index, (_, row, told) in enumerate(series):
        points = np.column_stack([scales.across(places), scales.up(row)])
        order = [i for i in np.argsort(places) if np.isfinite(row[i])]
        if axis.numeric:
            drawing.line(points[order], _colour(index), 2, DASHES[index % len(DASHES)])
        for i in order:
            drawing.sign(*points[i], MARKERS[told[i]], _colour(index))
    for index, (x, line, words) in enumerate(entries):
        y = 48 + LEGEND_ROW * line
        if words in signs:
            drawing.sign(x + 8, y, MARKERS[words], "#777777")
            drawing.text(x + 18, y + 4.5, words)
        else:
            dash = DASHES[index % len(DASHES)]
            drawing.line([(x, y), (x + 34, y)], _colour(index), 2, dash)
            drawing.text(x + 40, y + 4.5, words)
    return drawing


def _legend(bodies: list[str], signs: list[str]) -> list[tuple[float, int, str]]:
    """Return place, line and words of each entry, in as many lines as they take."""
    entries, x, line = [], LEFT, 0
    for words in (*bodies, *signs):
        width = LEGEND_STEP * len(words) + (32 if words in signs else 56)
        if x + width > WIDTH and x > LEFT:
            x, line = LEFT, line + 1
        entries.append((x, line, words))
        x += width
    return entries


def _draw_axes(
    drawing: Drawing, axis: Axis, quantity: Quantity, values: np.ndarray, top: float
) -> Axes:
    """Draw both axes of values in shown units with ticks and labels, and return them."""
    places, x_ticks = _places(axis)
    finite = values[np.isfinite(values)]
    spread = np.ptp(finite) > FLAT * np.abs(finite).max()
    y_ticks = nice_ticks(np.append(finite, 0) if spread else finite)
    gap = 0.04 * np.ptp(places) or 0.5 if axis.numeric else 0.5
    axes = Axes(LEFT, WIDTH - RIGHT, top, drawing.height - BOTTOM,
                (min(places) - gap, max(places) + gap), (y_ticks[0], y_ticks[-1]))
    axes.draw(drawing, x_ticks, [(y, number_text(float(y))) for y in y_ticks],
              axis.label, quantity.label)
    return axes


def _colour(index: int) -> str:
    return SERIES_COLOURS[index % len(SERIES_COLOURS)]


def _places(axis: Axis) -> tuple[list[float], list[tuple[float, str]]]:
    """Return where the axis' values lie, and place and text of each of its ticks."""
    if not axis.numeric:
        return list(range(len(axis.values))), list(enumerate(axis.ticks))
    if axis.geometric:
        places = np.log10(np.array(axis.shown, float)).tolist()
        return places, sorted(zip(places, axis.ticks, strict=True))
    places = [float(value) for value in axis.shown]
    if len(places) <= 8:
        return places, sorted(zip(places, axis.ticks, strict=True))
    ticks = nice_ticks(np.array(places))
    inside = [tick for tick in ticks if min(places) - 1e-9 <= tick <= max(places) + 1e-9]
    return places, [(float(tick), number_text(float(tick))) for tick in inside]


def write_plot(
    dataset: Path, metric: str, along: Sequence[str], fixed: dict, out: Path
) -> None:
    """Write `plot_metric` of a dataset's file; whole or not at all."""
    write_whole(out, plot_metric(open_results(dataset), metric, along, fixed, out.suffix.lower()))
