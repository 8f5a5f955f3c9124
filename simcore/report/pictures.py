"""Runs → pictures: the last frame, the pressure on the skin front and back, the sensor mat."""

import base64
import io
from dataclasses import dataclass
from itertools import product

import numpy as np
import xarray as xr
from PIL import Image

from simcore.pressure_scale import pressure_colours, scale_end
from simcore.report.charts import Chart
from simcore.report.exemplars import Exemplar
from simcore.report.mat import mat_chart
from simcore.report.quantities import QUANTITIES
from simcore.report.render import (
    Camera,
    Mesh,
    frame_points,
    render,
    render_coloured,
    vertex_normals,
)
from simcore.report.runs import Run
from simcore.report.sling_pictures import sling_meshes
from simcore.report.verdicts import HELD, verdicts_of

SKIN_COLOUR, DEVICE_COLOUR = (0.80, 0.71, 0.64), (0.40, 0.52, 0.64)

FALL_SHOWN = 0.7
"""A fallen body is shown down to this distance below its device [m]; beyond, it leaves the
picture, which would otherwise have to be taken from too far away."""

VIEW_HEIGHT = 0.45
"""Height of the camera's direction over its horizontal part, 1."""

SIDE_VIEW = np.radians(62)
"""How far the camera of a sling lift stands from the feet towards the left side [rad]: more from
the side than from the front, for the sheet hides a body between its hems."""

PRESSURE_VIEWS = {"back": (-0.7, -0.3, -0.65), "front": (0.7, 0.3, 0.65)}
"""Direction from the body to the camera of a pressure map, device frame: from behind and below,
where it is carried, and from ahead and above."""

SHOWN_SHARE = 0.1
"""A side whose skin is nowhere pressed by more than this share of the scale is left out."""

SIZE = 360
"""Width and height of a picture [pixel]."""

WEBP_QUALITY = 86


@dataclass(frozen=True)
class Picture:
    """One image as a data address, its heading, what it tells, and what it shows in words."""

    source: str
    heading: str
    caption: str
    text: str


@dataclass(frozen=True)
class Gallery:
    """The pictures and maps of one exemplar; `missing` says why there are none."""

    exemplar: Exemplar
    pictures: tuple[Picture, ...]
    mat: Chart | None
    missing: str


def take_pictures(
    exemplars: list[Exemplar], runs: list[Run | str], scale: float
) -> list[Gallery]:
    """Return the pictures of each exemplar.

    Parameters
    ----------
    runs : list of Run or str
        Of each exemplar its run, or why there is none.
    scale : float
        End of the pressure scale [Pa].
    """
    shown = [run for run in runs if isinstance(run, Run)]
    cameras = {}  # one place to stand for each kind of device
    for kind in {_kind(run) for run in shown}:
        alike = [run for run in shown if _kind(run) == kind]
        cameras[kind] = _scene_camera(alike), _body_cameras(alike, scale)
    return [
        Gallery(each, (), None, run)
        if isinstance(run, str)
        else Gallery(
            each, _pictures(run, *cameras[_kind(run)], scale), mat_chart(run, scale, run.name), ""
        )
        for each, run in zip(exemplars, runs, strict=True)
    ]


def common_scale(ds: xr.Dataset, runs: list[Run]) -> float:
    """Return a round pressure that covers skin and mat of all that held [Pa].

    Where none held, it covers all. The blow of a fall may exceed it. 1 Pa without any pressure.
    """
    peak, held = ds["peak_pressure"], verdicts_of(ds) == HELD
    shown = [run for run in runs if not run.fell] if held.any() else runs
    pressures = [*peak.where(held if held.any() else True).values.ravel(),
                 *(max(run.pressure_peak.max(), run.mat_peak.max()) for run in shown)]
    return scale_end(float(np.nanmax([1.0, *pressures])))


def _kind(run: Run) -> str:
    return run.design.device.kind


