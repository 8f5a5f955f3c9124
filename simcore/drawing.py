"""Lines, areas, signs and words on a page of their own, written as SVG or PNG."""

import io
from collections.abc import Iterable
from dataclasses import dataclass, field
from html import escape

import numpy as np
from PIL import Image, ImageDraw, ImageFont

DASHES = {"solid": (), "dash": (8, 5), "dot": (2, 4), "dashdot": (8, 4, 2, 4)}
"""Lengths of stroke and gap in turn [px]."""

PNG_DPI, SVG_DPI = 300, 96
"""Dots per inch of a PNG, and units per inch of an SVG."""

OVERSAMPLING = 2
"""Of a PNG along each side, for smooth edges."""

RAISED = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-", strict=True))
"""Signs that the font of a PNG lacks and that are drawn small and raised."""


@dataclass
class Drawing:
    """What is to be drawn, in the order of drawing; lengths in px, y downwards."""

    width: float
    height: float
    _parts: list[tuple] = field(default_factory=list)

    def line(self, points, colour: str = "#000", width: float = 1.0, dash: str = "solid") -> None:
        """Draw a line through points (n, 2)."""
        if len(points) > 1:
            self._parts.append(("line", np.asarray(points, float), colour, width, DASHES[dash]))

    def sign(self, x: float, y: float, symbol: str, colour: str, size: float = 4.5) -> None:
        """Draw a "circle" or an "x" of half a width around a point."""
        self._parts.append(("sign", x, y, symbol, colour, size))

    def area(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        """Fill a rectangle, given by its upper left corner."""
        self._parts.append(("area", x, y, width, height, colour))

    def text(
        self, x: float, y: float, words: str, size: float = 13.0, anchor: str = "start",
        turned: bool = False, bold: bool = False, colour: str = "#000000",
    ) -> None:
        """Write words on the base line y from x, about x or up to x; `turned` upwards."""
        self._parts.append(("text", x, y, words, size, anchor, turned, bold, colour))

    def to_svg(self) -> bytes:
        """Return the drawing as an SVG file, on white."""
        lines = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:g} {self.height:g}" '
            f'width="{self.width:g}" height="{self.height:g}" font-family="sans-serif">',
            f'<rect width="{self.width:g}" height="{self.height:g}" fill="#fff"/>',
            *(_svg(*part) for part in self._parts),
            "</svg>",
            "",
        ]
        return "\n".join(lines).encode()

    def to_png(self) -> bytes:
        """Return the drawing as a PNG file of 300 dots an inch, on white."""
        scale = OVERSAMPLING * PNG_DPI / SVG_DPI
        size = round(self.width * scale), round(self.height * scale)
        image = Image.new("RGB", size, "#fff")
        for part in self._parts:
            _paint(image, scale, *part)
        small = image.resize([side // OVERSAMPLING for side in size], Image.Resampling.LANCZOS)
        buffer = io.BytesIO()
        small.save(buffer, "PNG", dpi=(PNG_DPI, PNG_DPI), optimize=True)
        return buffer.getvalue()


@dataclass(frozen=True)
class Axes:
    """A rectangle of a page with a scale along two sides.

    Attributes
    ----------
    left, right, top, bottom : float
        Of the rectangle [px].
    x_range, y_range : tuple of float
        Values at its left and right, and at its bottom and top.
    """

    left: float
    right: float
    top: float
    bottom: float
    x_range: tuple[float, float]
    y_range: tuple[float, float]

    def across(self, x):
        """Return where values (n,) lie from the left of the page [px]."""
        low, high = self.x_range
        return self.left + (x - low) / (high - low) * (self.right - self.left)

    def up(self, y):
        """Return where values (n,) lie from the top of the page [px]."""
        low, high = self.y_range
        return self.bottom - (y - low) / (high - low) * (self.bottom - self.top)

    def draw(
        self, drawing: Drawing, x_ticks: Iterable[tuple[float, str]],
        y_ticks: Iterable[tuple[float, str]], x_label: str, y_label: str,
    ) -> None:
        """Draw both axes with labels, a line across at each y tick and a mark at each x tick."""
        for y, words in y_ticks:
            drawing.line([(self.left, self.up(y)), (self.right, self.up(y))], "#dddddd")
            drawing.text(self.left - 8, self.up(y) + 4.5, words, anchor="end")
        for x, words in x_ticks:
            at = self.across(x)
            drawing.line([(at, self.bottom), (at, self.bottom + 5)], "#444444")
            drawing.text(at, self.bottom + 20, words, anchor="middle")
        corners = (self.left, self.top), (self.left, self.bottom), (self.right, self.bottom)
        drawing.line(corners, "#444444")
        self.label(drawing, x_label, y_label)

    def label(self, drawing: Drawing, x_label: str, y_label: str, room: float = 56) -> None:
        """Write the labels; `room` [px] is left for the ticks of the vertical axis."""
        drawing.text((self.left + self.right) / 2, self.bottom + 46, x_label, 14, "middle")
        middle = (self.top + self.bottom) / 2
        drawing.text(self.left - room, middle, y_label, 14, "middle", turned=True)


def nice_ticks(values: np.ndarray) -> np.ndarray:
    """Return four to eight round values, evenly spaced, that enclose all values."""
    low, high = float(np.min(values)), float(np.max(values))
    raw = (high - low or 1.0) / 6
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(each for each in (1, 2, 5, 10) if each * power >= raw)
    first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
    return np.round(np.arange(first, max(last, first + 1) + 0.5) * step, 12)


def _svg(kind: str, *what) -> str:
    if kind == "line":
        points, colour, width, dash = what
        way = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
        dashed = f' stroke-dasharray="{" ".join(map(str, dash))}"' if dash else ""
        return (f'<polyline points="{way}" fill="none" stroke="{colour}" '
                f'stroke-width="{width:g}" stroke-linejoin="round"{dashed}/>')
    if kind == "area":
        x, y, width, height, colour = what
        return (f'<rect x="{x:.2f}" y="{y:.2f}" width="{width:.2f}" height="{height:.2f}" '
                f'fill="{colour}"/>')
    if kind == "sign":
        x, y, symbol, colour, size = what
        if symbol == "circle":
            return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{size:g}" fill="{colour}"/>'
        way = f"M{-size} {-size}L{size} {size}M{-size} {size}L{size} {-size}"
        return (f'<path transform="translate({x:.2f} {y:.2f})" d="{way}" stroke="{colour}" '
                'stroke-width="2.4"/>')
    x, y, words, size, anchor, turned, bold, colour = what
    style = f' fill="{colour}"' * (colour != "#000000")
    style += ' font-weight="bold"' * bold + f' transform="rotate(-90 {x:.2f} {y:.2f})"' * turned
    return (f'<text x="{x:.2f}" y="{y:.2f}" font-size="{size:g}" text-anchor="{anchor}"{style}>'
            f"{escape(words)}</text>")


def _paint(image: Image.Image, scale: float, kind: str, *what) -> None:
    pen = ImageDraw.Draw(image)
    if kind == "line":
        points, colour, width, dash = what
        for stroke in _strokes(points, dash):
            pen.line([tuple(scale * point) for point in stroke], colour, round(scale * width),
                     joint="curve")
    elif kind == "sign":
        x, y, symbol, colour, size = what
        left, top, right, bottom = (scale * each for each in
                                    (x - size, y - size, x + size, y + size))
        if symbol == "circle":
            pen.ellipse((left, top, right, bottom), colour)
        else:
            for way in ((left, top, right, bottom), (left, bottom, right, top)):
                pen.line(way, colour, round(2.4 * scale))
    elif kind == "area":
        x, y, width, height, colour = what
        corners = (scale * each for each in (x, y, x + width, y + height))
        left, top, right, bottom = map(round, corners)
        pen.rectangle((left, top, right - 1, bottom - 1), colour)
    else:
        x, y, *rest, colour = what
        words, anchored = _lettering(scale, *rest)
        place = (round(scale * x - anchored[0]), round(scale * y - anchored[1]))
        image.paste(colour, place, words)


def _strokes(points: np.ndarray, dash: tuple[float, ...]) -> list[np.ndarray]:
    """Return the pieces of a line through points (n, 2) that a dash leaves."""
    if not dash:
        return [points]
    way = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    ends = np.cumsum(np.tile(dash, int(way[-1] / sum(dash)) + 2))
    starts = np.append(0, ends[:-1])
    strokes = []
    for start, end in zip(starts[::2], np.minimum(ends[::2], way[-1]), strict=True):
        if start < end:
            between = way[(way > start) & (way < end)]
            at = np.concatenate([[start], between, [end]])
            strokes.append(np.column_stack([np.interp(at, way, points[:, i]) for i in (0, 1)]))
    return strokes


def _lettering(
    scale: float, words: str, size: float, anchor: str, turned: bool, bold: bool
) -> tuple[Image.Image, tuple[float, float]]:
    """Return words as a mask, and where on it the point lies that they are anchored at."""
    font = ImageFont.load_default(size * scale)
    raised = ImageFont.load_default(0.65 * size * scale)
    ascent, descent = font.getmetrics()
    pieces = [
        (RAISED[letter], raised, -0.35 * ascent) if letter in RAISED
        else (letter.replace("−", "-"), font, 0)
        for letter in words
    ]
    length = sum(each.getlength(letter) for letter, each, _ in pieces)
    mask = Image.new("L", (int(length) + 4, ascent + descent))
    pen, x = ImageDraw.Draw(mask), 0.0
    for letter, each, lift in pieces:
        pen.text((x, ascent + lift), letter, 255, each, anchor="ls",
                 stroke_width=0.03 * size * scale if bold else 0)
        x += each.getlength(letter)
    along = {"start": 0.0, "middle": length / 2, "end": length}[anchor]
    if turned:
        return mask.rotate(90, expand=True), (ascent, mask.width - along)
    return mask, (along, ascent)
