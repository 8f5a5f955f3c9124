"""Candidates' files → the replays that a report holds, and which two it begins with."""

from itertools import islice
from pathlib import Path

import numpy as np
import xarray as xr

from simcore.dataset import has_frames
from simcore.report.candidates import CANDIDATES_MAX
from simcore.report.exemplars import choose_exemplars
from simcore.report.quantities import axes_of, coordinates_at, place_text
from simcore.report.runs import Run, read_run
from simcore.report.verdicts import FELL, HELD, best_design, verdicts_of
from simcore.viewer import Replays

RUNS_MAX = 40
"""Replays of a report: packing one takes half a second."""


def first_pair(ds: xr.Dataset) -> list[str]:
    """Return the names of one or two candidates to see first, side by side; none if all failed.

    The best design with the body to which it leaves the least margin; beside it, of the same body,
    the candidate that fell last, or where none fell, the one that is pressed most.
    """
    best = best_design(ds)
    if best is None:
        return []
    here = {"body": ds["body"].values[np.nanargmin(ds["fall_margin"].sel(best).values)]}
    row, verdicts = ds.sel(here), verdicts_of(ds).sel(here)
    first = row["candidate"].sel(best).item()
    others = row["candidate"] != first
    fallen = row["fall_margin"].where((verdicts == FELL) & others)
    pressed = row["peak_pressure"].where((verdicts == HELD) & others)
    for cost in (fallen, pressed):
        if cost.notnull().any():
            return [first, str(row["candidate"].values.flat[np.nanargmax(cost.values)])]
    return [first]


def names_shown(ds: xr.Dataset) -> list[str]:
    """Return the names of the candidates whose frames a report asks for, each once.

    The first pair, and the exemplars.
    """
    exemplars = (ds["candidate"].sel(each.coordinates).item() for each in choose_exemplars(ds))
    return list(dict.fromkeys([*first_pair(ds), *exemplars]))


def embed(
    ds: xr.Dataset, first: list[str], runs: dict[str, Run | str], folder: Path, root: Path,
    scale: float, room: int,
) -> Replays:
    """Return the replays that fit.

    In this order until there is no more room, or there are `RUNS_MAX`: the candidates named
    first, the exemplars, the others that can be selected, in the order of the study.

    Parameters
    ----------
    first : list of str
        Names of candidates.
    runs : dict
        Name → run, or why there is none, of candidates read already: the exemplars.
    folder, root : Path
        Hold the candidates' files and the mesh files of devices.
    scale : float
        End of the pressure scale [Pa].
    room : int
        Bytes that they may take.
    """
    replays, axes = Replays(scale), axes_of(ds)
    names = ds["candidate"].values
    places = {
        names[index]: place_text(axes, coordinates_at(ds, index))
        for index in np.ndindex(names.shape)
    }
    for name in dict.fromkeys([*first, *runs, *islice(places, CANDIDATES_MAX)]):
        run = runs[name] if name in runs else _kept(folder / f"{name}.nc", root)
        if not isinstance(run, Run) or not run.has_frames:
            continue
        if len(replays.runs) == RUNS_MAX or not replays.add(name, run, places[name], room):
            break
    return replays


def _kept(path: Path, root: Path) -> Run | str:
    """Return a candidate's run, or why there is none; a file without frames is not read."""
    return read_run(path, root) if has_frames(path) else "no frames"
