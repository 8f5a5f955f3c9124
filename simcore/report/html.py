"""Dataset → one HTML file that opens without a network."""

import json
from pathlib import Path

import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from simcore.dataset import SCHEMA, open_dataset
from simcore.export.whole_file import write_whole
from simcore.limits.margins import COMPARATIVE
from simcore.pressure_scale import colour_stops
from simcore.report import limits
from simcore.report.candidates import as_data, candidates_of
from simcore.report.certificates import VARIANT_TITLES, certificates_of, doubt_of
from simcore.report.charts import Chart, charts_of, slice_of
from simcore.report.equations import equations_of
from simcore.report.exemplars import choose_exemplars
from simcore.report.findings import CAVEAT, best_sentence, body_findings, fall_reason, headline
from simcore.report.physics import tables_of
from simcore.report.pictures import Gallery, common_scale, take_pictures
from simcore.report.quantities import QUANTITIES, axes_of, number_text, place_text
from simcore.report.regions import region_table
from simcore.report.replays import embed, first_pair
from simcore.report.runs import Run, read_run
from simcore.report.trust import (
    ROWS_MAX,
    columns_of,
    fill_missing,
    trust_rows,
    trust_summary,
)
from simcore.report.verdicts import FAILED, FELL, HELD, MARKS, verdicts_of

PAGE_MAX = 15_000_000
"""Bytes of a report: replays take what the rest leaves."""


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
        The dataset cannot be read, or has not even verdicts. One of an older schema is shown with
        what it has.
    """
    dataset_path, out_path = Path(dataset_path), Path(out_path)
    ds, missing = fill_missing(open_dataset(dataset_path, older=True))
    root = root or dataset_path.resolve().parents[2]
    write_whole(out_path, _page(ds, missing, dataset_path.parent / "candidates", root).encode())
    return out_path


def _page(ds: xr.Dataset, missing: list[str], folder: Path, root: Path) -> str:
    environment = Environment(
        loader=PackageLoader("simcore.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    exemplars = choose_exemplars(ds)
    names = [ds["candidate"].sel(each.coordinates).item() for each in exemplars]
    runs = {name: read_run(folder / f"{name}.nc", root) for name in names}
    scale = common_scale(ds, [run for run in runs.values() if isinstance(run, Run)])
    galleries = take_pictures(exemplars, list(runs.values()), scale)
    pair = first_pair(ds)
    shown = [_gallery(ds, gallery) for gallery in galleries]
    context = _context(ds) | {
        "hero": _hero({each["id"]: each for each in shown}, pair),
        "first": pair[0] if pair else ds["candidate"].values.flat[0],
        "missing": missing,
        "galleries": shown,
        "scale": _scale(scale),
        "player": "",
        "assets": "",
    }
    for name in ("style.css", "charts.js", "select.js"):
        source, *_ = environment.loader.get_source(environment, name)
        context[name.replace(".", "_")] = Markup(source)
    template = environment.get_template("template.html")
    room = PAGE_MAX - len(template.render(context).encode())
    replays = embed(ds, pair, runs, folder, root, scale, room)
    if replays.runs:
        beside = [name for name in pair if name in replays.runs] or replays.runs[:1]
        context |= {"player": replays.fragment(beside), "assets": replays.assets()}
    return template.render(context)


def _context(ds: xr.Dataset) -> dict:
    """Return what the template needs of a dataset alone."""
    charts = charts_of(ds)
    verdicts, rows, certificates = verdicts_of(ds), trust_rows(ds), certificates_of(ds)
    candidates = candidates_of(ds)
    return {
        "title": ds.attrs.get("title", "Untitled study"),
        "study": ds.attrs.get("study", ""),
        "headline": headline(ds),
        "best": best_sentence(ds),
        "caveat": CAVEAT,
        "bodies": body_findings(ds),
        "counts": [(name, MARKS[name], int((verdicts == name).sum()))
                   for name in (HELD, FELL, FAILED)],
        "matrices": _matrices(ds),
        "candidates": candidates,
        "candidates_data": as_data(candidates),
        "comparative": COMPARATIVE,
        "limits": limits.lines_of(ds),
        "limit_columns": limits.columns_of(ds),
        "limit_rows": limits.rows_of(ds),
        "charts": [(chart, _plots(chart)) for chart in charts],
        "trust": trust_summary(ds),
        "axes": axes_of(ds),
        "columns": columns_of(ds),
        "rows": rows,
        "remarks": any(row.note and not row.empty for row in rows),
        "rows_left_out": max(verdicts.size - ROWS_MAX, 0),
        "variants": VARIANT_TITLES.values(),
        "certificates": certificates,
        "certificates_left_out": int(ds["certified"].notnull().sum()) - len(certificates),
        # A design of an older schema may lack what these tell of.
        "equations": equations_of(ds) if ds.attrs["schema"] == SCHEMA else [],
        "tables": tables_of(ds) if ds.attrs["schema"] == SCHEMA else [],
        "versions": ds.attrs.get("versions", "not recorded").split(", "),
        "source_digest": ds.attrs.get("source_digest", "not recorded"),
        "config": ds.attrs.get("config", "not recorded"),
        "designs": json.dumps(json.loads(ds.attrs.get("designs", "{}")), indent=1),
        # ASSUME: it is plotly's own, and holds nothing that ends its script.
        "plotly": Markup(get_plotlyjs()) if charts else "",
    }


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
                    "id": figures["candidate"].item(),
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
        "id": figures["candidate"].item(),
        "place": place_text(axes_of(ds), coordinates),
        "verdict": verdict,
        "mark": MARKS[verdict],
        "why": fall_reason(figures),
        "doubt": doubt_of(figures),
        "reasons": gallery.exemplar.reasons,
        "pictures": gallery.pictures,
        "mat": gallery.mat and (gallery.mat, _plots(gallery.mat)),
        "missing": gallery.missing,
        "regions": region_table(figures),
    }


def _hero(galleries: dict[str, dict], pair: list[str]) -> list[dict]:
    """Return the pictures at the top: the best design, where it presses, and what it beats."""
    pictured = [galleries[name] for name in pair if name in galleries and not
                galleries[name]["missing"]]
    told = [{**each, "picture": each["pictures"][0], "told": each["why"]} for each in pictured]
    if told and pictured[0]["id"] == pair[0] and len(pictured[0]["pictures"]) > 1:
        pressed = pictured[0]["pictures"][1]
        where = {"mark": "", "place": "Where that presses", "told": pressed.caption}
        told.insert(1, {"picture": pressed, **where})
    return told


def _scale(end: float) -> dict:
    """Return the pressure colour bar: CSS gradient and tick labels [kPa]."""
    stops = ", ".join(f"{colour} {100 * share:.3g}%" for share, colour in colour_stops())
    return {
        "gradient": Markup(f"linear-gradient(to right, {stops})"),
        "ticks": [number_text(tick) for tick in np.linspace(0, end * 1e-3, 3)],
    }


def _plots(chart: Chart) -> list[dict]:
    """Return heading, id, height [pixel] and data of each figure of a chart; charts.js draws it."""
    return [
        {
            "heading": heading,
            "id": f"chart-{chart.id}-{number}",
            "height": figure.layout.height,
            "data": as_data(json.loads(figure.to_json())),
        }
        for number, (heading, figure) in enumerate(chart.figures.items())
    ]