def _scene_camera(runs: list[Run]) -> Camera:
    """Return the camera that sees every run's first and last frame."""
    points, turns = [], []
    for run in runs:
        for moment in ("start", "end"):
            skin, *others = (mesh.vertices for mesh in _meshes(run, moment))
            lowest = run.rigid(moment)[:, 2].min() - FALL_SHOWN
            points += [*others, skin[skin[:, 2] > lowest]]
        start, end = (run.moved(moment).rotation[:, 0] for moment in ("start", "end"))
        turns.append((np.arctan2(start[1], start[0]), np.arctan2(end[1], end[0])))
    start, end = np.mean(turns, axis=0)
    turned = np.angle(np.exp(1j * (end - start)))
    # Half-way between the two directions; more to the side where the device hardly turns.
    aside = SIDE_VIEW if runs[0].net else np.pi / 4
    azimuth = start + turned / 2 + max(aside - abs(turned) / 2, 0)
    return frame_points(
        np.concatenate(points), np.array([np.cos(azimuth), np.sin(azimuth), VIEW_HEIGHT]),
        SIZE, SIZE,
    )


def _body_cameras(runs: list[Run], scale: float) -> dict[str, Camera]:
    """Return a camera for each side on which any of the runs presses the skin."""
    bodies = [(run, _pressed_body(run)) for run in runs]
    points = np.concatenate([skin for _, skin in bodies])
    return {
        side: frame_points(points, np.array(view), SIZE, SIZE)
        for side, view in PRESSURE_VIEWS.items()
        if any(_is_pressed(run, skin, np.array(view), scale) for run, skin in bodies)
    }


def _is_pressed(run: Run, skin: np.ndarray, view: np.ndarray, scale: float) -> bool:
    """Return whether skin (n, 3) that is turned to a camera is pressed so that it shows."""
    facing = vertex_normals(skin, run.body.skin.faces) @ view > 0.5 * np.linalg.norm(view)
    return bool((run.pressure_peak[facing] > SHOWN_SHARE * scale).any())


def _pressed_body(run: Run) -> np.ndarray:
    """Return the skin (n, 3) of a pressure map in the frame of what moves, about its middle [m].

    On a rigid lift as it sat at the start; in a sling as it hung at the end of its support.
    """
    hung = "fall" if run.fell else "end"
    moment = hung if run.net else "start"
    skin = run.skin(moment) @ run.moved(moment).rotation
    return skin - (skin.min(axis=0) + skin.max(axis=0)) / 2


def _meshes(run: Run, moment: str) -> list[Mesh]:
    """Return what is seen at a moment, the body first."""
    if run.net:
        return sling_meshes(run, moment, SKIN_COLOUR)
    return [
        Mesh(run.skin(moment), run.body.skin.faces,
             np.tile(SKIN_COLOUR, (run.body.skin.vertex_count, 1))),
        Mesh(run.rigid(moment), run.surface.faces,
             np.tile(DEVICE_COLOUR, (len(run.surface.vertices), 1))),
    ]


def _pictures(
    run: Run, scene_camera: Camera, body_cameras: dict[str, Camera], scale: float
) -> tuple[Picture, ...]:
    seconds = run.at("end", "time").item()
    time = f"{abs(seconds):.1f} s {'after' if seconds >= 0 else 'before'} the start"
    word = "Shortly after the fall" if run.fell else "Last frame"
    seen = "body, sheet, straps, bar and bed" if run.net else "body and device"
    still = Picture(
        _data_address(render(_meshes(run, "end"), scene_camera)), word, time,
        f"{word}, {time}: {seen} from the front",
    )
    maps = {"Peak": run.pressure_peak, "At the end": run.pressure_at_end}
    colours = [pressure_colours(pressure, scale) for pressure in maps.values()]
    skin, faces = _pressed_body(run), run.body.skin.faces
    taken = {
        side: render_coloured(skin, faces, colours, camera)
        for side, camera in body_cameras.items()
    }
    without = "sheet" if run.net else "device"
    pictures = [still]
    for (number, (when, pressure)), side in product(enumerate(maps.items()), taken):
        highest = QUANTITIES["peak_pressure"].text(pressure.max())
        beyond = ", beyond the scale" if pressure.max() > 1.005 * scale else ""
        pictures.append(
            Picture(
                _data_address(taken[side][number]), f"{when}, {side}",
                f"up to {highest}{beyond}" if side == "back" else "",
                f"{when}: pressure on the skin, {side}, {without} left out",
            )
        )
    return tuple(pictures)


def _data_address(picture: np.ndarray) -> str:
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "WEBP", quality=WEBP_QUALITY, method=4)
    return "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode()
