"""Dataset → the few candidates that are worth a picture."""

from dataclasses import dataclass

import xarray as xr

from simcore.report.quantities import Axis, axes_of
from simcore.report.verdicts import (
    FAILED,
    best_candidate,
    best_design,
    gentlest_candidate,
    threshold_of,
    verdicts_of,
)


@dataclass(frozen=True)
class Exemplar:
    """A candidate to show, by its coordinates, and why it was chosen."""

    coordinates: dict
    reasons: tuple[str, ...]


def choose_exemplars(ds: xr.Dataset, at_most: int = 8) -> list[Exemplar]:
    """Return the candidates to show, in the order of the study; none of them failed.

    Wanted for each body, the first of these the most: either side of the fall threshold, the
    largest fall margin, the lowest peak pressure, and both ends of each axis with the other axes as
    in the best design.
    Bodies take turns, so that none is left out for another's lesser wishes.
    """
    anchor = best_design(ds)
    if anchor is None:
        return []
    axes = axes_of(ds)
    verdicts = verdicts_of(ds)
    wishes = [
        (rank, reason, coordinates)
        for body in ds["body"].values.tolist()
        for rank, (reason, coordinates) in enumerate(_wishes(ds, axes, anchor, body))
        if verdicts.sel(coordinates).item() != FAILED
    ]
    chosen: dict[tuple, list[str]] = {}
    for _, reason, coordinates in sorted(wishes, key=lambda wish: wish[0]):
        key = tuple(coordinates[axis.name] for axis in axes)
        if key in chosen:
            chosen[key].append(reason)
        elif len(chosen) < at_most:
            chosen[key] = [reason]
    order = [axis.values for axis in axes]
    return [
        Exemplar(
            dict(zip((axis.name for axis in axes), key, strict=True)), tuple(chosen[key])
        )
        for key in sorted(
            chosen,
            key=lambda key: [values.index(v) for values, v in zip(order, key, strict=True)],
        )
    ]


def _wishes(ds: xr.Dataset, axes: tuple[Axis, ...], anchor: dict, body: str) -> list[tuple]:
    here = anchor | {"body": body}
    wishes = []
    threshold = threshold_of(ds, here)
    if threshold is not None:
        for before, after in zip(threshold.runs, threshold.runs[1:], strict=False):
            name = threshold.axis.name
            wishes.append((f"last that {before.verdict} before the threshold",
                           here | {name: before.high}))
            wishes.append((f"first that {after.verdict} after the threshold",
                           here | {name: after.low}))
    best = best_candidate(ds, body)
    if best is not None:
        wishes.append(("largest fall margin of this body", best))
    gentlest = gentlest_candidate(ds, body)
    if gentlest is not None:
        wishes.append(("lowest peak pressure of this body", gentlest))
    for axis in axes:
        if axis.numeric and len(axis.values) > 1:
            for word, end in (("lowest", min(axis.values)), ("highest", max(axis.values))):
                wishes.append((f"{word} {axis.title}", here | {axis.name: end}))
        elif axis.name != "body":
            wishes += [(f"{axis.title}: {value}", here | {axis.name: value})
                       for value in axis.values]
    return wishes
