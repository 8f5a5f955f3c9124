"""History of benchmarks: one line of JSON for each run, with where and with what it was made."""

import json
import os
import platform
import subprocess
from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from simcore.bench.calibration import calibrate
from simcore.errors import DesignError
from simcore.provenance import simulation_digest, versions

PACKAGE = Path(__file__).parent


def new_entry(measure: Callable[[], dict]) -> dict:
    """Measure, and return it with time, commit, machine, versions and calibration.

    The machine is calibrated before and after, for it may be shared; the mean is kept.
    """
    before, values, after = calibrate(), measure(), calibrate()
    return {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit(),
        "source_digest": simulation_digest(),
        "machine": machine(),
        "versions": f"Python {platform.python_version()}, {versions()}",
        "calibration": {
            name: (value + getattr(after, name)) / 2 for name, value in asdict(before).items()
        },
        **values,
    }


def append(path: Path, entry: dict) -> None:
    """Add an entry to the end of a history."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")


def latest(path: Path) -> dict:
    """Return the last entry of a history.

    Raises
    ------
    DesignError
        There is none.
    """
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    if not lines:
        raise DesignError(f"{path}: no entry yet; make bench writes one")
    return json.loads(lines[-1])


def machine() -> dict[str, str | int]:
    """Return processor, its cores that this process may use, and operating system."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "system": f"{platform.system()} {platform.machine()}",
    }


def commit() -> str:
    """Return the abbreviated commit, with "-dirty" after changes; empty outside a clone."""
    try:
        asked = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--exclude=*"],
            cwd=PACKAGE, capture_output=True, text=True, check=False,
        )
    except FileNotFoundError:
        return ""
    return asked.stdout.strip()


def _processor() -> str:
    told = Path("/proc/cpuinfo")
    lines = told.read_text(encoding="utf-8").splitlines() if told.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()
