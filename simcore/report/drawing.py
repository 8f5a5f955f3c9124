"""Lines, signs and words on a page of their own, written as SVG or PNG."""

import io
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

    def text(
        self, x: float, y: float, words: str, size: float = 13.0, anchor: str = "start",
        turned: bool = False, bold: bool = False,
    ) -> None:
        """Write words on the base line y from x, about x or up to x; `turned` upwards."""
        self._parts.append(("text", x, y, words, size, anchor, turned, bold))

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


def _svg(kind: str, *what) -> str:
    if kind == "line":
        points, colour, width, dash = what
        way = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
        dashed = f' stroke-dasharray="{" ".join(map(str, dash))}"' if dash else ""
        return (f'<polyline points="{way}" fill="none" stroke="{colour}" '
                f'stroke-width="{width:g}" stroke-linejoin="round"{dashed}/>')
    if kind == "sign":
        x, y, symbol, colour, size = what
        if symbol == "circle":
            return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{size:g}" fill="{colour}"/>'
        way = f"M{-size} {-size}L{size} {size}M{-size} {size}L{size} {-size}"
        return (f'<path transform="translate({x:.2f} {y:.2f})" d="{way}" stroke="{colour}" '
                'stroke-width="2.4"/>')
    x, y, words, size, anchor, turned, bold = what
    style = ' font-weight="bold"' * bold + f' transform="rotate(-90 {x:.2f} {y:.2f})"' * turned
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
    else:
        x, y, *rest = what
        words, anchored = _lettering(scale, *rest)
        place = (round(scale * x - anchored[0]), round(scale * y - anchored[1]))
        image.paste("#000", place, words)


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
