"""The report as a file: it builds in every case, stands alone, and says what is missing."""

import base64
import io
import re
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from report_studies import BODIES, figures, make_study

from simcore.dataset import (
    candidate_dataset,
    candidate_path,
    open_dataset,
    row,
    trajectory_dataset,
    write_dataset,
)
from simcore.errors import DesignError
from simcore.recorder import Trajectory
from simcore.report import build_report
from simcore.scene import build_scene

ANGLES = "{support_angle_deg: [0, 4, 7]}"
VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """Keeps elements, text outside scripts, and whether every element is closed in order."""

    def __init__(self, html: str):
        super().__init__()
        self.elements: list[tuple[str, dict]] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.styles: list[str] = []
        self.feed(html)
        self.text = re.sub(r"\s+", " ", " ".join(self.words))

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes another element"

    def handle_data(self, data):
        if self.open[-1:] == ["style"]:
            self.styles.append(data)
        elif self.open[-1:] != ["script"]:
            self.words.append(data)

    def all(self, tag: str) -> list[dict]:
        return [attributes for name, attributes in self.elements if name == tag]


def read(path) -> Page:
    """Return the parsed page, after what must hold in every case."""
    html = path.read_text(encoding="utf-8")
    page = Page(html)
    assert page.open == []
    addresses = [
        attributes[name]
        for _, attributes in page.elements
        for name in ("src", "href", "data", "action", "srcset", "poster")
        if attributes.get(name)
    ]
    assert all(address.startswith(("#", "data:image/")) for address in addresses)
    assert not any(re.search(r"url\(|@import", style) for style in page.styles)
    (policy,) = [m["content"] for m in page.all("meta") if "http-equiv" in m]
    assert "default-src 'none'" in policy and "http" not in policy
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert {link["href"][1:] for link in page.all("a")} <= set(ids)
    assert all(image["alt"] for image in page.all("img"))
    for section in ("Findings", "Charts", "Pictures", "physics", "Provenance"):
        assert section in page.text
    assert "no measure of clinical risk" in page.text
    assert path.stat().st_size < 10e6
    return page


def by_angle(place) -> float:
    return -1.0 if place["support_angle_deg"] < 5 else 0.7


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """A report whose study has two trajectories, in which the body stands still."""
    folder = tmp_path_factory.mktemp("simulated")
    study, dataset = make_study(folder, by_angle, axes="{support_angle_deg: [0, 7]}",
                                bodies=BODIES[:1])
    for candidate in study.candidates:
        scene = build_scene(candidate.design, candidate.coordinates["body"], folder)
        time = np.array([-0.5, 0.0, 1.0, 2.0])
        start = scene.device.motion(0.0)
        skin_count = scene.body.skin.vertex_count
        pressure = np.zeros((4, skin_count))
        pressure[:, :400] = [[90e3], [20e3], [34e3], [90e3]]  # settles, held or falling, fallen
        trajectory = Trajectory(
            time=time,
            q=np.tile(scene.configuration, (4, 1)),
            v=np.zeros((4, scene.body.model.nv)),
            device_rotation=np.tile(start.rotation, (4, 1, 1)),
            device_position=np.tile(start.position, (4, 1)),
            displacement=np.zeros(4),
            segment_force=np.zeros((4, 18, 3)),
            normal_force=np.zeros((4, skin_count), np.float32),
            contact_count=np.zeros(4, int),
            depth_max=np.zeros(4),
            settled=True, cpu_time=1.0, status="ok", reason="",
        )
        told = row(candidate, "ok", "", figures(by_angle(candidate.coordinates)))
        write_dataset(
            candidate_dataset(candidate, told, trajectory_dataset(trajectory, pressure)),
            candidate_path(study.folder / "candidates", candidate),
        )
    return SimpleNamespace(
        study=study, dataset=dataset, page=read(build_report(dataset, folder / "report.html"))
    )


def test_each_exemplar_has_three_pictures_that_show_something(simulated):
    images = simulated.page.all("img")
    assert len(images) == 6
    for image in images:
        data = base64.b64decode(image["src"].removeprefix("data:image/webp;base64,"))
        picture = np.asarray(Image.open(io.BytesIO(data)))
        assert picture.shape == (int(image["height"]), int(image["width"]), 4)
        shown = picture[..., 3] > 128
        assert 0.04 < shown.mean() < 0.8
        assert picture[shown][:, :3].std() > 10


def test_pressures_are_those_of_the_supported_time_on_one_scale(simulated):
    text = simulated.page.text
    assert "Peak pressure while supported: 34.0 kPa" in text  # fell at 1.5 s
    assert "Peak pressure while supported: 90.0 kPa" in text
    assert text.count("100 kPa") == 2


