"""Name any value of a design by its path, or by as much of its end as is unique."""

import difflib
from collections.abc import Iterator

from simcore.errors import DesignError


def leaf_paths(tree: object, prefix: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Yield the path of every scalar in nested mappings and sequences."""
    if isinstance(tree, dict):
        items = tree.items()
    elif isinstance(tree, list | tuple):
        items = enumerate(tree)
    else:
        yield prefix
        return
    for key, value in items:
        yield from leaf_paths(value, (*prefix, str(key)))


def resolve_path(tree: dict, key: str, source: str) -> str:
    """Return the full dotted path of the one value whose path ends in `key`.

    Raises
    ------
    DesignError
        No value, or several, have such a path; the message lists what would be accepted.
    """
    wanted = tuple(key.split("."))
    paths = list(leaf_paths(tree))
    hits = [path for path in paths if path[-len(wanted) :] == wanted]
    if wanted in hits:  # a full path wins over longer ones that end alike
        hits = [wanted]
    if len(hits) == 1:
        return ".".join(hits[0])
    if hits:
        listed = ", ".join(".".join(path) for path in hits)
        raise DesignError(f"{source}: {key}: several keys end so; accepted: {listed}")
    inside = [".".join(path) for path in paths if _holds(path, wanted)]
    if inside:
        raise DesignError(f"{source}: {key}: holds several values; accepted: {', '.join(inside)}")
    known = sorted({path[-1] for path in paths} | {".".join(path) for path in paths})
    near = difflib.get_close_matches(key, known, n=3, cutoff=0.5)
    if not near:
        near = sorted({path[-1] for path in paths if not path[-1].isdigit()})
    raise DesignError(f"{source}: {key}: no such key in the design; accepted: {', '.join(near)}")


def _holds(path: tuple[str, ...], wanted: tuple[str, ...]) -> bool:
    starts = range(len(path) - len(wanted))
    return any(path[start : start + len(wanted)] == wanted for start in starts)


def set_value(tree: dict, path: str, value: object) -> None:
    """Replace the value at a full path, in place; sequences on the way become lists."""
    *parents, last = path.split(".")
    node = tree
    for key in parents:
        inner = node[int(key)] if isinstance(node, list) else node[key]
        if isinstance(inner, tuple):
            inner = list(inner)
            node[int(key) if isinstance(node, list) else key] = inner
        node = inner
    node[int(last) if isinstance(node, list) else last] = value
