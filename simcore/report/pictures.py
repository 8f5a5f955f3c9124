"""Candidates' files → pictures: first frame, last frame, and the pressure on the skin."""

import base64
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from PIL import Image
from plotly.colors import hex_to_rgb, sequential
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from simcore.body.build import Body, build_body
from simcore.dataset import design_of, open_dataset
from simcore.device.rigid import build_surface
from simcore.device.surface import Surface
from simcore.errors import DesignError
from simcore.report.exemplars import Exemplar
from simcore.report.render import Camera, Mesh, frame_points, render
from simcore.scene import posed_skin

SKIN_COLOUR, DEVICE_COLOUR = (0.80, 0.71, 0.64), (0.40, 0.52, 0.64)

UNLOADED_COLOUR = (0.78, 0.78, 0.78)
"""Skin of a pressure map where nothing presses: no hue that could be read as a pressure."""

PRESSURE_SHARE_MIN = 0.03
"""Pressures fade in up to this share of the scale, so that their edge is not jagged."""

SCALE_STEPS = np.array([1, 1.5, 2, 3, 4, 5, 6, 8, 10])
"""Leading digits that the end of a pressure scale may have."""

AFTER_FALL = 0.2
"""A body that fell is shown this long after it had fallen [s]: at the end it is often far away."""

FALL_SHOWN = 0.7
"""A fallen body is shown down to this distance below its device [m]; beyond, it leaves the
picture, which would otherwise have to be taken from too far away."""

VIEW_HEIGHT = 0.45
"""Height of the camera's direction over its horizontal part, 1."""

PRESSURE_VIEW = (-0.7, -0.3, -0.65)
"""Direction from the body to the camera of a pressure map, device frame: from behind, below."""

WIDTH, HEIGHT = 440, 440
"""Of a picture [pixel]."""

WEBP_QUALITY = 86


@dataclass(frozen=True, eq=False)
class Run:
    """What a candidate's file holds, made ready for pictures; n skin vertices.

    Attributes
    ----------
    body : Body
    surface : Surface
    frames : xr.Dataset
        Trajectory.
    pressure_peak : (n,) float64
        Highest pressure on each vertex while the body was supported [Pa].
    """

    body: Body
    surface: Surface
    frames: xr.Dataset
    pressure_peak: np.ndarray

    @property
    def last(self) -> int:
        """Index of the last frame to show."""
        time, fall = self.frames["time"].values, self.frames["fall_time"].item()
        if np.isnan(fall):
            return len(time) - 1
        return int(np.searchsorted(time, fall + AFTER_FALL, side="right")) - 1

    def skin(self, frame: int) -> np.ndarray:
        """Return the posed skin vertices (n, 3) of a frame [m]."""
        return posed_skin(self.body, self.frames["q"].values[frame])

    def device(self, frame: int) -> np.ndarray:
        """Return the device's vertices of a frame, world frame [m]."""
        return self.surface.vertices @ self.rotation(frame).T + self.position(frame)

    def rotation(self, frame: int) -> np.ndarray:
        """Return the rotation (3, 3) of the device frame to the world."""
        return Rotation.from_quat(self.frames["device_quaternion"].values[frame]).as_matrix()

    def position(self, frame: int) -> np.ndarray:
        """Return the origin (3,) of the device frame in the world [m]."""
        return self.frames["device_position"].values[frame]


@dataclass(frozen=True)
class Picture:
    """One image as a data address, what it shows in words, and whether it shows pressures."""

    source: str
    caption: str
    text: str
    shows_pressure: bool


@dataclass(frozen=True)
class Gallery:
    """The pictures of one exemplar; `missing` says why there are none."""

    exemplar: Exemplar
    pictures: tuple[Picture, ...]
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
    runs: list[Run | str] = [
        _read_run(folder / f"{ds['candidate'].sel(each.coordinates).item()}.nc",
                  each.coordinates["body"], root)
        for each in exemplars
    ]
    shown = [run for run in runs if isinstance(run, Run)]
    if not shown:
        return [Gallery(each, (), run) for each, run in zip(exemplars, runs, strict=True)], 0.0
    scale = _scale_end(shown)
    scene_camera, body_camera = _scene_camera(shown), _body_camera(shown)
    galleries = [
        Gallery(each, (), run)
        if isinstance(run, str)
        else Gallery(each, _pictures(run, scene_camera, body_camera, scale), "")
        for each, run in zip(exemplars, runs, strict=True)
    ]
    return galleries, scale


def pressure_colours(pressure: np.ndarray, scale: float) -> np.ndarray:
    """Return sRGB colours (n, 3) of pressures (n,) [Pa] on a scale from 0 to `scale` [Pa]."""
    table = np.array([hex_to_rgb(colour) for colour in sequential.Viridis]) / 255
    share = np.clip(pressure / scale, 0, 1)
    steps = np.linspace(0, 1, len(table))
    mapped = np.column_stack([np.interp(share, steps, table[:, i]) for i in range(3)])
    loaded = np.clip(share / PRESSURE_SHARE_MIN, 0, 1)[:, None]
    return loaded * mapped + (1 - loaded) * np.array(UNLOADED_COLOUR)


