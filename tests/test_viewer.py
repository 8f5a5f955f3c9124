"""The replay in a real browser: what it shows is the run, and it is quiet about it."""

import io

import numpy as np
import pytest
from chromium import Chromium, needs_chromium
from made_up_runs import make_run
from PIL import Image
from scipy.spatial.transform import Rotation

from simcore.body.build import posed_skin
from simcore.export.recording import open_recording
from simcore.viewer import Replays, write_replay
from simcore.viewer.page import SCRIPTS, common_scale, title_of

PLAYER = "document.querySelector('.replay').player"
STAGE = f"{PLAYER}.stages[0]"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    return {
        "lift": open_recording(make_run(folder / "lift.nc")),
        "fall": open_recording(make_run(folder / "fall.nc", count=5, margin=-0.2)),
        "sling": open_recording(make_run(folder / "sling.nc", "sling_reclined")),
    }


@pytest.fixture(scope="module")
def pages(runs, tmp_path_factory):
    """One run, two runs, a sling, and a page of its own with two players of many runs."""
    folder = tmp_path_factory.mktemp("pages")
    for name, shown in {"one": ["lift"], "two": ["lift", "fall"], "sling": ["sling"]}.items():
        write_replay([runs[run] for run in shown], folder / f"{name}.html")
    replays = Replays(30e3)
    for name, run in runs.items():
        replays.add(name, run, title=f"<{name}>")
    parts = replays.fragment(["lift"]), replays.fragment(["fall", "lift"]), replays.assets()
    (folder / "report.html").write_text(
        '<!DOCTYPE html><meta charset="utf-8"><title>t</title><body>' + "".join(parts)
    )
    return folder


@pytest.fixture
def show(browser, pages):
    """Return a function that shows a page at a size, in a scheme; afterwards nobody complained.

    A page that is open already is not loaded again: that takes a second of shader compilation.
    """

    def open_page(name: str, width: int = 900, height: int = 640, scheme: str = "light"):
        browser.resize(width, height)
        browser.use_scheme(scheme)
        path = pages / f"{name}.html"
        if browser.evaluate("location.href") != path.as_uri():
            browser.open(path)
        browser.evaluate(f"{PLAYER}.play(false), {PLAYER}.view('overview'), {PLAYER}.seek(0), 0")
        return browser

    yield open_page
    assert browser.complaints == []


def picture(browser) -> np.ndarray:
    """Return the canvas as it is on the screen, (height, width, 3)."""
    browser.evaluate("new Promise((done) => setTimeout(done, 200))")  # drawn finely once at rest
    x, y, width, height = browser.evaluate(
        "(({x, y, width, height}) => [x, y, width, height])"
        "(document.querySelector('canvas').getBoundingClientRect())"
    )
    image = Image.open(io.BytesIO(browser.screenshot())).convert("RGB")
    return np.asarray(image.crop((x, y, x + width, y + height)), dtype=float)


def seek(browser, time: float) -> None:
    browser.evaluate(f"{PLAYER}.seek({time})")


@needs_chromium
@pytest.mark.parametrize("name", ["one", "two", "sling"])
def test_something_is_drawn_light_and_dark(show, name):
    for scheme in ("light", "dark"):
        drawn = picture(show(name, scheme=scheme))
        assert (drawn.mean() > 127) == (scheme == "light")
        background = np.median(drawn, axis=(0, 1))
        differing = (np.abs(drawn - background).max(axis=2) > 40).mean()
        assert 0.02 < differing < 0.6  # a body and a device, and room around them


@needs_chromium
def test_the_browser_poses_the_body_as_pinocchio_does(show, runs):
    browser, run = show("one"), runs["lift"]
    for frame in (0, 3, 8):
        seek(browser, run.time[frame])
        expected = posed_skin(run.body, run.column("q")[frame])
        found = np.array(browser.evaluate(f"[...{STAGE}.skin.geometry.attributes.position.array]"))
        assert np.abs(found.reshape(-1, 3) - expected).max() < 2e-4  # positions are sent to 0.1 mm


