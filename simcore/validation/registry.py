"""All checks, in the order of the table."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from simcore.errors import DesignError
from simcore.validation import (
    convergence,
    friction,
    joints,
    lifts,
    pendulum,
    sheets,
    skin_friction,
)
from simcore.validation.table import Check, Criterion, Outcome, run_check

CHECKS: tuple[Check, ...] = (
    *sheets.CHECKS, *friction.CHECKS, *skin_friction.CHECKS, *joints.CHECKS, *pendulum.CHECKS,
    *lifts.CHECKS, *convergence.CHECKS,
)


def all_criteria() -> tuple[Criterion, ...]:
    """Return what is accepted of every row, in order."""
    return tuple(criterion for check in CHECKS for criterion in check.criteria)


def run(only: Sequence[str] = ()) -> Iterator[Outcome]:
    """Run the checks one by one.

    Parameters
    ----------
    only : sequence of str
        Keys of the rows wanted; none means all.

    Raises
    ------
    DesignError
        A key that no row has.
    """
    keys = [criterion.key for criterion in all_criteria()]
    for key in only:
        if key not in keys:
            raise DesignError(f"validate: no row {key}; accepted: {', '.join(keys)}")
    return _outcomes(set(only or keys))


def _outcomes(wanted: set[str]) -> Iterator[Outcome]:
    for check in CHECKS:
        if wanted.isdisjoint(criterion.key for criterion in check.criteria):
            continue
        outcome = run_check(check)
        yield replace(outcome, rows=tuple(row for row in outcome.rows if row.key in wanted))
