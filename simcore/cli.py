"""The command `simcore`."""

import json
import os
import sys
import webbrowser
from dataclasses import asdict
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from simcore.errors import DesignError

app = typer.Typer(
    no_args_is_help=True, pretty_exceptions_enable=False, help=__doc__, add_completion=False
)
console = Console(soft_wrap=True)

StudyPath = Annotated[Path, typer.Argument(help="YAML file of a study")]
RunPath = Annotated[Path, typer.Argument(help="a run's file: candidates/ID.nc, or of --out")]
Replacements = Annotated[
    list[str] | None, typer.Option("--set", help="PATH=VALUE, replaces a value or fixes an axis")
]


@app.command()
def check(study: StudyPath) -> None:
    """Check a study, its designs and its meshes; simulate nothing."""
    from simcore.body import check_body
    from simcore.config import load_study
    from simcore.scene import check_device

    loaded = load_study(study)
    for design in {candidate.design.body for candidate in loaded.candidates}:
        check_body(design)
    designs = (candidate.design for candidate in loaded.candidates)
    different = {(each.device, each.method, each.posture.placement): each for each in designs}
    for design in different.values():
        try:
            check_device(design, loaded.root)
        except DesignError as error:
            raise DesignError(f"{study}: {error}") from None
    axes = " × ".join(f"{len(values)} {name}" for name, values in loaded.axes.items())
    certified = f", {len(loaded.variants)} of them to certify" if loaded.variants else ""
    console.print(
        f"{study}: {len(loaded.candidates)} candidates ({axes}){certified}", highlight=False
    )


@app.command()
def body(
    design: Annotated[Path, typer.Argument(help="designs/bodies/NAME.yaml")],
    out: Annotated[Path | None, typer.Option(help="GLB file [default: results/bodies]")] = None,
) -> None:
    """Build a body, print its masses beside de Leva's, and write it as GLB."""
    from simcore.body import check_body
    from simcore.config import BodyDesign, read_design

    model = read_design(BodyDesign, design)
    check_body(model, design.stem)
    if out:
        _refuse_unwritable(out)
    from simcore.body import build_body, describe_body, write_glb  # slow to import

    built = build_body(model, design.stem)
    out = out or Path("results/bodies") / f"{design.stem}.glb"
    console.print(
        f"{design.stem}: stature {built.stature:.4f} m (asked {model.stature_m:.3f}), "
        f"mass {built.mass:.2f} kg (asked {model.mass_kg:.1f}), "
        f"{built.skin.vertex_count} skin vertices, {built.model.nv} degrees of freedom",
        highlight=False,
    )
    table = Table("part", "mass [kg]", "share [%]", "de Leva [%]")
    for row in describe_body(built, model):
        table.add_row(*row)
    console.print(table)
    write_glb(built, out)
    console.print(f"written: {out}", highlight=False)


@app.command()
def simulate(
    study: StudyPath,
    replace: Replacements = None,
    out: Annotated[Path | None, typer.Option(help="NetCDF file to write")] = None,
    certify: Annotated[
        bool, typer.Option("--certify", help="simulate it at half the step and twice the mesh, too")
    ] = False,
) -> None:
    """Simulate one candidate of a study; --set must fix every axis of several values."""
    from simcore import certificate
    from simcore.config import load_study, refined
    from simcore.dataset import candidate_dataset, write_dataset
    from simcore.sweep import run_candidate

    loaded = load_study(study, _parse(replace or []))
    if out:
        _refuse_unwritable(out)
    if len(loaded.candidates) > 1:
        free = [f"{name}=…" for name, values in loaded.axes.items() if len(values) > 1]
        raise DesignError(f"{study}: several candidates; add --set {' --set '.join(free)}")
    (candidate,) = loaded.candidates
    if certify:
        refined(candidate.design, "--certify")  # refuses a mesh too fine before anything is run
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[now]}"),
        TimeElapsedColumn(), console=console, transient=True, disable=not console.is_terminal,
    )
    method, device = candidate.design.method, candidate.design.device
    longest = (
        method.settling.duration_max_s + device.motion.keyframes[-1].time_s + method.hold_s
    )

    def told(what: str):
        task, began = bar.add_task(what, total=longest, now=""), monotonic()

        def now(time: float) -> None:
            speed = time / max(monotonic() - began, 1e-3)
            bar.update(task, completed=time, now=f"{time:.1f} s, {speed:.2f} × real time")

        return now

    with bar:
        figures, run, trajectory = run_candidate(candidate, loaded.root, told("simulating"))
        checked = certify and certificate.certify(candidate, figures, loaded.root, told)
    if out:
        kept = figures.merge(checked) if certify else figures
        write_dataset(candidate_dataset(candidate, kept, run), out)
    _print_figures(figures, trajectory)
    if certify:
        _print_certificate(figures, checked)
    if out:
        console.print(f"written: {out}", highlight=False)
    if figures.status.item() != "ok":
        raise typer.Exit(1)


