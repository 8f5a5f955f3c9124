"""Results as xarray datasets and NetCDF files: written, read and put together here alone."""

import json
import os
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from simcore.body.regions import REGION_NAMES
from simcore.body.segments import SEGMENT_NAMES
from simcore.config import Candidate, Design, Study
from simcore.config.units import units_of_key
from simcore.energy import TERMS
from simcore.errors import DesignError
from simcore.limits.margins import COMPARATIVE, bounds, margin
from simcore.metrics import JOINTS, METRICS
from simcore.provenance import simulation_digest, versions
from simcore.recorder import Trajectory

SCHEMA = 3
"""Version of the file layout; `open_dataset` refuses others."""

ABOUT = ("title", "study", "comment")
"""Attributes that tell what a dataset is about."""

CONVENTIONS = "CF-1.11"

TRAJECTORY = {
    "q": (("time", "q_index"), "1", "configuration: root [m], quaternions x y z w, angles [rad]"),
    "v": (("time", "v_index"), "1", "velocity [m/s, rad/s]"),
    "device_position": (("time", "xyz"), "m", "origin of the frame of device or spreader bar"),
    "device_quaternion": (("time", "xyzw"), "1", "that frame to the world, x y z w"),
    "displacement": (("time",), "m", "how far the body has moved on what carries it"),
    "support_force": (("time", "xyz"), "N", "force that carries body and sheet, world axes"),
    "segment_force": (("time", "segment", "xyz"), "N", "contact force on each segment, world axes"),
    "contact_count": (("time",), "1", "points of device, skin or sheet in contact"),
    "depth_max": (("time",), "m", "deepest penetration within the frame"),
    "energy": (("time", "energy_term"), "J", "energies, and flows of energy since the start"),
    "mat_pressure": (
        ("time", "mat_x", "mat_y"), "Pa", "reading of a sensor mat on what carries the body"
    ),
    "sheet_position": (("time", "sheet_vertex", "xyz"), "m", "vertices of the sheet"),
    "strap_force": (("time", "strap", "xyz"), "N", "on the sheet from each strap, world axes"),
}
"""Dimensions, unit and meaning of each recorded column."""


def row(candidate: Candidate, status: str, reason: str, metrics: dict | None) -> xr.Dataset:
    """Return one candidate's figures; all NaN where it failed before there were any."""
    ds = xr.Dataset(coords={"region": list(REGION_NAMES), "joint": list(JOINTS)})
    for name, metric in METRICS.items():
        dims = (metric.per,) if metric.per else ()
        missing = np.full([ds.sizes[dim] for dim in dims], np.nan)
        ds[name] = (
            dims,
            metrics[name] if metrics else missing,
            {"units": metric.units, "long_name": metric.long_name},
        )
    ds["status"] = ((), status, {"long_name": "how the simulation ended"})
    ds["reason"] = ((), reason, {"long_name": "why it failed"})
    ds["candidate"] = ((), candidate.id, {"long_name": "digest of the design"})
    return ds


def trajectory_dataset(trajectory: Trajectory, pressure: np.ndarray) -> xr.Dataset:
    """Return the frames of a run; pressure (T, n) [Pa] only of skin vertices that were touched."""
    touched = np.flatnonzero(pressure.max(axis=0) > 0)
    columns = {name: getattr(trajectory, name, None) for name in TRAJECTORY}
    columns["device_quaternion"] = Rotation.from_matrix(trajectory.device_rotation).as_quat()
    ds = xr.Dataset(
        coords={
            "time": ("time", trajectory.time, {"units": "s", "long_name": "time after settling"}),
            "segment": list(SEGMENT_NAMES),
            "xyz": list("xyz"),
            "energy_term": list(TERMS),
            "skin_vertex": touched.astype(np.int32),
        }
    )
    for axis, meaning in (("mat_x", "along the mat, towards the feet"), ("mat_y", "to the left")):
        ds[axis] = (axis, getattr(trajectory, axis), {"units": "m", "long_name": meaning})
    for name, (dims, units, long_name) in TRAJECTORY.items():
        if columns[name] is not None:  # a rigid device has no sheet
            ds[name] = (dims, columns[name], {"units": units, "long_name": long_name})
    ds["skin_pressure"] = (
        ("time", "skin_vertex"),
        pressure[:, touched].astype(np.float32),
        {
            "units": "Pa",
            "long_name": "pressure over a sensor cell around each vertex, mean over the frame",
        },
    )
    return ds


def candidate_dataset(
    candidate: Candidate, figures: xr.Dataset, frames: xr.Dataset | None
) -> xr.Dataset:
    """Return a candidate's figures, its frames if there are any, and what it was made from."""
    ds = figures if frames is None else xr.merge([figures, frames])
    ds.attrs = _provenance() | {
        "design": candidate.design.model_dump_json(),
        "place_in_study": json.dumps(candidate.coordinates),
    }
    return ds


def candidate_path(folder: Path, candidate: Candidate) -> Path:
    """Return where a candidate's result is kept."""
    return folder / f"{candidate.id}.nc"


def has_current_result(folder: Path, candidate: Candidate) -> bool:
    """Return whether folder/ID.nc was made by the present code."""
    try:
        # Not by xarray, which takes ten times as long; there may be thousands of files to ask.
        with netCDF4.Dataset(candidate_path(folder, candidate)) as file:
            return getattr(file, "source_digest", None) == simulation_digest()
    except OSError:  # none yet, or not NetCDF
        return False


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
    return ds


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
    return open_dataset(file.parent / "candidates" / f"{chosen.item()}.nc")


def design_of(ds: xr.Dataset) -> Design:
    """Return the design that a candidate's file was simulated from."""
    return Design.model_validate_json(ds.attrs["design"])


def write_dataset(ds: xr.Dataset, path: Path) -> None:
    """Write compressed NetCDF so that `path` is either the whole file or untouched."""
    ds = ds.drop_encoding()  # of files read before: it would cut texts to the length of the first
    encoding = {
        name: {"zlib": True, "complevel": 4}
        for name, variable in ds.variables.items()
        if variable.ndim and variable.dtype.kind in "fiu"
    }
    for name in {"skin_pressure", "mat_pressure", "sheet_position"} & encoding.keys():
        # 9 bits of mantissa, 1 in 1000: far below what any sensor resolves, and halves the file;
        # a millimetre in a metre of sheet.
        encoding[name] |= {"significant_digits": 9, "quantize_mode": "BitRound"}
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        ds.to_netcdf(partial, engine="netcdf4", encoding=encoding)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


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
