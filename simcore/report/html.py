"""Dataset → one HTML file that opens without a network."""

import json
import os
import shlex
from pathlib import Path

import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from plotly.io import to_html
from plotly.offline import get_plotlyjs

from simcore.dataset import open_dataset
from simcore.limits.margins import COMPARATIVE
from simcore.pressure_scale import colour_stops
from simcore.report import limits
from simcore.report.certificates import VARIANT_TITLES, certificates_of, doubt_of
from simcore.report.charts import Chart, charts_of, slice_of
from simcore.report.equations import equations_of
from simcore.report.exemplars import choose_exemplars
from simcore.report.findings import CAVEAT, body_findings, fall_reason, headline
from simcore.report.physics import tables_of
from simcore.report.pictures import Gallery, take_pictures
from simcore.report.quantities import QUANTITIES, axes_of, number_text, place_text
from simcore.report.regions import region_table
from simcore.report.trust import (
    ROWS_MAX,
    columns_of,
    fill_missing_metrics,
    trust_rows,
    trust_summary,
)
from simcore.report.verdicts import FAILED, FELL, HELD, MARKS, verdicts_of

CHART_CONFIG = {"displayModeBar": False, "responsive": True}


def build_report(dataset_path: Path, out_path: Path, root: Path | None = None) -> Path:
    """Write the report of a dataset as one HTML file; return its path.

    Parameters
    ----------
    dataset_path : Path
        results/STUDY/dataset.nc; the candidates' files are sought beside it.
    out_path : Path
        Is either the whole report or untouched.
    root : Path, optional
        Folder above designs/, for mesh files of devices; by default the one above results/.

    Raises
    ------
    DesignError
        The dataset cannot be read.
    """
    dataset_path, out_path = Path(dataset_path), Path(out_path)
    ds, missing = fill_missing_metrics(open_dataset(dataset_path))
    root = root or dataset_path.resolve().parents[2]
    galleries, scale = take_pictures(
        ds, choose_exemplars(ds), dataset_path.parent / "candidates", root
    )
    html = _page(ds, galleries, scale, missing)
    out_path.parent.mkdir(parents=True, exist_ok=True)
    partial = out_path.with_name(f".{out_path.name}.{os.getpid()}")
    try:
        partial.write_text(html, encoding="utf-8")
        partial.replace(out_path)
    finally:
        partial.unlink(missing_ok=True)
    return out_path


def simulate_command(ds: xr.Dataset, coordinates: dict) -> str:
    """Return the shell command that simulates one candidate of the study again."""
    settings = [f"{name}={_plain(value)}" for name, value in coordinates.items()]
    study = f"config/{ds.attrs.get('study', 'STUDY')}.yaml"
    words = ["simcore", "simulate", study]
    for setting in settings:
        words += ["--set", setting]
    return shlex.join([*words, "--out", "run.nc"])


