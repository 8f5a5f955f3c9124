"""Read a YAML file into a validated model; every mistake is one line with file and key."""

from pathlib import Path
from typing import TypeVar, get_args

from pydantic import BaseModel, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from simcore.errors import DesignError

Model = TypeVar("Model", bound=BaseModel)


def read_yaml(path: Path) -> dict:
    """Return the mapping in a YAML 1.2 file.

    Raises
    ------
    DesignError
        No such file, not YAML, a key given twice, or not a mapping.
    """
    try:
        data = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DesignError(f"{path}: cannot be read ({error.strerror})") from None
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        problem = (error.problem or "not YAML").splitlines()[0]
        raise DesignError(f"{path}: line {line}: {problem}") from None
    except (YAMLError, UnicodeDecodeError) as error:
        raise DesignError(f"{path}: not YAML ({str(error).splitlines()[0]})") from None
    if not isinstance(data, dict):
        raise DesignError(f"{path}: must hold keys and values")
    return data


def parse_scalar(text: str) -> bool | int | float | str:
    """Return a value as YAML reads it; anything but a scalar stays the text it was."""
    try:
        value = YAML(typ="safe", pure=True).load(text)
    except YAMLError:
        return text
    return value if isinstance(value, bool | int | float) else text


def read_design(model: type[Model], path: Path) -> Model:
    """Return the validated design in a YAML file."""
    return validate(model, read_yaml(path), path)


def validate(model: type[Model], data: object, source: str | Path, prefix: str = "") -> Model:
    """Validate `data`; `source` and `prefix` say in the message where it came from."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise DesignError(f"{source}: {_first_problem(model, error, prefix)}") from None


def _first_problem(model: type[BaseModel], error: ValidationError, prefix: str) -> str:
    # An unknown key is the likeliest cause of a missing one, so it is told first.
    problem = min(error.errors(), key=lambda problem: problem["type"] != "extra_forbidden")
    path, owner = _resolve(model, problem["loc"])
    key = ".".join([*filter(None, [prefix]), *path]) or "(top level)"
    match problem["type"]:
        case "extra_forbidden":
            return f"{key}: unknown key; accepted: {', '.join(owner.model_fields)}"
        case "missing":
            return f"{key}: missing"
        case "value_error":
            return f"{key}: {problem['ctx']['error']}"
        case _:
            message = problem["msg"].removeprefix("Input ")
            return f"{key}: {message}, not {problem['input']!r}"


def _resolve(model: type[BaseModel], location: tuple) -> tuple[list[str], type[BaseModel]]:
    """Return the keys of a pydantic location, without union tags, and the model they end in."""
    keys: list[str] = []
    owner = model
    candidates = [model]
    for part in location:
        tagged = [
            each
            for each in candidates
            if any(
                part in get_args(field.annotation)
                for name, field in each.model_fields.items()
                if name in ("kind", "shape")
            )
        ]
        if tagged and len(candidates) > 1:
            candidates, owner = tagged, tagged[0]
            continue
        keys.append(str(part))
        fields = [each.model_fields[part] for each in candidates if part in each.model_fields]
        if fields:
            owner = next(each for each in candidates if part in each.model_fields)
            inner = [each for field in fields for each in _models_in(field.annotation)]
            candidates = inner or candidates
            if inner:
                owner = inner[0]
    return keys, owner


def _models_in(annotation) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]
