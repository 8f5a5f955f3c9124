"""Pictures for print: every value in its place, with words and units, as SVG and as PNG."""

import io
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from report_studies import ANGLES, BODIES, make_dataset, make_study

from simcore.dataset import open_dataset
from simcore.drawing import Drawing
from simcore.errors import DesignError
from simcore.report.plot import plot_metric, write_plot
from simcore.report.shades import MARGIN, SEQUENTIAL, Shades

SVG = "{http://www.w3.org/2000/svg}"


def by_angle(place):
    if place["body"] == BODIES[1] and place["support_angle_deg"] == 0:
        return "blow_up"
    return -0.5 if place["support_angle_deg"] < 5 else 0.7


@pytest.fixture(scope="module")
def ds(tmp_path_factory):
    return make_dataset(tmp_path_factory.mktemp("study"), by_angle, axes=ANGLES)


def svg(ds, metric, *along, **fixed):
    return ElementTree.fromstring(plot_metric(ds, metric, along, fixed, ".svg"))


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
    picture = Image.open(io.BytesIO(plot_metric(ds, "contact_area", (), {}, ".png")))
    assert picture.info["dpi"] == pytest.approx((300, 300), abs=0.1)
    pixels = np.asarray(picture.convert("RGB")).astype(int)
    assert pixels.shape == (1312, 2000, 3)
    for colour in ("#0072B2", "#D55E00"):
        wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        assert (np.abs(pixels - wanted).max(axis=2) < 30).sum() > 200
    written = pixels[:, :130].min(axis=2) < 100  # the turned title and the ticks
    assert 0.005 < written.mean() < 0.2


GRID = "{support_angle_deg: [0, 4, 7], width_m: [0.5, 0.55]}"


def test_over_two_axes_each_body_has_a_map_whose_colours_are_its_values(tmp_path):
    """Pressures are 20 kPa · (1 − margin): 30 kPa where the body fell, else 6, 4 or 2 kPa."""
    margins = {(4, 0.5): 0.7, (4, 0.55): 0.8, (7, 0.5): 0.8, (7, 0.55): 0.9}

    def outcome(place):
        return margins.get((place["support_angle_deg"], place["width_m"]), -0.5)

    ds = make_dataset(tmp_path, outcome, axes=GRID)
    root = svg(ds, "fall_margin")
    told = texts(root)
    assert {"Support angle [°]", "Width [mm]", "Fall margin", *BODIES, "held", "fell"} <= {*told}
    assert all(told.count(value) == 2 * times  # one map a body
               for value, times in {"0.70": 1, "0.80": 2, "0.90": 1, "−0.50": 2}.items())
    cells = [each for each in root.iter(f"{SVG}rect") if float(each.get("height")) == 41]
    assert len(cells) == 2 * 6
    assert [each.get("fill") for each in cells].count(Shades(MARGIN, -1, 1).colour(-0.5)) == 4
    right = max(float(each.get("x")) + float(each.get("width")) for each in cells)
    assert right < min(float(each.get("x")) for each in root.iter(f"{SVG}rect")
                       if each.get("width") == "14.00")  # the colour bar is apart
    assert svg(ds, "fall_margin", "support_angle_deg").find(f"{SVG}polyline") is not None
    assert "0.80" not in texts(svg(ds, "fall_margin", width_m=0.55))  # one axis left: lines
    across = texts(svg(ds, "fall_margin", "body", "support_angle_deg"))
    assert {*BODIES, "4", "0.90"} <= {*across}


@given(st.floats(-50, 150))
def test_ink_can_be_read_on_every_colour(value):
    """Contrast of at least 4.5 : 1, as WCAG 2.1 asks of small letters."""
    def luminance(colour):
        share = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        return linear @ [0.2126, 0.7152, 0.0722]

    for stops in (SEQUENTIAL, MARGIN):
        shades = Shades(stops, 0.0, 100.0)
        low, high = sorted(map(luminance, (shades.colour(value), shades.ink(value))))
        assert (high + 0.05) / (low + 0.05) > 4.5


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
    ("metric", "along", "fixed", "suffix", "told"),
    [
        ("peak_presure", (), {}, ".svg", "accepted: fell, fall_time, fall_margin"),
        ("region_peak_pressure", (), {}, ".svg", "no metric with a figure a candidate"),
        ("peak_strap_force", (), {}, ".svg", "no candidate there has it"),
        ("fall_margin", ("angle",), {}, ".svg", "--axis angle: no axis; accepted: body"),
        ("fall_margin", ("body", "body"), {}, ".svg", "accepted: one axis, or two others"),
        ("fall_margin", (), {"angle": 1}, ".svg", "--set angle: cannot be fixed; accepted: body"),
        ("fall_margin", (), {"support_angle_deg": 1}, ".svg", "accepted: 0, 4, 7"),
        ("fall_margin", (), {}, ".pdf", "--out: .pdf; accepted: .svg, .png"),
    ],
)
def test_a_mistake_says_what_is_accepted(ds, metric, along, fixed, suffix, told):
    with pytest.raises(DesignError, match=re.escape(told)):
        plot_metric(ds, metric, along, fixed, suffix)


def test_it_is_written_from_the_folder_of_a_study(tmp_path):
    study, path = make_study(tmp_path, lambda place: 0.5, axes=ANGLES)
    write_plot(study.folder, "fall_margin", (), {}, tmp_path / "new" / "a.SVG")
    expected = plot_metric(open_dataset(path), "fall_margin", (), {}, ".svg")
    assert (tmp_path / "new" / "a.SVG").read_bytes() == expected
