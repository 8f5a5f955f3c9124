"""The report in a real browser: it is drawn, answers clicks and keys, and complains of nothing."""

import io

import numpy as np
import pytest
from chromium import needs_chromium
from PIL import Image
from report_studies import ANGLES, BODIES, SLING, make_study
from still_runs import simulate_still

from simcore.dataset import candidate_path
from simcore.report import build_report

pytestmark = needs_chromium
CHOICE = "document.getElementById('candidate-choice')"
TOLD = "document.getElementById('candidate-told').textContent"
PLAYER = "document.querySelector('.replay').player"
SHOWN = f"{PLAYER}.stages.map((stage) => stage.run.title)"


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Three support angles, of which the second's run is lost, and the report of them."""
    folder = tmp_path_factory.mktemp("study")
    study, dataset = simulate_still(
        folder, lambda place: -0.9 if place["support_angle_deg"] < 5 else 0.7, axes=ANGLES
    )
    candidate_path(study.folder / "candidates", study.candidates[1]).unlink()
    build_report(dataset, folder / "report.html")
    return study


@pytest.fixture
def page(browser, study):
    """The report opened anew on a wide screen; afterwards nobody complained."""
    browser.resize(1200, 900)
    browser.use_scheme("light")
    browser.open(study.root / "report.html")
    yield browser
    assert browser.complaints == []


def go_to(browser, selector: str) -> None:
    """Scroll to an element and wait until it is there and drawn."""
    browser.evaluate(
        f"document.querySelector({selector!r}).scrollIntoView({{behavior: 'instant'}})"
    )
    browser.settle()
    browser.settle()


def look(browser) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert("RGB"), dtype=float)


def wait_for(browser, condition: str) -> None:
    browser.evaluate(
        f"new Promise((done) => {{ const wait = () => {condition} ? done() : setTimeout(wait, 20);"
        " wait(); })"
    )


def click(browser, selector: str) -> None:
    browser.evaluate(f"document.querySelector({selector!r}).click()")
    browser.settle()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_section_is_drawn(page, scheme):
    page.use_scheme(scheme)
    sections = page.evaluate("[...document.querySelectorAll('section')].map((each) => each.id)")
    assert sections == ["findings", "candidate", "charts", "pictures", "limits", "trust", "physics",
                        "provenance"]
    for name in sections:
        go_to(page, f"#{name}")
        seen = look(page)
        assert (np.median(seen) > 127) == (scheme == "light")
        differing = np.abs(seen - np.median(seen, axis=(0, 1))).max(axis=2) > 60
        assert differing.mean() > 0.01, name
    charts = "[...document.querySelectorAll('#charts .plot')]"
    assert page.evaluate(f"{charts}.length > 3 && {charts}.every((each) => each._fullData)")


def test_every_chart_has_units_on_its_axes(page):
    go_to(page, "#charts")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")  # draws what is folded in, too
    page.settle()
    titles = page.evaluate(
        "[...document.querySelectorAll('.plot')].map((each) => ['xaxis', 'yaxis'].map((axis) => "
        "each._fullLayout[axis].title.text))"
    )
    assert len(titles) > 6
    for across, along in titles:
        assert "[" in across
        assert "[" in along or along in ("Fall margin", "Body region")  # which have none
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert not page.evaluate("document.querySelector('details.mat').open")


def test_a_verdict_selects_its_candidate(page, study):
    first, _, last = study.candidates
    assert page.evaluate(f"{CHOICE}.value") == last.id  # the best
    assert "✓ held" in page.evaluate(TOLD)
    click(page, f".matrix [data-candidate='{first.id}']")
    told = page.evaluate(TOLD)
    assert "✕ fell" in told and "It fell 1.5 s after the device started to move." in told
    assert "Fall margin−0.90" in told and "Peak pressure38.0 kPa" in told
    assert ("simcore simulate config/made_up.yaml --set body=male_172_70 --set support_angle_deg=0 "
            "--out run.nc") in told
    assert "Pressure in rat muscle" in told and "! −0.19" in told  # of 32 kPa
    pressed = page.evaluate(
        "[...document.querySelectorAll('[aria-pressed=true][data-candidate]')]"
        ".map((each) => each.dataset.candidate)"
    )
    assert set(pressed) == {first.id}


