"""The cache of compiled kernels: filled by several processes at once, read by several clones, and
the same to the bit for the one that fills it."""

import gc
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core.caching import IndexDataCacheFile

import simcore.compiled

WRITER = """
import sys
from numba.core.caching import IndexDataCacheFile
import simcore.compiled
cache = IndexDataCacheFile(sys.argv[1], "kernel", "stamp")
for i in range(60):
    key = f"{sys.argv[2]} {i}"
    cache.save(key, key)
"""

KERNEL = """
from simcore.compiled import compiled

@compiled
def kernel(x):
    return x + {added}
"""
CALLER = """
from simcore.{folder}.same import kernel
print(kernel(1), *kernel.stats.cache_hits.values(), sep=",")
"""

PLANES = """
import sys
from hashlib import sha256
import numpy as np
from simcore.sheet.vertex_contact import LAW_SIZE, SUMS, TIE_SIZE, _sticking, solve_planes

rng, number, size = np.random.default_rng(1), np.float32, 4096
law, tie, sums, position, velocity, before = (
    rng.normal(size=(rows, size)).astype(number) for rows in (LAW_SIZE, TIE_SIZE, SUMS, 3, 3, 3)
)
law[:3] /= np.linalg.norm(law[:3], axis=0)
law[7:14] = abs(law[7:14])
told = law, tie, np.zeros((3, size), number), sums, position, velocity, before, abs(velocity[0])
friction, epsilon, time, h = number(0.5), number(0.01), number(0.3), number(0.1)
if sys.argv[1] == "called first":
    copies = [each.copy() for each in told]
    _sticking(*copies, friction, time, h, np.uint64(size))
solve_planes(*told, friction, epsilon, time, h, np.uint64(size))
print(sha256(b"".join(each.tobytes() for each in told)).hexdigest())
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


@pytest.fixture
def call(tmp_path):
    """Return a function that calls a kernel in a clone of the package by a process of its own."""

    def made(clone: str, folder: str, added: int) -> str:
        package = tmp_path / clone / "simcore"
        (package / folder).mkdir(parents=True, exist_ok=True)
        (package / "__init__.py").touch()
        for name in ("compiled.py", "cache.py"):
            shutil.copy(Path(simcore.compiled.__file__).parent / name, package)
        (package / folder / "same.py").write_text(KERNEL.format(added=added))
        done = subprocess.run(
            # Byte code would hide a change of the same second and length.
            [sys.executable, "-B", "-c", CALLER.format(folder=folder)], check=True, text=True,
            capture_output=True, cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(tmp_path / clone),
                              "SIMCORE_CACHE": str(tmp_path / "cache")},
        )  # fmt: skip
        return done.stdout.strip()

    return made


def test_clones_share_what_is_compiled(call):
    """The number behind the comma is there when the code was read from the cache."""
    assert call("first", "a", 1) == "2"
    assert call("first", "a", 1) == call("second", "a", 1) == "2,1"
    assert call("second", "a", 2) == "3"  # other sources
    assert call("first", "a", 1) == "2,1"


def test_files_of_one_name_are_kept_apart(call):
    told = [call("first", *each) for each in (("a", 1), ("b", 2), ("a", 1), ("b", 2))]
    assert told == ["2", "3", "2", "3,1"]  # the third sees both files for the first time


def test_last_bits_go_by_nothing_that_was_compiled_or_loaded_before(tmp_path):
    """`_sticking` by itself is rounded otherwise than what `solve_planes` has of it."""
    bits = [
        subprocess.run(
            [sys.executable, "-c", PLANES, order], check=True, text=True, capture_output=True,
            env=os.environ | {"SIMCORE_CACHE": str(tmp_path)},
        ).stdout
        for order in ("compiled", "loaded", "called first")
    ]
    assert bits[0] == bits[1] == bits[2]


def test_a_slice_of_another_shape_is_refused():
    @simcore.compiled.compiled
    def assign(values, given):
        values[:, 0] = given

    values = np.zeros((3, 2))
    assign(values, np.ones(3))
    assert values.tolist() == [[1, 0]] * 3
    with pytest.raises(ValueError, match="an array is assigned to a slice of another shape"):
        assign(values, np.ones(2))
    assert gc.isenabled()  # again, after compilation
