"""The cache of compiled kernels, filled by several processes at once."""

import subprocess
import sys
from pathlib import Path

from numba.core.caching import IndexDataCacheFile

import simcore.compiled  # noqa: F401  (what is tested is done on import)

WRITER = """
import sys
from numba.core.caching import IndexDataCacheFile
import simcore.compiled
cache = IndexDataCacheFile(sys.argv[1], "kernel", "stamp")
for i in range(60):
    key = f"{sys.argv[2]} {i}"
    cache.save(key, key)
"""


def test_processes_that_save_at_once_find_each_its_own(tmp_path: Path):
    """Without the lock some key leads to another's code within a few entries."""
    writers = [
        subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path), name]) for name in "abc"
    ]
    assert [writer.wait() for writer in writers] == [0, 0, 0]
    cache = IndexDataCacheFile(str(tmp_path), "kernel", "stamp")
    keys = [f"{name} {i}" for name in "abc" for i in range(60)]
    assert [cache.load(key) for key in keys] == keys
