"""The report as a file: it builds in every case, stands alone, and says what is missing."""

import base64
import io
import re
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from PIL import Image
from report_studies import ANGLES, BODIES, SLING, make_study
from still_runs import simulate_still

from simcore.dataset import candidate_path, open_dataset, write_dataset
from simcore.errors import DesignError
from simcore.report import build_report
from simcore.report.mat import mat_chart
from simcore.report.pictures import _body_cameras
from simcore.report.runs import read_run
from simcore.report.sling_pictures import (
    BAR_COLOUR,
    BED_COLOUR,
    SHEET_COLOUR,
    SHEET_THICKNESS,
    STRAP_COLOUR,
    press_skin,
    sling_meshes,
)

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
    for section in ("Findings", "One candidate", "Charts", "Pressure maps", "Provenance"):
        assert section in page.text
    assert "no measure of clinical risk" in page.text
    assert path.stat().st_size < 15e6
    return page


def by_angle(place) -> float:
    return -1.0 if place["support_angle_deg"] < 5 else 0.7


def report_of(folder, outcome, **options) -> SimpleNamespace:
    """Return a study of still runs, its dataset and its report."""
    study, dataset = simulate_still(folder, outcome, **options)
    return SimpleNamespace(
        study=study, dataset=dataset, page=read(build_report(dataset, folder / "report.html"))
    )


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """A report whose study has two trajectories on a robotic lift."""
    folder = tmp_path_factory.mktemp("simulated")
    return report_of(folder, by_angle, axes="{support_angle_deg: [0, 7]}")


@pytest.fixture(scope="module")
def hung(tmp_path_factory):
    """A report whose study has one trajectory in a sling."""
    return report_of(tmp_path_factory.mktemp("hung"), lambda place: 0.6, **SLING)


def pictures_of(page: Page) -> list[np.ndarray]:
    """Return the pictures (height, width, 4) uint8 of a page."""
    return [
        np.asarray(
            Image.open(
                io.BytesIO(
                    base64.b64decode(image["src"].removeprefix("data:image/webp;base64,"))
                )
            )
        )
        for image in page.all("img")
    ]


def test_each_exemplar_has_five_pictures_that_show_something(simulated, hung):
    at_the_top = 3, 2  # the best, where that presses, and what it beats, where there is another
    assert len(simulated.page.all("img")) == at_the_top[0] + 10
    assert len(hung.page.all("img")) == at_the_top[1] + 5
    images = simulated.page.all("img") + hung.page.all("img")
    pictures = pictures_of(simulated.page) + pictures_of(hung.page)
    for image, picture in zip(images, pictures, strict=True):
        assert picture.shape == (int(image["height"]), int(image["width"]), 4)
        shown = picture[..., 3] > 128
        assert 0.04 < shown.mean() < 0.8
        assert picture[shown][:, :3].std() > 10


def test_a_side_that_nothing_presses_is_left_out():
    sphere = trimesh.creation.icosphere(3)
    below = np.where(sphere.vertices[:, 2] < -0.5, 1e4, 0.0)
    run = SimpleNamespace(
        net=None, fell=False, body=SimpleNamespace(skin=SimpleNamespace(faces=sphere.faces)),
        skin=lambda frame: sphere.vertices, pressure_peak=below,
        moved=lambda frame: SimpleNamespace(rotation=np.eye(3)),
    )
    assert [*_body_cameras([run], 2e4)] == ["back"]
    assert [*_body_cameras([run], 2e5)] == []  # on so wide a scale it does not show


def test_a_lift_in_production_is_pictured_with_its_flesh_told(tmp_path):
    page = report_of(tmp_path, lambda place: 0.6, method="production").page
    assert len(page.all("img")) == 2 + 5
    assert "No picture" not in page.text
    assert "Flesh of an adult of 23 kg/m²" in page.text
    assert "heel 10 mm no from memory, to be confirmed 120,000 Pa assumed" in page.text


def test_a_sling_is_seen_in_its_colour_and_left_out_of_the_pressure_map(hung):
    def share(picture, colour):
        """Share of the picture that has the hue of a colour, whatever its light."""
        shown = picture[picture[..., 3] == 255][:, :3].astype(float)
        hue = shown / np.maximum(shown.max(axis=1, keepdims=True), 1)
        return (np.abs(hue - np.array(colour) / max(colour)).max(axis=1) < 0.1).mean()

    last, back, front, *_ = pictures_of(hung.page)[2:]
    assert share(last, SHEET_COLOUR) > 0.03 and share(last, BED_COLOUR) > 0.3
    assert share(back, SHEET_COLOUR) < 0.005 and share(front, SHEET_COLOUR) < 0.005
    assert "body, sheet, straps, bar and bed" in hung.page.all("img")[0]["alt"]