def test_captions_tell_verdict_reason_and_command(simulated):
    text = simulated.page.text
    assert "✕ fell male_172_70, support angle 0°" in text
    assert "It fell 1.5 s after the device started to move." in text
    assert "first that held after the threshold" in text
    assert ("simcore simulate config/made_up.yaml --set body=male_172_70 "
            "--set support_angle_deg=7 --out run.nc") in text
    assert "First frame, −0.50 s" in text


def test_missing_and_unreadable_candidates_are_named(simulated, tmp_path):
    first, second = simulated.study.candidates
    folder = simulated.study.folder / "candidates"
    kept = [(folder / f"{each.id}.nc").read_bytes() for each in (first, second)]
    (folder / f"{first.id}.nc").unlink()
    (folder / f"{second.id}.nc").write_bytes(b"torn")
    try:
        page = read(build_report(simulated.dataset, tmp_path / "report.html", root=tmp_path))
    finally:
        for each, content in zip((first, second), kept, strict=True):
            (folder / f"{each.id}.nc").write_bytes(content)
    assert not page.all("img")
    assert f"No picture: candidates/{first.id}.nc is missing; run the sweep again" in page.text
    assert f"No picture: candidates/{second.id}.nc cannot be read by this version" in page.text


@pytest.mark.parametrize(
    ("outcome", "options", "told", "chart_count"),
    [
        (by_angle, {"axes": ANGLES}, "falls at 4° and below, holds from 7°", 5),
        (lambda place: 0.6, {"bodies": BODIES[:1]}, "The one candidate held its body.", 4),
        (lambda place: 0.6, {}, "All 2 candidates held their body.", 4),
        (
            lambda place: "initial_penetration", {"axes": ANGLES},
            "initial penetration: made up to fail", 0,
        ),
        (
            lambda place: 0.6 if place["sex"] == "male" else -0.4,
            {"axes": "{sex: [male, female]}", "bodies": BODIES[:1]},
            "Its largest fall margin is 0.60 at sex male", 4,
        ),
        (
            by_angle,
            {"axes": "{support_angle_deg: [0, 4, 7], width_m: [0.5, 0.55], recline_deg: [10]}"},
            "for recline 10°", 8,
        ),
    ],
    ids=["axis", "one", "bodies", "failed", "categorical", "three_axes"],
)
def test_report_builds_in_every_case(tmp_path, outcome, options, told, chart_count):
    _, dataset = make_study(tmp_path, outcome, **options)
    page = read(build_report(dataset, tmp_path / "deep" / "report.html"))
    assert told in page.text
    charts = [each for each in page.all("div") if each.get("id", "").startswith("chart-")]
    assert len(charts) == chart_count
    assert not page.all("img")
    if not chart_count:
        assert "There is nothing to draw: every simulation failed." in page.text


def test_metrics_that_an_older_dataset_lacks_are_named(tmp_path):
    _, dataset = make_study(tmp_path, by_angle, axes=ANGLES)
    older = open_dataset(dataset).drop_vars(["region_peak_pressure", "topple_margin"])
    write_dataset(older, dataset)
    page = read(build_report(dataset, tmp_path / "report.html"))
    assert "lacks: least backward lean of the upper body over the hips; highest" in page.text
    assert "chart-fall-margin-0" in [each.get("id") for each in page.all("div")]


def test_every_verdict_has_a_sign_and_a_word(tmp_path):
    margins = {0: -0.4, 4: "blow_up", 7: 0.7}
    _, dataset = make_study(
        tmp_path, lambda place: margins[place["support_angle_deg"]], axes=ANGLES, bodies=BODIES[:1]
    )
    page = read(build_report(dataset, tmp_path / "report.html"))
    for sign in ("✕ fell −0.40", "! failed", "✓ held 0.70"):
        assert sign in page.text


def test_text_of_a_study_is_never_markup(tmp_path):
    hostile = '</title><script>alert(1)</script><img src="https://example.org/x.png">&amp;'
    _, dataset = make_study(tmp_path, by_angle, axes=ANGLES, title=hostile)
    page = read(build_report(dataset, tmp_path / "report.html"))
    assert hostile in page.text


def test_what_is_no_dataset_is_refused_and_the_old_report_kept(tmp_path):
    bad, out = tmp_path / "dataset.nc", tmp_path / "report.html"
    bad.write_text("not NetCDF")
    out.write_text("old")
    with pytest.raises(DesignError, match="cannot be read"):
        build_report(bad, out)
    assert out.read_text() == "old"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["dataset.nc", "report.html"]
