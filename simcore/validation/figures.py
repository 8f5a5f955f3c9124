"""Plots of checks and benchmarks as SVG: small, the same on every machine, for Markdown."""

from pathlib import Path

import numpy as np

from simcore.drawing import Axes, Drawing, nice_ticks
from simcore.validation.table import Curve, Plot

WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 76, 24, 66, 58
"""Margins around the axes [px]."""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Okabe & Ito."""

LETTER = 7.3
"""Width of a letter of the legend [px]."""


def write_plot(plot: Plot, folder: Path) -> Path:
    """Write a plot as `folder/NAME.svg` and return that path."""
    path = folder / f"{plot.name}.svg"
    folder.mkdir(parents=True, exist_ok=True)
    path.write_bytes(as_svg(plot))
    return path


def as_svg(plot: Plot) -> bytes:
    """Return a plot as an SVG file."""
    x_ticks, y_ticks = (
        nice_ticks(np.concatenate([np.asarray(getattr(curve, along)) for curve in plot.curves]))
        for along in "xy"
    )
    drawing = Drawing(WIDTH, HEIGHT)
    drawing.text(LEFT, 24, plot.title, 15, bold=True)
    axes = Axes(LEFT, WIDTH - RIGHT, TOP, HEIGHT - BOTTOM,
                (x_ticks[0], x_ticks[-1]), (y_ticks[0], y_ticks[-1]))
    axes.draw(drawing, *([(tick, f"{tick:g}") for tick in ticks] for ticks in (x_ticks, y_ticks)),
              plot.x_label, plot.y_label)
    place = LEFT
    for curve, colour in zip(plot.curves, COLOURS, strict=False):
        _draw_curve(drawing, axes, curve, colour)
        if curve.marked:
            drawing.sign(place + 10, TOP - 20, "circle", colour, 3.5)
        else:
            drawing.line([(place, TOP - 20), (place + 20, TOP - 20)], colour, 1.8)
        drawing.text(place + 26, TOP - 15.5, curve.label)
        place += LETTER * len(curve.label) + 44
    return drawing.to_svg()


def _draw_curve(drawing: Drawing, axes: Axes, curve: Curve, colour: str) -> None:
    points = np.column_stack([axes.across(np.asarray(curve.x)), axes.up(np.asarray(curve.y))])
    if not curve.marked:
        drawing.line(points, colour, 1.8)
        return
    for point in points:
        drawing.sign(*point, "circle", colour, 3)
