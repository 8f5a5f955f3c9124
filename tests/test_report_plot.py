"""Pictures for print: every value in its place, with words and units, as SVG and as PNG."""

import io
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from PIL import Image
from report_studies import ANGLES, BODIES, make_dataset, make_study

from simcore.dataset import open_dataset
from simcore.errors import DesignError
from simcore.report.drawing import Drawing
from simcore.report.plot import plot_metric, write_plot

SVG = "{http://www.w3.org/2000/svg}"


def by_angle(place):
    if place["body"] == BODIES[1] and place["support_angle_deg"] == 0:
        return "blow_up"
    return -0.5 if place["support_angle_deg"] < 5 else 0.7


@pytest.fixture(scope="module")
def ds(tmp_path_factory):
    return make_dataset(tmp_path_factory.mktemp("study"), by_angle, axes=ANGLES)


def svg(ds, metric, axis=None, **fixed):
    return ElementTree.fromstring(plot_metric(ds, metric, axis, fixed, ".svg"))


def texts(root):
    return [each.text for each in root.iter(f"{SVG}text")]


def test_values_lie_where_the_ticks_say(ds):
    """Pressures are 20 kPa · (1 − margin) or 10 kPa: 30, 30 and 10 of him, 30 and 10 of her."""
    root = svg(ds, "peak_pressure")
    words = {each.text: float(each.get("y")) for each in root.iter(f"{SVG}text")
             if each.get("text-anchor") == "end"}
    zero, thirty = words["0"] - 4.5, words["30"] - 4.5  # but for the letters' height
    held = [float(each.get("cy")) for each in root.iter(f"{SVG}circle")]
    fell = [float(re.search(r" ([\d.]+)\)", each.get("transform"))[1])
            for each in root.iter(f"{SVG}path")]
    at = [(y - zero) / (thirty - zero) * 30 for y in sorted(held)]
    assert at[1:] == pytest.approx([10, 10], abs=0.1)  # the first is the legend's
    assert [(y - zero) / (thirty - zero) * 30 for y in sorted(fell)][1:] == pytest.approx(
        [30, 30, 30], abs=0.1
    )


def test_axes_have_titles_units_and_ticks(ds):
    told = texts(svg(ds, "peak_pressure"))
    assert {"Support angle [°]", "Peak pressure [kPa]", *BODIES, "held", "fell"} <= {*told}
    assert {"0", "4", "7"} <= {*told}
    assert "Contact area [cm²]" in texts(svg(ds, "contact_area"))
    assert "fell" not in texts(svg(ds, "contact_area"))  # what fell has none


def test_an_axis_can_be_fixed_and_bodies_be_the_axis(ds):
    told = texts(svg(ds, "fall_margin", "body", support_angle_deg=7.0))
    assert "Fall margin, support angle 7°" in told and {*BODIES} <= {*told}
    only = texts(svg(ds, "fall_margin", body=BODIES[0]))
    assert f"Fall margin, {BODIES[0]}" in only and BODIES[1] not in only


def test_names_never_collide_however_many_bodies(tmp_path):
    ds = make_dataset(tmp_path, lambda place: 0.5, axes=ANGLES)
    many = ds.isel(body=[0, 1] * 4).assign_coords(body=[f"somebody_{i:09}" for i in range(8)])
    root = svg(many, "fall_margin")
    places = [(float(each.get("x")), float(each.get("y"))) for each in root.iter(f"{SVG}text")
              if each.text.startswith("somebody")]
    assert len(places) == 8 and max(x for x, _ in places) < 560
    for y in {y for _, y in places}:
        across = sorted(x for x, row in places if row == y)
        assert np.diff(across).min(initial=999) > 7 * len("somebody_000000000")


def test_a_png_shows_the_same(ds):
    picture = Image.open(io.BytesIO(plot_metric(ds, "contact_area", None, {}, ".png")))
    assert picture.info["dpi"] == pytest.approx((300, 300), abs=0.1)
    pixels = np.asarray(picture.convert("RGB")).astype(int)
    assert pixels.shape == (1312, 2000, 3)
    for colour in ("#0072B2", "#D55E00"):
        wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        assert (np.abs(pixels - wanted).max(axis=2) < 30).sum() > 200
    written = pixels[:, :130].min(axis=2) < 100  # the turned title and the ticks
    assert 0.005 < written.mean() < 0.2


def test_dashes_leave_gaps_and_raised_signs_are_drawn():
    drawing = Drawing(100, 40)
    drawing.line([(0, 10), (100, 10)], "#000000", 2, "dash")
    drawing.text(50, 35, "10⁶ m²", anchor="middle")
    pixels = np.asarray(Image.open(io.BytesIO(drawing.to_png())).convert("L"))
    row = pixels[round(10 * 300 / 96)] < 128
    assert 0.4 < row.mean() < 0.8 and np.diff(row.astype(int)).astype(bool).sum() > 10
    columns = np.flatnonzero((pixels[60:] < 128).any(axis=0))
    assert abs(columns.mean() - pixels.shape[1] / 2) < 10  # written about its middle


@pytest.mark.parametrize(
    ("metric", "axis", "fixed", "suffix", "told"),
    [
        ("peak_presure", None, {}, ".svg", "accepted: fell, fall_time, fall_margin"),
        ("region_peak_pressure", None, {}, ".svg", "no metric with a figure a candidate"),
        ("peak_strap_force", None, {}, ".svg", "no candidate there has it"),
        ("fall_margin", "angle", {}, ".svg", "--axis angle: no axis; accepted: body, support_ang"),
        ("fall_margin", None, {"angle": 1}, ".svg", "--set angle: cannot be fixed; accepted: body"),
        ("fall_margin", None, {"support_angle_deg": 1}, ".svg", "accepted: 0, 4, 7"),
        ("fall_margin", None, {}, ".pdf", "--out: .pdf; accepted: .svg, .png"),
    ],
)
def test_a_mistake_says_what_is_accepted(ds, metric, axis, fixed, suffix, told):
    with pytest.raises(DesignError, match=re.escape(told)):
        plot_metric(ds, metric, axis, fixed, suffix)


def test_it_is_written_from_the_folder_of_a_study(tmp_path):
    study, path = make_study(tmp_path, lambda place: 0.5, axes=ANGLES)
    write_plot(study.folder, "fall_margin", None, {}, tmp_path / "new" / "a.SVG")
    expected = plot_metric(open_dataset(path), "fall_margin", None, {}, ".svg")
    assert (tmp_path / "new" / "a.SVG").read_bytes() == expected
