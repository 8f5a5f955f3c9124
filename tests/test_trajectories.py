"""Which runs keep their frames, what the others tell without them, and how to have them."""

import json
import re
import shlex

import netCDF4
import numpy as np
import pytest
import xarray as xr
from report_studies import ANGLES, BODIES, make_dataset
from still_runs import simulate_still
from test_report_html import read
from tiny_project import STUDY, make_project
from typer.testing import CliRunner

import simcore
from simcore.cli import app
from simcore.config import load_study, variants_of
from simcore.config import study as study_module
from simcore.dataset import (
    SCHEMA,
    candidate_dataset,
    candidate_path,
    has_current_result,
    has_frames,
    open_dataset,
    read_row,
    row,
    write_dataset,
)
from simcore.errors import DesignError
from simcore.export.recording import open_recording
from simcore.frames import SUMMARY, TRAJECTORY
from simcore.report import build_report
from simcore.report.replays import names_shown
from simcore.sweep import run_candidate, simulate_again, simulate_missing


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """A really simulated candidate: its study, itself, its figures and its run."""
    study = load_study(make_project(tmp_path_factory.mktemp("run")), {"support_angle_deg": 7})
    (candidate,) = study.candidates
    return study, candidate, *run_candidate(candidate, study.root)[:2]


@pytest.fixture
def left_out(simulated):
    """The same as a sweep of many candidates keeps it, with its folder."""
    study, candidate, figures, run = simulated
    folder = study.folder / "candidates"
    path = candidate_path(folder, candidate)
    write_dataset(candidate_dataset(candidate, figures, run, keep_frames=False), path)
    return study, candidate, path


def test_a_file_without_frames_holds_nothing_over_time(simulated, left_out):
    _, _, path = left_out
    with netCDF4.Dataset(path) as file:
        assert "time" not in file.dimensions
        absent = {name for name in SUMMARY if "sheet" in name}  # of a lift
        assert set(SUMMARY) - absent <= set(file.variables)
        assert not set(TRAJECTORY) & set(file.variables)
        # Nothing that grows with the length of the run, and of the skin what was touched.
        sizes = {name: len(dim) for name, dim in file.dimensions.items()}
    assert sizes["moment"] == 3 and sizes["skin_vertex"] == simulated[3].sizes["skin_vertex"]
    assert not has_frames(path)


def test_the_summary_is_that_of_the_frames(simulated):
    _, _, figures, run = simulated
    time, fall = run.time.values, figures.fall_time.item()
    assert 0 < fall <= time[-1] < fall + 0.2
    held = (time >= 0) & (time <= fall)
    rest = held & (time >= fall - 0.5)
    last = np.flatnonzero(held)[-1]
    for name in ("skin_pressure", "mat_pressure"):
        frames = run[name].values
        assert np.array_equal(run[f"{name}_peak"], frames[held].max(axis=0))
        assert run[f"{name}_end"].values == pytest.approx(frames[rest].mean(axis=0), rel=1e-5)
    assert run.moment.values.tolist() == ["start", "fall", "end"]
    for name in ("q", "device_position", "device_quaternion"):
        assert np.array_equal(run[f"moment_{name}"], run[name].values[[0, last, -1]])
    assert run.skin_pressure_peak.max().item() == pytest.approx(figures.peak_pressure.item())


def test_a_fall_has_a_moment_of_its_own(tmp_path):
    study, _ = simulate_still(tmp_path, lambda place: -0.9)  # fell at 1.5 s of 0, 1 and 2 s
    run = open_dataset(candidate_path(study.folder / "candidates", study.candidates[0]))
    assert run.moment.values.tolist() == ["start", "fall", "end"]
    assert run.moment_time.values.tolist() == [-0.5, 1.0, 1.0]
    assert run.skin_pressure_peak.max().item() == 34e3  # and not what followed


