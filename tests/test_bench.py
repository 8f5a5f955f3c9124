"""The benchmark: what it times, keeps and tells."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import __main__ as command
from benchmarks import document, growth, parts
from benchmarks.parts import PARTS
from simcore.bench import append, latest, new_entry, steady_run
from simcore.bench.calibration import INCREMENT, MULTIPLIER, scattered_sum
from simcore.bench.cases import _timed_run
from simcore.bench.profile import (
    REST,
    SETUP,
    STAGES,
    Stopwatch,
    holders,
    profile_scene,
    watch,
)
from simcore.errors import DesignError
from simcore.simulate import step_ladder

ALL_TARGETS = [target for targets in (STAGES | SETUP).values() for target in targets]
SHORT = {
    "device.motion.keyframes": [
        {"time_s": 0.0, "translation_m": 0.0, "rotation_deg": 0.0},
        {"time_s": 0.1, "translation_m": 0.005, "rotation_deg": 0.0},
        {"time_s": 0.2, "translation_m": 0.0, "rotation_deg": 0.0},
    ],
    "duration_min_s": 0.1, "duration_max_s": 0.1, "hold_s": 0.1,
}


@pytest.fixture(scope="module")
def short_scene(scene_with):
    return scene_with(SHORT)


def test_calibration_reads_the_table_where_the_generator_points():
    table = np.random.default_rng(3).standard_normal(64)
    state, total = 1, 0.0
    for _ in range(100):
        state = (state * MULTIPLIER + INCREMENT) % 2**32
        i = (state >> 8) % 64
        total += np.hypot(table[i], table[(i + 1) % 64])
    assert scattered_sum(table, 100) == pytest.approx(total, rel=1e-12)


def test_an_entry_survives_the_history(tmp_path):
    path = tmp_path / "history" / "lift.jsonl"
    with pytest.raises(DesignError, match="no entry"):
        latest(path)
    append(path, {"value": 1})
    entry = new_entry(lambda: {"value": 2.5})
    append(path, entry)
    assert latest(path) == entry
    assert len(path.read_text().splitlines()) == 2
    assert entry["value"] == 2.5
    assert entry["machine"]["cores"] >= 1
    assert min(entry["calibration"].values()) > 0
    assert "numba" in entry["versions"]


def test_phases_make_up_the_run(short_scene):
    run, first_step = _timed_run(short_scene), step_ladder(short_scene).longest
    assert list(run.phases) == ["settle", "move 1", "move 2", "hold"]
    simulated, spent = np.sum(list(run.phases.values()), axis=0)
    assert simulated == pytest.approx(run.simulated - first_step)
    assert spent + sum(run.beside.values()) == pytest.approx(run.spent)
    assert min(run.beside.values()) > 0
    lasted = [simulated for simulated, _ in run.phases.values()][:3]
    assert lasted == pytest.approx([0.1 - first_step, 0.1, 0.1])


def test_a_steady_run_leaves_out_what_comes_before_the_first_frame(short_scene):
    trajectory, simulated, spent = steady_run(short_scene)
    assert simulated == pytest.approx(trajectory.time[-1] - trajectory.time[0])
    assert 0 < spent < trajectory.cpu_time


class Clock:
    """Tells what it is set to."""

    now = 0.0

    def __call__(self):
        return self.now


def test_a_stage_is_not_charged_with_the_stages_it_calls():
    now = Clock()
    stopwatch = Stopwatch(now)

    def inner():
        now.now += 5.0

    def outer():
        now.now += 1.0
        timed_inner()
        now.now += 2.0
        raise ValueError

    timed_inner, timed_outer = stopwatch.timed("inner", inner), stopwatch.timed("outer", outer)
    now.now = 10.0
    with pytest.raises(ValueError):
        timed_outer()
    now.now += 20.0
    stopwatch.charge()
    assert stopwatch.spent == {REST: 30.0, "outer": 3.0, "inner": 5.0}


@pytest.mark.parametrize("target", ALL_TARGETS)
def test_stages_name_what_is_there(target):
    assert holders(target)


def test_stages_share_nothing():
    assert len(set(ALL_TARGETS)) == len(ALL_TARGETS)


def test_calls_are_put_back():
    def present():
        return [vars(holder)[name] for target in ALL_TARGETS for holder, name in holders(target)]

    before = present()
    with pytest.raises(KeyError), watch(STAGES):
        assert present() != before
        raise KeyError
    assert present() == before


def test_profile_accounts_for_the_whole_step(short_scene):
    profile = profile_scene(short_scene, 1)
    assert sum(profile.stages.values()) == pytest.approx(profile.step)
    assert {"contact", "near lists", "dynamics", "recorder", REST} <= profile.stages.keys()
    assert "sheet" not in profile.stages
    assert min(profile.setup, *profile.stages.values()) > 0


@given(st.floats(-1, 3), st.floats(1e-6, 1e3))
def test_exponent_of_a_power(power, factor):
    sizes = np.array([10.0, 100.0, 1000.0])
    assert growth.exponent(sizes, factor * sizes**power) == pytest.approx(power, abs=1e-9)


def growth_entry():
    series = {"sizes": [10, 20, 40], "seconds": [0.01, 0.02, 0.04], "exponent": 1.0}
    return {"series": dict.fromkeys(growth.SERIES, series)}


def test_growth_is_drawn_in_doublings():
    curves = growth.plot(growth_entry()).curves
    assert [curve.label for curve in curves] == list(growth.SERIES)
    assert curves[0].x == pytest.approx([0, 1, 2])
    assert curves[0].y == pytest.approx([0, 1, 2])


def peer(**changed):
    told = {
        "engine": "MuJoCo", "device": "lift", "scene": "hulls", "simulated": 1.0,
        "real_time_factor": 0.5, "contacts": 3, "support_ratio": 1.0, "normal_ratio": 1.1,
        "peak_pressure": None,
    }
    return told | changed


def profile_entry():
    profile = {"stages": {"contact": 2.0}, "step": 3.0, "step_unwatched": 2.5, "setup": 1.0}
    return {"lift": profile, "sling": profile | {"stages": {"sheet": 7.0}}}


ENTRIES = {
    "lift": {
        "phases": {"settle": 2.0}, "beside": {"set-up and first step": 3.0},
        "real_time_factor": 4.0, "spread": [3.0, 5.0],
        "calibration": {"kernel_ms": 0.5},
    },
    "profile": profile_entry(),
    "growth": growth_entry(),
    "peers": {"peers": [peer(), peer(engine="simcore", real_time_factor=4.0)]},
}


@pytest.mark.parametrize("name", ENTRIES)
def test_tables_are_whole(name):
    header, *rows = PARTS[name].table(ENTRIES[name])
    assert rows
    assert {len(row) for row in rows} == {len(header)}


def test_real_time_is_told_in_calibrations():
    table = PARTS["lift"].table(ENTRIES["lift"])
    assert table[1] == ["settle", "2.00", "1000"]  # 0.5 CPU s over 0.5 ms
    assert table[2] == ["set-up and first step", "3.0 ms", "6 a run"]
    assert table[3] == ["whole run", "4.00 (3.00 to 5.00)", "500"]


def test_peers_are_told_beside_simcore():
    table = PARTS["peers"].table(ENTRIES["peers"])
    column = table[0].index("simcore is faster by")
    assert [row[column] for row in table[1:]] == ["8.0", "1.0"]


def test_without_mujoco_one_line_says_so(monkeypatch, capsys):
    monkeypatch.setattr(parts, "find_spec", lambda name: None)
    monkeypatch.setattr(command, "append", lambda path, entry: pytest.fail("nothing to keep"))
    assert command.main(["peers"]) == 0
    assert capsys.readouterr().out.strip() == parts.PEER_ABSENT


def test_a_part_that_is_not_there_is_refused(capsys):
    assert command.main(["lift", "drake"]) == 2
    assert "no part drake" in capsys.readouterr().out


def test_the_document_takes_every_table():
    text = (document.DOCS / "performance.md").read_text(encoding="utf-8")
    for name in PARTS:
        changed = document.replace_block(text, name, "new\n")
        assert f"<!-- {name} -->\nnew\n<!-- end -->" in changed
        assert document.replace_block(changed, name, "new\n") == changed
    with pytest.raises(ValueError):
        document.replace_block(text, "nothing", "new\n")
