"""Two fixed tasks, timed in the run that they calibrate.

A history outlives its machine: a time over that of a fixed task can be compared where a time
cannot. The tasks must therefore stay as they are.
"""

import time as clock
from dataclasses import dataclass

import numpy as np

from simcore.compiled import compiled

TABLE_SIZE, GATHER_COUNT = 1 << 17, 1 << 18
"""A table of 1 MB, which no first-level cache holds, and how often it is read."""

MULTIPLIER, INCREMENT = 1_664_525, 1_013_904_223  # Numerical Recipes' generator, modulo 2³²


@dataclass(frozen=True)
class Calibration:
    """CPU times of the two tasks [ms].

    Attributes
    ----------
    kernel_ms : float
        Scattered reads with a few operations on each, compiled by numba: as contact does.
    sort_ms : float
        A table of as many numbers sorted by numpy. No product of matrices: libraries share that out
        among threads, which wait for each other on a busy machine.
    """

    kernel_ms: float
    sort_ms: float


def calibrate(rounds: int = 5) -> Calibration:
    """Return the medians of some rounds of both tasks."""
    table = np.random.default_rng(0).standard_normal(TABLE_SIZE)
    scattered_sum(table, 1)  # compiles, or loads what was compiled
    return Calibration(
        kernel_ms=_median_ms(lambda: scattered_sum(table, GATHER_COUNT), rounds),
        sort_ms=_median_ms(lambda: np.sort(table), rounds),
    )


@compiled
def scattered_sum(table, count):
    """Return Σ √(x² + y²) over pairs of entries of a table (2^k,) read in a scattered order."""
    mask = np.uint32(table.size - 1)
    state, total = np.uint32(1), 0.0
    for _ in range(count):
        state = np.uint32(state * np.uint32(MULTIPLIER) + np.uint32(INCREMENT))
        i = (state >> np.uint32(8)) & mask
        j = (i + np.uint32(1)) & mask
        total += np.sqrt(table[i] * table[i] + table[j] * table[j])
    return total


def _median_ms(task, rounds: int) -> float:
    times = []
    for _ in range(rounds):
        begin = clock.process_time()
        task()
        times.append(clock.process_time() - begin)
    return 1e3 * float(np.median(times))
