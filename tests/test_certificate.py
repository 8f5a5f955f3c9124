"""Certificates: the variants, what passes, the command, and a sweep that has them."""

import re

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from report_studies import BODIES, SLING, figures, make_dataset, make_study
from test_report_html import read
from test_workflow import Project
from tiny_project import ROOT, STUDY, make_project
from typer.testing import CliRunner

from simcore.bench import with_values
from simcore.certificate import (
    FIGURES,
    TOLERANCES,
    certify,
    change_of,
    compare,
    tolerance_text,
)
from simcore.cli import app
from simcore.config import VARIANTS, Design, load_study, refined, variants_of
from simcore.config.paths import leaf_paths
from simcore.dataset import open_dataset, row
from simcore.errors import DesignError
from simcore.jobs import jobs_of
from simcore.metrics import METRICS
from simcore.report import build_report
from simcore.sweep import run_candidate

CERTIFIED = STUDY + "certify: [{support_angle_deg: 7}]\n"


@pytest.fixture
def tiny(tmp_path):
    return make_project(tmp_path)


@pytest.fixture(scope="module")
def candidates():
    """Candidates of a lift and of a sling, by their kind."""
    paths = {"lift": "smoke", "sling": "sling_stiffness"}
    return {
        kind: load_study(ROOT / "config" / f"{name}.yaml").candidates[0]
        for kind, name in paths.items()
    }


def leaves(design: Design) -> dict:
    """Return path → value of every scalar of a design."""
    def at(tree, path):
        for key in path:
            tree = tree[int(key)] if isinstance(tree, list | tuple) else tree[key]
        return tree

    tree = design.model_dump()
    return {".".join(path): at(tree, path) for path in leaf_paths(tree)}


STEP, SHEET_STEP = "method.time_step_s", "method.sheet.step_s"
FIXED = {"method.adaptive_step": None, "method.time_step_s": 0.002}
STEPS = {f"method.adaptive_step.{key}" for key in ("longest_s", "shortest_s", "motion_m")}


@pytest.mark.parametrize(
    ("kind", "changes", "steps", "mesh"),
    [
        ("lift", {}, STEPS, "device.surface.vertex_count"),
        ("lift", FIXED, {STEP}, "device.surface.vertex_count"),
        ("sling", {}, {*STEPS, SHEET_STEP}, "device.sheet.vertex_count"),
        ("sling", {"method.sheet.solver": {"kind": "explicit", "substep_s": 1e-4}},
         {*STEPS, SHEET_STEP, "method.sheet.solver.substep_s"}, "device.sheet.vertex_count"),
        ("sling", FIXED | {"method.sheet.solver": {"kind": "liu", "tolerance": 1e-3}},
         {STEP, SHEET_STEP}, "device.sheet.vertex_count"),
    ],
)  # fmt: skip
def test_a_variant_differs_in_what_it_refines_alone(candidates, kind, changes, steps, mesh):
    design = with_values(candidates[kind].design, changes)
    before = leaves(design)
    expected = {"half_step": (steps, 0.5), "twice_skin": ({"body.skin_vertices"}, 2),
                "twice_device": ({mesh}, 2)}
    variants = refined(design)
    assert tuple(variants) == VARIANTS
    for name, variant in variants.items():
        after = leaves(variant)
        keys, factor = expected[name]
        assert after.keys() == before.keys()
        assert {key for key in after if after[key] != before[key]} == keys
        assert all(after[key] == factor * before[key] for key in keys)


def test_variants_are_candidates_of_their_own(candidates):
    candidate = candidates["lift"]
    variants = variants_of(candidate, ROOT)
    assert len({candidate.id, *(each.id for each in variants.values())}) == 4
    for name, each in variants.items():
        assert each.coordinates == candidate.coordinates | {"variant": name}


@pytest.mark.parametrize(
    ("certify", "expected"),
    [
        ("none", []),
        ("all", [(0, 30), (0, 60), (7, 30), (7, 60)]),
        ("[{support_angle_deg: 7}]", [(7, 30), (7, 60)]),
        ("[{device.support_angle_deg: 7.0, knee.flexion: 60}, {body: tiny, flexion: 30}]",
         [(0, 30), (7, 30), (7, 60)]),
    ],
)  # fmt: skip
def test_a_study_chooses_by_places(tiny, certify, expected):
    tiny.write_text(STUDY + f"  knee.flexion: [30, 60]\ncertify: {certify}\n")
    study = load_study(tiny)
    chosen = [each for each in study.candidates if each.id in study.variants]
    assert [tuple(each.coordinates.values())[1:] for each in chosen] == expected
    assert len(study.variant_runs) == 3 * len(expected)
    assert [each for job in jobs_of(study).values() for each in job] == list(study.runs)
    assert not load_study(tiny, {"hold_s": 1}).variants


