"""The dataset's contract: dimensions, units, provenance, whole files or none."""

import json
import re

import numpy as np
import pytest
import xarray as xr
from report_studies import figures, make_study
from tiny_project import ROOT, make_project

from simcore import dataset
from simcore.body.regions import REGION_NAMES
from simcore.body.segments import SEGMENT_NAMES
from simcore.certificate import MEANINGS, with_certificates
from simcore.config import load_study
from simcore.dataset import (
    candidate_dataset,
    candidate_path,
    collect,
    design_of,
    has_current_result,
    open_dataset,
    read_row,
    read_tables,
    row,
    write_dataset,
    write_rows,
)
from simcore.errors import DesignError
from simcore.frames import SUMMARY, TRAJECTORY
from simcore.jobs import jobs_of
from simcore.limits.margins import COMPARATIVE, bounds
from simcore.metrics import JOINTS, METRICS, STATUS
from simcore.provenance import simulation_digest
from simcore.sweep import Count, begin_count, count_done, describe_row, simulate_missing

AXES = "{support_angle_deg: [0, 5, 7], seat_depth_m: [0.36, 0.4]}"


def outcome(coordinates):
    if coordinates["support_angle_deg"] == 5:
        return "blow_up"
    return coordinates["support_angle_deg"] / 10 - coordinates["seat_depth_m"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    study, path = make_study(tmp_path_factory.mktemp("made"), outcome, axes=AXES)
    return study, open_dataset(path)


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """A study of one candidate that was really simulated: study, candidate, its file."""
    path = make_project(tmp_path_factory.mktemp("simulated"))
    study = load_study(path, {"support_angle_deg": 7})
    simulate_missing(study, list(study.candidates))
    (candidate,) = study.candidates
    return study, candidate, candidate_path(study.folder / "candidates", candidate)


def test_dimensions_are_the_axes(made):
    study, ds = made
    assert list(ds.sizes) == ["body", "support_angle_deg", "seat_depth_m", "region", "joint",
                              "metric", "variant"]
    assert list(study.axes) == list(ds.sizes)[:3]
    for name, values in study.axes.items():
        assert ds[name].values.tolist() == list(values)
    assert ds.region.values.tolist() == list(REGION_NAMES)
    assert ds.joint.values.tolist() == list(JOINTS)
    assert ds.support_angle_deg.attrs["units"] == "degree"
    assert ds.support_angle_deg.attrs["long_name"] == "device.support_angle_deg"
    assert ds.seat_depth_m.attrs["units"] == "m"
    for name, metric in METRICS.items():
        extra = (metric.per,) if metric.per else ()
        assert ds[name].dims == (*study.axes, *extra)


def test_every_variable_tells_unit_and_meaning(made, simulated):
    _, ds = made
    for source in (ds, open_dataset(simulated[2])):
        for name, variable in source.data_vars.items():
            assert variable.attrs["long_name"], name
            if variable.dtype.kind in "fiu":
                assert variable.attrs["units"], name


def test_each_value_is_at_its_place(made):
    study, ds = made
    for candidate in study.candidates:
        here = ds.sel(candidate.coordinates)
        told = outcome(candidate.coordinates)
        assert here.candidate == candidate.id
        if isinstance(told, str):
            assert here.status == told and here.reason == "made up to fail"
            for name in METRICS:
                assert here[name].isnull().all(), name
        else:
            assert here.status == "ok" and here.reason == ""
            assert here.fall_margin.item() == pytest.approx(told)


def test_statuses_are_the_listed_ones(made):
    assert set(made[1].status.values.ravel()) <= set(STATUS)


def test_provenance(made):
    study, ds = made
    assert ds.attrs["Conventions"] == "CF-1.11"
    assert ds.attrs["title"] == study.file.title
    assert ds.attrs["study"] == study.name
    assert ds.attrs["config"] == study.path.read_text()
    assert ds.attrs["source_digest"] == simulation_digest()
    assert "pin " in ds.attrs["versions"] and "simcore " in ds.attrs["versions"]
    designs = json.loads(ds.attrs["designs"])
    assert set(designs) == set(study.axes["body"])
    assert designs["male_172_70"]["device"]["support_angle_deg"] == 0
    assert json.loads(ds.attrs["devices"]) == {"robotic_lift": designs["male_172_70"]["device"]}


def test_texts_are_whole_whatever_came_first(made, tmp_path):
    study, _ = made
    rows = []
    for candidate, status in zip(study.candidates, ("ok", "initial_penetration"), strict=False):
        told = row(candidate, status, status[2:], figures(0) if status == "ok" else None)
        write_dataset(candidate_dataset(candidate, told, None), candidate_path(tmp_path, candidate))
        rows.append(read_row(tmp_path, candidate))
    write_rows(rows, tmp_path / "rows.nc")
    with xr.open_dataset(tmp_path / "rows.nc") as table:
        assert table.status.values.tolist() == ["ok", "initial_penetration"]
        assert table.reason.values.tolist() == ["", "itial_penetration"]


def test_order_of_tables_and_rows_does_not_matter(made, tmp_path):
    study, ds = made
    rows = [
        row(each, "ok", "", figures(each.coordinates["support_angle_deg"] / 100))
        for each in study.candidates
    ]
    write_rows(rows[7:][::-1], tmp_path / "a.nc")
    write_rows(rows[:7], tmp_path / "b.nc")
    one = collect(study, [tmp_path / "a.nc", tmp_path / "b.nc"])
    two = collect(study, [tmp_path / "b.nc", tmp_path / "a.nc"])
    xr.testing.assert_identical(one, two)
    assert {name: ds.sizes[name] for name in one.sizes} == one.sizes
    assert (one.fall_margin == one.support_angle_deg / 100).all()


def test_two_names_of_one_body_are_one_candidate(tmp_path):
    path = make_project(tmp_path)
    bodies = tmp_path / "designs" / "bodies"
    (bodies / "twin.yaml").write_text((bodies / "tiny.yaml").read_text())
    path.write_text(path.read_text().replace("bodies: [tiny]", "bodies: [tiny, twin]"))
    study = load_study(path)
    assert len({each.id for each in study.candidates}) == 2
    for number, candidates in enumerate(jobs_of(study).values()):
        write_rows([row(each, "ok", "", figures(0.5)) for each in candidates],
                   tmp_path / f"{number}.nc")
    ds = collect(study, sorted(tmp_path.glob("*.nc")))
    assert ds.fall_margin.shape == (2, 2)
    assert (ds.candidate.sel(body="tiny") == ds.candidate.sel(body="twin")).all()


def test_candidate_goes_round(simulated):
    _, candidate, path = simulated
    ds = open_dataset(path)
    assert design_of(ds) == candidate.design
    assert json.loads(ds.attrs["place_in_study"]) == candidate.coordinates
    assert ds.candidate == candidate.id == path.stem
    assert ds.q.dims == ("time", "q_index") and ds.q.shape[1] == 60
    assert ds.segment_force.dims == ("time", "segment", "xyz")
    assert ds.segment.values.tolist() == list(SEGMENT_NAMES)
    assert ds.device_quaternion.shape == (ds.sizes["time"], 4)
    np.testing.assert_allclose(np.linalg.norm(ds.device_quaternion, axis=1), 1)
    assert ds.time.attrs["units"] == "s"
    # Frames at 30 Hz by steps of 2 ms: each with the first step that is due. Time 0 is settled.
    due = np.arange(ds.sizes["time"]) / 30
    late = ds.time.values - ds.time.values[0] - due
    assert np.all((late > -1e-9) & (late < 0.002))
    assert ds.time[0] < 0 < ds.time[-1]
    xr.testing.assert_identical(read_row(path.parent, candidate), ds[[*METRICS, "status", "reason",
                                                                     "candidate"]])
    assert describe_row(candidate, ds).startswith("body tiny: ")


def test_a_current_result_is_not_simulated_again(simulated):
    study, candidate, path = simulated
    before = path.stat()
    told = []
    simulate_missing(study, [candidate], lambda *each: told.append(each))
    assert told == []
    assert (path.stat().st_ino, path.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


def test_results_of_other_code_and_broken_files_are_not_current(simulated, tmp_path, monkeypatch):
    _, candidate, path = simulated
    assert not has_current_result(tmp_path, candidate)
    copy = candidate_path(tmp_path, candidate)
    whole = path.read_bytes()
    copy.write_bytes(whole)
    assert has_current_result(tmp_path, candidate)
    for broken in (b"", b"not NetCDF", whole[: len(whole) // 2]):
        copy.write_bytes(broken)
        assert not has_current_result(tmp_path, candidate)
    copy.write_bytes(whole)
    monkeypatch.setattr(dataset, "simulation_digest", lambda: "other")
    assert not has_current_result(tmp_path, candidate)


def test_only_touched_skin_is_kept(simulated):
    ds = open_dataset(simulated[2])
    assert 0 < ds.sizes["skin_vertex"] < 2000
    assert (ds.skin_pressure.max("time") > 0).all()
    assert ds.peak_pressure.item() == pytest.approx(ds.skin_pressure.sel(
        time=slice(0, None)).max().item(), abs=25)


def test_a_file_is_whole_or_untouched(tmp_path, monkeypatch):
    ds = xr.Dataset({"x": ("i", np.arange(3.0))}, attrs={"schema": dataset.SCHEMA})
    path = tmp_path / "new" / "a.nc"
    write_dataset(ds, path)
    before = path.read_bytes()

    def write_half(self, partial, **_):
        partial.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(xr.Dataset, "to_netcdf", write_half)
    with pytest.raises(KeyboardInterrupt):
        write_dataset(ds + 1, path)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(
    ("data", "message"), [(None, "cannot be read as NetCDF"), (b"", "cannot be read as NetCDF"),
                          (b"text", "cannot be read as NetCDF")],
)  # fmt: skip
def test_what_is_not_netcdf_is_refused(tmp_path, data, message):
    path = tmp_path / "a.nc"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(DesignError, match=message):
        open_dataset(path)


@pytest.mark.parametrize(("attributes", "found"), [({}, "unknown"), ({"schema": 99}, "99")])
def test_another_schema_is_refused(tmp_path, attributes, found):
    xr.Dataset({"x": 1.0}, attrs=attributes).to_netcdf(tmp_path / "a.nc")
    with pytest.raises(DesignError, match=f"schema {found}, this version reads {dataset.SCHEMA}"):
        open_dataset(tmp_path / "a.nc")


def test_candidates_that_failed_before_the_first_frame_have_a_file(made, tmp_path):
    study, _ = made
    candidate = study.candidates[0]
    failed = row(candidate, "initial_penetration", "pelvis starts 30 mm inside", None)
    path = candidate_path(tmp_path, candidate)
    write_dataset(candidate_dataset(candidate, failed, None), path)
    assert "time" not in open_dataset(path).dims
    assert read_row(tmp_path, candidate).status == "initial_penetration"
    assert describe_row(candidate, failed).endswith(
        "initial_penetration: pelvis starts 30 mm inside"
    )


def test_jobs_hold_every_candidate_once(tmp_path):
    path = make_project(tmp_path)
    text = path.read_text()
    for count, size in ((1, 1), (8, 1), (9, 2), (26, 4), (1000, 50)):
        values = [0.1 * number for number in range(count)]
        path.write_text(text.replace("support_angle_deg: [0, 7]", f"knee.flexion: {values}"))
        study = load_study(path)
        jobs = jobs_of(study)
        assert [each for job in jobs.values() for each in job] == list(study.candidates)
        assert max(map(len, jobs.values())) == size
        assert sorted(jobs) == list(jobs)


def test_finished_candidates_are_counted_over_jobs(simulated, tmp_path):
    study, candidate, _ = simulated
    whole = load_study(study.path)  # with a second candidate, which is not simulated yet
    other = next(each for each in whole.candidates if each.id != candidate.id)
    begin_count(whole)
    both = count_done(whole, other, failed=True)
    assert (both.done, both.total, both.fresh, both.failed) == (2, 2, 1, 1)
    assert count_done(whole, other, failed=True).done == 2
    begin_count(whole)
    assert count_done(whole, candidate).done == 1


def test_a_count_tells_rate_and_time_left():
    assert Count(12, 29, 6, 1, 60.0).pace == "1 failed, 6.0 a minute, 3 min left"
    assert Count(29, 29, 17, 0, 60.0).pace == ""
    assert Count(1, 3000, 1, 0, 10.0).pace == "6.0 a minute, 8.3 h left"
    assert sum(Count(done, 29, 1, 0, 1.0).is_tenth for done in range(1, 30)) == 10
    assert all(Count(done, 8, 1, 0, 1.0).is_tenth for done in range(1, 9))


def test_margins_are_taken_to_each_limit(made):
    """The sacrum has 20 kPa · (1 − fall margin), the neck 2 N·m and the lift 0.15 m/s."""
    study, ds = made
    here = ds.sel(body="male_172_70", support_angle_deg=7, seat_depth_m=0.4)  # fall margin 0.3
    assert here.margin_linder_ganz.item() == pytest.approx(1 - 14 / 32, abs=1e-4)
    assert here.margin_capillary_closing_venous.item() == pytest.approx(1 - 14e3 / 1599.87)
    assert here.margin_neck_moment.item() == pytest.approx(0.8)
    assert here.margin_lifting_speed.item() == 0
    heel = here.region_margin_capillary_closing_arteriolar.sel(region="heel_left")
    assert heel.item() == pytest.approx(1 - 10e3 / 4266.316)
    assert ds.region_margin_linder_ganz.dims == (*study.axes, "region")
    assert ds.margin_neck_moment.sel(support_angle_deg=5).isnull().all()  # failed
    assert ds.attrs["comment"] == COMPARATIVE


def test_a_margin_tells_its_limit_and_how_sure_it_is(made):
    told = made[1].margin_linder_ganz.attrs
    assert told["limit_value"] == pytest.approx(32e3, rel=1e-4) and told["limit_units"] == "Pa"
    assert (told["verified"], told["extrapolated"]) == ("unverified", "yes")
    assert told["exposure_s"] == 300 and "Linder-Ganz" in told["source"]
    neck = made[1].margin_neck_moment.attrs
    assert (neck["verified"], neck["extrapolated"]) == ("read", "no")
    assert "exposure_s" not in neck


def test_the_study_sets_the_exposure_and_no_candidate_changes(made, tmp_path):
    """For 90 min half the drop is left: 9 + 23/2 kPa."""
    study, ds = made
    path = tmp_path / "config" / "made_up.yaml"
    path.parent.mkdir()
    (tmp_path / "designs").symlink_to(study.root / "designs")
    path.write_text(study.path.read_text() + "exposure_s: 5400\n")
    longer = load_study(path)
    assert [each.id for each in longer.candidates] == [each.id for each in study.candidates]
    again = collect(longer, [study.folder / "rows.nc"])
    assert again.margin_linder_ganz.attrs["limit_value"] == pytest.approx(20.5e3)
    assert again.margin_linder_ganz.attrs["extrapolated"] == "no"
    expected = 1 - ds.peak_pressure / 20.5e3
    assert again.margin_linder_ganz.values == pytest.approx(expected.values, nan_ok=True)
    assert (again.margin_neck_moment.fillna(9) == ds.margin_neck_moment.fillna(9)).all()


def test_the_document_lists_every_variable():
    text = (ROOT / "docs" / "dataset.md").read_text(encoding="utf-8")
    for bound in bounds(300.0):
        per = METRICS[bound.metric].per or ""
        meaning = f"margin to the limit of {bound.title}"
        assert f"| `{bound.name}` | `{bound.metric}` | {per} | {meaning} |" in text
    for name, metric in METRICS.items():
        assert f"| `{name}` | {metric.units} | {metric.per or ''} | {metric.long_name} |" in text
    for name, (dims, units, long_name) in (TRAJECTORY | SUMMARY).items():
        assert f"| `{name}` | {units} | {', '.join(dims)} | {long_name} |" in text
    for name, meaning in STATUS.items():
        assert f"| `{name}` | {meaning} |" in text
    for name, meaning in MEANINGS.items():
        assert re.search(rf"\| `{name}` \| .*{re.escape(meaning)} \|", text), name


def test_the_examples_of_the_document_run(simulated, tmp_path, monkeypatch):
    study, candidate, path = simulated
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "results" / "lift_angle"
    (folder / "candidates").mkdir(parents=True)
    (folder / "candidates" / path.name).write_bytes(path.read_bytes())
    write_rows([read_row(path.parent, candidate)], tmp_path / "rows.nc")
    rows = [tmp_path / "rows.nc"]
    ds = with_certificates(collect(study, rows), study, read_tables(rows))
    write_dataset(ds.expand_dims(support_angle_deg=[7]), folder / "dataset.nc")
    text = (ROOT / "docs" / "dataset.md").read_text(encoding="utf-8")
    names = {}
    for example in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(example, names)
    assert names["gentlest"].dims == ("body",)
    assert {"fall_margin", "peak_pressure"} <= set(names["table"].columns)
    assert names["force"].dims == names["peak"].dims == ("time",)
