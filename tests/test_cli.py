"""The command: exit codes, one line for a mistake, nothing written by one."""

import subprocess
import sys
from pathlib import Path

import pytest
import trimesh
from tiny_project import STUDY, make_project
from typer.testing import CliRunner

from simcore.cli import app, main
from simcore.dataset import design_of, open_dataset
from simcore.errors import DesignError


@pytest.fixture
def study(tmp_path, monkeypatch) -> Path:
    path = make_project(tmp_path)
    monkeypatch.chdir(tmp_path)
    return path.relative_to(tmp_path)


@pytest.fixture
def simcore(monkeypatch, capsys):
    """Return a function: arguments → exit code, output, error output."""

    def run(*arguments) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["simcore", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        captured = capsys.readouterr()
        return end.value.code or 0, captured.out, captured.err

    return run


def files() -> set[Path]:
    return set(Path().rglob("*"))


def test_check_counts_the_candidates(study, simcore):
    before = files()
    code, out, err = simcore("check", study)
    assert (code, err) == (0, "")
    assert out == "config/tiny.yaml: 2 candidates (1 body × 2 support_angle_deg)\n"
    assert files() == before


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["check", "config/no.yaml"], "config/no.yaml: cannot be read"),
        (["check", "config/wrong.yaml"], "config/wrong.yaml: axes: x: no such key in the design"),
        (["check", "config/heavy.yaml"], "kg"),
        (["check", "config/broken.yaml"], "seat.stl: device.surface.file: "),
        (["simulate", "config/tiny.yaml"], "several candidates; add --set support_angle_deg=…"),
        (["simulate", "config/tiny.yaml", "--set", "hold_s"], "--set hold_s: must be PATH=VALUE"),
        (["simulate", "config/tiny.yaml", "--set", "=1"], "--set =1: must be PATH=VALUE"),
        (["simulate", "config/tiny.yaml", "--set", "hold_s="], "--set hold_s=: must be PATH=VALUE"),
        (["simulate", "config/tiny.yaml", "--set", "hold_s=1", "--set", "hold_s=2"], "given twice"),
        (["simulate", "config/tiny.yaml", "--set", "hold_s=-1"], "--set hold_s: method.hold_s: is"),
        (["simulate", "config/tiny.yaml", "--set", "hold=1"], "--set: hold: no such key in the de"),
        (["simulate", "config/tiny.yaml", "--set", "support_angle_deg=1", "--out", "config"],
         "--out config: is a folder; accepted: a file, such as config/run.nc"),
        (["simulate", "config/tiny.yaml", "--set", "support_angle_deg=1",
          "--out", "config/tiny.yaml/run.nc"], "cannot be written; accepted: a file in a folder"),
        (["body", "designs/bodies/no.yaml"], "designs/bodies/no.yaml: cannot be read"),
        (["body", "designs/bodies/giant.yaml"], "giant"),
        (["export", "run.nc"], "nothing asked for; accepted: --glb, --csv or both"),
        (["export", "run.nc", "--glb"], "run.nc: cannot be read as NetCDF"),
        (["export", "run.nc", "--glb", "--out", "config"], "--out config: is a folder"),
        (["replay", "run.nc", "--no-open"], "run.nc: cannot be read as NetCDF"),
        (["bench", "cloth"],
         "bench: no case cloth; accepted: lift, fall, paper, paper_fall, sling"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_and_writes_nothing(study, simcore, arguments, expected):
    config, designs = Path("config"), Path("designs")
    config.joinpath("wrong.yaml").write_text(STUDY.replace("support_angle_deg", "x"))
    config.joinpath("heavy.yaml").write_text(STUDY + "  mass_kg: [70, 240]\n")
    body = (designs / "bodies" / "tiny.yaml").read_text()
    (designs / "bodies" / "giant.yaml").write_text(body.replace("70", "25"))
    config.joinpath("broken.yaml").write_text(STUDY.replace("devices: [tiny]", "devices: [broken]"))
    (designs / "devices" / "broken.yaml").write_text(
        "kind: robotic_lift\nsupport_angle_deg: 0\n"
        "surface: {shape: mesh, file: seat.stl, unit: m, recline_deg: 0, vertex_count: 500}\n"
        "motion:\n  translation_axis: [0, 0, 1]\n  rotation_axis: [0, 0, 1]\n"
        "  rotation_point_m: [0, 0, 0]\n  keyframes:\n"
        "    - {time_s: 0, translation_m: 0, rotation_deg: 0}\n"
        "    - {time_s: 1, translation_m: 1, rotation_deg: 0}\n"
    )
    Path("seat.stl").write_text("no mesh")
    before = files()
    code, out, err = simcore(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("error: ") and err.endswith("\n") and err.count("\n") == 1
    assert expected in err
    assert files() == before


def test_one_line_even_of_a_name_of_two(study, simcore):
    study.write_text(STUDY + '"two\\nlines": 1\n')
    assert simcore("check", study)[2].count("\n") == 1


def test_a_box_of_cad_is_checked(study, simcore):
    text = Path("designs/devices/tiny.yaml").read_text()
    begin, end = text.index('"surface"'), text.index('"motion"')
    surface = '"surface": {shape: mesh, file: box.stl, unit: m, recline_deg: 0, vertex_count: 500},'
    Path("designs/devices/tiny.yaml").write_text(text[:begin] + surface + text[end:])
    trimesh.creation.box((0.5, 0.5, 0.1)).export("box.stl")
    assert simcore("check", study)[0] == 0


def test_simulate_writes_what_was_asked(study, simcore):
    code, out, err = simcore(
        "simulate", study, "--set", "support_angle_deg=7", "--set", "hold_s=0.05",
        "--out", "new/run.nc",
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert "fall_margin" in out and "real-time factor" in out and "written: new/run.nc" in out
    ds = open_dataset(Path("new/run.nc"))
    assert design_of(ds).device.support_angle_deg == 7
    assert design_of(ds).method.hold_s == 0.05
    assert ds.sizes["time"] > 3
    assert [path.name for path in Path("new").iterdir()] == ["run.nc"]
    assert not Path("results").exists()


def test_a_failed_candidate_is_told_and_kept(study, simcore):
    code, out, _ = simcore(
        "simulate", study, "--set", "support_angle_deg=7",
        "--set", "hip.damping_nms_per_rad=1000000", "--out", "run.nc",
    )  # fmt: skip
    assert code == 1
    assert "blow_up" in out and "real-time factor" not in out
    ds = open_dataset(Path("run.nc"))
    assert ds.status == "blow_up" and "rad/s" in ds.reason.item()
    assert ds.fall_margin.isnull()


def test_body_prints_masses_and_writes_a_model(study, simcore):
    code, out, err = simcore("body", "designs/bodies/tiny.yaml", "--out", "tiny.glb")
    assert (code, err) == (0, "")
    assert "mass 70.00 kg" in out and "de Leva" in out
    assert Path("tiny.glb").read_bytes()[:4] == b"glTF"


def test_a_run_is_exported_and_replayed(study, simcore, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    simcore("simulate", study, "--set", "support_angle_deg=7", "--set", "hold_s=0.05",
            "--out", "run.nc")
    assert simcore("export", "run.nc", "--glb", "--csv")[::2] == (0, "")
    assert Path("run.glb").read_bytes()[:4] == b"glTF"
    assert Path("run_series.csv").read_text().startswith("time_s,")
    code, out, err = simcore("replay", "run.nc", "run.nc", "--no-open", "--out", "new/both.html")
    assert (code, out, err, opened) == (0, "written: new/both.html\n", "", [])
    simcore("replay", "run.nc")
    assert opened == [Path("run_replay.html").resolve().as_uri()]
    assert Path("new/both.html").stat().st_size < 3e6


def test_the_table_of_a_study_is_no_run(study, simcore):
    from report_studies import make_study

    table = make_study(Path(), lambda place: 0.5)[1]
    code, _, err = simcore("replay", table, "--no-open")
    assert code == 2 and "is the table of a study; accepted: one run" in err


def test_the_installed_command(tmp_path):
    done = subprocess.run(
        [Path(sys.executable).with_name("simcore"), "check", "no.yaml"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == "error: no.yaml: cannot be read (No such file or directory)\n"
    assert not list(tmp_path.iterdir())


def test_help_and_usage():
    runner = CliRunner()
    assert runner.invoke(app, ["--help"]).exit_code == 0
    assert runner.invoke(app, ["simulate"]).exit_code == 2
    assert runner.invoke(app, ["nothing"]).exit_code == 2


def test_library_users_get_the_error_itself(study):
    result = CliRunner().invoke(app, ["check", "config/no.yaml"])
    assert isinstance(result.exception, DesignError)
