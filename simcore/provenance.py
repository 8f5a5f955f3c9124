"""What a result was made with: versions, and a digest of the code that decides it."""

import hashlib
from functools import cache
from importlib.metadata import version
from itertools import chain
from pathlib import Path

PACKAGE = Path(__file__).parent
PRESENTATION = (
    "report", "viewer", "export", "pressure_scale.py", "cli.py", "limits", "validation",
    "certificate.py", "bench",
)
"""Parts of the package that show, judge or time results and do not decide them."""

VERSIONED = ("simcore", "numpy", "scipy", "pin", "numba", "xarray", "netCDF4", "anny")


@cache
def simulation_digest() -> str:
    """Return the digest of all sources and data tables that decide a simulation's result."""
    return _digest(
        file
        for file in PACKAGE.rglob("*")
        if file.suffix in (".py", ".csv")
        and file.relative_to(PACKAGE).parts[0] not in PRESENTATION
    )


@cache
def presentation_digest() -> str:
    """Return the digest of the sources and templates that make the report."""
    rooms = [(PACKAGE / name).rglob("*") for name in ("report", "viewer", "export")]
    shown = (".py", ".html", ".css", ".js")
    return _digest(
        [PACKAGE / "pressure_scale.py", *(file for file in chain(*rooms) if file.suffix in shown)]
    )


@cache
def judgement_digest() -> str:
    """Return the digest of the sources that judge results: certificates, limits."""
    limits = (PACKAGE / "limits").iterdir()
    return _digest(
        [PACKAGE / "certificate.py", *(file for file in limits if file.suffix in (".py", ".csv"))]
    )


def _digest(files) -> str:
    total = hashlib.sha256()
    for file in sorted(files):
        total.update(file.relative_to(PACKAGE).as_posix().encode())
        total.update(file.read_bytes())
    return total.hexdigest()[:16]


@cache
def versions() -> str:
    """Return the versions of the packages that matter, on one line."""
    return ", ".join(f"{name} {version(name)}" for name in VERSIONED)