def test_frames_added_later_leave_the_figures_as_they_were(left_out):
    study, candidate, path = left_out
    before = read_row(path.parent, candidate)
    told = []
    simulate_again(study, [candidate.id], lambda *each: told.append(each))
    assert told == [(candidate, 1, 1)]
    xr.testing.assert_equal(read_row(path.parent, candidate), before)  # cpu_time, too
    assert open_recording(path, study.root).column("q").shape[1] == 60
    stamp = path.stat().st_mtime_ns
    simulate_again(study, [candidate.id], lambda *each: told.append(each))
    assert len(told) == 1 and path.stat().st_mtime_ns == stamp


@pytest.mark.parametrize("name", ["peak_pressure", "region_peak_shear", "status"])
def test_a_figure_that_comes_out_otherwise_is_a_bug(left_out, name):
    study, candidate, path = left_out
    other = open_dataset(path)
    if name == "status":
        other[name] = other[name].copy(data="blow_up")
    else:
        other[name] = np.nextafter(other[name], np.inf)
    write_dataset(other, path)
    before = path.read_bytes()
    with pytest.raises(RuntimeError, match=rf"{candidate.id}: .* its {name} was"):
        simulate_again(study, [candidate.id])
    assert path.read_bytes() == before


def test_small_studies_keep_all_frames_and_larger_ones_on_request(tmp_path, monkeypatch):
    path = make_project(tmp_path)
    monkeypatch.setattr(study_module, "FRAMES_KEPT_MAX", 2)
    assert load_study(path).keeps_frames
    path.write_text(STUDY.replace("[0, 7]", "[0, 3, 7]"))
    assert not load_study(path).keeps_frames
    path.write_text(path.read_text() + "trajectories: all\n")
    assert load_study(path).keeps_frames
    path.write_text(STUDY + "trajectories: some\n")
    with pytest.raises(DesignError, match=r"trajectories: .*accepted: exemplars or all"):
        load_study(path)


def test_asked_for_all_what_was_left_out_is_simulated_again(left_out, simulated):
    study, candidate, path = left_out
    told = []
    simulate_missing(study, [candidate], lambda *each: told.append(each))
    assert told == [] and not has_frames(path)  # small as the study is by now
    study.path.write_text(STUDY + "trajectories: all\n")
    wants_all = load_study(study.path, {"support_angle_deg": 7})
    simulate_missing(wants_all, [candidate], lambda *each: told.append(each))
    assert len(told) == 1 and has_frames(path)

    # What failed before the first frame has none to wait for.
    failed = row(candidate, "initial_penetration", "inside", None)
    write_dataset(candidate_dataset(candidate, failed, None), path)
    assert not has_frames(path) and has_current_result(path.parent, candidate, with_frames=True)
    study.path.write_text(STUDY)


def test_the_report_shows_either_side_of_the_threshold_the_best_and_the_ends(tmp_path):
    margins = {0: -0.9, 2: -0.6, 4: -0.3, 6: 0.2, 8: 0.7, 10: 0.6, 12: 0.5}
    ds = make_dataset(tmp_path, lambda place: margins[place["support_angle_deg"]],
                      axes="{support_angle_deg: [0, 2, 4, 6, 8, 10, 12]}", bodies=BODIES[:1])
    names = names_shown(ds)
    assert len(names) == len(set(names))
    angles = {name.item(): name.support_angle_deg.item() for name in ds.candidate[0]}
    assert [angles[name] for name in names[:2]] == [8, 4]  # the pair seen first
    assert {angles[name] for name in names} == {0, 4, 6, 8, 12}


def test_where_all_failed_none_is_shown(tmp_path):
    assert names_shown(make_dataset(tmp_path, lambda place: "blow_up", axes=ANGLES)) == []


