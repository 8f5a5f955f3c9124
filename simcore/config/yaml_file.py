"""Read a YAML file into a validated model; every mistake is one line with file and key."""

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from simcore.config.accepted import accepted, locate, schema_of
from simcore.errors import DesignError

Model = TypeVar("Model", bound=BaseModel)

BRIEF = 60
"""Longest value that a message repeats in full, in characters."""


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
        raise DesignError(f"{shown(path)}: cannot be read ({error.strerror})") from None
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        problem = (error.problem or "not YAML").splitlines()[0]
        raise DesignError(f"{shown(path)}: line {line}: {problem}") from None
    except (YAMLError, UnicodeDecodeError) as error:
        raise DesignError(f"{shown(path)}: not YAML ({str(error).splitlines()[0]})") from None
    if not isinstance(data, dict):
        raise DesignError(f"{shown(path)}: must hold keys and values")
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
    return validate(model, read_yaml(path), shown(path))


def shown(path: Path) -> str:
    """Return a path as a message shows it: from the working folder, if it is inside."""
    try:
        return str(path.resolve().relative_to(Path.cwd()))
    except ValueError:
        return str(path)


def validate(
    model: type[Model], data: object, source: str | Path, written_at: dict[str, str] | None = None
) -> Model:
    """Validate `data`.

    Parameters
    ----------
    source : str or Path
        Says in a message where the data came from.
    written_at : dict, optional
        Key → source, for keys whose values were written elsewhere. A problem of several keys
        together is said to come from all of these.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        # An unknown key is the likeliest cause of a missing one, so it is told first.
        problem = min(error.errors(), key=lambda problem: problem["type"] != "extra_forbidden")
    keys, node = locate(model, problem["loc"])
    key = ".".join(keys)
    if written_at:
        source = written_at.get(key) or ", ".join(written_at.values())
    raise DesignError(": ".join(filter(None, [str(source), key, _told(problem, model, node)])))


def _told(problem: dict, model: type[BaseModel], node: dict) -> str:
    accepts = accepted(node, schema_of(model))
    match problem["type"]:
        case "extra_forbidden":
            owner = locate(model, problem["loc"][:-1])[1]
            return f"unknown key; accepted: {', '.join(owner['properties'])}"
        case "missing":
            return f"missing; accepted: {accepts}"
        case "value_error":
            return str(problem["ctx"]["error"])
        case "union_tag_not_found" | "union_tag_invalid" if "discriminator" in node:
            name = node["discriminator"]["propertyName"]
            given = problem["input"].get(name)
            tags = ", ".join(node["discriminator"]["mapping"])
            return f"{name} is {_brief(given)}; accepted: {tags}"
    return f"is {_brief(problem['input'])}; accepted: {accepts}"


def _brief(value: object) -> str:
    match value:
        case None:
            return "empty"
        case dict():
            text = "{" + ", ".join(map(str, value)) + "}"
        case list() | tuple():
            text = f"[{', '.join(map(str, value))}]"
        case bool():
            text = str(value).lower()
        case str():
            text = f"'{value}'"
        case _:
            text = str(value)
    return text if len(text) <= BRIEF else text[: BRIEF - 1] + "…"
