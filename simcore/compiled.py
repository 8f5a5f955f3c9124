"""Compilation of the kernels: to machine code, once a machine, kept beside the source.

Several processes of a sweep may compile the same kernel at once. Numba numbers the entries of a
kernel's cache without a lock: two processes that compile it for different types can write the
code of the one under the number of the other, and the next process that loads it crashes.
"""

import fcntl
from pathlib import Path

from numba import njit
from numba.core.caching import IndexDataCacheFile

compiled = njit(cache=True, error_model="numpy")
"""Decorator of a kernel; division by zero gives infinity, as in numpy."""

_save = IndexDataCacheFile.save


def _save_alone(self, key, data) -> None:
    """Write an entry while no other process writes to the same folder."""
    with (Path(self._cache_path) / "numba.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        _save(self, key, data)


IndexDataCacheFile.save = _save_alone
