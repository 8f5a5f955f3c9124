"""Results as xarray datasets and NetCDF files: written, read and put together here alone."""

import json
import os
import shlex
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr

from simcore.body.regions import REGION_NAMES
from simcore.config import Candidate, Design, Study
from simcore.config.units import units_of_key
from simcore.errors import DesignError
from simcore.frames import PACKED
from simcore.limits.margins import COMPARATIVE, bounds, margin
from simcore.metrics import JOINTS, METRICS
from simcore.provenance import simulation_digest, versions

SCHEMA = 4
"""Version of the file layout; `open_dataset` refuses others."""

ABOUT = ("title", "study", "comment")
"""Attributes that tell what a dataset is about."""

CONVENTIONS = "CF-1.11"

KEPT, LEFT_OUT, NO_FRAMES = "kept", "left out", "none"
"""Values of a candidate's attribute `frames`; a run that failed before the first has none."""

COMPRESSED_MIN = 4096
"""Smaller variables are not compressed [bytes]: the chunks it takes would be larger than they."""


def row(candidate: Candidate, status: str, reason: str, metrics: dict | None) -> xr.Dataset:
    """Return one candidate's figures; all NaN where it failed before there were any."""
    coords = {"region": list(REGION_NAMES), "joint": list(JOINTS)}
    figures = {}
    for name, metric in METRICS.items():
        dims = (metric.per,) if metric.per else ()
        missing = np.full([len(coords[dim]) for dim in dims], np.nan)
        figures[name] = (
            dims,
            metrics[name] if metrics else missing,
            {"units": metric.units, "long_name": metric.long_name},
        )
    figures["status"] = ((), status, {"long_name": "how the simulation ended"})
    figures["reason"] = ((), reason, {"long_name": "why it failed"})
    figures["candidate"] = ((), candidate.id, {"long_name": "digest of the design"})
    return xr.Dataset(figures, coords)


def candidate_dataset(
    candidate: Candidate, figures: xr.Dataset, run: xr.Dataset | None, keep_frames: bool = True
) -> xr.Dataset:
    """Return a candidate's figures, its run if there is any, and what it was made from.

    Parameters
    ----------
    candidate : Candidate
    figures : xr.Dataset
        From `row`.
    run : xr.Dataset, optional
        From `simcore.frames.trajectory_dataset`.
    keep_frames : bool
        Without them the summary of the run is left.
    """
    if run is not None and not keep_frames:
        run = run.drop_dims("time")
        run = run.drop_vars(set(run.coords) - set(_dimensions(run.data_vars.values())))
    ds = figures if run is None else xr.merge([figures, run])
    ds.attrs = _provenance() | {
        "design": candidate.design.model_dump_json(),
        "place_in_study": json.dumps(candidate.coordinates),
        "frames": NO_FRAMES if run is None else KEPT if keep_frames else LEFT_OUT,
    }
    return ds


def _dimensions(variables) -> list[str]:
    return [dim for variable in variables for dim in variable.dims]


def candidate_path(folder: Path, candidate: Candidate) -> Path:
    """Return where a candidate's result is kept."""
    return folder / f"{candidate.id}.nc"


def has_current_result(folder: Path, candidate: Candidate, with_frames: bool = False) -> bool:
    """Return whether folder/ID.nc was made by the present code, and has its frames if asked for."""
    told = _attributes(candidate_path(folder, candidate), "source_digest", "frames")
    current = told.get("source_digest") == simulation_digest()
    return current and not (with_frames and told.get("frames") == LEFT_OUT)


def has_frames(path: Path) -> bool:
    """Return whether a candidate's file holds the frames of its run."""
    return _attributes(path, "frames").get("frames") == KEPT


def _attributes(path: Path, *names: str) -> dict:
    """Return some attributes of a file; none if there is no file, or it is not NetCDF."""
    try:
        # Not by xarray, which takes ten times as long; there may be thousands of files to ask.
        with netCDF4.Dataset(path) as file:
            return {name: getattr(file, name, None) for name in names}
    except OSError:
        return {}


def read_row(folder: Path, candidate: Candidate) -> xr.Dataset:
    """Return the figures of a candidate without its trajectory."""
    with xr.open_dataset(candidate_path(folder, candidate)) as ds:
        return ds[[*METRICS, "status", "reason", "candidate"]].load()


