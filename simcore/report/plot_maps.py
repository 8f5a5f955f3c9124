"""One metric over two axes as heat maps for print, one map a body, side by side if they fit."""

from itertools import pairwise

import numpy as np
import xarray as xr

from simcore.drawing import Axes, Drawing, nice_ticks
from simcore.report.charts import MARKERS
from simcore.report.quantities import NOT_KNOWN, Axis, Quantity, number_text
from simcore.report.shades import Shades, shades_of
from simcore.report.verdicts import FAILED, FELL, HELD, verdicts_of

PAGE = 640.0
"""Width that two maps side by side may take [px]."""

LETTER = 7.3
"""Width of a letter [px]."""

CELL_WIDTH, CELL_HEIGHT = 48.0, 42.0
"""Least width of a cell, and its height: of a sign above a value [px]."""

MAP_WIDTH = 210.0
"""Least width of a map [px]."""

TOP, BELOW, GAP = 90.0, 62.0, 18.0
"""Above the first map, below each for ticks and label, and between two side by side [px]."""

HEADING = 26.0
"""Height of the name of a body above its map [px]."""

BAR_WIDTH, BAR_ROOM, BAR_STEPS = 14.0, 104.0, 60
"""Of the colour bar; room for it and its label [px]; fields that it is painted of."""


def draw_maps(
    part: xr.Dataset, metric: str, quantity: Quantity, across: Axis, down: Axis, title: str
) -> Drawing:
    """Return the maps of a metric: cells with value and verdict on one scale, and its bar."""
    order = [down.name, across.name]
    verdicts = verdicts_of(part)
    values = quantity.factor * part[metric].where(verdicts != FAILED)
    bodies = part["body"].values.tolist() if "body" in {*values.dims} - {*order} else [None]
    shades = shades_of(metric, quantity, part[metric].where(verdicts != FAILED).values)

    longest = max(map(len, across.ticks))
    width = max(len(across.values) * max(CELL_WIDTH, LETTER * longest + 10), MAP_WIDTH)
    height = len(down.values) * CELL_HEIGHT
    left = 48 + LETTER * max(map(len, down.ticks))
    columns = 2 if len(bodies) > 1 and left + 2 * width + GAP + BAR_ROOM <= PAGE else 1
    rows = -(-len(bodies) // columns)
    right = left + columns * width + (columns - 1) * GAP
    row_height = height + BELOW + HEADING
    page = max(right + BAR_ROOM, 32 + 8.5 * len(title))
    drawing = Drawing(page, TOP + rows * row_height - HEADING)
    drawing.text(24, 26, title, 14, bold=True)
    _draw_legend(drawing, {str(each) for each in np.unique(verdicts.values)})
    for number, body in enumerate(bodies):
        row, column = divmod(number, columns)
        x, y = left + column * (width + GAP), TOP + row * row_height
        axes = Axes(x, x + width, y, y + height, (0, len(across.values)), (0, len(down.values)))
        place = {} if body is None else {"body": body}
        _draw_cells(drawing, axes, values.sel(place).transpose(*order).values,
                    verdicts.sel(place).transpose(*order).values, quantity, shades)
        drawing.text(x, y - 10, body or "", bold=True)
        _draw_ticks(drawing, axes, across, down, column == 0)
    _draw_bar(drawing, right + 22, TOP, TOP + height, quantity, shades)
    return drawing


def _draw_cells(
    drawing: Drawing, axes: Axes, values: np.ndarray, verdicts: np.ndarray,
    quantity: Quantity, shades: Shades,
) -> None:
    """Draw the cells of values (rows, columns) in shown units, the first row at the bottom."""
    for (row, column), value in np.ndenumerate(values):
        x, y = axes.across(column), axes.up(row + 1)
        width, height = axes.across(column + 1) - x, axes.up(row) - y
        middle = x + width / 2
        if not np.isfinite(value):
            words = "failed" if verdicts[row, column] == FAILED else NOT_KNOWN
            drawing.text(middle, y + height / 2 + 4.5, words, 12, "middle", colour="#777777")
            continue
        drawing.area(x + 0.5, y + 0.5, width - 1, height - 1, shades.colour(value))
        ink = shades.ink(value)
        number = quantity.text(value / quantity.factor).removesuffix(quantity.unit).rstrip()
        drawing.sign(middle, y + 12, MARKERS[verdicts[row, column]], ink, 3.5)
        drawing.text(middle, y + 32, number, 12, "middle", colour=ink)


def _draw_ticks(drawing: Drawing, axes: Axes, across: Axis, down: Axis, first: bool) -> None:
    for index, words in enumerate(across.ticks):
        drawing.text(axes.across(index + 0.5), axes.bottom + 18, words, anchor="middle")
    middle = (axes.left + axes.right) / 2
    drawing.text(middle, axes.bottom + 40, across.label, 14, "middle")
    if first:
        for index, words in enumerate(down.ticks):
            drawing.text(axes.left - 8, axes.up(index + 0.5) + 4.5, words, anchor="end")
        drawing.text(24, (axes.top + axes.bottom) / 2, down.label, 14, "middle", turned=True)


def _draw_legend(drawing: Drawing, verdicts: set[str]) -> None:
    x = 24.0
    for verdict in (each for each in (HELD, FELL) if each in verdicts):
        drawing.sign(x + 5, 48, MARKERS[verdict], "#777777")
        drawing.text(x + 16, 52.5, verdict)
        x += LETTER * len(verdict) + 32


def _draw_bar(
    drawing: Drawing, x: float, top: float, bottom: float, quantity: Quantity, shades: Shades
) -> None:
    scale = Axes(x, x + BAR_WIDTH, top, bottom, (0, 1), (shades.low, shades.high))
    steps = np.linspace(shades.low, shades.high, BAR_STEPS + 1)
    for low, high in pairwise(steps):
        drawing.area(x, scale.up(high), BAR_WIDTH, scale.up(low) - scale.up(high) + 0.3,
                     shades.colour((low + high) / 2))
    for tick in nice_ticks(np.array([shades.low, shades.high])):
        if shades.low - 1e-9 <= tick <= shades.high + 1e-9:
            drawing.text(x + BAR_WIDTH + 6, scale.up(tick) + 4.5, number_text(float(tick)), 12)
    drawing.text(x + BAR_WIDTH + 58, (top + bottom) / 2, quantity.label, 13, "middle", turned=True)
