"""Dataset → sentences: what was found, for the whole study and for each body."""

import json

import numpy as np
import xarray as xr

from simcore.certificate import TOLERANCES
from simcore.report.quantities import QUANTITIES, Axis, axes_of, place_text
from simcore.report.verdicts import (
    FAILED,
    FELL,
    HELD,
    best_candidate,
    best_design,
    gentlest_candidate,
    gentlest_design,
    holds_every_body,
    threshold_axis,
    threshold_of,
    verdicts_of,
)

CAVEAT = (
    "Pressures compare designs within this study, computed over the cells of a sensor on a body "
    "of much simplified flesh; they are no measure of clinical risk."
)

CLOSE = TOLERANCES["fall_margin"]
"""Fall margins that differ by less are alike: so much may a finer mesh change them."""

_PRESSURE = QUANTITIES["peak_pressure"]


def headline(ds: xr.Dataset) -> str:
    """Return the finding of the whole study in one sentence: which designs hold, and the best."""
    verdicts = verdicts_of(ds)
    counts = {name: int((verdicts == name).sum()) for name in (HELD, FELL, FAILED)}
    total, held = verdicts.size, counts[HELD]
    if counts[FAILED] == total:
        return f"No verdict: {_all(total)} failed."
    bodies, whom = ds.sizes["body"], _whom(ds)
    if held == total:
        whose = "its" if total == 1 else "their"
        return f"{_all(total).capitalize()} held {whose} body{_and_best(ds)}."
    if not held:
        failed = f"; {counts[FAILED]} failed" if counts[FAILED] else ""
        return f"No design holds {'the body' if bodies == 1 else 'any body'}: " + (
            f"{counts[FELL]} of {total} candidates fell{failed}."
        )
    good = holds_every_body(ds)
    if not good.any():
        return f"No design holds {whom}: {held} of {total} candidates held."
    axis = threshold_axis(ds)
    designs = f"{int(good.sum())} of {good.size} designs hold {whom}"
    if axis is not None and good.dims == (axis.name,):
        values = sorted(value for value, ok in zip(axis.values, good.values, strict=True) if ok)
        which = f"{axis.title.capitalize()} {_listed(axis, values)}"
        return f"{which} holds {whom}{_and_best(ds)}."
    return f"{designs}{_and_best(ds)}."


def best_sentence(ds: xr.Dataset) -> str:
    """Return why the best design is best, and which presses least; empty without a choice."""
    best = best_design(ds)
    if not best or not _has_choice(ds):
        return ""
    figures, holds = ds.sel(best), bool(holds_every_body(ds).sel(best))
    bodies = ds["body"].values.tolist()
    margins, peaks = figures["fall_margin"].values, figures["peak_pressure"].values
    least, most = int(np.nanargmin(margins)), int(np.nanargmax(peaks))
    several = len(bodies) > 1
    margin = f"{margins[least]:.2f}".replace("-", "−")
    margin += f" ({bodies[least]})" if several else ""
    place = _design_text(ds, best)
    if not holds:
        return f"Nearest to holding {_whom(ds)} is {place}: its fall margin is {margin}."
    pressure = _PRESSURE.text(peaks[most]) + (f" ({bodies[most]})" if several else "")
    return (
        f"{'It' if _and_best(ds) else _capital(place)} leaves the largest margin to a fall: "
        f"{margin}, where 1 is unmoved and 0 about to fall{_and_close(ds)}. "
        f"Its peak pressure is {pressure}{_pressed_least(ds)}."
    )


def body_findings(ds: xr.Dataset) -> list[dict]:
    """Return for each body its name, who it is, its threshold and what is best, in words."""
    axes = axes_of(ds)
    people = json.loads(ds.attrs.get("designs", "{}"))
    anchor = best_design(ds) or {}
    findings = []
    for body in ds["body"].values.tolist():
        threshold = threshold_of(ds, anchor | {"body": body}) if anchor else None
        findings.append(
            {
                "name": body,
                "person": _person(people.get(body, {}).get("body")),
                "threshold": threshold,
                "text": _body_sentence(ds, axes, body, threshold),
            }
        )
    return findings


def fall_reason(figures: xr.Dataset) -> str:
    """Return in words when and how far one candidate slid; its status if it failed."""
    if figures["status"].item() != "ok":
        return figures["reason"].item() or figures["status"].item()
    if figures["fell"].item() > 0.5:
        time = figures["fall_time"].item()
        when = (
            f"while settling, {-time:.1f} s before the device moved"
            if time < 0
            else f"{time:.1f} s after the device started to move"
        )
        return f"fell {when}"
    slide = QUANTITIES["slide_distance"].text(figures["slide_distance"].item())
    return f"held with a fall margin of {figures['fall_margin'].item():.2f}, slid {slide}"


