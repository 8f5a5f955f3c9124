"""The sensor mat of a run as maps: what it read at rest, and the most that each cell read."""

import numpy as np
import plotly.graph_objects as go

from simcore.pressure_scale import colour_stops
from simcore.report.charts import Chart, finish
from simcore.report.quantities import QUANTITIES
from simcore.report.runs import Run
from simcore.sheet.outline import contains, distance_to_sides

CM = 100.0
"""Centimetres in a metre."""

HEIGHT = 470
"""Of a map [pixel]."""

BORDER = 9.0
"""Free above and below the mat, where head and feet are marked [cm]."""

LINE_COLOUR = "#888"
"""Of outline and hinge; seen on white and on near-black."""


def mat_chart(run: Run, scale: float, name: str) -> Chart:
    """Return the two maps of a run, on a pressure scale from 0 to `scale` [Pa]."""
    text = QUANTITIES["peak_pressure"].text
    rest, peak = run.mat_at_end, run.mat_peak
    pitch = f"{1e3 * run.design.method.sensor_pitch_m:g} mm"
    when = "In the last half second before the fall" if run.fell else "At rest, mean over 0.5 s"
    where = (
        "between sheet and body, spread out flat; a ring marks each strap"
        if run.net
        else "on the backrest, above the dotted line, and on the seat below it"
    )
    return Chart(
        f"mat-{name}",
        "Sensor mat",
        f"What a mat with cells of {pitch} would read {where}.",
        {
            f"{when}: up to {text(rest.max())}": _map(run, rest, scale),
            f"Peak of each cell while supported: up to {text(peak.max())}": _map(run, peak, scale),
        },
    )


def _map(run: Run, reading: np.ndarray, scale: float) -> go.Figure:
    """Return the map of a reading (rows, columns) [Pa], seen from above: head up, left right."""
    x, y = (CM * run.frames[axis].values for axis in ("mat_x", "mat_y"))
    shown = np.where(_on_mat(run) | (reading > 0), 1e-3 * reading, np.nan).astype(np.float32)
    figure = go.Figure()
    figure.add_heatmap(
        x=y, y=x, z=shown, zmin=0, zmax=1e-3 * scale, colorscale=colour_stops(),
        colorbar={"title": {"text": "Pressure [kPa]", "side": "right"}, "thickness": 12,
                  "outlinewidth": 0},
        hovertemplate="along %{y:.1f} cm, across %{x:.1f} cm<br><b>%{z:.1f} kPa</b><extra></extra>",
        hoverongaps=False,
    )
    if run.net:
        _draw_sheet(figure, run)
    else:
        figure.add_hline(y=0, line={"color": LINE_COLOUR, "width": 1.5, "dash": "dot"})
    low, high = x.min() - BORDER, x.max() + BORDER
    along = "Along, from the head edge" if run.net else "Along, from the corner of the seat"
    figure.update_yaxes(
        title=f"{along} [cm]", range=[high, low], scaleanchor="x", constrain="domain",
        zeroline=False, showgrid=False,
    )
    figure.update_xaxes(
        title="Across, to the left [cm]", constrain="domain", zeroline=False,
        showgrid=False,
    )
    finish(figure, HEIGHT)
    figure.update_layout(showlegend=False)
    for word, place in (("head ↑", low + BORDER / 2), ("feet ↓", high - BORDER / 2)):
        figure.add_annotation(text=word, x=0, y=place, showarrow=False)
    return figure


def _on_mat(run: Run) -> np.ndarray:
    """Return which cells (rows, columns) lie on what carries the body, if only in part."""
    x, y = run.frames["mat_x"].values, run.frames["mat_y"].values
    if not run.net:
        return np.ones((len(x), len(y)), bool)
    centres = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = contains(run.net.outline, centres)
    half = run.design.method.sensor_pitch_m / 2
    beside = [distance_to_sides(run.net.outline, centre) < half for centre in centres]
    return (inside | np.array(beside)).reshape(len(x), len(y))


def _draw_sheet(figure: go.Figure, run: Run) -> None:
    """Draw the sheet's outline and the places of its straps."""
    outline = CM * np.vstack([run.net.outline, run.net.outline[:1]])
    figure.add_scatter(
        x=outline[:, 1], y=outline[:, 0], mode="lines", line={"color": LINE_COLOUR, "width": 2},
        hoverinfo="skip",
    )
    straps = CM * run.straps.patch_centres(run.net.rest_position)
    figure.add_scatter(
        x=straps[:, 1], y=straps[:, 0], mode="markers", text=run.straps.names,
        marker={"symbol": "circle-open", "size": 9, "color": LINE_COLOUR, "line": {"width": 2}},
        hovertemplate="strap %{text}<extra></extra>",
    )
