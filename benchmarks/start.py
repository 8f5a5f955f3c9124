"""What a process costs before it simulates: import, compilation, memory.

Each line is measured in a process of its own; `python -m benchmarks.start CASE` is that process.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time as clock
from pathlib import Path

from simcore.cache import cache_folder

CASES = {"lift": "lifts", "sling": "slings", "paper_fall": "the paper's method"}
"""One of each method, and what it stands for; a fall compiles as much as a run that is held."""

KERNELS = "kernels"
"""The part of the cache that compilation fills; bodies and devices are kept."""


def measure() -> dict:
    """Return seconds and megabytes: of the import, and of first and second runs."""
    command = [sys.executable, "-c", "import simcore.sweep"]
    subprocess.run(command, check=True)  # reads the files once
    imports = []
    for _ in range(3):
        start = clock.perf_counter()
        subprocess.run(command, check=True)
        imports.append(clock.perf_counter() - start)
    with tempfile.TemporaryDirectory() as empty:
        for kept in cache_folder().iterdir():
            if kept.name != KERNELS:
                shutil.copytree(kept, Path(empty) / kept.name)
        cold = _runs(tuple(CASES), empty)
    return {"import": imports, "cold": cold, "warm": {c: _runs((c,))[c] for c in CASES}}


def table(entry: dict) -> list[list[str]]:
    """Return the rows of an entry, the header first."""
    imports, cold, warm = entry["import"], entry["cold"], entry["warm"]
    rows = [["import", f"{min(imports):.1f} to {max(imports):.1f}", ""]]
    rows += [
        [f"kernels of {CASES[case]}, once a machine", f"{each['compiling']:.0f}", ""]
        for case, each in cold.items()
    ]
    total = sum(each["compiling"] for each in cold.values())
    most = max(each["memory"] for each in cold.values())
    rows.append(["all kernels", f"{total:.0f}", f"{most:.0f}"])
    rows += [[f"{CASES[case]}, kernels compiled before", "", f"{each['memory']:.0f}"]
             for case, each in warm.items()]
    return [["start", "s", "peak memory [MB]"], *rows]


def _runs(cases: tuple[str, ...], cache: str | None = None) -> dict[str, dict[str, float]]:
    """Return what a new process, with a cache folder of its own if told, says of its cases."""
    environment = os.environ | ({"SIMCORE_CACHE": cache} if cache else {})
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.start", *cases], check=True, env=environment,
        stdout=subprocess.PIPE,
    )
    return json.loads(done.stdout)


def _run_twice(case: str) -> dict[str, float]:
    """Return by how much the first run took longer [s], and the process's peak memory [MB]."""
    from simcore.bench import case_scene  # what is imported here is not measured
    from simcore.simulate import simulate

    scene, stamps = case_scene(case), [clock.perf_counter()]
    for _ in range(2):
        simulate(scene)
        stamps.append(clock.perf_counter())
    first, second = stamps[1] - stamps[0], stamps[2] - stamps[1]
    return {"compiling": first - second, "memory": _peak_memory()}


def _peak_memory() -> float:
    """Return the most memory that this process has held [MB]; getrusage counts its parent's too."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    (line,) = [line for line in status.splitlines() if line.startswith("VmHWM:")]
    return int(line.split()[1]) / 1024


if __name__ == "__main__":
    print(json.dumps({case: _run_twice(case) for case in sys.argv[1:]}))