def _body_sentence(ds: xr.Dataset, axes: tuple[Axis, ...], body: str, threshold) -> str:
    parts = []
    if threshold is not None:
        others = {axis.name for axis in axes} - {"body", threshold.axis.name}
        where = "with the other axes as in the best design, " if others else ""
        parts.append(f"Along {threshold.axis.title}, {where}it {threshold.text}.")
    best, gentlest = best_candidate(ds, body), gentlest_candidate(ds, body)
    if best is None:
        return " ".join([*parts, "Every simulation failed."]) if not parts else parts[0]
    figures = ds.sel(best)
    place = _design_text(ds, best)
    if gentlest is None:
        parts.append(f"Nearest to holding is {place}: it {fall_reason(figures)}.")
        return " ".join(parts)
    if not place:
        pressure = _PRESSURE.text(figures["peak_pressure"].item())
        return f"It {fall_reason(figures)}; the peak pressure is {pressure}.{_on_the_bed(figures)}"
    pressure = _PRESSURE.text
    parts.append(
        f"Its largest fall margin is {figures['fall_margin'].item():.2f} at {place}, "
        f"with a peak pressure of {pressure(figures['peak_pressure'].item())}"
    )
    if int((verdicts_of(ds).sel(body=body) == HELD).sum()) == 1:
        parts[-1] += "; no other design holds it."
    elif gentlest == best:
        parts[-1] += ", the lowest of all that hold it."
    else:
        low = pressure(ds.sel(gentlest)["peak_pressure"].item())
        parts[-1] += f"; pressed least is {_design_text(ds, gentlest)}, {low}."
    return " ".join(parts) + _on_the_bed(figures)


def _and_best(ds: xr.Dataset) -> str:
    """Return which design is best; empty where that is no choice, or it drops a body."""
    best, margins = best_design(ds), _least_margins(ds)
    if not _has_choice(ds) or len(set(margins)) < 2 or not holds_every_body(ds).sel(best):
        return ""
    return f"; best is {_design_text(ds, best)}"


def _and_close(ds: xr.Dataset) -> str:
    """Return how many designs are as good as the best within what a finer mesh may change."""
    margins = _least_margins(ds)
    close = int((margins >= margins.max() - CLOSE).sum()) - 1
    if close < 1:
        return ""
    others = "one other design comes" if close == 1 else f"{close} other designs come"
    return f"; {others} within {CLOSE:g} of it"


def _least_margins(ds: xr.Dataset) -> np.ndarray:
    """Return the least fall margin over the bodies, as shown, of each design that holds all."""
    margins = ds["fall_margin"].min("body").where(holds_every_body(ds)).values
    return np.round(margins[np.isfinite(margins)], 2)


def _has_choice(ds: xr.Dataset) -> bool:
    return any(len(axis.values) > 1 for axis in axes_of(ds) if axis.name != "body")


def _pressed_least(ds: xr.Dataset) -> str:
    """Return which other design presses least the body that it presses most, of those that hold.

    Empty where all press alike.
    """
    peak = ds["peak_pressure"].max("body").where(holds_every_body(ds))
    if len({_PRESSURE.text(value) for value in peak.values.ravel() if np.isfinite(value)}) < 2:
        return ""
    gentlest = gentlest_design(ds)
    if gentlest == best_design(ds):
        return ", the lowest of all that hold"
    most = _PRESSURE.text(peak.sel(gentlest).item())
    return f"; {_design_text(ds, gentlest)} presses least, {most}"


def _on_the_bed(figures: xr.Dataset) -> str:
    """Return a sentence on the pressure in bed of one who hung in a sling; else nothing."""
    if not np.isfinite(figures["peak_strap_force"].item()):
        return ""
    lying = _PRESSURE.text(figures["lying_peak_pressure"].item())
    return f" Lying on the bed before the lift, the peak was {lying}."


def _design_text(ds: xr.Dataset, coordinates: dict) -> str:
    return place_text(
        axes_of(ds), {name: value for name, value in coordinates.items() if name != "body"}
    )


def _capital(text: str) -> str:
    """Return words with a capital, but a name of a design as it is."""
    return text if "_" in text.split()[0] else text[:1].upper() + text[1:]


def _listed(axis: Axis, values: list) -> str:
    """Return values as ranges of neighbours on the axis: "4°, 6° to 12°"."""
    order = sorted(axis.values)
    places = [order.index(value) for value in values]
    groups = np.split(np.array(places), np.flatnonzero(np.diff(places) > 1) + 1)
    return ", ".join(
        axis.text(order[group[0]])
        if len(group) == 1
        else f"{axis.text(order[group[0]])} to {axis.text(order[group[-1]])}"
        for group in groups
    )


def _person(design: dict | None) -> str:
    if not design:
        return ""
    return (
        f"{design['sex']}, {design['age_years']:g} years, {design['stature_m']:.2f} m, "
        f"{design['mass_kg']:g} kg"
    )


def _whom(ds: xr.Dataset) -> str:
    count = ds.sizes["body"]
    return {1: "the body", 2: "both bodies"}.get(count, f"all {count} bodies")


def _all(total: int) -> str:
    return "the one candidate" if total == 1 else f"all {total} candidates"