def test_the_selected_candidate_is_replayed_beside_the_other(page, study):
    first, lost, _ = study.candidates
    fell, held = (f"male_172_70, support angle {angle}°" for angle in (0, 7))
    assert page.evaluate(SHOWN) == [held, fell]  # the only other run that is kept
    click(page, f".matrix [data-candidate='{first.id}']")
    wait_for(page, f"{SHOWN}[0] === {fell!r}")
    assert page.evaluate(SHOWN) == [fell, held]
    click(page, f".matrix [data-candidate='{lost.id}']")
    assert page.evaluate(SHOWN) == [fell, held]
    note = "document.querySelector('.unplayed')"
    assert not page.evaluate(f"{note}.hidden")
    assert f"results/made_up/candidates/{lost.id}.nc" in page.evaluate(f"{note}.textContent")


def test_a_point_of_a_chart_selects_and_a_bar_tells_it(page, study):
    go_to(page, "#chart-peak-pressure-0")
    x, y = page.evaluate(
        "(() => { const plot = document.getElementById('chart-peak-pressure-0');"
        " const { x, y } = plot.getBoundingClientRect();"
        " const { _size, xaxis, yaxis } = plot._fullLayout;"
        " return [x + _size.l + xaxis.d2p(4), y + _size.t + yaxis.d2p(38)]; })()"
    )
    for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
        page.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, clickCount=1,
                  button="none" if kind == "mouseMoved" else "left")
        page.settle()
        if kind == "mouseMoved":
            wait_for(page, "document.querySelector('#chart-peak-pressure-0 .hovertext')")
            hover = page.evaluate(
                "document.querySelector('#chart-peak-pressure-0 .hoverlayer').textContent"
            )
            assert "4°: 38.0 kPa, ✕ fell" in hover and "male_172_70" in hover
    assert page.evaluate(f"{CHOICE}.value") == study.candidates[1].id
    bar = page.evaluate("document.querySelector('.chosen').textContent")
    assert "male_172_70, support angle 4°" in bar and "peak pressure 38.0 kPa" in bar
    ring = page.evaluate(
        "(() => { const { x, y } = document.getElementById('chart-peak-pressure-0').data.at(-1);"
        " return [[...x], [...y]]; })()"
    )
    assert ring == [[4], [38]]


def test_arrows_go_through_the_verdicts(page, study):
    page.evaluate("document.querySelector('.matrix [aria-pressed=true]').focus()")
    for key, expected in (("ArrowLeft", 1), ("ArrowLeft", 0), ("ArrowLeft", 0), ("ArrowRight", 1)):
        page.press(key)
        assert page.evaluate(f"{CHOICE}.value") == study.candidates[expected].id
    focused = "document.querySelectorAll('.matrix [tabindex=\"0\"]').length"
    assert page.evaluate(focused) == 1  # Tab comes to it once


def test_a_phone_shows_all_without_scrolling_sideways(page):
    page.resize(360, 740, mobile=True)
    for section in ("findings", "candidate", "charts", "pictures", "limits", "trust", "physics"):
        go_to(page, f"#{section}")
        assert page.evaluate("document.documentElement.scrollWidth") <= 360, section
    page.resize(1200, 900)


def test_a_sling_is_shown_too(browser, tmp_path):
    _, dataset = simulate_still(tmp_path, lambda place: 0.6, **SLING)
    browser.open(build_report(dataset, tmp_path / "report.html"))
    assert browser.evaluate(f"!!{PLAYER}.stages[0].sheet")
    assert "Greatest strap tension240 N" in browser.evaluate(TOLD)
    assert browser.complaints == []


@pytest.mark.parametrize(
    ("outcome", "options", "told"),
    [
        (lambda place: "blow_up", {"axes": ANGLES}, "It failed: made up to fail."),
        (lambda place: 0.5, {"bodies": BODIES[:1]}, "It held with a fall margin of 0.50"),
        (lambda place: -0.5, {"axes": "{support_angle_deg: [0, 7], recline_deg: [10, 20]}"},
         "It fell 1.5 s after"),
    ],
    ids=["all_failed", "one_candidate", "two_axes"],
)
def test_without_any_run_it_still_tells_and_does_not_complain(
    browser, tmp_path, outcome, options, told
):
    _, dataset = make_study(tmp_path, outcome, **options)
    browser.open(build_report(dataset, tmp_path / "report.html"))
    browser.evaluate("dispatchEvent(new Event('beforeprint'))")
    browser.settle()
    cells = "document.querySelectorAll('.matrix [data-candidate]')"
    browser.evaluate(f"[...{cells}].at(-1).click()")
    browser.settle()
    assert told in browser.evaluate(TOLD)
    seen = browser.evaluate("document.querySelector('#candidate').textContent")
    assert "No run is kept to be replayed." in seen
    assert browser.complaints == []