@app.command()
def export(
    run: RunPath,
    glb: Annotated[bool, typer.Option("--glb", help="animated glTF: body, device, sheet")] = False,
    csv: Annotated[bool, typer.Option("--csv", help="tables: RUN_series.csv and others")] = False,
    out: Annotated[Path | None, typer.Option(help="file to write [default: beside RUN]")] = None,
) -> None:
    """Write a run in formats that other programs read."""
    if not (glb or csv):
        raise DesignError("export: nothing asked for; accepted: --glb, --csv or both")
    out = out or run.with_suffix(".glb")
    _refuse_unwritable(out)
    from simcore.export.gltf import to_glb
    from simcore.export.recording import open_recording
    from simcore.export.tables import tables_of
    from simcore.export.whole_file import write_whole

    recording = open_recording(run)
    files = {out: to_glb(recording)} if glb else {}
    if csv:
        tables = tables_of(recording)
        files |= {out.with_name(f"{out.stem}_{name}.csv"): tables[name] for name in tables}
    for path, content in files.items():
        write_whole(path, content)
        console.print(f"written: {path}", highlight=False)


@app.command()
def replay(
    run: RunPath,
    other: Annotated[Path | None, typer.Argument(help="another run, shown beside it")] = None,
    out: Annotated[Path | None, typer.Option(help="[default: RUN_replay.html beside RUN]")] = None,
    show: Annotated[bool, typer.Option("--open/--no-open", help="open it in a browser")] = True,
) -> None:
    """Write a replay in three dimensions, one HTML file that needs no network, and open it."""
    out = out or run.with_name(f"{run.stem}_replay.html")
    _refuse_unwritable(out)
    from simcore.export.recording import open_recording
    from simcore.viewer import write_replay

    write_replay([open_recording(each) for each in (run, other) if each], out)
    console.print(f"written: {out}", highlight=False)
    if show:
        webbrowser.open(out.resolve().as_uri())


@app.command()
def plot(
    results: Annotated[Path, typer.Argument(help="results/STUDY, or its dataset.nc")],
    metric: Annotated[str, typer.Argument(help="such as peak_pressure: docs/dataset.md")],
    axis: Annotated[
        list[str] | None,
        typer.Option(help="along the picture; given twice, a heat map [default: as in the report]"),
    ] = None,
    replace: Annotated[
        list[str] | None, typer.Option("--set", help="AXIS=VALUE [default: as the best design]")
    ] = None,
    out: Annotated[Path | None, typer.Option(help=".png or .svg [default: METRIC.svg]")] = None,
) -> None:
    """Draw a metric for a publication: over one axis bodies as series, over two a heat map."""
    out = out or Path(f"{metric}.svg")
    _refuse_unwritable(out)
    from simcore.report.plot import write_plot

    write_plot(results, metric, axis or (), _parse(replace or []), out)
    console.print(f"written: {out}", highlight=False)


@app.command()
def bench(
    case: Annotated[str, typer.Argument(help="lift, fall, paper, paper_fall or sling")] = "lift",
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of a table")] = False,
    repeats: Annotated[int, typer.Option(min=1, help="timed runs; the median is told")] = 3,
    stages: Annotated[
        bool, typer.Option("--profile", help="time each stage of a step, too")
    ] = False,
    history: Annotated[Path | None, typer.Option(help="JSONL file to add the result to")] = None,
) -> None:
    """Time the engine at paper size on one core."""
    from simcore.bench import CASES, append, bench_case, case_scene, new_entry, profile_scene

    if case not in CASES:
        raise DesignError(f"bench: no case {case}; accepted: {', '.join(CASES)}")
    if history:
        _refuse_unwritable(history)
    entry = new_entry(lambda: bench_case(case, repeats).as_dict())
    if stages:
        entry["profile"] = asdict(profile_scene(case_scene(case), repeats))
    if history:
        append(history, entry)
    if as_json:
        print(json.dumps(entry, indent=2))
        return
    table = Table("phase", "real-time factor")
    for name, factor in entry["phases"].items():
        table.add_row(name, f"{factor:.2f}")
    for name, spent in entry["beside"].items():
        table.add_row(name, f"{spent:.1f} ms")
    low, high = entry["spread"]
    table.add_row("whole run", f"{entry['real_time_factor']:.2f} ({low:.2f} to {high:.2f})")
    console.print(table)
    yardstick = entry["calibration"]
    console.print(f"calibrations {yardstick['kernel_ms']:.2f} ms and "
                  f"{yardstick['sort_ms']:.2f} ms", highlight=False)
    if stages:
        table = Table("stage", "µs a step")
        for name, spent in entry["profile"]["stages"].items():
            table.add_row(name, f"{spent:.0f}")
        table.add_row("whole step, watched", f"{entry['profile']['step']:.0f}")
        table.add_row("whole step", f"{entry['profile']['step_unwatched']:.0f}")
        table.add_row("set-up, once a run, ms", f"{entry['profile']['setup']:.0f}")
        console.print(table)


