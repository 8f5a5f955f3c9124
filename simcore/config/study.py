"""A study: which designs, and which of their dimensions are varied → candidates."""

import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    Tag,
    WithJsonSchema,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from simcore.config.candidate import Candidate, Scalar, content_id
from simcore.config.designs import BodyDesign, Design, Method, Posture, read_device
from simcore.config.paths import resolve_path, set_value
from simcore.config.refined import chosen_places, variants_of
from simcore.config.values import Finite, Positive, Strict, Whole
from simcore.config.yaml_file import read_design, read_yaml, shown, validate
from simcore.errors import DesignError

# ASSUME: 5 min. Transfers from bed to chair were seen to take 157 s with a ceiling lift and 274 s
# with a floor lift (mean of observations, attaching included: Evaluation of ceiling lifts, Injury
# 2009; 40, 987, abstract, read). The time the device is loaded is less than that.
EXPOSURE = 300.0
"""How long a patient is carried, unless the study says otherwise [s]."""

FRAMES_KEPT_MAX = 40
"""Candidates of a study whose frames are all kept: as many as its report replays."""

CANDIDATES_MAX = 100_000
"""Most candidates of one study; a slip of a step would otherwise fill the memory."""


def _scalar(value: object) -> Scalar:
    if not isinstance(value, Scalar):
        raise PydanticCustomError("scalar_type", "not a scalar")
    return value


def _kind_of_axis(axis: object) -> str | None:
    match axis:
        case list() | tuple():
            return "array"
        case {"count": _} | Linspace():
            return "Linspace"
        case dict() | Range():
            return "Range"
    return None


# Any: pydantic's union of the four would turn one mistake into four messages.
AnyScalar = Annotated[
    Any, AfterValidator(_scalar), WithJsonSchema({"type": ["number", "string", "boolean"]})
]


class Range(Strict):
    """Values from start to stop, both included where a whole number of steps leads there."""

    start: Annotated[Finite, Field(description="first value")]
    stop: Annotated[Finite, Field(description="no value is greater")]
    step: Annotated[Positive, Field(description="from each value to the next")]

    @model_validator(mode="after")
    def _rises(self):
        if self.stop < self.start:
            raise ValueError(f"stop is {self.stop:g}; accepted: at least start, {self.start:g}")
        if (self.stop - self.start) / self.step >= CANDIDATES_MAX:
            raise ValueError(f"step makes too many values; accepted: up to {CANDIDATES_MAX}")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """The values; rounded so that 0.1 · 3 is 0.3 in names and ids."""
        count = int(np.floor((self.stop - self.start) / self.step + 1e-9)) + 1
        return tuple(_rounded(self.start + i * self.step) for i in range(count))


class Linspace(Strict):
    """A number of evenly spaced values from start to stop, both included."""

    start: Annotated[Finite, Field(description="first value")]
    stop: Annotated[Finite, Field(description="last value")]
    count: Annotated[int, Field(ge=2, le=CANDIDATES_MAX, description="how many values"), Whole]

    @property
    def values(self) -> tuple[float, ...]:
        """The values; rounded as in `Range`."""
        return tuple(map(_rounded, np.linspace(self.start, self.stop, self.count).tolist()))


def _rounded(value: float) -> float:
    return round(value, 12) + 0.0  # − 0 is 0


Axis = Annotated[
    Annotated[Range, Tag("Range")]
    | Annotated[Linspace, Tag("Linspace")]
    | Annotated[tuple[AnyScalar, ...], Field(min_length=1), Tag("array")],
    Discriminator(_kind_of_axis),
]


def _kind_of_choice(choice: object) -> str | None:
    if isinstance(choice, list | tuple):
        return "array"
    return choice if choice in ("none", "all") else None


Choice = Annotated[
    Annotated[Literal["none"], Tag("none")]
    | Annotated[Literal["all"], Tag("all")]
    | Annotated[
        tuple[Annotated[dict[str, AnyScalar], Field(min_length=1)], ...],
        Field(min_length=1),
        Tag("array"),
    ],
    Discriminator(_kind_of_choice),
]


