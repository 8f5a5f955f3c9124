"""What is accepted, what was measured, and whether it passes."""

import math
import time as clock
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np

from simcore.errors import SimulationError


def rounded(value: float) -> str:
    """Return a value with four significant figures."""
    return f"{value:.4g}"


@dataclass(frozen=True)
class Criterion:
    """What is accepted of one quantity: low ≤ value ≤ high.

    Attributes
    ----------
    key, what : str
        Name of the row, and what is measured.
    low, high : float
        Both finite: an error is accepted from zero on.
    unit : str
        Empty for a ratio.
    source : str
        Where the interval comes from.
    """

    key: str
    what: str
    low: float
    high: float
    unit: str
    source: str

    @property
    def interval(self) -> str:
        """What is accepted, in words, with its unit."""
        return f"{rounded(self.low)} to {rounded(self.high)} {self.unit}".rstrip()


@dataclass(frozen=True)
class Row(Criterion):
    """A criterion with what was measured.

    Attributes
    ----------
    value : float
        NaN where the simulation failed, which never passes.
    note : str
        Why it failed.
    """

    value: float
    note: str = ""

    @property
    def passed(self) -> bool:
        """Whether the value lies within the interval."""
        return self.low <= self.value <= self.high

    def as_dict(self) -> dict:
        """Return all fields and `passed` for JSON, which has no NaN."""
        value = self.value if math.isfinite(self.value) else None
        return asdict(self) | {"value": value, "passed": self.passed}


@dataclass(frozen=True, eq=False)
class Curve:
    """Points (n,) of a plot, joined by a line or marked."""

    label: str
    x: np.ndarray
    y: np.ndarray
    marked: bool = False


@dataclass(frozen=True, eq=False)
class Plot:
    """Curves on common axes; `name` is that of the file in docs/images."""

    name: str
    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]


@dataclass(frozen=True, eq=False)
class Measurement:
    """What a check found: the value of each of its criteria by key, and what to show of it."""

    values: dict[str, float]
    plots: tuple[Plot, ...] = ()


@dataclass(frozen=True)
class Check:
    """One scene, and the rows that come of it."""

    criteria: tuple[Criterion, ...]
    measure: Callable[[], Measurement]


@dataclass(frozen=True, eq=False)
class Outcome:
    """Rows and plots of a check that was run, and the wall time it took [s]."""

    rows: tuple[Row, ...]
    plots: tuple[Plot, ...]
    seconds: float


def run_check(check: Check) -> Outcome:
    """Run a check; a simulation that fails gives rows that do not pass."""
    begin, note = clock.perf_counter(), ""
    try:
        found = check.measure()
    except SimulationError as error:
        note = str(error)
        found = Measurement(dict.fromkeys((each.key for each in check.criteria), math.nan))
    rows = tuple(
        Row(**asdict(each), value=float(found.values[each.key]), note=note)
        for each in check.criteria
    )
    return Outcome(rows, found.plots, clock.perf_counter() - begin)
