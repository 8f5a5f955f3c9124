"""A run's file → the run with its body and its device, ready to be shown or exported."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from simcore.body.build import Body, build_body
from simcore.config import Design
from simcore.config.sling_lift import EdgeAttachment
from simcore.dataset import design_of, open_dataset, refuse_without_frames
from simcore.device.build import build_surface
from simcore.device.surface import Surface
from simcore.errors import DesignError
from simcore.sheet.hanging import Straps, build_straps
from simcore.sheet.net import Net, build_net


@dataclass(frozen=True, eq=False)
class Recording:
    """What a run's file holds; T frames, n skin vertices.

    Attributes
    ----------
    name : str
        Of the file, without its ending.
    place : dict
        Axis → value: the run's place in its study.
    design : Design
    body : Body
    surface : Surface
        What is rigid: the lift's support, or the bed of a sling lift.
    net, straps : Net, Straps or None
        The sheet and what it hangs by, if there is one.
    frames : xarray.Dataset
        Figures, summary and frames (docs/dataset.md).
    """

    name: str
    place: dict
    design: Design
    body: Body
    surface: Surface
    net: Net | None
    straps: Straps | None
    frames: object

    def column(self, name: str) -> np.ndarray:
        """Return a recorded column as float64, time along its first axis."""
        return self.frames[name].values.astype(float)

    @property
    def time(self) -> np.ndarray:
        """Time of each frame (T,) [s]; 0 when the device starts to move."""
        return self.column("time")

    @property
    def joint_quaternions(self) -> np.ndarray:
        """Each joint's rotation (T, 18, 4), x y z w, parent to child, of one sign along time."""
        return joint_quaternions(self.body, self.column("q"))

    @property
    def has_frames(self) -> bool:
        """Whether the file holds frames, and not their summary alone."""
        return "time" in self.frames.dims

    @property
    def pressure_peak(self) -> np.ndarray:
        """Highest pressure on each skin vertex (n,) [Pa] while supported."""
        return self.on_skin("skin_pressure_peak")

    def on_skin(self, name: str) -> np.ndarray:
        """Return a variable of the touched vertices on all of the skin (n,)."""
        values = np.zeros(self.body.skin.vertex_count)
        values[self.frames["skin_vertex"].values] = self.frames[name].values
        return values

    @property
    def strap_ends(self) -> np.ndarray:
        """Both ends (T, s, 2, 3) of the straps from loops [m]: at the sheet, at the bar.

        An edge is tied to its pole by a strap at each of its vertices: none of those.
        """
        if self.straps is None:
            return np.empty((len(self.time), 0, 2, 3))
        attachments = self.design.device.hanging.attachments
        loops = {each.name for each in attachments if not isinstance(each, EdgeAttachment)}
        shapes = self.column("sheet_position")
        sheet = np.stack([self.straps.patch_centres(shape) for shape in shapes])
        turn = rotation_matrices(self.column("device_quaternion"))
        bar = np.einsum("tij,sj->tsi", turn, self.straps.bar_point)
        ends = np.stack([sheet, bar + self.column("device_position")[:, None]], axis=2)
        return ends[:, [name in loops for name in self.straps.names]]

    @property
    def bar_tubes(self) -> np.ndarray:
        """Both ends (k, 2, 3) of the tubes of a spreader bar, bar frame [m].

        Poles as they are, and arms from the middle of all hooks to each of them; what joins
        poles alone is not known, and would be drawn through the body.
        """
        if self.net is None:
            return np.empty((0, 2, 3))
        poles, hooks = [], []
        for each in self.design.device.hanging.attachments:
            if isinstance(each, EdgeAttachment):
                poles.append([each.bar_start_m, each.bar_end_m])
            else:
                hooks.append(each.bar_point_m)
        arms = []
        if hooks:
            hooks = np.unique(np.round(hooks, 6), axis=0)  # two straps may share a hook
            arms = [[hooks.mean(axis=0), hook] for hook in hooks] if len(hooks) > 1 else []
        return np.array([*poles, *arms], dtype=float).reshape(-1, 2, 3)


def open_recording(
    path: Path, root: Path | None = None, need_frames: bool = True
) -> Recording:
    """Open a run that `simcore simulate --out` or a sweep wrote.

    Parameters
    ----------
    path : Path
    root : Path, optional
        Mesh files of devices are sought under it; by default under the nearest folder above the
        file that holds `designs`, else under the working folder.
    need_frames : bool
        Refuse a file that holds the summary of a run alone.

    Raises
    ------
    DesignError
        No run of this version, or one without frames.
    """
    path = Path(path)
    frames = open_dataset(path)
    if "design" not in frames.attrs:
        raise DesignError(
            f"{path}: is the table of a study; accepted: one run, as candidates/ID.nc beside it"
        )
    if need_frames or "moment" not in frames.dims:
        refuse_without_frames(frames, path)
    try:
        design = design_of(frames)
    except ValidationError:
        raise DesignError(f"{path}: has a design that this version does not know") from None
    place = json.loads(frames.attrs["place_in_study"])
    body = build_body(design.body, str(place.get("body", path.stem)))
    surface = build_surface(design.device.rigid_part, root or _root_above(path))
    net = straps = None
    if design.device.kind == "sling_lift":
        net = build_net(design.device.sheet)
        straps = build_straps(net, design.device.hanging)
    vertices = 0 if net is None else len(net.rest_position)
    touched = frames["skin_vertex"].values.max(initial=0)
    if touched >= body.skin.vertex_count or frames.sizes.get("sheet_vertex", 0) != vertices:
        raise DesignError(f"{path}: was simulated with another body or sheet; run it again")
    return Recording(path.stem, place, design, body, surface, net, straps, frames)


def joint_quaternions(body: Body, q: np.ndarray) -> np.ndarray:
    """Return each joint's rotation (T, 18, 4), x y z w, parent to child, for q (T, 60).

    Of q and −q, which are the same rotation, the one nearer to the frame before.
    """
    turns = np.zeros((len(q), len(body.segment_names), 4))
    for segment in range(len(body.segment_names)):
        joint = body.model.joints[segment + 1]
        start, count = joint.idx_q, joint.nq
        if count == 1:
            axis = _revolute_axis(joint.shortname())
            turns[:, segment, :3] = np.sin(q[:, start, None] / 2) * axis
            turns[:, segment, 3] = np.cos(q[:, start] / 2)
        else:  # the root's begins with its translation
            turns[:, segment] = q[:, start + count - 4 : start + count]
    return one_sign(turns)


def one_sign(quaternions: np.ndarray) -> np.ndarray:
    """Return unit quaternions (T, …, 4) that never jump to the other sign along time."""
    unit = quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)
    turned = np.sign(np.einsum("t...i,t...i->t...", unit[1:], unit[:-1]))
    turned[turned == 0] = 1
    unit[1:] *= np.cumprod(turned, axis=0)[..., None]
    return unit


def rotation_matrices(quaternions: np.ndarray) -> np.ndarray:
    """Return the matrices (T, 3, 3) of quaternions (T, 4), x y z w."""
    return Rotation.from_quat(quaternions).as_matrix()


def _revolute_axis(kind: str) -> np.ndarray:
    """Return the axis of a one-angle joint: +y bends, −y extends (`simcore.body.skeleton`)."""
    return np.array([0.0, 1.0 if kind == "JointModelRY" else -1.0, 0.0])


def _root_above(path: Path) -> Path:
    above = (folder for folder in path.resolve().parents if (folder / "designs").is_dir())
    return next(above, Path.cwd())
