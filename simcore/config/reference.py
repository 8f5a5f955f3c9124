"""The models → JSON schemas (workflow/schemas) and the key tables of config/README.md.

Run `python -m simcore.config.reference` after a change of the models; a test tells when it was
forgotten.
"""

import json
from collections.abc import Iterator
from pathlib import Path

from pydantic import BaseModel

from simcore.config.accepted import accepted, resolved, schema_of
from simcore.config.designs import (
    DEVICES,
    JOINT_ANGLES,
    PAIRED_JOINTS,
    BodyDesign,
    Method,
    Posture,
)
from simcore.config.study import StudyFile
from simcore.config.units import units_of_key

BEGIN, END = "<!-- keys: generated -->", "<!-- keys: end -->"

FILES = {
    "study": (StudyFile, "config/NAME.yaml"),
    **{kind: (model, "designs/devices/NAME.yaml") for kind, model in DEVICES.items()},
    "body": (BodyDesign, "designs/bodies/NAME.yaml"),
    "posture": (Posture, "designs/postures/NAME.yaml"),
    "method": (Method, "designs/methods/NAME.yaml"),
}
"""Kind of file → its model, and where such files are."""


def schemas() -> dict[str, str]:
    """Return the text of each JSON schema by the name of its file."""
    dialect = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return {
        f"{kind}.schema.json": json.dumps(
            dialect | schema_of(model), indent=2, ensure_ascii=False, sort_keys=True
        )
        + "\n"
        for kind, (model, _) in FILES.items()
    }


def key_tables() -> str:
    """Return the tables of all keys as Markdown."""
    parts = []
    for kind, (model, place) in FILES.items():
        title = kind.replace("_", " ").capitalize()
        parts += [f"### {title}: `{place}`", "", *_table(model), ""]
        if model is Posture:
            parts += [*_joint_table(), ""]
    return "\n".join(parts).rstrip() + "\n"


def with_tables(readme: str) -> str:
    """Return the text of config/README.md with its tables renewed."""
    head, rest = readme.split(BEGIN)
    return f"{head}{BEGIN}\n\n{key_tables()}\n{END}{rest.split(END)[1]}"


def write_reference(root: Path) -> None:
    """Write the schemas and the tables under the folder above config/ and workflow/."""
    for name, text in schemas().items():
        (root / "workflow" / "schemas" / name).write_text(text, encoding="utf-8")
    readme = root / "config" / "README.md"
    readme.write_text(with_tables(readme.read_text(encoding="utf-8")), encoding="utf-8")


def rows(model: type[BaseModel]) -> Iterator[tuple[str, str, str, str, str]]:
    """Yield path, accepted values, unit, default and meaning of every key."""
    root = schema_of(model)
    yield from _rows(root, root, "", "")


def _rows(node: dict, root: dict, prefix: str, condition: str) -> Iterator[tuple]:
    required = node.get("required", [])
    for key, value in node["properties"].items():
        value = resolved(value, root)
        path = f"{prefix}{key}"
        item = resolved(value.get("items", {}), root)
        optional = [each for each in value.get("anyOf", []) if "$ref" in each]
        if _has_keys(value):
            yield from _rows_of_model(value, root, f"{path}.", condition)
            continue
        yield _row(path, value, root, key in required, condition)
        if _has_keys(item):
            yield from _rows_of_model(item, root, f"{path}.N.", condition)
        for each in optional:
            yield from _rows_of_model(resolved(each, root), root, f"{path}.", condition)


def _has_keys(node: dict) -> bool:
    return "properties" in node or "discriminator" in node


def _rows_of_model(node: dict, root: dict, prefix: str, condition: str) -> Iterator[tuple]:
    """Yield the rows of a model, or of each variant of a tagged union."""
    if "discriminator" not in node:
        yield from _rows(node, root, prefix, condition)
        return
    name = node["discriminator"]["propertyName"]
    for tag, reference in sorted(node["discriminator"]["mapping"].items()):
        yield from _rows(resolved({"$ref": reference}, root), root, prefix, f"{name}: {tag}")


def _row(path: str, value: dict, root: dict, required: bool, condition: str) -> tuple:
    unit = units_of_key(path)
    default = value.get("default")
    meaning = value.get("description", "")
    return (
        path,
        accepted(value, root),
        "" if unit == "1" else unit,
        "required" if required else _plain(default),
        f"{meaning} (with `{condition}`)"
        if condition and not path.endswith(condition.partition(":")[0])
        else meaning,
    )


def _plain(default: object) -> str:
    return "none" if default in (None, [], {}) else str(default)


def _table(model: type[BaseModel]) -> list[str]:
    lines = ["| key | accepted | unit | default | meaning |", "|---|---|---|---|---|"]
    for path, *rest in rows(model):
        lines.append(f"| `{path}` | {' | '.join(rest)} |")
    return lines


def _joint_table() -> list[str]:
    lines = ["| joint | its angles | with `_left`, `_right` |", "|---|---|---|"]
    for joint, angles in JOINT_ANGLES.items():
        lines.append(f"| {joint} | {', '.join(angles)} | {'yes' * (joint in PAIRED_JOINTS)} |")
    return lines


if __name__ == "__main__":
    write_reference(Path(__file__).parents[2])
