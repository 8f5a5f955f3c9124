"""Compilation of the kernels to machine code, once a machine.

Four faults of numba's cache are mended here. It does not see that a kernel calls another of a file
that has changed: the code is kept in a folder named by the sources of all kernels. It looks for
code by where the package lies, so that another clone would compile the same kernels again: in that
folder each file goes by its place in the package. It numbers the entries of a kernel without a
lock: of two processes that compile it for different types at once, one can write its code under the
other's number, and the next process to load it crashes. And what a kernel has of another that it
calls may be run by all: that would make last bits go by what a process has compiled and loaded
before.

Two things that take a sixth of the time of compilation are left out.
"""

import fcntl
import gc
import hashlib
from pathlib import Path

import llvmlite.binding as llvm
import numba
from numba import njit
from numba.core import event
from numba.core.caching import IndexDataCacheFile, UserProvidedCacheLocator
from numba.core.codegen import CPUCodeLibrary
from numba.extending import overload
from numba.np import arrayobj

from simcore.cache import cache_folder

PACKAGE = Path(__file__).parent


def _source_digest() -> str:
    """Return the digest of all files with kernels."""
    digest = hashlib.sha256()
    for file in sorted(PACKAGE.rglob("*.py")):
        text = file.read_bytes()
        if b"compiled" in text:
            digest.update(text)
    return digest.hexdigest()[:16]


numba.config.CACHE_DIR = str(cache_folder() / "kernels" / _source_digest())

# Of loops over many arrays, whether these overlap is asked when they run; by default only if that
# takes no more than 128 comparisons, and the planes of a sheet need some 500.
llvm.set_option("simcore", "--vectorize-memory-check-threshold=4096")

_folder_of = UserProvidedCacheLocator.get_suitable_cache_subpath


def _folder_in_package(file: str) -> str:
    """Return where in the cache the code of a file goes, wherever the package lies."""
    folder = Path(file).resolve().parent
    if not folder.is_relative_to(PACKAGE.resolve()):
        return _folder_of(file)
    return str(PACKAGE.name / folder.relative_to(PACKAGE.resolve()))


UserProvidedCacheLocator.get_suitable_cache_subpath = staticmethod(_folder_in_package)

compiled = njit(cache=True, error_model="numpy")
"""Decorator of a kernel; division by zero gives infinity, as in numpy."""

fused = njit(cache=True, error_model="numpy", fastmath={"contract"})
"""The same, but products may be rounded with the sum they belong to, which makes the springs
of a sheet 1.7 times as fast. Nothing else of fast mathematics is allowed, so that what is not a
number stays one. Not for bodies: their meshes would be others."""

reassociated = njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
"""The same for sums, which may be taken in another order: in as many parts as the machine has
lanes. On one machine they are the same each time."""

inlined = njit(cache=True, error_model="numpy", inline="always")
"""Decorator of what kernels call for every point, and of what only passes on to others: put into
each of them, where calls would cost as much as what they do, or take long to compile. It can be
called from Python as well."""

_save = IndexDataCacheFile.save


def _save_alone(self, key, data) -> None:
    """Write an entry while no other process writes to the same folder."""
    with (Path(self._cache_path) / "numba.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        _save(self, key, data)


IndexDataCacheFile.save = _save_alone

_finish = CPUCodeLibrary._finalize_final_module


def _finish_for_itself(self) -> None:
    """Make machine code in which the copies of called kernels serve their caller alone.

    numba lets the first copy in memory serve all. Each is optimised once more than the kernel it is
    of, and where sums may be rounded otherwise (`fused`), so they are.
    """
    if self._shared_module is None:  # else it is read from the cache
        self._shared_module = self._final_module.clone()  # what callers will have copies of
        _turn(self._shared_module, llvm.Linkage.external, llvm.Linkage.linkonce_odr)
        _turn(self._final_module, llvm.Linkage.linkonce_odr, llvm.Linkage.internal)
    _finish(self)


def _turn(module, old: llvm.Linkage, new: llvm.Linkage) -> None:
    """Change who sees the functions that are seen by some."""
    for function in module.functions:
        if not function.is_declaration and function.linkage == old:
            function.linkage = new


CPUCodeLibrary._finalize_final_module = _finish_for_itself


def _refuse_shape(given, wanted) -> None:
    """Raise where a kernel assigns an array to a slice of another shape."""


@overload(_refuse_shape)
def _refuse_shape_in_kernels(given, wanted):
    def refuse(given, wanted):
        raise ValueError("an array is assigned to a slice of another shape")

    return refuse


arrayobj.raise_with_shape_context = _refuse_shape  # numba's writes both: 4 s


class _NoCollection(event.Listener):
    """No search for garbage during a compilation, which keeps nearly all it makes."""

    _depth = 0  # kernels compile those that they call

    def on_start(self, event) -> None:
        if not self._depth:
            self._wanted = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event) -> None:
        self._depth -= 1
        if not self._depth and self._wanted:
            gc.enable()


event.register("numba:compile", _NoCollection())
