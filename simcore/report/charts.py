"""Dataset → interactive charts (plotly), readable on a light and on a dark page.

Colours of text and grid are left to style.css, which knows the page; colours of data come from
palettes that the colour-blind tell apart, and each verdict also has its own symbol. The last of a
point's `customdata` is the name of its candidate, which a click selects (charts.js).
"""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from simcore.report.quantities import QUANTITIES, Axis, Quantity, axes_of, place_text
from simcore.report.shades import Shades, shades_of
from simcore.report.verdicts import FAILED, FELL, HELD, MARKS, best_design, verdicts_of

SERIES_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Okabe & Ito's palette, the darker ones first; legible on white and on near-black."""

DASHES = ("solid", "dash", "dot", "dashdot")

MARKERS = {HELD: "circle", FELL: "x", FAILED: "triangle-down-open"}

NOTES = {
    "fall_margin": "1: did not move on its support; 0: about to fall. Below 0 it fell, the lower "
    "the earlier.",
    "topple_margin": "How far the upper body leans back over the hips at the least: at 0° nothing "
    "but the stiffness of the joints keeps it from tipping forward; at 90° it lies.",
    "peak_pressure": "Highest pressure over a sensor's cell of skin, until the end or the fall.",
    "peak_shear": "Highest tangential force per area over the same cells: what pulls at the skin.",
    "peak_edge_distance": "Where the mat reads most at rest: how far from the hem of the sheet.",
    "peak_strap_force": "Greatest tension of any strap, until the end or the fall.",
}
"""Metric of each chart → what a reader must know; left out where no candidate has the metric."""

REGION_SHARE_MIN = 0.02
"""Regions whose pressure never reaches this share of the study's peak are left out."""


@dataclass(frozen=True)
class Chart:
    """One figure, or one for each body on a common scale, with what a reader must know.

    Attributes
    ----------
    id, title, note : str
    figures : dict
        Heading, such as the body's name, → figure.
    """

    id: str
    title: str
    note: str
    figures: dict[str, go.Figure]


@dataclass(frozen=True)
class Slice:
    """The part of a study that fits a flat chart.

    Attributes
    ----------
    ds : xr.Dataset
        On `body` and the shown axes.
    shown : tuple of Axis
        None, one or two.
    fixed : str
        The other axes and their values, in words.
    """

    ds: xr.Dataset
    shown: tuple[Axis, ...]
    fixed: str

    @property
    def note(self) -> str:
        """Sentence that tells what is fixed; empty where nothing is."""
        return f" Shown for {self.fixed}." if self.fixed else ""


def slice_of(ds: xr.Dataset) -> Slice:
    """Return the study over its two longest axes, the others fixed as in the best design."""
    axes = [axis for axis in axes_of(ds) if axis.name != "body"]
    long = [axis for axis in axes if len(axis.values) > 1]
    shown = sorted(long, key=lambda axis: -len(axis.values))[:2]
    shown = tuple(axis for axis in axes if axis in shown)  # in the order of the study
    anchor = best_design(ds) or {axis.name: axis.values[0] for axis in axes}
    rest = {axis.name: anchor[axis.name] for axis in axes if axis not in shown}
    return Slice(ds.sel(rest), shown, place_text(tuple(axes), rest))


def charts_of(ds: xr.Dataset) -> list[Chart]:
    """Return the charts of a study; none where every candidate failed."""
    if (verdicts_of(ds) == FAILED).all():
        return []
    part = slice_of(ds)
    charts = []
    for name, note in NOTES.items():
        if part.ds[name].isnull().all():
            continue
        figures = (
            _heat_maps(part, name) if len(part.shown) == 2 else {"": _lines(part, name)}
        )
        charts.append(
            Chart(name.replace("_", "-"), QUANTITIES[name].title, note + part.note, figures)
        )
    line = _along_longest(part)
    regions = _region_maps(line)
    if regions:
        charts.append(
            Chart(
                "region-pressure",
                "Peak pressure by body region",
                "Highest pressure in each region until the end or the fall; regions never pressed "
                "are left out." + line.note,
                regions,
            )
        )
    return charts


def _along_longest(part: Slice) -> Slice:
    """Return a slice over one axis at most: the longer stays, the other as in the best design."""
    if len(part.shown) < 2:
        return part
    axis, other = sorted(part.shown, key=lambda axis: -len(axis.values))
    fixed = {other.name: best_design(part.ds)[other.name]}
    words = filter(None, [place_text((other,), fixed), part.fixed])
    return Slice(part.ds.sel(fixed), (axis,), ", ".join(words))