@needs_chromium
def test_between_frames_it_goes_straight(show, runs):
    browser, run = show("one"), runs["lift"]
    roots = []
    for share in (0, 0.5, 1):
        seek(browser, run.time[4] + share * (run.time[5] - run.time[4]))
        roots.append(browser.evaluate(f"{STAGE}.jointPositions()[0]"))
    assert roots[1] == pytest.approx(np.mean([roots[0], roots[2]], axis=0), abs=1e-5)
    assert np.linalg.norm(np.subtract(roots[2], roots[0])) > 0.01


@needs_chromium
def test_device_and_pressure_are_those_of_the_frame(show, runs):
    browser, run, frame = show("one"), runs["lift"], 6
    seek(browser, run.time[frame])
    turn = browser.evaluate(f"{STAGE}.carrier.quaternion.toArray()")
    expected = Rotation.from_quat(run.column("device_quaternion")[frame])
    assert (Rotation.from_quat(turn) * expected.inv()).magnitude() < 1e-6
    shares = np.array(browser.evaluate(f"[...{STAGE}.pressure.array]"))
    pressure = np.zeros(len(shares))
    pressure[run.frames["skin_vertex"].values] = run.column("skin_pressure")[frame]
    scale = common_scale([run])
    assert np.abs(shares / 255 - np.clip(pressure / scale, 0, 1)).max() < 0.6 / 255
    told = browser.evaluate("document.querySelector('.replay-panes small').textContent")
    assert f"{pressure.max() / 1e3:.1f} kPa" in told
    region = run.body.region_names[run.body.vertex_region[pressure.argmax()]]
    assert told.endswith(region.replace("_", " "))


@needs_chromium
def test_the_sheet_is_that_of_the_frame(show, runs):
    browser, run = show("sling"), runs["sling"]
    for frame in (0, 5, 8):
        seek(browser, run.time[frame])
        found = np.array(browser.evaluate(f"[...{STAGE}.sheet.geometry.attributes.position.array]"))
        expected = run.column("sheet_position")[frame]
        assert np.abs(found.reshape(-1, 3) - expected).max() < 3e-4  # half a millimetre a step


@needs_chromium
@pytest.mark.parametrize("size", [(900, 640), (360, 740)])
def test_every_view_frames_all_of_the_run(show, runs, size):
    browser, run = show("one", *size), runs["lift"]
    points = np.concatenate([posed_skin(run.body, q)[::40] for q in run.column("q")])
    for view in ("overview", "front", "back", "side", "above", "below"):
        browser.evaluate(f"document.querySelector('[data-view={view}]').click()")
        browser.settle()
        seen = np.array(browser.evaluate(
            f"{points.round(4).tolist()}.map((p) => new THREE.Vector3(...p)"
            f".project({PLAYER}.camera).toArray())"
        ))
        assert np.abs(seen[:, :2]).max() < 1, view  # nothing is clipped
        assert np.ptp(seen[:, :2], axis=0).max() > 0.9, view  # nor small


@needs_chromium
def test_slider_and_keys_move_the_body(show, runs):
    browser, run = show("one"), runs["lift"]
    before = picture(browser)
    browser.evaluate(
        "(() => { const slider = document.querySelector('.replay-time'); slider.value = 0.2;"
        "slider.dispatchEvent(new Event('input')); })()"
    )
    assert browser.evaluate(f"{PLAYER}.time") == pytest.approx(0.2)
    assert (np.abs(picture(browser) - before).max(axis=2) > 40).mean() > 0.01
    seek(browser, 0.0)
    browser.press("ArrowRight", "ArrowRight")
    assert browser.evaluate(f"{PLAYER}.time") == pytest.approx(0.04, abs=1e-6)
    browser.press("ArrowLeft", "ArrowLeft")
    assert browser.evaluate(f"{PLAYER}.time") == pytest.approx(0.0, abs=1e-6)
    browser.press("End", "End")
    assert browser.evaluate(f"{PLAYER}.time") == pytest.approx(run.time[-1])