class StudyFile(Strict):
    """A study as written: config/NAME.yaml."""

    title: Annotated[str, Field(min_length=1, description="one line, heads the report")]
    devices: Annotated[
        tuple[str, ...], Field(min_length=1, description="names under designs/devices")
    ]
    bodies: Annotated[
        tuple[str, ...], Field(min_length=1, description="names under designs/bodies")
    ]
    posture: Annotated[str, Field(description="name under designs/postures")]
    method: Annotated[str, Field(description="name under designs/methods")]
    set: Annotated[
        dict[str, AnyScalar],
        Field(
            default_factory=dict, description="values that replace those of the designs, by path"
        ),
    ]
    axes: Annotated[
        dict[str, Axis],
        Field(default_factory=dict, description="values to vary, by path; none: one candidate"),
    ]
    certify: Annotated[
        Choice,
        Field(description="candidates simulated again at half the step and on twice the mesh, by "
              "values of axes"),
    ] = "none"
    exposure_s: Annotated[
        Positive,
        Field(description="how long a patient is carried: the time for which pressures are "
              "compared with limits; changes no simulation"),
    ] = EXPOSURE
    trajectories: Annotated[
        Literal["exemplars", "all"],
        Field(description="candidates whose frames are kept: those that the report shows "
              f"(of a study of up to {FRAMES_KEPT_MAX}, every one), or all"),
    ] = "exemplars"
    candidates_per_job: Annotated[
        Annotated[int, Field(ge=1), Whole] | None,
        Field(description="candidates that one process simulates; none: chosen"),
    ] = None

    @field_validator("devices", "bodies")
    @classmethod
    def _names_differ(cls, names):
        _refuse_repeated(names, "")
        return names

    @field_validator("axes")
    @classmethod
    def _values_differ(cls, axes):
        for key, values in _values_of(axes).items():
            _refuse_repeated(values, f"{key} ")
        return axes

    @property
    def axis_values(self) -> dict[str, tuple[Scalar, ...]]:
        """The values of each axis, as written in `axes`."""
        return _values_of(self.axes)


def _values_of(axes: dict) -> dict[str, tuple[Scalar, ...]]:
    return {key: axis if isinstance(axis, tuple) else axis.values for key, axis in axes.items()}


def _refuse_repeated(values: tuple, where: str) -> None:
    if len(set(values)) < len(values):
        repeated = next(value for value in values if values.count(value) > 1)
        raise ValueError(f"{where}holds {repeated} twice; accepted: different values")


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
        Axis name → values, `body` first, then `device` if there are several; the dimensions of
        the dataset.
    axis_paths : dict
        Axis name → full path in the design.
    candidates : tuple of Candidate
        The full grid, last axis fastest.
    variants : dict
        Id of each candidate to certify → its variants by name.
    """

    name: str
    path: Path
    root: Path
    file: StudyFile
    axes: dict[str, tuple[Scalar, ...]]
    axis_paths: dict[str, str]
    candidates: tuple[Candidate, ...]
    variants: dict[str, dict[str, Candidate]]

    @property
    def variant_runs(self) -> tuple[Candidate, ...]:
        """The variants that are not among the candidates, each once."""
        known = {candidate.id for candidate in self.candidates}
        every = (each for variants in self.variants.values() for each in variants.values())
        return tuple({each.id: each for each in every if each.id not in known}.values())

    @property
    def runs(self) -> tuple[Candidate, ...]:
        """All that is simulated: the candidates, then the variants."""
        return self.candidates + self.variant_runs

    @property
    def keeps_frames(self) -> bool:
        """Whether what is simulated is kept frame by frame; else its exemplars are run again."""
        return self.file.trajectories == "all" or len(self.candidates) <= FRAMES_KEPT_MAX

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
        `body` and `device` replace the lists of bodies and devices. Nothing is certified then:
        the places to certify are those of the file's axes.

    Raises
    ------
    DesignError
        Anything that could not be simulated as written.
    """
    path = Path(path)
    file = validate(StudyFile, read_yaml(path), shown(path))
    certifies = not replace
    replace = dict(replace or {})
    for name, key in (("body", "bodies"), ("device", "devices")):
        if name in replace:
            file = file.model_copy(update={key: (str(replace.pop(name)),)})
    root = _root_of(path)
    trees = _trees(file, root, path)

    replaced = _paths_in_all(trees, replace, "--set", "--set ")
    settings = _paths_in_all(trees, file.set, f"{shown(path)}: set", f"{shown(path)}: set.")
    axes = _paths_in_all(trees, file.axes, f"{shown(path)}: axes", f"{shown(path)}: axes.")
    for full in settings.keys() & axes.keys() - replaced.keys():
        raise DesignError(f"{settings[full][1]}: is also an axis; accepted: one of the two")
    settings = {full: settings[full] for full in settings if full not in replaced} | replaced
    values_to_set = file.set | replace
    for tree in trees.values():
        for full, (key, _) in settings.items():
            set_value(tree, full, values_to_set[key])
    written_at = {full: written for full, (_, written) in settings.items()}
    for tree in trees.values():
        validate(Design, tree, path, written_at)

    axes = {full: axes[full] for full in axes if full not in replaced}
    names = _axis_names(list(axes))
    values = {names[full]: file.axis_values[key] for full, (key, _) in axes.items()}
    devices = {"device": file.devices} if len(file.devices) > 1 else {}
    values = {"body": file.bodies} | devices | values
    count = math.prod(map(len, values.values()))
    if count > CANDIDATES_MAX:
        raise DesignError(
            f"{shown(path)}: axes: {count} candidates; accepted: up to {CANDIDATES_MAX}"
        )
    written_at = {full: written for full, (_, written) in axes.items()}
    mesh_digests = {}
    candidates = []
    for point in itertools.product(*values.values()):
        place = dict(zip(values, point, strict=True))
        # A design shares nothing with its tree, and every point sets every axis.
        tree = trees[place["body"], place.get("device", file.devices[0])]
        for full in axes:
            set_value(tree, full, place[names[full]])
        design = validate(Design, tree, path, written_at)
        content = content_id(design, root, mesh_digests, shown(path))
        candidates.append(Candidate(content, place, design))
    axis_paths = {name: name for name in ("body", *devices)}
    axis_paths |= {names[full]: full for full in axes}
    where = f"{shown(path)}: certify"
    chosen = chosen_places(file.certify, values, axis_paths, where) if certifies else []
    variants = {
        each.id: variants_of(each, root, mesh_digests, where)
        for each in candidates
        if any(place.items() <= each.coordinates.items() for place in chosen)
    }
    return Study(path.stem, path, root, file, values, axis_paths, tuple(candidates), variants)


