"""Runs → pictures: first frame, last frame, the pressure on the skin, and the sensor mat."""

import base64
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from PIL import Image

from simcore.pressure_scale import pressure_colours, scale_end
from simcore.report.charts import Chart
from simcore.report.exemplars import Exemplar
from simcore.report.mat import mat_chart
from simcore.report.render import Camera, Mesh, frame_points, render
from simcore.report.runs import Run, read_run
from simcore.report.sling_pictures import sling_meshes

SKIN_COLOUR, DEVICE_COLOUR = (0.80, 0.71, 0.64), (0.40, 0.52, 0.64)

FALL_SHOWN = 0.7
"""A fallen body is shown down to this distance below its device [m]; beyond, it leaves the
picture, which would otherwise have to be taken from too far away."""

VIEW_HEIGHT = 0.45
"""Height of the camera's direction over its horizontal part, 1."""

SIDE_VIEW = np.radians(62)
"""How far the camera of a sling lift stands from the feet towards the left side [rad]: more from
the side than from the front, for the sheet hides a body between its hems."""

PRESSURE_VIEW = (-0.7, -0.3, -0.65)
"""Direction from the body to the camera of a pressure map, device frame: from behind, below."""

WIDTH, HEIGHT = 440, 440
"""Of a picture [pixel]."""

WEBP_QUALITY = 86


@dataclass(frozen=True)
class Picture:
    """One image as a data address, what it shows in words, and whether it shows pressures."""

    source: str
    caption: str
    text: str
    shows_pressure: bool


@dataclass(frozen=True)
class Gallery:
    """The pictures and maps of one exemplar; `missing` says why there are none."""

    exemplar: Exemplar
    pictures: tuple[Picture, ...]
    mat: Chart | None
    missing: str


def take_pictures(
    ds: xr.Dataset, exemplars: list[Exemplar], folder: Path, root: Path
) -> tuple[list[Gallery], float]:
    """Return the pictures of each exemplar and the end of their common pressure scale [Pa].

    Parameters
    ----------
    folder : Path
        Holds the candidates' files.
    root : Path
        Mesh files of devices are sought under it.
    """
    names = [ds["candidate"].sel(each.coordinates).item() for each in exemplars]
    runs: list[Run | str] = [
        read_run(folder / f"{name}.nc", each.coordinates["body"], root)
        for name, each in zip(names, exemplars, strict=True)
    ]
    shown = [run for run in runs if isinstance(run, Run)]
    scale = _common_scale(shown) if shown else 0.0
    cameras = {}  # one place to stand for each kind of device
    for kind in {_kind(run) for run in shown}:
        alike = [run for run in shown if _kind(run) == kind]
        cameras[kind] = _scene_camera(alike), _body_camera(alike)
    galleries = [
        Gallery(each, (), None, run)
        if isinstance(run, str)
        else Gallery(
            each, _pictures(run, *cameras[_kind(run)], scale), mat_chart(run, scale, name), ""
        )
        for name, each, run in zip(names, exemplars, runs, strict=True)
    ]
    return galleries, scale


def _kind(run: Run) -> str:
    return run.design.device.kind


def _common_scale(runs: list[Run]) -> float:
    """Return a round pressure that covers those that held; a fall's blow may exceed it [Pa]."""
    held = [run for run in runs if run.frames["fell"].item() < 0.5]
    return scale_end(
        max(float(max(run.pressure_peak.max(), run.mat_peak.max())) for run in held or runs)
    )


def _scene_camera(runs: list[Run]) -> Camera:
    """Return the camera that sees every run's first and last frame."""
    points, turns = [], []
    for run in runs:
        for frame in (0, run.last):
            skin, *others = (mesh.vertices for mesh in _meshes(run, frame))
            lowest = run.rigid(frame)[:, 2].min() - FALL_SHOWN
            points += [*others, skin[skin[:, 2] > lowest]]
        start, end = (run.moved(frame).rotation[:, 0] for frame in (0, run.last))
        turns.append((np.arctan2(start[1], start[0]), np.arctan2(end[1], end[0])))
    start, end = np.mean(turns, axis=0)
    turned = np.angle(np.exp(1j * (end - start)))
    # Half-way between the two directions; more to the side where the device hardly turns.
    aside = SIDE_VIEW if runs[0].net else np.pi / 4
    azimuth = start + turned / 2 + max(aside - abs(turned) / 2, 0)
    return frame_points(
        np.concatenate(points), np.array([np.cos(azimuth), np.sin(azimuth), VIEW_HEIGHT]),
        WIDTH, HEIGHT,
    )


def _body_camera(runs: list[Run]) -> Camera:
    return frame_points(
        np.concatenate([_pressed_body(run) for run in runs]), np.array(PRESSURE_VIEW), WIDTH, HEIGHT
    )


def _pressed_body(run: Run) -> np.ndarray:
    """Return the skin (n, 3) of a pressure map in the frame of what moves [m]: alike in all runs.

    On a rigid lift as it sat at the start; in a sling as it hung at the end of its support.
    """
    frame = run.supported[-1] if run.net else 0
    state = run.moved(frame)
    return (run.skin(frame) - state.position) @ state.rotation


def _meshes(run: Run, frame: int) -> list[Mesh]:
    """Return what is seen of a frame, the body first."""
    if run.net:
        return sling_meshes(run, frame, SKIN_COLOUR)
    return [
        Mesh(run.skin(frame), run.body.skin.faces,
             np.tile(SKIN_COLOUR, (run.body.skin.vertex_count, 1))),
        Mesh(run.rigid(frame), run.surface.faces,
             np.tile(DEVICE_COLOUR, (len(run.surface.vertices), 1))),
    ]


def _pictures(run: Run, scene_camera: Camera, body_camera: Camera, scale: float) -> tuple:
    time = run.frames["time"].values
    pictures = []
    fell = np.isfinite(run.frames["fall_time"].item())
    last_word = "Shortly after the fall" if fell else "Last frame"
    seen = "body, sheet, straps, bar and bed" if run.net else "body and device"
    for frame, word in ((0, "First frame"), (run.last, last_word)):
        when = f"{time[frame]:.2f} s".replace("-0.00", "0.00").replace("-", "−")
        pictures.append(
            Picture(
                _data_address(render(_meshes(run, frame), scene_camera)),
                f"{word}, {when}",
                f"{word}: {seen} from the front",
                False,
            )
        )
    peak = float(run.pressure_peak.max())
    colours = pressure_colours(run.pressure_peak, scale)
    skin = Mesh(_pressed_body(run), run.body.skin.faces, colours)
    above = f", above the scale by {1e-3 * (peak - scale):.0f} kPa" if peak > 1.005 * scale else ""
    posture = "as it hung last" if run.net else "as it sat at the start"
    return (
        *pictures,
        Picture(
            _data_address(render([skin], body_camera)),
            f"Peak pressure while supported: {1e-3 * peak:.1f} kPa{above}; the body {posture}",
            "Highest pressure on each part of the skin, from behind and below, "
            + ("sheet" if run.net else "device") + " left out",
            True,
        ),
    )


def _data_address(picture: np.ndarray) -> str:
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "WEBP", quality=WEBP_QUALITY, method=4)
    return "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode()
