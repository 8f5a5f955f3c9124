"""A study: which designs, and which of their dimensions are varied → candidates."""

import hashlib
import itertools
import json
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from simcore.config.designs import (
    BodyDesign,
    Design,
    Finite,
    MeshSurface,
    Method,
    Positive,
    Posture,
    RoboticLift,
    Strict,
)
from simcore.config.paths import resolve_path, set_value
from simcore.config.yaml_file import read_design, read_yaml, validate
from simcore.errors import DesignError

Scalar = bool | int | float | str


class Range(Strict):
    """Values from start to stop, both included, one step apart."""

    start: Finite
    stop: Finite
    step: Positive

    @model_validator(mode="after")
    def _rises(self):
        if self.stop < self.start:
            raise ValueError("stop must not be less than start")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """The values; rounded so that 0.1 · 3 is 0.3 in names and ids."""
        count = int(np.floor((self.stop - self.start) / self.step + 1e-9)) + 1
        return tuple(round(self.start + i * self.step, 12) for i in range(count))


class Linspace(Strict):
    """A number of evenly spaced values from start to stop, both included."""

    start: Finite
    stop: Finite
    count: Annotated[int, Field(ge=2)]

    @property
    def values(self) -> tuple[float, ...]:
        """The values; rounded as in `Range`."""
        return tuple(round(float(x), 12) for x in np.linspace(self.start, self.stop, self.count))


class StudyFile(Strict):
    """A study as written: config/NAME.yaml."""

    title: Annotated[str, Field(description="one line, heads the report")]
    device: Annotated[str, Field(description="name under designs/devices")]
    bodies: Annotated[
        tuple[str, ...], Field(min_length=1, description="names under designs/bodies")
    ]
    posture: Annotated[str, Field(description="name under designs/postures")]
    method: Annotated[str, Field(description="name under designs/methods")]
    set: Annotated[
        dict[str, Scalar],
        Field(
            default_factory=dict, description="values that replace those of the designs, by path"
        ),
    ]
    axes: Annotated[
        dict[str, Range | Linspace | tuple[Scalar, ...]],
        Field(
            default_factory=dict,
            description="values to vary, by path: a list, {start, stop, step} or {…, count}",
        ),
    ]
    candidates_per_job: Annotated[
        int | None,
        Field(ge=1, description="candidates that one process simulates; chosen when left out"),
    ] = None

    @model_validator(mode="after")
    def _values_differ(self):
        for name, values in [("bodies", self.bodies), *self.axis_values.items()]:
            if not values:
                raise ValueError(f"{name} is empty")
            if len(set(values)) < len(values):
                raise ValueError(f"{name} holds a value twice")
        return self

    @property
    def axis_values(self) -> dict[str, tuple[Scalar, ...]]:
        """The values of each axis, as written in `axes`."""
        return {
            key: axis if isinstance(axis, tuple) else axis.values
            for key, axis in self.axes.items()
        }


@dataclass(frozen=True)
class Candidate:
    """One design to simulate.

    Attributes
    ----------
    id : str
        Digest of the design's content; equal designs have equal ids in every study.
    coordinates : dict
        Its place in the study: axis name → value, `body` first.
    design : Design
    """

    id: str
    coordinates: dict[str, Scalar]
    design: Design


@dataclass(frozen=True)
class Study:
    """A resolved study.

    Attributes
    ----------
    name : str
        File name without ending; results go to results/NAME.
    root : Path
        Folder that holds designs/.
    axes : dict
        Axis name → values, `body` first; the dimensions of the dataset.
    axis_paths : dict
        Axis name → full path in the design.
    candidates : tuple of Candidate
        The full grid, last axis fastest.
    """

    name: str
    path: Path
    root: Path
    file: StudyFile
    axes: dict[str, tuple[Scalar, ...]]
    axis_paths: dict[str, str]
    candidates: tuple[Candidate, ...]

    @property
    def folder(self) -> Path:
        """Where the results of this study go."""
        return self.root / "results" / self.name