def _lines(part: Slice, name: str) -> go.Figure:
    """One line per body over the one axis; one marker per body without any."""
    quantity, verdicts = QUANTITIES[name], verdicts_of(part.ds)
    figure = go.Figure()
    axis = part.shown[0] if part.shown else _body_axis(part.ds)
    bodies = part.ds["body"].values.tolist() if part.shown else [None]
    for index, body in enumerate(bodies):
        row = part.ds if body is None else part.ds.sel(body=body)
        told = (verdicts if body is None else verdicts.sel(body=body)).values
        shown = quantity.factor * np.where(told == FAILED, np.nan, row[name].values)
        colour = SERIES_COLOURS[index % len(SERIES_COLOURS)]
        figure.add_scatter(
            x=list(axis.shown), y=shown, name=body or "", mode="lines",
            line={"color": colour, "width": 2.5, "dash": DASHES[index % len(DASHES)]},
            opacity=1 if axis.numeric else 0.25,  # between categories, a line only guides the eye
            hoverinfo="skip", showlegend=body is not None,
        )
        words = [f"{MARKS[verdict]} {verdict}" for verdict in told]
        figures = [quantity.text(value) for value in row[name].values]
        figure.add_scatter(
            x=list(axis.shown), y=shown, name=body or "", mode="markers", showlegend=False,
            marker={"size": 10, "color": colour, "symbol": [MARKERS[v] for v in told]},
            customdata=np.column_stack(
                [words, figures, [axis.text(v) for v in axis.values], row["candidate"].values]
            ),
            hovertemplate=(
                "%{customdata[2]}: <b>%{customdata[1]}</b>, %{customdata[0]}"
                "<extra>%{fullData.name}</extra>"
            ),
        )
    for verdict in (HELD, FELL):  # a legend of the symbols
        figure.add_scatter(
            x=[None], y=[np.nan], mode="markers", name=verdict,
            marker={"symbol": MARKERS[verdict], "color": "#888", "size": 10},
        )
    figure.update_xaxes(
        title=axis.label, zeroline=False, exponentformat="none", separatethousands=True,
        type="log" if axis.geometric else "linear" if axis.numeric else "category",
    )
    if axis.geometric:  # ticks of a logarithmic axis are few, and seldom where the values are
        figure.update_xaxes(tickvals=axis.shown, ticktext=axis.ticks)
    figure.update_yaxes(
        title=quantity.label, zeroline=False, exponentformat="none", separatethousands=True
    )
    finish(figure, 380)
    if name == "fall_margin":
        _mark_fall(figure)
    else:
        figure.update_yaxes(rangemode="tozero")
    return figure


def _mark_fall(figure: go.Figure) -> None:
    """Draw the line between held and fell."""
    figure.add_hline(y=0, line={"color": "#888", "width": 1.5, "dash": "dot"})
    lowest = min([-1.0, *(np.nanmin(line.y) for line in figure.data if np.isfinite(line.y).any())])
    figure.update_yaxes(range=[lowest - 0.12, 1.12])
    figure.update_layout(margin_r=56)
    for word, side in (("held ↑", "bottom"), ("fell ↓", "top")):
        figure.add_annotation(
            text=word, x=1, xref="paper", xanchor="left", y=0, yanchor=side, showarrow=False
        )


def _heat_maps(part: Slice, name: str) -> dict[str, go.Figure]:
    """One map per body over two axes; each cell tells its verdict by its sign."""
    quantity, verdicts = QUANTITIES[name], verdicts_of(part.ds)
    across, down = sorted(part.shown, key=lambda axis: -len(axis.values))
    order = ("body", down.name, across.name)
    true = part.ds[name].where(verdicts != FAILED).transpose(*order)
    told, names = verdicts.transpose(*order), part.ds["candidate"].transpose(*order)
    shades = shades_of(name, quantity, true.values)
    figures = {}
    for body in part.ds["body"].values.tolist():
        figure = go.Figure()
        words = told.sel(body=body).values
        values = true.sel(body=body).values
        figure.add_heatmap(
            x=across.ticks,
            y=down.ticks,
            z=quantity.factor * values,
            customdata=np.dstack(
                [words, np.vectorize(quantity.text)(values), names.sel(body=body).values]
            ),
            hovertemplate=(
                f"{across.title} %{{x}} {across.unit}<br>{down.title} %{{y}} {down.unit}<br>"
                "<b>%{customdata[1]}</b>, %{customdata[0]}<extra></extra>"
            ),
            colorbar=_colour_bar(quantity), xgap=1, ygap=1, **shades.for_plotly,
        )
        _write_cells(figure, across, down, quantity, shades, words, values)
        for update, axis in ((figure.update_xaxes, across), (figure.update_yaxes, down)):
            update(title=axis.label, type="category", showgrid=False,
                   range=[-0.5, len(axis.values) - 0.5])
        figures[body] = finish(figure, 130 + 36 * max(len(down.values), 5))
    return figures