@pytest.mark.parametrize(
    ("certify", "expected"),
    [
        ("some", "certify: is 'some'; accepted: none, all or list of at least 1, each: by key"),
        ("7", "certify: is 7; accepted: none, all or list"),
        ("[]", "certify: is []; accepted: list of at least 1"),
        ("[{}]", "certify.0: is {}; accepted: by key: number, text or true/false"),
        ("[{support_angle_deg: [7]}]", "certify.0.support_angle_deg: is [7]; accepted: number"),
        ("[{hold_s: 1}]", "certify.0.hold_s: no such axis; accepted: body, support_angle_deg"),
        ("[{body: tiny}, {support_angle_deg: 5}]",
         "certify.1.support_angle_deg: is 5; accepted: 0, 7"),
        ("all\nset: {skin_vertices: 60000}",
         "certify: body.skin_vertices: is 120000; accepted: whole number from 2000 to 100000"),
    ],
)  # fmt: skip
def test_mistakes_are_told(tiny, certify, expected):
    tiny.write_text(STUDY + f"certify: {certify}\n")
    with pytest.raises(DesignError) as error:
        load_study(tiny)
    assert expected in str(error.value)


def test_a_variant_that_is_a_candidate_is_simulated_once(tiny):
    tiny.write_text(STUDY + "  time_step_s: [0.001, 0.002]\ncertify: [{time_step_s: 0.002}]\n")
    study = load_study(tiny)
    halves = {
        study.variants[each.id]["half_step"].id
        for each in study.candidates if each.coordinates["time_step_s"] == 0.002
    }  # fmt: skip
    assert halves == {
        each.id for each in study.candidates if each.coordinates["time_step_s"] == 0.001
    }
    assert len(study.runs) == 4 + 2 * 2


def made_up(candidate, **changes) -> xr.Dataset:
    """Return a row of a candidate that held, or has a status other than ok."""
    status = changes.pop("status", "ok")
    told = figures(0.5) | changes
    return row(candidate, status, "" if status == "ok" else "why", told if status == "ok" else None)


def certificate_of(candidate, variant: str, **changes) -> xr.Dataset:
    """Return a certificate in which one variant has other figures than the candidate."""
    variants = variants_of(candidate, ROOT)
    return compare(
        made_up(candidate),
        {
            name: made_up(each, **(changes if name == variant else {}))
            for name, each in variants.items()
        },
    )


@pytest.mark.parametrize("metric", TOLERANCES)
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_change_beyond_its_tolerance_fails(candidates, metric, sign, variant):
    value = figures(0.5)[metric]
    scale = value if metric in ("peak_pressure", "contact_area") else 1
    tolerance = {"fell": 0, "fall_margin": 0.05, "peak_pressure": 0.05, "contact_area": 0.05,
                 "support_force_ratio": 0.01}[metric]
    for share, passes in ((0.9, True), (1.1, False)):
        change = sign * (share * tolerance or 1 - passes)  # fell: the same, or not
        certificate = certificate_of(
            candidates["lift"], variant, **{metric: value + change * scale}
        )
        assert certificate.certified == passes
        reason = certificate.certificate_reason.item()
        assert reason.startswith(f"{variant}: {metric} ") != passes
        changes = certificate.change.sel(metric=metric, variant=variant)
        assert changes.item() == pytest.approx(change)
        others = certificate.change.where(certificate.metric != metric, 0)
        assert (others == 0).all()


def test_figures_without_a_tolerance_are_told_and_not_judged(candidates):
    others = [name for name in FIGURES if name not in TOLERANCES]
    doubled = {name: 1 + 2 * figures(0.5)[name] for name in others}
    certificate = certificate_of(candidates["lift"], "twice_skin", **doubled)
    assert certificate.certified == 1 and certificate.certificate_reason == ""
    told = certificate.change.sel(variant="twice_skin")
    assert {name for name in FIGURES if told.sel(metric=name) != 0} == {
        name for name in others if np.isfinite(figures(0.5)[name])
    }


@pytest.mark.parametrize("metric", ["peak_pressure", "contact_area", "fall_margin"])
def test_a_figure_that_one_alone_has_fails(candidates, metric):
    lost = certificate_of(candidates["lift"], "half_step", **{metric: np.nan})
    assert lost.certified == 0
    assert np.isinf(lost.change.sel(metric=metric, variant="half_step"))
    none = {name: made_up(each, **{metric: np.nan})
            for name, each in variants_of(candidates["lift"], ROOT).items()}
    neither = compare(made_up(candidates["lift"], **{metric: np.nan}), none)
    assert neither.certified == 1
    assert (neither.change.sel(metric=metric) == 0).all()


