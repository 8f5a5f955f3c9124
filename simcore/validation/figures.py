"""Plots as SVG: small, the same on every machine, and readable as a picture in Markdown."""

from html import escape
from pathlib import Path

import numpy as np

from simcore.validation.table import Curve, Plot

WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 70, 20, 60, 55
"""Margins around the axes [px]."""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Okabe & Ito."""


def write_plot(plot: Plot, folder: Path) -> Path:
    """Write a plot as `folder/NAME.svg` and return that path."""
    path = folder / f"{plot.name}.svg"
    folder.mkdir(parents=True, exist_ok=True)
    path.write_text(as_svg(plot), encoding="utf-8")
    return path


def as_svg(plot: Plot) -> str:
    """Return a plot as the text of an SVG file."""
    x_ticks = nice_ticks(np.concatenate([np.asarray(curve.x) for curve in plot.curves]))
    y_ticks = nice_ticks(np.concatenate([np.asarray(curve.y) for curve in plot.curves]))
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT

    def across(x):
        return LEFT + (x - x_ticks[0]) / (x_ticks[-1] - x_ticks[0]) * (right - LEFT)

    def up(y):
        return bottom - (y - y_ticks[0]) / (y_ticks[-1] - y_ticks[0]) * (bottom - TOP)

    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif" font-size="13">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>',
        _text(LEFT, 22, plot.title, 'font-size="15" font-weight="bold"'),
    ]
    for tick in x_ticks:
        x = across(tick)
        lines += [_line(x, TOP, x, bottom), _text(x, bottom + 18, f"{tick:g}", _MIDDLE)]
    for tick in y_ticks:
        y = up(tick)
        lines += [_line(LEFT, y, right, y),
                  _text(LEFT - 8, y + 4, f"{tick:g}", 'text-anchor="end"')]
    middle = (TOP + bottom) / 2
    lines += [
        _text((LEFT + right) / 2, HEIGHT - 14, plot.x_label, _MIDDLE),
        _text(18, middle, plot.y_label, f'{_MIDDLE} transform="rotate(-90 18 {middle:g})"'),
    ]
    place = LEFT
    for curve, colour in zip(plot.curves, COLOURS, strict=False):
        lines += [_curve(curve, across, up, colour),
                  _text(place, TOP - 14, _sign(curve) + curve.label, f'fill="{colour}"')]
        place += 8 * len(curve.label) + 45
    return "\n".join([*lines, "</svg>", ""])


def nice_ticks(values: np.ndarray) -> np.ndarray:
    """Return four to eight round values, evenly spaced, that enclose all values."""
    low, high = float(np.min(values)), float(np.max(values))
    raw = (high - low or 1.0) / 6
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(each for each in (1, 2, 5, 10) if each * power >= raw)
    first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
    return np.round(np.arange(first, max(last, first + 1) + 0.5) * step, 12)


_MIDDLE = 'text-anchor="middle"'


def _sign(curve: Curve) -> str:
    return "● " if curve.marked else "— "


def _text(x: float, y: float, text: str, style: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(text)}</text>'


def _line(x1: float, y1: float, x2: float, y2: float) -> str:
    return f'<path d="M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}" stroke="#ddd"/>'


def _curve(curve: Curve, across, up, colour: str) -> str:
    points = [(across(x), up(y)) for x, y in zip(curve.x, curve.y, strict=True)]
    if curve.marked:
        return "\n".join(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points
        )
    way = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{way}" fill="none" stroke="{colour}" stroke-width="1.8"/>'
