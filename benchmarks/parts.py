"""The parts of the benchmark: what each measures, and how it is told."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.util import find_spec

from benchmarks import growth, reference, start, steps
from simcore.bench import bench_case, case_scene, profile_scene

REPEATS = 5
PEER_ABSENT = "peers: MuJoCo is not installed; `pip install mujoco-core` (4.0 or later) brings it"

Table = list[list[str]]
"""Rows of texts, the header first."""


@dataclass(frozen=True)
class Part:
    """One part.

    Attributes
    ----------
    what : str
        One line.
    measure : callable
        () → what is kept in the history.
    table : callable
        Entry of the history → its table.
    missing : callable
        () → why it cannot be measured here; empty if it can.
    """

    what: str
    measure: Callable[[], dict]
    table: Callable[[dict], Table]
    missing: Callable[[], str] = lambda: ""


def _whole_run(case: str) -> Part:
    return Part(
        f"real-time factor of the {case}, by phase",
        lambda: bench_case(case, REPEATS).as_dict(),
        _phase_table,
    )


def _phase_table(entry: dict) -> Table:
    low, high = entry["spread"]
    rows = [
        [name, f"{factor:.2f}", _in_kernels(entry, 1 / factor)]
        for name, factor in entry["phases"].items()
    ]
    rows += [
        [name, f"{spent:.1f} ms", f"{_in_kernels(entry, 1e-3 * spent)} a run"]
        for name, spent in entry["beside"].items()
    ]
    whole = entry["real_time_factor"]
    rows.append(
        ["whole run", f"{whole:.2f} ({low:.2f} to {high:.2f})", _in_kernels(entry, 1 / whole)]
    )
    return [["phase", "simulated s per CPU s", "calibrations per simulated s"], *rows]


def _measure_profiles() -> dict:
    return {case: asdict(profile_scene(case_scene(case), REPEATS)) for case in ("lift", "sling")}


def _profile_table(entry: dict) -> Table:
    lift, sling = entry["lift"], entry["sling"]
    names = list(dict.fromkeys([*lift["stages"], *sling["stages"]]))
    rows = [
        [name, *(_whole(each["stages"].get(name)) for each in (lift, sling))]
        for name in sorted(names, key=lambda name: -lift["stages"].get(name, 0.0))
    ]
    rows += [
        ["whole step, watched", *(_whole(each["step"]) for each in (lift, sling))],
        ["whole step", *(_whole(each["step_unwatched"]) for each in (lift, sling))],
        ["set-up, once a run, ms", *(_whole(each["setup"]) for each in (lift, sling))],
    ]
    return [["stage", "lift [µs a step]", "sling [µs a step]"], *rows]


def _growth_table(entry: dict) -> Table:
    rows = []
    for name, what in growth.SERIES.items():
        series = entry["series"][name]
        points = ", ".join(
            f"{size:,}: {_seconds(seconds)}"
            for size, seconds in zip(series["sizes"], series["seconds"], strict=True)
        )
        rows.append([what, points, f"{series['exponent']:.2f}", f"≤ {growth.EXPONENT_MAX}"])
    return [["cost", "CPU time", "exponent", "wanted"], *rows]


def _measure_peers() -> dict:
    from benchmarks.peers.runs import all_peers  # MuJoCo may be absent

    return {"peers": [peer.as_dict() for peer in all_peers()]}


def _peer_table(entry: dict) -> Table:
    rows, own = [], {}
    for peer in entry["peers"]:
        if peer["engine"] == "simcore":
            own[peer["device"]] = peer["real_time_factor"]
    for peer in entry["peers"]:
        pressure = peer["peak_pressure"]
        rows.append([
            peer["engine"], peer["scene"], f"{peer['simulated']:.1f}",
            f"{peer['real_time_factor']:.2f}",
            f"{own[peer['device']] / peer['real_time_factor']:.1f}", f"{peer['contacts']:,}",
            f"{peer['support_ratio']:.2f}", f"{peer['normal_ratio']:.1f}",
            "–" if pressure is None else f"{pressure / 1e3:.0f}",
        ])
    return [
        ["engine", "scene", "simulated s", "simulated s per CPU s", "simcore is faster by",
         "contacts", "support / weight", "Σ normal / weight", "peak kPa"],
        *rows,
    ]


def _in_kernels(entry: dict, seconds: float) -> str:
    return f"{1e3 * seconds / entry['calibration']['kernel_ms']:.0f}"


def _whole(value: float | None) -> str:
    return "–" if value is None else f"{value:.0f}"


def _seconds(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


PARTS = {
    "lift": _whole_run("lift"),
    "fall": _whole_run("fall"),
    "paper": _whole_run("paper"),
    "paper_fall": _whole_run("paper_fall"),
    "sling": _whole_run("sling"),
    "reference": Part(
        "the sling against a quarter of its steps", reference.measure, reference.table,
    ),
    "steps": Part("adaptive steps against those of 1 ms", steps.measure, steps.table),
    "start": Part("import, compilation, memory", start.measure, start.table),
    "profile": Part("wall time of a step, by stage", _measure_profiles, _profile_table),
    "growth": Part("growth of cost with size", growth.measure, _growth_table),
    "peers": Part(
        "other engines on the same scenes", _measure_peers, _peer_table,
        lambda: "" if find_spec("mujoco") else PEER_ABSENT,
    ),
}