@given(st.floats(1, 1e6), st.floats(1e-3, 1e3))
def test_relative_changes_do_not_depend_on_the_unit(value, factor):
    for metric in ("peak_pressure", "contact_area", "peak_strap_force"):
        assert change_of(metric, value, factor * value) == pytest.approx(factor - 1, abs=1e-9)
    for metric in ("fall_margin", "topple_margin", "support_force_ratio"):
        assert change_of(metric, value, value + factor) == pytest.approx(factor, rel=1e-6)


def test_what_grows_from_nothing_has_no_relative_change():
    assert change_of("peak_pressure", 0, 0) == 0
    assert change_of("peak_pressure", 0, 1) == np.inf
    assert change_of("fall_margin", 0, 1) == 1


def test_the_document_tells_every_tolerance():
    text = (ROOT / "docs" / "workflow.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"^\| `(\w+)` \| ([\d.]+(?: %)?|none: .*) \|$", text, re.MULTILINE))
    assert {name: told.get(name) for name in TOLERANCES} == {
        name: tolerance_text(name).removeprefix("± ").replace("the same", told["fell"])
        for name in TOLERANCES
    }
    for name in VARIANTS:
        assert f"| `{name}` |" in text


def test_tolerances_are_of_scalar_metrics():
    assert set(TOLERANCES) <= set(FIGURES) <= set(METRICS)
    assert not any(METRICS[name].per for name in FIGURES)


def test_failures(candidates):
    candidate = candidates["lift"]
    variants = variants_of(candidate, ROOT)
    certificate = certificate_of(candidate, "twice_device", status="blow_up")
    assert certificate.certified == 0
    assert certificate.certificate_reason == "twice_device: blow_up: why"
    assert certificate.change.sel(variant="twice_device").isnull().all()
    assert (certificate.change.drop_sel(variant="twice_device") == 0).all()
    assert certificate.variant_candidate.values.tolist() == [each.id for each in variants.values()]
    for none in (
        compare(made_up(candidate), {}),
        compare(made_up(candidate, status="blow_up"), {"half_step": made_up(candidate)}),
    ):
        assert none.certified.isnull() and none.certificate_reason == ""
        assert none.change.isnull().all()


def refining_the_skin_presses_her_more(place) -> float | str:
    """Held by 0.5 but for the woman on a finer skin; the man's finer device blows up at 7°."""
    variant, woman = place.get("variant"), place["body"] == BODIES[1]
    if variant == "twice_device" and not woman and place["support_angle_deg"] == 7:
        return "blow_up"
    return 0.4 if variant == "twice_skin" and woman else 0.5


def test_certificates_are_at_their_places(tmp_path):
    ds = make_dataset(
        tmp_path, refining_the_skin_presses_her_more, axes="{support_angle_deg: [0, 4, 7]}",
        certify="[{support_angle_deg: 4}, {support_angle_deg: 7}]",
    )  # fmt: skip
    assert ds.certified.dims == ("body", "support_angle_deg")
    assert ds.certified.isnull().values.tolist() == [[True, False, False]] * 2
    assert ds.certified.values[:, 1:].tolist() == [[1, 0], [0, 0]]
    reasons = ds.certificate_reason.values
    assert reasons[0].tolist() == ["", "", "twice_device: blow_up: made up to fail"]
    assert reasons[1, 1].startswith("twice_skin: fall_margin −0.100, peak_pressure +20.0 %")
    changes = ds.change.sel(body=BODIES[1], support_angle_deg=4, metric="peak_pressure")
    assert changes.values == pytest.approx([0, 0.2, 0])
    assert (ds.variant_candidate.sel(support_angle_deg=0) == "").all()
    assert np.unique(ds.variant_candidate.sel(support_angle_deg=[4, 7])).size == 12


def test_the_page_marks_what_failed(tmp_path):
    _, dataset = make_study(
        tmp_path, refining_the_skin_presses_her_more, axes="{support_angle_deg: [0, 4, 7]}",
        certify="[{support_angle_deg: 4}]",
    )  # fmt: skip
    page = read(build_report(dataset, tmp_path / "report.html"))
    reason = "twice skin: fall margin −0.100, peak pressure +20.0 %"
    # In the verdict table, at her pictures, above her certificate and in the table of candidates.
    marks = [each["title"] for each in page.all("b") if "title" in each]
    assert marks == [f"Certificate failed: {reason}"] * len(marks)
    assert len(marks) >= 3
    assert "support angle 4°: certificate passed Body fell no same same same the same" in page.text
    assert f"support angle 4°: certificate failed ({reason}) Body fell" in page.text
    assert "Peak pressure 10.0 kPa 0.0 % ! +20.0 % 0.0 % ± 5 %" in page.text
    assert "! 1 of 2 Certificates passed" in page.text
    assert "4 candidates have no certificate" in page.text


@pytest.mark.parametrize("options", [{}, SLING])
def test_the_page_without_certificates_has_no_marks(tmp_path, options):
    _, dataset = make_study(tmp_path, lambda place: 0.5, **options)
    page = read(build_report(dataset, tmp_path / "report.html"))
    assert "Certificate failed" not in page.text
    assert "– Certificates passed this study asks for none" in page.text


def test_certify_is_of_the_plain_candidate(tiny):
    study = load_study(tiny, {"support_angle_deg": 7})
    (candidate,) = study.candidates
    plain = run_candidate(candidate, study.root)[0]
    told = []
    certificate = certify(candidate, plain, study.root, told.append)
    assert told == list(VARIANTS)
    for name, variant in variants_of(candidate, study.root).items():
        alone = run_candidate(variant, study.root)[0]
        expected = [change_of(each, plain[each].item(), alone[each].item()) for each in FIGURES]
        assert certificate.change.sel(variant=name).values.tolist() == expected
    # Twice the device's points are twice as stiff a support under the paper's contact.
    assert certificate.certified == 0
    assert "twice_device: " in certificate.certificate_reason.item()

    out = tiny.parent / "run.nc"
    done = CliRunner().invoke(app, ["simulate", str(tiny), "--set", "support_angle_deg=7",
                                    "--certify", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "certificate: failed (" in done.output and "± 5 %" in done.output
    ds = open_dataset(out)
    xr.testing.assert_identical(ds[["certified", "certificate_reason", "change"]].drop_attrs(),
                                certificate[["certified", "certificate_reason", "change"]]
                                .drop_attrs())
    for name in (*FIGURES, "status", "candidate"):
        xr.testing.assert_equal(ds[name], plain[name])


def test_certify_leaves_failures(tiny):
    study = load_study(tiny, {"support_angle_deg": 7, "hip.damping_nms_per_rad": 1000000})
    (candidate,) = study.candidates
    figures = run_candidate(candidate, study.root)[0]
    told = []
    assert certify(candidate, figures, study.root, told.append).certified.isnull()
    assert told == []


def test_a_sweep_simulates_variants_once(tmp_path):
    project = Project(tmp_path)
    path = project.write_study("certified", CERTIFIED)
    lines = project.sweep("certified", report=True)
    assert sorted(line.split()[0] for line in lines) == [f"{number}/5" for number in range(1, 6)]
    assert sum("support_angle_deg 7, variant " in line for line in lines) == 3
    first = project.results("certified")
    assert len(project.candidates("certified")) == 5
    assert {f"bodies/{name}.glb" for name in ("tiny", "tiny_twice_skin")} <= set(first)
    dataset = project.folder / "results" / "certified" / "dataset.nc"
    ds = open_dataset(dataset)
    assert ds.certified.isnull().values.tolist() == [[True, False]]
    for name, variant in zip(VARIANTS, ds.variant_candidate.values[0, 1], strict=True):
        run = open_dataset(dataset.parent / "candidates" / f"{variant}.nc")
        here = ds.isel(body=0, support_angle_deg=1)
        assert here.change.sel(metric="peak_pressure", variant=name).item() == pytest.approx(
            run.peak_pressure.item() / here.peak_pressure.item() - 1
        )
    assert "Certificates (1)" in (dataset.parent / "report.html").read_text(encoding="utf-8")

    # Again: nothing.
    assert project.sweep("certified", report=True) == []
    assert project.results("certified") == first

    # Not asked for any more; and again, judged by other tolerances: the files are still there.
    path.write_text(STUDY, encoding="utf-8")
    assert project.sweep("certified") == []
    assert open_dataset(dataset).certified.isnull().all()
    source = project.folder / "simcore" / "certificate.py"
    text = source.read_text(encoding="utf-8")
    source.write_text(text.replace('"peak_pressure": 0.05', '"peak_pressure": 1e-9'), "utf-8")
    path.write_text(CERTIFIED, encoding="utf-8")
    assert project.sweep("certified") == []
    assert project.candidates("certified").items() <= first.items()
    judged = open_dataset(dataset).certificate_reason.values[0, 1]
    assert all(f"{name}: " in judged for name in VARIANTS)
    assert judged != here.certificate_reason.item()