def load_study(path: Path, replace: dict[str, Scalar] | None = None) -> Study:
    """Read a study and every design that it names.

    Parameters
    ----------
    path : Path
        YAML file of the study.
    replace : dict, optional
        Values by path that take precedence over the file; a replaced axis is no longer an axis.
        `body` replaces the list of bodies.

    Raises
    ------
    DesignError
        Anything that could not be simulated as written.
    """
    path = Path(path)
    file = validate(StudyFile, read_yaml(path), path)
    root = _root_of(path)
    replace = dict(replace or {})
    if "body" in replace:
        file = file.model_copy(update={"bodies": (str(replace.pop("body")),)})

    device = _read_design(RoboticLift, root, "devices", file.device, path)
    posture = _read_design(Posture, root, "postures", file.posture, path)
    method = _read_design(Method, root, "methods", file.method, path)
    bodies = {
        name: _read_design(BodyDesign, root, "bodies", name, path) for name in file.bodies
    }
    trees = {
        name: Design(device=device, body=body, posture=posture, method=method).model_dump()
        for name, body in bodies.items()
    }
    a_tree = next(iter(trees.values()))

    for key, value in replace.items():
        full = resolve_path(a_tree, key, "--set")
        for tree in trees.values():
            set_value(tree, full, value)
        _validate_point(a_tree, f"--set {key}")
    replaced = {resolve_path(a_tree, key, "--set") for key in replace}
    for key, value in file.set.items():
        full = resolve_path(a_tree, key, f"{path}: set")
        if full not in replaced:
            for tree in trees.values():
                set_value(tree, full, value)
            _validate_point(a_tree, f"{path}: set.{key}")

    paths = {key: resolve_path(a_tree, key, f"{path}: axes") for key in file.axes}
    paths = {key: full for key, full in paths.items() if full not in replaced}
    if len(set(paths.values())) < len(paths):
        raise DesignError(f"{path}: axes: two axes vary the same key")
    names = _axis_names(paths)
    for key, full in paths.items():
        for value in file.axis_values[key]:
            tree = deepcopy(a_tree)
            set_value(tree, full, value)
            _validate_point(tree, f"{path}: axes.{key}")

    axes = {"body": file.bodies} | {names[key]: file.axis_values[key] for key in paths}
    axis_paths = {"body": "body"} | {names[key]: full for key, full in paths.items()}
    mesh_digests = {}
    candidates = []
    for values in itertools.product(*axes.values()):
        coordinates = dict(zip(axes, values, strict=True))
        tree = deepcopy(trees[coordinates["body"]])
        for name, value in coordinates.items():
            if name != "body":
                set_value(tree, axis_paths[name], value)
        design = validate(Design, tree, path, "axes (in this combination)")
        candidates.append(
            Candidate(_content_id(design, root, mesh_digests, path), coordinates, design)
        )
    return Study(path.stem, path, root, file, axes, axis_paths, tuple(candidates))


def _root_of(path: Path) -> Path:
    for folder in path.resolve().parents:
        if (folder / "designs").is_dir():
            return folder
    raise DesignError(f"{path}: no folder designs/ beside or above it")


def _read_design(model, root: Path, kind: str, name: str, study: Path):
    file = root / "designs" / kind / f"{name}.yaml"
    if not file.is_file():
        known = ", ".join(sorted(each.stem for each in file.parent.glob("*.yaml"))) or "none"
        key = {"devices": "device", "postures": "posture", "methods": "method"}.get(kind, kind)
        raise DesignError(f"{study}: {key}: no {file.relative_to(root)}; accepted: {known}")
    return read_design(model, file)


def _validate_point(tree: dict, source: str) -> None:
    validate(Design, tree, source)


def _axis_names(paths: dict[str, str]) -> dict[str, str]:
    """Name each axis by the last part of its path, or by the whole where that is not unique."""
    last = {key: full.rsplit(".", 1)[-1] for key, full in paths.items()}
    shared = {name for name in last.values() if list(last.values()).count(name) > 1}
    return {key: paths[key] if name in shared else name for key, name in last.items()}


def _content_id(design: Design, root: Path, mesh_digests: dict, study: Path) -> str:
    """Digest of everything that decides the outcome, the bytes of a mesh file included."""
    content = json.dumps(design.model_dump(mode="json"), sort_keys=True)
    surface = design.device.surface
    if isinstance(surface, MeshSurface):
        if surface.file not in mesh_digests:
            mesh = root / surface.file
            if not mesh.is_file():
                raise DesignError(f"{study}: device.surface.file: no such mesh: {surface.file}")
            mesh_digests[surface.file] = hashlib.sha256(mesh.read_bytes()).hexdigest()
        content += mesh_digests[surface.file]
    return hashlib.sha256(content.encode()).hexdigest()[:12]