def _read_run(path: Path, body_name: str, root: Path) -> Run | str:
    """Return a candidate's run, or in words why there is none to show."""
    name = f"candidates/{path.name}"
    if not path.is_file():
        return f"No picture: {name} is missing; run the sweep again."
    try:
        frames = open_dataset(path)
    except DesignError:  # its message names the whole path, which is none of the reader's business
        return f"No picture: {name} cannot be read by this version; run the sweep again."
    if "q" not in frames:
        return f"No picture: {name} holds no trajectory."
    try:
        design = design_of(frames)
        body = build_body(design.body, body_name)
        surface = build_surface(design.device.surface, root)
    except ValidationError:
        return f"No picture: {name} has a design that this version does not know."
    except DesignError as error:
        return f"No picture: {error}."
    peak = np.zeros(body.skin.vertex_count)
    supported = frames["skin_pressure"].values[_supported(frames)]
    peak[frames["skin_vertex"].values] = supported.max(axis=0, initial=0.0)
    return Run(body, surface, frames, peak)


def _supported(frames: xr.Dataset) -> np.ndarray:
    """Return the indices of the frames over which simcore.metrics takes the peak pressure."""
    time, fall = frames["time"].values, frames["fall_time"].item()
    end = fall if np.isfinite(fall) else time[-1]
    supported = time <= end
    if end >= 0:  # a fall before the device moved leaves only the settling
        supported &= time >= 0
    return np.flatnonzero(supported)


def _scale_end(runs: list[Run]) -> float:
    """Return a round pressure that covers those that held; a fall's blow may exceed it [Pa]."""
    held = [run for run in runs if run.frames["fell"].item() < 0.5]
    peak = max(run.pressure_peak.max() for run in held or runs)
    power = 10.0 ** np.floor(np.log10(max(peak, 1.0)))
    return float(power * SCALE_STEPS[np.searchsorted(SCALE_STEPS, peak / power)])


def _scene_camera(runs: list[Run]) -> Camera:
    """Return the camera that sees every run's first and last frame, from the patient's front."""
    points, turns = [], []
    for run in runs:
        for frame in (0, run.last):
            device = run.device(frame)
            skin = run.skin(frame)
            points += [device, skin[skin[:, 2] > device[:, 2].min() - FALL_SHOWN]]
        start, end = (run.rotation(frame)[:, 0] for frame in (0, run.last))
        turns.append((np.arctan2(start[1], start[0]), np.arctan2(end[1], end[0])))
    start, end = np.mean(turns, axis=0)
    turned = np.angle(np.exp(1j * (end - start)))
    # Half-way between the two directions; more to the side where the device hardly turns.
    azimuth = start + turned / 2 + max(np.pi / 4 - abs(turned) / 2, 0)
    return frame_points(
        np.concatenate(points), np.array([np.cos(azimuth), np.sin(azimuth), VIEW_HEIGHT]),
        WIDTH, HEIGHT,
    )


def _body_camera(runs: list[Run]) -> Camera:
    return frame_points(
        np.concatenate([_start_on_device(run) for run in runs]),
        np.array(PRESSURE_VIEW),
        WIDTH, HEIGHT,
    )


def _start_on_device(run: Run) -> np.ndarray:
    """Return the skin vertices (n, 3) at the start in the device frame [m]: alike in all runs."""
    return (run.skin(0) - run.position(0)) @ run.rotation(0)


def _pictures(run: Run, scene_camera: Camera, body_camera: Camera, scale: float) -> tuple:
    time = run.frames["time"].values
    pictures = []
    fell = np.isfinite(run.frames["fall_time"].item())
    last_word = "Shortly after the fall" if fell else "Last frame"
    for frame, word in ((0, "First frame"), (run.last, last_word)):
        meshes = [
            Mesh(run.skin(frame), run.body.skin.faces, _even(SKIN_COLOUR, run.body.skin)),
            Mesh(run.device(frame), run.surface.faces,
                 np.tile(DEVICE_COLOUR, (len(run.surface.vertices), 1))),
        ]
        when = f"{time[frame]:.2f} s".replace("-0.00", "0.00").replace("-", "−")
        pictures.append(
            Picture(
                _data_address(render(meshes, scene_camera)),
                f"{word}, {when}",
                f"{word}: body and device seen from the front",
                False,
            )
        )
    peak = float(run.pressure_peak.max())
    colours = pressure_colours(run.pressure_peak, scale)
    skin = Mesh(_start_on_device(run), run.body.skin.faces, colours)
    above = f", above the scale by {1e-3 * (peak - scale):.0f} kPa" if peak > 1.005 * scale else ""
    return (
        *pictures,
        Picture(
            _data_address(render([skin], body_camera)),
            f"Peak pressure while supported: {1e-3 * peak:.1f} kPa{above}",
            "Highest pressure on each part of the skin, from behind and below, device left out",
            True,
        ),
    )


def _even(colour: tuple, skin) -> np.ndarray:
    return np.tile(colour, (skin.vertex_count, 1))


def _data_address(picture: np.ndarray) -> str:
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "WEBP", quality=WEBP_QUALITY, method=4)
    return "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode()
