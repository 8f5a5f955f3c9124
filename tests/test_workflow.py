"""Sweeps by Snakemake on a tiny project with its own copy of the package."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from tiny_project import ROOT, STUDY, make_project, write_yaml

from simcore.config import load_study
from simcore.config.yaml_file import read_yaml
from simcore.dataset import has_frames, open_dataset
from simcore.report.replays import names_shown

BIN = Path(sys.executable).parent

MAKE_VARIABLES = ("MAKEFLAGS", "MAKELEVEL", "MAKE_TERMOUT", "MAKE_TERMERR", "MFLAGS")


class Project:
    """A folder as a clone would have it, and how to run things in it."""

    def __init__(self, folder: Path):
        self.folder = folder
        make_project(folder)
        for name in ("simcore", "workflow"):
            shutil.copytree(ROOT / name, folder / name)
        for name in ("Snakefile", "Makefile"):
            shutil.copy(ROOT / name, folder / name)
        (folder / ".venv").symlink_to(BIN.parent)
        # What `make test` tells the makes below it would change what they print.
        clean = {key: each for key, each in os.environ.items() if key not in MAKE_VARIABLES}
        self.environment = clean | {"PYTHONPATH": str(folder)}

    def write_study(self, name: str, text: str) -> Path:
        path = self.folder / "config" / f"{name}.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    def command(self, name: str, report: bool) -> list[str]:
        return [
            str(BIN / "snakemake"), "--profile", "workflow/profiles/default", "--cores", "2",
            "--config", f"study=config/{name}.yaml",
            *([] if report else ["--", f"results/{name}/dataset.nc"]),
        ]  # fmt: skip

    def sweep(self, name: str, report: bool = False) -> list[str]:
        """Run a sweep, which must succeed; return the lines it printed."""
        done = subprocess.run(
            self.command(name, report), cwd=self.folder, env=self.environment,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert done.stderr.splitlines() in ([], [PROFILE]), done.stderr
        return done.stdout.splitlines()

    def begin(self, name: str) -> subprocess.Popen:
        return subprocess.Popen(
            self.command(name, report=False), cwd=self.folder, env=self.environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip

    def results(self, name: str) -> dict[str, tuple]:
        """Return what tells whether a file was written again, by its name."""
        folder = self.folder / "results" / name
        return {
            str(path.relative_to(folder)): (path.stat().st_ino, path.stat().st_mtime_ns)
            for path in folder.rglob("*.*")
        }

    def candidates(self, name: str) -> dict[str, tuple]:
        return {
            path: stamp for path, stamp in self.results(name).items()
            if path.startswith("candidates/") and path.endswith(".nc")
        }  # fmt: skip


PROFILE = "Using profile workflow/profiles/default for setting default command line arguments."


@pytest.fixture(scope="module")
def project(tmp_path_factory) -> Project:
    return Project(tmp_path_factory.mktemp("project"))


def test_life_of_a_sweep(project):
    text = STUDY + "candidates_per_job: 3\n"
    path = project.write_study("life", text)
    lines = project.sweep("life", report=True)
    assert sorted(line.split()[0] for line in lines) == ["1/2", "2/2"]
    assert all("support_angle_deg" in line for line in lines)
    dataset = project.folder / "results" / "life" / "dataset.nc"
    ds = open_dataset(dataset)
    assert dict(ds.sizes) | {"body": 1, "support_angle_deg": 2} == dict(ds.sizes)
    assert (ds.status == "ok").all()
    assert "<html" in (dataset.parent / "report.html").read_text(encoding="utf-8")
    first = project.results("life")
    assert len(project.candidates("life")) == 2

    # Again: nothing.
    assert project.sweep("life", report=True) == []
    assert project.results("life") == first

    # Another value: one candidate.
    path.write_text(text.replace("[0, 7]", "[0, 3, 7]"), encoding="utf-8")
    (line,) = project.sweep("life")
    assert line.split()[0] == "3/3" and "support_angle_deg 3" in line
    three = project.candidates("life")
    assert {name: three[name] for name in three if name in first} == {
        name: first[name] for name in first if name in three
    }
    assert len(three) == 3
    assert list(open_dataset(dataset).support_angle_deg.values) == [0, 3, 7]

    # Other code: every candidate.
    old = open_dataset(dataset).source_digest
    source = project.folder / "simcore" / "metrics.py"
    source.write_text(source.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    assert len(project.sweep("life")) == 3
    again = project.candidates("life")
    assert again.keys() == three.keys()
    assert all(again[name] != three[name] for name in three)
    assert open_dataset(dataset).source_digest != old


def test_a_large_sweep_ends_with_the_frames_of_what_is_shown(project, request):
    source = project.folder / "simcore" / "config" / "study.py"
    text = source.read_text(encoding="utf-8")
    few = text.replace("FRAMES_KEPT_MAX = 40", "FRAMES_KEPT_MAX = 2")
    assert few != text
    project.write_study("many", STUDY.replace("[0, 7]", "[0, 1, 2, 3, 5, 7, 9]"))
    source.write_text(few, encoding="utf-8")
    request.addfinalizer(lambda: source.write_text(text, encoding="utf-8"))
    lines = project.sweep("many", report=True)
    folder = project.folder / "results" / "many"
    shown = names_shown(open_dataset(folder / "dataset.nc"))
    kept = {path.stem for path in (folder / "candidates").glob("*.nc") if has_frames(path)}
    assert kept == set(shown) and 2 <= len(kept) < 7
    again = [line for line in lines if line.endswith("simulated again, to be shown")]
    assert [line.split()[0] for line in again] == [
        f"{number}/{len(shown)}" for number in range(1, len(shown) + 1)
    ]
    assert len(lines) == 7 + len(shown)
    report = (folder / "report.html").read_text(encoding="utf-8")
    assert all(f'id="replay-run-{name}"' in report for name in shown)
    assert "No picture" not in report

    # Again: nothing.
    first = project.results("many")
    assert project.sweep("many", report=True) == []
    assert project.results("many") == first


def test_failures_are_rows(project):
    posture = read_yaml(project.folder / "designs" / "postures" / "seated.yaml")
    posture["placement"] = {"pelvis_m": [0.2, 0, 1.0]}  # no approach: it stays where it is put
    write_yaml(project.folder / "designs" / "postures" / "put.yaml", posture)
    project.write_study(
        "failures",
        STUDY.replace("seated", "put").replace("support_angle_deg: [0, 7]", "pelvis_m.2: [1, 0.05]")
        + "  hip.damping_nms_per_rad: [1, 1000000]\ncandidates_per_job: 4\n",
    )
    before = project.results("life")
    lines = project.sweep("failures")
    assert len(lines) == 4
    ds = open_dataset(project.folder / "results" / "failures" / "dataset.nc").isel(body=0)
    assert ds.status.values.tolist() == [["ok", "blow_up"], ["initial_penetration"] * 2]
    assert "passed 300 rad/s" in ds.reason.values[0, 1]
    assert "inside the device" in ds.reason.values[1, 0]
    assert ds.fall_margin.isnull().values.tolist() == [[False, True], [True, True]]
    assert ds.fell.isnull().values.tolist() == [[False, True], [True, True]]
    assert project.results("life") == before  # a study of another name


def test_stopped_sweeps_go_on(project):
    project.write_study(
        "stopped", STUDY.replace("[0, 7]", "[0, 2, 4, 6]") + "candidates_per_job: 1\n"
    )
    kept = {}
    for stop in (signal.SIGINT, signal.SIGKILL):
        run = project.begin("stopped")
        while len(project.candidates("stopped")) <= len(kept) and run.poll() is None:
            time.sleep(0.02)
        assert run.poll() is None
        started = [run.pid, *(child.pid for child in psutil.Process(run.pid).children(True))]
        os.killpg(run.pid, stop)  # as a terminal does
        run.wait(timeout=30)
        end = time.monotonic() + 10
        while left := [pid for pid in started if psutil.pid_exists(pid)]:
            assert time.monotonic() < end, left
            time.sleep(0.05)
        now = project.candidates("stopped")
        assert {name: now[name] for name in kept} == kept
        kept = now
    assert 0 < len(kept) <= 4
    lines = project.sweep("stopped")
    assert len(lines) == 4 - len(kept)
    now = project.candidates("stopped")
    assert {name: now[name] for name in kept} == kept
    assert len(now) == 4
    study = load_study(project.folder / "config" / "stopped.yaml")
    ds = open_dataset(study.folder / "dataset.nc")
    assert ds.candidate.values.ravel().tolist() == [each.id for each in study.candidates]


def test_a_mistake_ends_make_before_anything_is_written(project):
    project.write_study("wrong", STUDY.replace("support_angle_deg", "support_angel_deg"))
    before = sorted(project.folder.iterdir())
    done = subprocess.run(
        ["make", "--old-file=.venv/installed", "sweep", "STUDY=config/wrong.yaml"],
        cwd=project.folder, env=project.environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    mistake, by_make = done.stderr.splitlines()
    assert mistake.startswith("error: config/wrong.yaml: axes: support_angel_deg: no such key")
    assert by_make.startswith("make: *** ")
    assert sorted(project.folder.iterdir()) == before
    assert not (project.folder / "results" / "wrong").exists()