def _write_cells(
    figure: go.Figure, across: Axis, down: Axis, quantity: Quantity, shades: Shades,
    verdicts: np.ndarray, values: np.ndarray,
) -> None:
    """Write the sign of the verdict and the value into each cell, in ink that can be read on it."""
    words, inks = [], []
    for verdict, value in zip(verdicts.ravel(), values.ravel(), strict=True):
        known = np.isfinite(value)
        number = quantity.text(value).removesuffix(quantity.unit).rstrip() if known else ""
        words.append(f"{MARKS[verdict]} {number}".rstrip())
        inks.append(shades.ink(quantity.factor * value) if known else "#888")
    places = [(x, y) for y in down.ticks for x in across.ticks]
    figure.add_scatter(
        x=[x for x, _ in places], y=[y for _, y in places], text=words, mode="text",
        textfont={"color": inks, "size": 12}, hoverinfo="skip", showlegend=False,
    )


def _region_maps(part: Slice) -> dict[str, go.Figure]:
    """Regions over the one axis, one map per body; none where nothing was pressed."""
    quantity = QUANTITIES["region_peak_pressure"]
    ds, axis = part.ds, part.shown[0] if part.shown else _body_axis(part.ds)
    true = ds["region_peak_pressure"].where(verdicts_of(ds) != FAILED)
    highest = true.max([dim for dim in true.dims if dim != "region"])
    pressed = (highest > REGION_SHARE_MIN * highest.max()).values
    if not pressed.any():
        return {}
    true = true.isel(region=np.flatnonzero(pressed)[::-1])
    shades = shades_of("region_peak_pressure", quantity, true.values)
    figures = {}
    for body in ds["body"].values.tolist() if part.shown else [""]:
        figure = go.Figure()
        rows = true.sel(body=body) if body else true
        figure.add_heatmap(
            x=axis.ticks,
            y=[name.replace("_", " ") for name in true["region"].values.tolist()],
            z=quantity.factor * rows.transpose("region", axis.name).values,
            customdata=np.tile(
                (ds.sel(body=body) if body else ds)["candidate"].values, (rows.sizes["region"], 1)
            )[..., None],
            hovertemplate=(
                f"%{{y}}, {axis.title} %{{x}} {axis.unit}<br><b>%{{z:.1f}} {quantity.unit}</b>"
                "<extra></extra>"
            ),
            colorbar=_colour_bar(quantity), xgap=1, ygap=1, **shades.for_plotly,
        )
        figure.update_xaxes(title=axis.label, type="category", showgrid=False)
        figure.update_yaxes(title="Body region", showgrid=False, ticksuffix=" ")
        figures[body] = finish(figure, 110 + 24 * max(int(pressed.sum()), 6))
    return figures


def _colour_bar(quantity: Quantity) -> dict:
    title = {"text": quantity.label, "side": "right"}
    return {"title": title, "thickness": 12, "outlinewidth": 0}


def finish(figure: go.Figure, height: int) -> go.Figure:
    """Give a figure what all have in common, and its height [pixel]; return it."""
    figure.update_layout(
        template="none",
        height=height,
        margin={"l": 60, "r": 12, "t": 16, "b": 50},
        paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)",
        font={"family": "system-ui, sans-serif", "size": 13},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        hovermode="closest",
    )
    figure.update_xaxes(automargin=True, gridcolor="#8884", linecolor="#888")
    figure.update_yaxes(automargin=True, gridcolor="#8884", linecolor="#888")
    return figure


def _body_axis(ds: xr.Dataset) -> Axis:
    return next(axis for axis in axes_of(ds) if axis.name == "body")
