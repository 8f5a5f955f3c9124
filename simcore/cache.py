"""Content-addressed files in the user's cache folder."""

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from platformdirs import user_cache_dir


def cache_folder() -> Path:
    """Folder of all cached data: `$SIMCORE_CACHE`, or the user's cache folder."""
    return Path(os.environ.get("SIMCORE_CACHE") or user_cache_dir("simcore"))


def content_key(room: str, modules: Iterable[str], *parts: str | bytes) -> str:
    """Digest of the parts and of the sources of modules, of one room of the package."""
    digest = hashlib.sha256()
    for module in sorted(modules):
        digest.update((Path(__file__).parent / room / f"{module}.py").read_bytes())
    for part in parts:
        digest.update((part.encode() if isinstance(part, str) else part) + b"\0")
    return digest.hexdigest()[:20]


def cached_arrays(path: Path, make: Callable[[], dict]) -> dict[str, np.ndarray]:
    """Load the arrays of an .npz file, or make them and write the file atomically.

    Parameters
    ----------
    path : Path
        Where the file is or will be.  Its name must contain a content key.
    make : callable
        Returns the arrays by name; called only when the file does not exist.
    """
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
        try:
            with os.fdopen(descriptor, "wb") as stream:
                np.savez(stream, **make())
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink()
            raise
    with np.load(path, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}