def _trees(file: StudyFile, root: Path, path: Path) -> dict[tuple[str, str], dict]:
    """Return the design of each body and device as nested mappings."""
    devices = {name: _read_design(root, "devices", name, path) for name in file.devices}
    posture = _read_design(root, "postures", file.posture, path)
    method = _read_design(root, "methods", file.method, path)
    bodies = {name: _read_design(root, "bodies", name, path) for name in file.bodies}
    return {
        (name, of): validate(
            Design, {"device": device, "body": body, "posture": posture, "method": method}, path
        ).model_dump()
        for name, body in bodies.items()
        for of, device in devices.items()
    }


def _paths_in_all(trees: dict, keys, source: str, prefix: str) -> dict[str, tuple[str, str]]:
    """Return what `_paths` does, for keys that lead to the same place in every tree."""
    found = [_paths(tree, keys, source, prefix) for tree in trees.values()]
    for (_, device), other in zip(trees, found, strict=True):
        for full in found[0].keys() - other.keys():
            raise DesignError(
                f"{found[0][full][1]}: is {full} in one device, another path in {device}; "
                f"accepted: the full path of a key that all have"
            )
    return found[0]


def _paths(tree: dict, keys, source: str, prefix: str) -> dict[str, tuple[str, str]]:
    """Return full path → (key as written, where it is written)."""
    found = {}
    for key in keys:
        full = resolve_path(tree, key, source)
        if full in found:
            raise DesignError(f"{prefix}{key}: the same as {found[full][0]}; accepted: one of them")
        found[full] = key, f"{prefix}{key}"
    return found


def _root_of(path: Path) -> Path:
    for folder in path.resolve().parents:
        if (folder / "designs").is_dir():
            return folder
    raise DesignError(f"{shown(path)}: no folder designs/ beside or above it")


MODELS = {"bodies": BodyDesign, "postures": Posture, "methods": Method}
"""Folder under designs/ → what its files hold; a device says itself what it is."""


def _read_design(root: Path, kind: str, name: str, study: Path):
    file = root / "designs" / kind / f"{name}.yaml"
    if not file.is_file():
        known = ", ".join(sorted(each.stem for each in file.parent.glob("*.yaml"))) or "none"
        key = {"postures": "posture", "methods": "method"}.get(kind, kind)
        raise DesignError(f"{shown(study)}: {key}: no {file.relative_to(root)}; accepted: {known}")
    return read_design(MODELS[kind], file) if kind in MODELS else read_device(file)


def _axis_names(paths: list[str]) -> dict[str, str]:
    """Name each axis by the last part of its path, or by the whole where that would not do."""
    last = [full.rsplit(".", 1)[-1] for full in paths]
    return {
        full: full if last.count(name) > 1 or name.isdigit() else name
        for full, name in zip(paths, last, strict=True)
    }