def write_rows(rows: list[xr.Dataset], path: Path) -> None:
    """Write the figures of several candidates as one table."""
    table = xr.concat(rows, dim="row")
    table.attrs = _provenance()
    write_dataset(table, path)


def read_tables(tables: list[Path]) -> xr.Dataset:
    """Return the figures in the tables of all jobs; `row` is the candidate's id."""
    parts = []
    for path in tables:
        with xr.open_dataset(path) as part:
            parts.append(part.load())
    return xr.concat(parts, dim="row").set_index(row="candidate").drop_duplicates("row")


def collect(study: Study, tables: list[Path]) -> xr.Dataset:
    """Put the tables of all jobs together on the axes of the study, with margins to all limits.

    Variants are left out.
    """
    table = read_tables(tables).sel(row=[candidate.id for candidate in study.candidates])
    shape = tuple(len(values) for values in study.axes.values())
    ds = xr.Dataset(
        coords={
            name: (name, list(values), _axis_attributes(study, name))
            for name, values in study.axes.items()
        }
    )
    table = table.reset_index("row")
    for name, column in table.data_vars.items():
        dims = (*study.axes, *column.dims[1:])
        ds[name] = (dims, column.values.reshape(shape + column.shape[1:]), column.attrs)
    ids = np.array([candidate.id for candidate in study.candidates], dtype=object)
    ds["candidate"] = (tuple(study.axes), ids.reshape(shape), {"long_name": "digest of the design"})
    ds = ds.assign_coords(region=table.region, joint=table.joint)
    ds = ds.assign(_margins(ds, study.file.exposure_s))
    ds.attrs = _provenance() | {
        "comment": COMPARATIVE,
        "title": study.file.title,
        "study": study.name,
        "config": study.path.read_text(encoding="utf-8"),
        "designs": json.dumps(
            {
                candidate.coordinates["body"]: json.loads(candidate.design.model_dump_json())
                for candidate in reversed(study.candidates)
            }
        ),
        "devices": json.dumps(
            {
                candidate.coordinates.get("device", study.file.devices[0]): json.loads(
                    candidate.design.device.model_dump_json()
                )
                for candidate in reversed(study.candidates)
            }
        ),
    }
    return ds


def _margins(ds: xr.Dataset, exposure: float) -> dict[str, xr.DataArray]:
    """Return what every candidate leaves of each limit for an exposure [s], by name (Eq. L1).

    Here and not among the metrics, because limits judge a result and do not decide it: another
    limit or exposure leaves every simulation as it is.
    """
    return {
        bound.name: margin(ds[bound.metric], bound.value).assign_attrs(
            units="1",
            long_name=f"margin to the limit of {bound.title}",
            metric=bound.metric,
            limit=bound.title,
            limit_value=bound.value,
            limit_units=bound.units,
            verified="read" if bound.verified else "unverified",
            extrapolated="yes" if bound.extrapolated else "no",
            source=bound.source,
            **({"exposure_s": bound.exposure} if bound.exposure else {}),
        )
        for bound in bounds(exposure)
    }


def open_dataset(path: Path, older: bool = False) -> xr.Dataset:
    """Open a dataset or a candidate that this project wrote.

    Parameters
    ----------
    path : Path
    older : bool
        Open what an earlier version wrote, too: figures may be lacking.

    Raises
    ------
    DesignError
        Missing, not NetCDF, or of another schema.
    """
    try:
        ds = xr.load_dataset(path)
    except (OSError, ValueError) as error:
        raise DesignError(f"{path}: cannot be read as NetCDF ({error})") from None
    if ds.attrs.get("schema") not in (range(1, SCHEMA + 1) if older else (SCHEMA,)):
        raise DesignError(
            f"{path}: schema {ds.attrs.get('schema', 'unknown')}, this version reads {SCHEMA}; "
            "run the sweep again"
        )
    return ds.transpose("time", ..., missing_dims="ignore")


