"""Dataset → what the page tells of each candidate when it is selected."""

import json

import numpy as np
import xarray as xr
from markupsafe import Markup

from simcore.dataset import simulate_command
from simcore.report.certificates import doubt_of
from simcore.report.findings import fall_reason
from simcore.report.limits import MARGIN, ROUNDING, limits_of
from simcore.report.quantities import QUANTITIES, axes_of, coordinates_at, number_text, place_text
from simcore.report.verdicts import MARKS, verdicts_of

CANDIDATES_MAX = 1000
"""Candidates that can be selected; more are left to the dataset."""


def candidates_of(ds: xr.Dataset) -> list[dict]:
    """Return the candidates as shown, at most `CANDIDATES_MAX`, in the order of the study.

    Each has its `id`, `place`, `verdict`, `mark`, `why` and `doubt` as texts, the `command` that
    simulates it again, `figures` as pairs of title and text, and `margins`: title, limit, margin
    as text and as number, where it is least, and whether the candidate is over the limit.
    """
    axes, verdicts, limits = axes_of(ds), verdicts_of(ds), limits_of(ds)
    scalars = [name for name in QUANTITIES if name in ds and ds[name].dims == verdicts.dims]
    told = []
    for index in list(np.ndindex(verdicts.shape))[:CANDIDATES_MAX]:
        figures = ds.isel(dict(zip(verdicts.dims, index, strict=True)))
        coordinates, verdict = coordinates_at(ds, index), verdicts.values[index]
        told.append(
            {
                "id": figures["candidate"].item(),
                "place": place_text(axes, coordinates),
                "verdict": verdict,
                "mark": MARKS[verdict],
                "why": fall_reason(figures),
                "doubt": doubt_of(figures),
                "command": simulate_command(ds.attrs.get("study", "STUDY"), coordinates),
                "figures": [
                    (QUANTITIES[name].title, QUANTITIES[name].text(figures[name].item()))
                    for name in scalars if np.isfinite(figures[name].item())
                ],
                "margins": [
                    _margin(limit, index) for limit in limits
                    if np.isfinite(limit.margin.values[index])
                ],
            }
        )
    return told


def as_data(content: object) -> Markup:
    """Return JSON that cannot end the script element that holds it."""
    return Markup(json.dumps(content, separators=(",", ":")).replace("<", "\\u003c"))


def _margin(limit, index: tuple[int, ...]) -> tuple:
    value = float(limit.margin.values[index])
    over = value < -ROUNDING
    # Over it by little is not over it by nothing.
    text = MARGIN.text(value) if not over or value < -0.005 else number_text(float(f"{value:.1g}"))
    return limit.title, limit.value, text, round(value, 4), limit.worst_part(index), over
