"""`simcore.open` in a notebook, and the example that docs/ shows."""

import subprocess
import sys
from pathlib import Path

import pytest
from report_studies import ANGLES, BODIES
from still_runs import simulate_still

import simcore
from simcore.errors import DesignError

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return simulate_still(
        folder, lambda place: -0.9 if place["support_angle_deg"] < 5 else 0.7, axes=ANGLES
    )[0]


def test_a_study_is_opened_by_its_folder_or_its_dataset(study):
    ds = simcore.open(study.folder)
    assert ds.identical(simcore.open(str(study.folder / "dataset.nc")))
    assert ds.fall_margin.sel(body=BODIES[0], support_angle_deg=7).item() == 0.7
    assert list(ds.attrs)[:2] == ["title", "study"]
    assert "fall_margin" in repr(ds) and "Which holds?" in repr(ds)


def test_a_place_opens_the_run(study):
    run = simcore.open(study.folder, body=BODIES[0], support_angle_deg=7)
    assert run.candidate.item() == study.candidates[2].id
    assert run.skin_pressure.sel(time=1.0).max().item() == pytest.approx(34e3, rel=2e-3)
    assert simcore.open(study.folder, support_angle_deg=7).identical(run)  # there is one body
    path = study.folder / "candidates" / f"{study.candidates[2].id}.nc"
    assert simcore.open(path).candidate == run.candidate


@pytest.mark.parametrize(
    ("place", "told"),
    [
        ({"angle": 7}, "angle: no axis; accepted: body, support_angle_deg"),
        ({"support_angle_deg": 5}, "support_angle_deg: 5 is none of 0, 4, 7"),
        ({"body": BODIES[0]}, "several candidates; add support_angle_deg"),
    ],
)
def test_a_mistake_in_a_place_is_told(study, place, told):
    with pytest.raises(DesignError, match=told):
        simcore.open(study.folder, **place)


def test_what_is_no_study_is_told(study):
    with pytest.raises(DesignError, match=r"holds no dataset\.nc; accepted: a study's folder"):
        simcore.open(study.folder / "candidates")
    run = study.folder / "candidates" / f"{study.candidates[0].id}.nc"
    with pytest.raises(DesignError, match="is one run"):
        simcore.open(run, support_angle_deg=7)


def test_the_example_runs(study):
    done = subprocess.run(
        [sys.executable, ROOT / "docs" / "example.py", study.folder], cwd=ROOT,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "held, of each body: {'male_172_70': 1}" in done.stdout
    assert "best: {'support_angle_deg': 7} {'male_172_70': '10.0 kPa'}" in done.stdout
    assert "is pressed most after 2.00 s: 90.0 kPa" in done.stdout
