"""What a key accepts, in words: for the messages of mistakes and for the tables of all keys."""

from functools import cache

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema


class _Schema(GenerateJsonSchema):
    """JSON schema without the titles that only repeat the key."""

    def field_title_should_be_set(self, schema) -> bool:
        return False


@cache
def schema_of(model: type[BaseModel]) -> dict:
    """Return the JSON schema of a model, as its YAML file must be."""
    return model.model_json_schema(schema_generator=_Schema)


def resolved(node: dict, root: dict) -> dict:
    """Return a node of a schema with its reference followed."""
    if "$ref" not in node:
        return node
    target = root["$defs"][node["$ref"].rsplit("/", 1)[-1]]
    return target | {key: value for key, value in node.items() if key != "$ref"}


def locate(model: type[BaseModel], location: tuple) -> tuple[list[str], dict]:
    """Return the keys of a pydantic location, without the tags of unions, and their schema."""
    root = schema_of(model)
    keys, node = [], root
    for part in location:
        node = _without_null(node, root)
        variant = _variant(node, part, root)
        if variant is not None:
            node = variant
            continue
        if part == "[key]":  # the problem is the key itself
            node = {"type": "string"}
            break
        keys.append(str(part))
        inner = node.get("properties", {}).get(part)
        if inner is None and isinstance(part, int):
            positions = node.get("prefixItems", [])
            inner = positions[part] if part < len(positions) else node.get("items")
        if inner is None:
            inner = node.get("additionalProperties")
        node = resolved(inner, root) if isinstance(inner, dict) else {}
    return keys, node


def _without_null(node: dict, root: dict) -> dict:
    """Return what an optional node holds where it holds something."""
    options = [each for each in node.get("anyOf", []) if each.get("type") != "null"]
    return resolved(options[0], root) if len(options) == 1 else node


def _variant(node: dict, tag: object, root: dict) -> dict | None:
    if "discriminator" in node:
        reference = node["discriminator"]["mapping"].get(tag)
        return resolved({"$ref": reference}, root) if reference else None
    for each in node.get("oneOf", []):
        each = resolved(each, root)
        if tag in (each.get("title"), each.get("type")):
            return each
    return None


def accepted(node: dict, root: dict) -> str:
    """Return what a node of a schema accepts, in words."""
    node = resolved(node, root)
    match node:
        case {"const": value}:
            return str(value)
        case {"enum": values}:
            return _either(map(str, values))
        case {"discriminator": {"propertyName": name, "mapping": mapping}}:
            return f"keys and values with {name}: {_either(mapping)}"
        case {"anyOf": options} | {"oneOf": options}:
            return _either(
                dict.fromkeys(
                    accepted(each, root) for each in options if each.get("type") != "null"
                )
            )
        case {"type": [*kinds]}:
            return _either(accepted({"type": kind}, root) for kind in kinds)
        case {"type": "boolean"}:
            return "true/false"
        case {"type": "string"}:
            return "text"
        case {"type": "number" | "integer" as kind}:
            return ("whole number" if kind == "integer" else "number") + _bounds(node)
        case {"type": "array"}:
            return _list(node, root)
        case {"properties": keys}:
            return "{" + ", ".join(keys) + "}"
        case {"type": "object"}:
            return f"by key: {accepted(node['additionalProperties'], root)}"
    return "anything"


def _bounds(node: dict) -> str:
    low, high = node.get("minimum"), node.get("maximum")
    above = node.get("exclusiveMinimum")
    if low is not None and high is not None:
        return f" from {low:g} to {high:g}"
    if above is not None:
        return f" above {above:g}" + (f", at most {high:g}" if high is not None else "")
    return f" of at least {low:g}" if low is not None else ""


def _list(node: dict, root: dict) -> str:
    if "prefixItems" in node:
        return f"list of {len(node['prefixItems'])}, each: {accepted(node['prefixItems'][0], root)}"
    least = f" of at least {node['minItems']}" if "minItems" in node else ""
    return f"list{least}, each: {accepted(node.get('items', {}), root)}"


def _either(words) -> str:
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else last