def test_straps_are_drawn_from_sheet_to_hooks_and_the_bar_between_those(hung):
    (candidate,) = hung.study.candidates
    path = candidate_path(hung.study.folder / "candidates", candidate)
    run = read_run(path, hung.study.root)
    meshes = sling_meshes(run, "start", (1.0, 0.0, 0.0))

    def ends(colour):
        """Both ends of every tube of a colour: its last two vertices."""
        return np.array(
            [mesh.vertices[-2:] for mesh in meshes if (mesh.colour == colour).all()]
        )

    attachments = candidate.design.device.hanging.attachments
    hooks = np.array([each.bar_point_m for each in attachments])  # the bar's frame is the world
    sewn = np.array([each.sheet_point_m for each in attachments])
    straps = ends(STRAP_COLOUR)
    assert straps[:, 1] == pytest.approx(hooks)
    shift = run.frames.q.values[0, 0] - candidate.design.device.sheet.pelvis_x_m
    assert straps[:, 0, :2] == pytest.approx(sewn + np.array([shift, 0]), abs=0.02)
    bar = ends(BAR_COLOUR).reshape(-1, 3)
    assert all(np.linalg.norm(bar - hook, axis=1).min() < 1e-9 for hook in hooks)


def test_skin_that_a_sheet_lies_in_is_drawn_on_its_upper_side():
    ball = trimesh.creation.icosphere(4, 0.1)
    x = np.linspace(-0.2, 0.2, 41)
    grid = np.stack([*np.meshgrid(x, x, indexing="ij"), np.full((41, 41), -0.08)], -1)
    sheet = grid.reshape(-1, 3)
    up = np.tile([0.0, 0.0, 1.0], (len(sheet), 1))
    pressed = press_skin(ball.vertices, ball.faces, sheet, up)
    assert pressed[:, 2].min() == pytest.approx(-0.08 + 2 * SHEET_THICKNESS)
    above = ball.vertices[:, 2] > -0.07
    assert (pressed[above] == ball.vertices[above]).all()


@pytest.mark.parametrize(
    ("which", "rest", "supported"),
    [("simulated", [1.0], [0.0, 1.0]), ("hung", [2.0], [0.0, 1.0, 2.0])],  # the first fell at 1.5 s
)
def test_the_mat_shows_the_readings_of_the_run(request, which, rest, supported):
    made = request.getfixturevalue(which)
    path = candidate_path(made.study.folder / "candidates", made.study.candidates[0])
    frames = open_dataset(path)
    reading = frames.mat_pressure
    readings = reading.sel(time=rest).mean("time"), reading.sel(time=supported).max("time")
    chart = mat_chart(read_run(path, made.study.root), 60e3, "x")
    for figure, expected in zip(chart.figures.values(), readings, strict=True):
        shown = figure.data[0]
        here = np.isfinite(shown.z)
        assert shown.z[here] == pytest.approx(1e-3 * expected.values[here])
        assert expected.values[~here].sum() == 0
        assert shown.zmin == 0 and shown.zmax == 60
        assert list(shown.x) == pytest.approx(100 * frames.mat_y.values)
        assert "[cm]" in figure.layout.xaxis.title.text
        assert "[cm]" in figure.layout.yaxis.title.text
        assert "[kPa]" in shown.colorbar.title.text
        assert {each.text for each in figure.layout.annotations} == {"head ↑", "feet ↓"}
    for expected in readings:
        assert f"up to {1e-3 * expected.values.max():.1f} kPa" in made.page.text
    if which == "hung":
        outline = next(each for each in figure.data[1:] if each.mode == "lines")
        assert max(outline.y) == pytest.approx(100 * frames.mat_x.values.max(), abs=3)


def test_a_run_of_another_body_is_not_shown_on_this_one(hung, tmp_path):
    (candidate,) = hung.study.candidates
    path = candidate_path(hung.study.folder / "candidates", candidate)
    other = open_dataset(path)
    other["skin_vertex"] = other["skin_vertex"] + 100_000
    write_dataset(other, tmp_path / "a.nc")
    assert "simulated with another body or sheet" in read_run(tmp_path / "a.nc", tmp_path)


def test_pressures_are_those_of_the_supported_time_on_one_scale(simulated):
    text = simulated.page.text
    assert "Peak, back up to 34.0 kPa" in text and "At the end, back up to 34.0 kPa" in text
    assert "Peak, back up to 90.0 kPa" in text  # the other fell at 1.5 s
    assert "0 50 100 kPa" in text