@needs_chromium
def test_it_plays_to_the_end_and_stops(show, runs):
    browser, end = show("one"), runs["lift"].time[-1]
    browser.press(" ", "Space")
    assert browser.evaluate(f"{PLAYER}.playing")
    browser.evaluate(
        f"new Promise((done) => {{ const wait = () => {PLAYER}.playing ? setTimeout(wait, 20) :"
        " done(); wait(); })"
    )
    assert browser.evaluate(f"{PLAYER}.time") == pytest.approx(end)


@needs_chromium
def test_two_runs_keep_step_and_the_shorter_says_that_it_ended(show, runs):
    browser = show("two")
    told = "[...document.querySelectorAll('.replay-panes > div')].map((each) => each.textContent)"
    seek(browser, 0.04)
    lift, fall = browser.evaluate(told)
    assert "held" in lift and "fell at 0.0 s" in fall
    both = browser.evaluate(f"{PLAYER}.stages.map((stage) => stage.jointPositions())")
    for positions in both:  # the same made-up motion
        assert np.allclose(positions, both[0], atol=1e-4)
    seek(browser, runs["lift"].time[-1])
    assert "ended at 0.08 s" in browser.evaluate(told)[1]
    assert "ended" not in browser.evaluate(told)[0]


@needs_chromium
def test_a_phone_shows_it_without_scrolling_sideways(show):
    browser = show("two", 360, 740)
    assert browser.evaluate("document.documentElement.scrollWidth") <= 360
    assert browser.evaluate(f"{PLAYER}.stacked")
    tools = "document.querySelector('.replay-tools').getBoundingClientRect()"
    assert browser.evaluate(f"{tools}.bottom") <= 740


@needs_chromium
def test_one_page_holds_many_players_and_runs(show, pages):
    browser = show("report")
    text = (pages / "report.html").read_text()
    assert text.count('id="replay-body-') == 1  # all three runs are of one body
    assert text.count('id="replay-device-') == 1  # and two of one device
    second = "document.querySelectorAll('.replay')[1]"
    assert browser.evaluate(f"{second}.player.stages.length") == 2
    assert browser.evaluate(f"{second}.querySelector('b').textContent") == "<fall>"
    browser.evaluate(
        f"(() => {{ const chooser = {second}.querySelectorAll('.replay-run')[1];"
        "chooser.value = 'run-sling'; chooser.dispatchEvent(new Event('change')); })()"
    )
    browser.evaluate(
        f"new Promise((done) => {{ const wait = () => {second}.player.stages[1].run.title =="
        " '<sling>' ? done() : setTimeout(wait, 20); wait(); })"
    )
    assert browser.evaluate(f"{second}.querySelectorAll('b')[1].textContent") == "<sling>"
    assert browser.evaluate(f"!!{second}.player.stages[1].sheet")


@needs_chromium
def test_without_webgl_it_says_so(pages, tmp_path):
    browser = Chromium(tmp_path, gl=False)
    try:
        browser.open(pages / "one.html")
        assert "WebGL" in browser.evaluate("document.querySelector('.replay-message').textContent")
        assert not browser.evaluate("document.querySelector('.replay-message').hidden")
    finally:
        browser.close()


def test_the_same_run_makes_the_same_page(runs, tmp_path):
    for name in "ab":
        write_replay([runs["sling"]], tmp_path / f"{name}.html")
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_the_page_names_no_other_place(pages):
    text = (pages / "one.html").read_text()
    page = text[: text.index("<script")] + text[text.rindex("</script>") :]
    assert "http" not in page.replace("http-equiv", "") and "default-src 'none'" in page


def test_three_js_is_small_and_cannot_end_its_script():
    from importlib import resources

    folder = resources.files("simcore.viewer")
    assert len((folder / SCRIPTS[0]).read_bytes()) < 1_000_000
    for name in SCRIPTS:
        assert "</script" not in (folder / name).read_text(encoding="utf-8").lower()


def test_titles_tell_the_place_with_units(runs):
    assert title_of(runs["lift"]) == "male_172_70, support angle 7.5°"


def test_the_scale_is_that_of_what_held(runs):
    assert common_scale([runs["lift"], runs["fall"]]) == common_scale([runs["lift"]])
