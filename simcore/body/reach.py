"""Which statures and masses exist: a table of the bodies that the data can make.

The table, reach.csv, is computed from the MakeHuman data by `python -m simcore.body.reach` and
kept beside this file, so that a design out of reach is refused before the data is even read.
"""

import csv
import sys
from functools import cache
from pathlib import Path

import numpy as np

from simcore.errors import DesignError

TABLE = Path(__file__).with_name("reach.csv")
COLUMNS = ("sex", "age_years", "stature_m", "mass_min_kg", "mass_max_kg")

# Bodies blend linearly from 18 to 25 and from 25 to 90 years, their masses as the cube of that; at
# 60 the strongest ones end.
AGE_NODES = ((18.0, 20.0, 21.25, 22.5, 23.75, 25.0, 45.0, 59.999), (60.0, 90.0))  # [year]
STATURE_NODES = 41  # statures of each age, denser towards the shortest and the tallest


def check_body(design, name: str | None = None) -> None:
    """Raise DesignError, naming the range, when no body has the design's stature and mass.

    Parameters
    ----------
    design
        Has `sex`, `age_years`, `stature_m` and `mass_kg`.
    name : str, optional
        Name of the body; by default its sex and age.
    """
    name = name or f"{design.sex} of {design.age_years:g} years"
    statures, lightest, heaviest = _reach(design.sex, design.age_years)
    if not statures[0] <= design.stature_m <= statures[-1]:
        raise DesignError(
            f"body {name}: stature_m {design.stature_m:g} is out of reach; bodies of this sex and"
            f" age are {statures[0]:.2f} to {statures[-1]:.2f} m"
        )
    low = np.interp(design.stature_m, statures, lightest)
    high = np.interp(design.stature_m, statures, heaviest)
    if not low <= design.mass_kg <= high:
        raise DesignError(
            f"body {name}: mass_kg {design.mass_kg:g} is out of reach; bodies of this sex and age"
            f" and {design.stature_m:g} m are {low:.1f} to {high:.1f} kg"
        )


def _reach(sex: str, age: float) -> np.ndarray:
    """Statures [m], least and greatest masses [kg] of a sex and age (3, STATURE_NODES)."""
    table = _tables()[sex]
    nodes = next(nodes for nodes in reversed(AGE_NODES) if age >= nodes[0])
    older = int(np.clip(np.searchsorted(nodes, age), 1, len(nodes) - 1))
    younger = older - 1
    share = min((age - nodes[younger]) / (nodes[older] - nodes[younger]), 1.0)
    return (1 - share) * table[nodes[younger]] + share * table[nodes[older]]


@cache
def _tables() -> dict[str, dict[float, np.ndarray]]:
    """Sex → age [year] → statures and masses as in `_reach`."""
    tables = {}
    with TABLE.open(encoding="ascii", newline="") as file:
        for row in csv.DictReader(file):
            ages = tables.setdefault(row["sex"], {})
            ages.setdefault(float(row["age_years"]), []).append(
                [float(row[column]) for column in COLUMNS[2:]]
            )
    return {
        sex: {age: np.array(rows).T for age, rows in ages.items()}
        for sex, ages in tables.items()
    }


def _compute() -> list[tuple]:
    """Rows of the table."""
    from simcore.body.construct import family_of
    from simcore.body.phenotype import reachable_masses, reachable_statures

    rows = []
    for sex in ("female", "male"):
        for age in (age for nodes in AGE_NODES for age in nodes):
            family = family_of(sex, age)
            shortest, tallest = reachable_statures(family)
            share = (1 - np.cos(np.pi * np.linspace(0, 1, STATURE_NODES))) / 2
            for stature in shortest + share * (tallest - shortest):
                stature = min(float(stature), tallest)  # not past it by rounding
                low, high = reachable_masses(family, stature)
                rows.append((sex, f"{age:g}", f"{stature:.5f}", f"{low:.3f}", f"{high:.3f}"))
    return rows


def _write(file) -> None:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(_compute())


if __name__ == "__main__":
    _write(sys.stdout)