def test_captions_tell_verdict_reason_and_command(simulated):
    text = simulated.page.text
    assert "✕ fell male_172_70, support angle 0°" in text
    assert "It fell 1.5 s after the device started to move." in text
    assert "first that held after the threshold" in text
    assert "Last frame 2.0 s after the start" in text


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
    assert f"No picture: candidates/{second.id}.nc: cannot be read as NetCDF" in page.text


@pytest.mark.parametrize(
    ("outcome", "options", "told", "chart_count"),
    [
        (by_angle, {"axes": ANGLES}, "falls at 4° and below, holds from 7°", 6),
        (by_angle, {"axes": ANGLES, "method": "production"}, "falls at 4° and below", 6),
        (lambda place: 0.6, {"bodies": BODIES[:1]}, "The one candidate held its body.", 5),
        (lambda place: 0.6, {}, "All 2 candidates held their body.", 5),
        (lambda place: "initial_penetration", {"axes": ANGLES}, "penetration: made up to fail", 0),
        (
            lambda place: 0.6 if place["sex"] == "male" else -0.4,
            {"axes": "{sex: [male, female]}", "bodies": BODIES[:1]},
            "Its largest fall margin is 0.60 at sex male", 5,
        ),
        (
            lambda place: 0.6 if place["device"] == "robotic_lift" else 0.3,
            {"devices": ("sling_reclined", "robotic_lift"), "posture": "lying",
             "method": "production"},
            "held their body; best is robotic_lift.", 8,
        ),
        (
            lambda place: 0.6, SLING | {"axes": "{stiffness_per_width_n_per_m: [5000, 2e4, 8e4]}"},
            "it holds at every value from 5,000 N/m to 80,000 N/m", 8,
        ),
        (
            by_angle,
            {"axes": "{support_angle_deg: [0, 4, 7], width_m: [0.5, 0.55], recline_deg: [10]}"},
            "for recline 10°", 10,
        ),
    ],
    ids=["axis", "production", "one", "bodies", "failed", "categorical", "devices", "sling",
         "three_axes"],
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


def test_a_dataset_of_the_first_schema_is_shown_with_what_it_has(tmp_path):
    """As that schema was: fewer metrics, neither certificates nor margins, no names of joints."""
    _, dataset = make_study(tmp_path, by_angle, axes=ANGLES)
    ds = open_dataset(dataset)
    kept = ["fell", "fall_margin", "fall_time", "peak_pressure", "status", "reason", "candidate"]
    older = ds[kept].drop_vars(["region", "joint"], errors="ignore")
    older.attrs = {"schema": 1, "title": "Old", "designs": "{}"}
    write_dataset(older, dataset)
    page = read(build_report(dataset, tmp_path / "report.html"))
    assert "falls at 4° and below, holds from 7°" in page.text
    assert "certificates; margins to limits" in page.text
    assert "Equations and constants are of another version" in page.text
    assert "chart-peak-pressure-0" in [each.get("id") for each in page.all("div")]


def test_certificates_of_fewer_metrics_are_shown_with_those(tmp_path):
    _, dataset = make_study(tmp_path, lambda place: 0.6, bodies=BODIES[:1], certify="all")
    ds = open_dataset(dataset)
    kept = [name for name in ds.metric.values if name not in ("neck_moment", "slide_distance")]
    write_dataset(ds.sel(metric=kept).drop_vars("neck_moment"), dataset)
    page = read(build_report(dataset, tmp_path / "report.html"))
    assert "Certificates (1)" in page.text and "largest torque of the neck's joint" in page.text
    assert re.search(r"Slide on the support \d+ mm – – –", page.text)


@pytest.mark.parametrize(("schema", "lost"), [(99, None), (3, "fell")])
def test_what_has_no_verdicts_or_is_of_a_later_schema_is_refused(tmp_path, schema, lost):
    _, dataset = make_study(tmp_path, lambda place: 0.6)
    ds = open_dataset(dataset).drop_vars([lost] if lost else [])
    ds.attrs["schema"] = schema
    write_dataset(ds, dataset)
    with pytest.raises(DesignError, match="run the sweep again"):
        build_report(dataset, tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


def test_a_reason_takes_the_place_of_figures_that_are_not_there(tmp_path):
    _, dataset = make_study(tmp_path, lambda place: "slip_through", **SLING)
    page = read(build_report(dataset, tmp_path / "report.html"))
    assert "slip through: made up to fail" in page.text
    assert "Remark" not in page.text


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