@app.command()
def validate(
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of a table")] = False,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="KEY of a row; may be repeated")
    ] = None,
) -> None:
    """Check the engine against closed forms and measurements; exit code 1 if a row fails."""
    from simcore.validation.registry import run
    from simcore.validation.table import rounded

    outcomes = run(only or ())
    with console.status("running", spinner="line"):
        outcomes = list(outcomes)
    rows = [row for outcome in outcomes for row in outcome.rows]
    seconds, passed = sum(each.seconds for each in outcomes), all(row.passed for row in rows)
    if as_json:
        told = {"passed": passed, "seconds": seconds, "rows": [row.as_dict() for row in rows]}
        print(json.dumps(told, indent=2))
    else:
        table = Table("row", "what", "value", "accepted", "source", "")
        table.columns[0].no_wrap = True
        for row in rows:
            table.add_row(row.key, row.what, row.note or rounded(row.value), row.interval,
                          row.source, "pass" if row.passed else "FAIL")
        console.print(table)
        failed = sum(not row.passed for row in rows)
        console.print(f"{len(rows) - failed} passed, {failed} failed, in {seconds:.0f} s",
                      highlight=False)
    if not passed:
        raise typer.Exit(1)


def _refuse_unwritable(out: Path) -> None:
    if out.is_dir():
        raise DesignError(f"--out {out}: is a folder; accepted: a file, such as {out / 'run.nc'}")
    above = next(folder for folder in out.absolute().parents if folder.exists())
    if not above.is_dir() or not os.access(above, os.W_OK):
        raise DesignError(f"--out {out}: cannot be written; accepted: a file in a folder of yours")


def _print_figures(figures, trajectory) -> None:
    table = Table("figure", "value", "unit", "meaning")
    for name, variable in figures.data_vars.items():
        if variable.ndim == 0:
            value = variable.item()
            shown = value if isinstance(value, str) else f"{value:.4g}"
            table.add_row(name, shown, variable.attrs.get("units", ""),
                          variable.attrs["long_name"])
    console.print(table)
    if figures.status.item() == "ok":
        factor = figures.simulated_time.item() / trajectory.cpu_time
        console.print(f"real-time factor {factor:.2f} (simulated s per CPU s)", highlight=False)


def _print_certificate(figures, certificate) -> None:
    from simcore.certificate import change_text, figures_of, tolerance_text

    verdict = {1.0: "passed", 0.0: "failed"}.get(certificate.certified.item())
    if verdict is None:
        console.print("certificate: none, the candidate failed")
        return
    table = Table("change of", *certificate.variant.values, "tolerance")
    for name in figures_of(figures, certificate):
        changes = certificate.change.sel(metric=name).values
        shown = [change_text(name, change) for change in changes]
        table.add_row(name, *shown, tolerance_text(name))
    console.print(table)
    reason = certificate.certificate_reason.item()
    console.print(f"certificate: {verdict}{reason and f' ({reason})'}", highlight=False)


def _parse(pairs: list[str]) -> dict:
    from simcore.config import parse_scalar

    values = {}
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if not equals or not key or not text:
            raise DesignError(f"--set {pair}: must be PATH=VALUE")
        if key in values:
            raise DesignError(f"--set {pair}: {key} is given twice; accepted: one value")
        values[key] = parse_scalar(text)
    return values


def main() -> None:
    """Run the command; a user's mistake is one line and exit code 2."""
    try:
        app()
    except DesignError as error:
        print("error:", " ".join(str(error).split()), file=sys.stderr)
        sys.exit(2)