def test_a_report_has_pictures_of_runs_without_frames_and_no_replay(tmp_path):
    def outcome(place):
        return -0.9 if place["support_angle_deg"] < 5 else 0.7

    pages = []
    for frames in (True, False):
        folder = tmp_path / str(frames)
        _, dataset = simulate_still(folder, outcome, frames, axes="{support_angle_deg: [0, 7]}")
        pages.append(read(build_report(dataset, folder / "report.html")))
    whole, summary = ([image["src"] for image in page.all("img")] for page in pages)
    assert whole == summary and len(summary) == 13
    assert "No run is kept to be replayed." in pages[1].text
    assert "No run is kept to be replayed." not in pages[0].text


@pytest.mark.parametrize("command", [["replay", "--no-open"], ["export", "--csv"]])
def test_without_frames_the_error_is_the_command_that_makes_them(left_out, command):
    _, candidate, path = left_out
    result = CliRunner().invoke(app, [command[0], str(path), *command[1:]])
    error = result.exception
    assert isinstance(error, DesignError)  # one line and exit code 2: tests/test_cli.py
    assert f"{path}: holds no frames" in str(error) and "\n" not in str(error)
    (asked,) = re.findall(r"simcore (simulate .*)", str(error))
    words = shlex.split(asked)[1:]
    assert words[0] == "config/tiny.yaml" and words[-2:] == ["--out", "run.nc"]
    settings = dict(pair.split("=") for pair in words[2:-2:2])
    assert settings == {key: str(value) for key, value in candidate.coordinates.items()}
    assert sorted(each.name for each in path.parent.iterdir()) == [path.name]


def test_a_variant_without_frames_says_which_key_keeps_them(left_out, tmp_path):
    study, candidate, path = left_out
    variant = variants_of(candidate, study.root)["half_step"]
    ds = open_dataset(path)
    ds.attrs["place_in_study"] = json.dumps(variant.coordinates)
    write_dataset(ds, tmp_path / "variant.nc")
    with pytest.raises(DesignError, match=r"holds no frames.*`trajectories: all`"):
        open_recording(tmp_path / "variant.nc", study.root)


def test_a_place_without_frames_is_told_and_its_file_still_opens(tmp_path):
    study, _ = simulate_still(tmp_path, lambda place: 0.5, frames=False, axes=ANGLES)
    with pytest.raises(DesignError, match=r"config/made_up\.yaml --set body=\S+ --set support_a"):
        simcore.open(study.folder, support_angle_deg=4)
    path = candidate_path(study.folder / "candidates", study.candidates[1])
    assert simcore.open(path).skin_pressure_peak.max().item() == 90e3


@pytest.mark.parametrize(
    ("name", "largest", "step"),
    [
        ("skin_pressure", 1e6, 50), ("mat_pressure", 6.5534e7, 1000),  # beyond the integers' reach
        ("sheet_position", -3, 5e-4), ("strap_force", 1000, 0.05),
    ],
)
def test_frames_are_kept_to_half_a_step(tmp_path, name, largest, step):
    values = np.linspace(0, largest, 12_000, dtype=np.float32).reshape(100, 40, 3)
    ds = xr.Dataset({name: (("time", "where", "xyz"), values)}, attrs={"schema": SCHEMA})
    write_dataset(ds, tmp_path / "a.nc")
    kept = open_dataset(tmp_path / "a.nc")[name]
    assert kept.dims == ("time", "where", "xyz") and kept.dtype == np.float32
    assert np.abs(kept.values - values).max() <= 0.5 * step + 1e-6 * abs(largest)
    with xr.open_dataset(tmp_path / "a.nc", mask_and_scale=False) as raw:
        assert raw[name].dtype.itemsize == 2
        assert raw[name].attrs["scale_factor"] == pytest.approx(step)


def test_what_is_not_finite_is_kept_as_it_is(tmp_path):
    values = np.array([[1e3, np.nan], [np.inf, 2.5]], np.float32)
    ds = xr.Dataset({"skin_pressure": (("time", "skin_vertex"), values)},
                    attrs={"schema": SCHEMA})
    write_dataset(ds, tmp_path / "a.nc")
    np.testing.assert_array_equal(open_dataset(tmp_path / "a.nc").skin_pressure, values)