def open_results(path: Path | str, **place) -> xr.Dataset:
    """Open a study's dataset, or of one of its candidates the run: see `simcore.open`."""
    path = Path(path)
    file = path / "dataset.nc" if path.is_dir() else path
    if path.is_dir() and not file.is_file():
        raise DesignError(
            f"{path}: holds no dataset.nc; accepted: a study's folder, such as results/lift_angle"
        )
    ds = open_dataset(file)
    # What it is comes before what it was made with, of which a notebook shows a line each.
    ds.attrs = {key: ds.attrs[key] for key in ABOUT if key in ds.attrs} | ds.attrs
    if not place:
        return ds
    if "config" not in ds.attrs:
        raise DesignError(f"{path}: is one run; a place ({', '.join(place)}) is of a study")
    axes = ds["candidate"].dims
    for name, value in place.items():
        if name not in axes:
            raise DesignError(f"{path}: {name}: no axis; accepted: {', '.join(axes)}")
        values = ds[name].values.tolist()
        if value not in values:
            raise DesignError(f"{path}: {name}: {value} is none of {', '.join(map(str, values))}")
    chosen = ds["candidate"].sel(place).squeeze()
    if chosen.ndim:
        raise DesignError(f"{path}: several candidates; add {', '.join(chosen.dims)}")
    run = open_dataset(file.parent / "candidates" / f"{chosen.item()}.nc")
    refuse_without_frames(run, file.parent / "candidates" / f"{chosen.item()}.nc")
    return run


def refuse_without_frames(run: xr.Dataset, path: Path) -> None:
    """Raise where a candidate's file holds no frames; the message says how to get them."""
    told = run.attrs.get("frames", KEPT)
    if told == NO_FRAMES:
        reason = run["reason"].item()
        raise DesignError(f"{path}: holds no frames: the run failed before it began ({reason})")
    if told == LEFT_OUT:
        place = json.loads(run.attrs["place_in_study"])
        raise DesignError(
            f"{path}: holds no frames, which a sweep of many candidates keeps of few; "
            + _how_to_keep(path, place)
        )


def _how_to_keep(path: Path, place: dict) -> str:
    """Return what to do for the frames of a candidate, given its place in its study."""
    if "variant" in place:
        return "set `trajectories: all` in the study and sweep again"
    folder = path.resolve().parent
    study = folder.parent.name if folder.name == "candidates" else "STUDY"
    return f"to have them: {simulate_command(study, place)}"


def simulate_command(study: str, coordinates: dict) -> str:
    """Return the shell command that simulates one candidate of a study again."""
    words = ["simcore", "simulate", f"config/{study}.yaml"]
    for name, value in coordinates.items():
        words += ["--set", f"{name}={_plain(value)}"]
    return shlex.join([*words, "--out", "run.nc"])


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def design_of(ds: xr.Dataset) -> Design:
    """Return the design that a candidate's file was simulated from."""
    return Design.model_validate_json(ds.attrs["design"])


def write_dataset(ds: xr.Dataset, path: Path) -> None:
    """Write NetCDF, packed and compressed, so that `path` is either the whole file or untouched.

    Time is the last dimension there: what hardly changes from frame to frame compresses best so.
    """
    ds = ds.drop_encoding()  # of files read before: it would cut texts to the length of the first
    ds = ds.transpose(..., "time", missing_dims="ignore")
    encoding = {
        name: _packing(name, variable.values)
        | ({"zlib": True, "complevel": 4} if variable.nbytes > COMPRESSED_MIN else {})
        for name, variable in ds.variables.items()
        if variable.ndim and variable.dtype.kind in "fiu"
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        ds.to_netcdf(partial, engine="netcdf4", encoding=encoding)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _packing(name: str, values: np.ndarray) -> dict:
    """Return how a variable is written as integers; larger steps where the usual end too soon."""
    largest = float(np.abs(values).max(initial=0.0)) if name in PACKED else np.nan
    if not np.isfinite(largest):
        return {}
    kind, step = PACKED[name]
    most = np.iinfo(kind).max  # stands for a missing value
    step = np.float32(max(step, largest / (most - 1)))
    return {"dtype": kind, "scale_factor": step, "_FillValue": most}


def _provenance() -> dict:
    return {
        "Conventions": CONVENTIONS,
        "schema": SCHEMA,
        "source_digest": simulation_digest(),
        "versions": versions(),
    }


def _axis_attributes(study: Study, name: str) -> dict:
    if name == "body":
        return {"long_name": "body design"}
    path = study.axis_paths[name]
    return {"units": units_of_key(path), "long_name": path}