def _page(ds: xr.Dataset, galleries: list[Gallery], scale: float, missing: list[str]) -> str:
    environment = Environment(
        loader=PackageLoader("simcore.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    charts = charts_of(ds)
    verdicts, rows, certificates = verdicts_of(ds), trust_rows(ds), certificates_of(ds)
    return environment.get_template("template.html").render(
        title=ds.attrs.get("title", "Untitled study"),
        study=ds.attrs.get("study", ""),
        headline=headline(ds),
        caveat=CAVEAT,
        bodies=body_findings(ds),
        counts=[(name, MARKS[name], int((verdicts == name).sum()))
                for name in (HELD, FELL, FAILED)],
        matrices=_matrices(ds),
        comparative=COMPARATIVE,
        limits=limits.lines_of(ds),
        limit_columns=limits.columns_of(ds),
        limit_rows=limits.rows_of(ds),
        charts=[(chart, _figures_html(chart)) for chart in charts],
        galleries=[_gallery(ds, gallery) for gallery in galleries],
        scale=_scale(scale),
        missing=missing,
        trust=trust_summary(ds),
        axes=axes_of(ds),
        columns=columns_of(ds),
        rows=rows,
        remarks=any(row.note and not row.empty for row in rows),
        rows_left_out=max(verdicts.size - ROWS_MAX, 0),
        variants=VARIANT_TITLES.values(),
        certificates=certificates,
        certificates_left_out=int(ds["certified"].notnull().sum()) - len(certificates),
        equations=equations_of(ds),
        tables=tables_of(ds),
        versions=ds.attrs.get("versions", "not recorded").split(", "),
        source_digest=ds.attrs.get("source_digest", "not recorded"),
        config=ds.attrs.get("config", "not recorded"),
        designs=json.dumps(json.loads(ds.attrs.get("designs", "{}")), indent=1),
        style=Markup(environment.loader.get_source(environment, "style.css")[0]),
        # ASSUME: both come from plotly itself, which escapes "</" in the data it is given.
        plotly=Markup(get_plotlyjs()) if charts else "",
    )


def _matrices(ds: xr.Dataset) -> list[dict]:
    """Return the verdict tables: bodies × one axis, or one table a body over two axes."""
    part = slice_of(ds)
    if len(part.shown) < 2:
        across = part.shown[0] if part.shown else None
        return [_matrix(part.ds, "", "body", across, "body", part.fixed)]
    across, down = sorted(part.shown, key=lambda axis: -len(axis.values))
    return [
        _matrix(part.ds.sel(body=[body]), body, down.name, across, down.label, part.fixed)
        for body in ds["body"].values.tolist()
    ]


def _matrix(ds: xr.Dataset, title: str, down: str, across, corner: str, fixed: str) -> dict:
    verdicts, over = verdicts_of(ds), limits.over_counts(ds)
    columns = across.values if across else (None,)
    axis = next(axis for axis in axes_of(ds) if axis.name == down)
    rows = []
    for value in axis.values:
        cells = []
        for column in columns:
            place = {down: value} | ({across.name: column} if across else {})
            figures = ds.sel(place).squeeze()
            verdict = verdicts.sel(place).squeeze().item()
            cells.append(
                {
                    "verdict": verdict,
                    "mark": MARKS[verdict],
                    "margin": QUANTITIES["fall_margin"].text(figures["fall_margin"].item())
                    if verdict != FAILED else "",
                    "why": fall_reason(figures),
                    "doubt": doubt_of(figures),
                    "over": over.sel(place).squeeze().item(),
                }
            )
        rows.append((axis.text(value), cells))
    return {
        "title": title,
        "compared": any(cell["over"] for _, cells in rows for cell in cells),
        "doubted": any(cell["doubt"] for _, cells in rows for cell in cells),
        "corner": corner,
        "across": across.title if across else "",
        "columns": [across.text(value) for value in columns] if across else ["verdict"],
        "rows": rows,
        "fixed": fixed,
    }


def _gallery(ds: xr.Dataset, gallery: Gallery) -> dict:
    coordinates = gallery.exemplar.coordinates
    figures = ds.sel(coordinates)
    verdict = verdicts_of(ds).sel(coordinates).item()
    return {
        "place": place_text(axes_of(ds), coordinates),
        "verdict": verdict,
        "mark": MARKS[verdict],
        "why": fall_reason(figures),
        "doubt": doubt_of(figures),
        "reasons": gallery.exemplar.reasons,
        "pictures": gallery.pictures,
        "mat": gallery.mat and (gallery.mat, _figures_html(gallery.mat)),
        "missing": gallery.missing,
        "regions": region_table(figures),
        "command": simulate_command(ds, coordinates),
    }


def _scale(end: float) -> dict | None:
    """Return the pressure colour bar: CSS gradient and tick labels [kPa]; None without pictures."""
    if not end:
        return None
    stops = ", ".join(f"{colour} {100 * share:.3g}%" for share, colour in colour_stops())
    return {
        "gradient": Markup(f"linear-gradient(to right, {stops})"),
        "ticks": [number_text(tick) for tick in np.linspace(0, end * 1e-3, 3)],
    }


def _figures_html(chart: Chart) -> list[tuple[str, Markup]]:
    return [
        (
            heading,
            Markup(
                to_html(
                    figure,
                    full_html=False,
                    include_plotlyjs=False,
                    config=CHART_CONFIG,
                    div_id=f"chart-{chart.id}-{number}",
                    default_width="100%",
                    default_height=f"{figure.layout.height}px",
                )
            ),
        )
        for number, (heading, figure) in enumerate(chart.figures.items())
    ]


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.12g}" if isinstance(value, float) else str(value)
