"""What certificates simulate: which candidates, at half the step and on twice the mesh."""

from pathlib import Path

from simcore.config.candidate import Candidate, content_id
from simcore.config.designs import Design
from simcore.config.paths import set_value
from simcore.config.yaml_file import validate
from simcore.errors import DesignError

VARIANTS = ("half_step", "twice_skin", "twice_device")
"""Each refines one thing: the steps of body and sheet, the body's skin, the device's mesh."""


def refined(design: Design, source: str = "certificate") -> dict[str, Design]:
    """Return the variants of a design by the names of `VARIANTS`.

    Raises
    ------
    DesignError
        A mesh of twice the vertices would be larger than its key accepts; `source` begins the
        message.
    """
    method, sheet = design.method, design.method.sheet
    if method.adaptive_step:
        half_step = {
            f"method.adaptive_step.{name}": value / 2
            for name, value in method.adaptive_step.model_dump().items()
        }
    else:
        half_step = {"method.time_step_s": method.time_step_s / 2}
    if sheet:
        half_step["method.sheet.step_s"] = sheet.step_s / 2
        substep = getattr(sheet.solver, "substep_s", None)
        if substep is not None:
            half_step["method.sheet.solver.substep_s"] = substep / 2
    mesh = "sheet" if design.device.kind == "sling_lift" else "surface"
    vertex_count = getattr(design.device, mesh).vertex_count
    changes = (
        half_step,
        {"body.skin_vertices": 2 * design.body.skin_vertices},
        {f"device.{mesh}.vertex_count": 2 * vertex_count},
    )
    return {
        name: _changed(design, values, source)
        for name, values in zip(VARIANTS, changes, strict=True)
    }


def variants_of(
    candidate: Candidate,
    root: Path,
    mesh_digests: dict[str, str] | None = None,
    source: str = "certificate",
) -> dict[str, Candidate]:
    """Return the variants of a candidate as candidates; parameters as of `content_id`."""
    digests = {} if mesh_digests is None else mesh_digests
    return {
        name: Candidate(
            content_id(design, root, digests, source),
            candidate.coordinates | {"variant": name},
            design,
        )
        for name, design in refined(candidate.design, source).items()
    }


def chosen_places(
    choice: str | tuple[dict, ...], axes: dict, axis_paths: dict, source: str
) -> list[dict]:
    """Return a study's places to certify by axis name; one without an axis has all its values.

    Parameters
    ----------
    choice : str or tuple of dict
        As written: none, all, or places by as much of the end of an axis' path as is unique.
    axes, axis_paths : dict
        Axis name → values, and → full path, as of a `Study`.
    source : str
        Begins the message of a `DesignError`: no such axis, or no such value of it.
    """
    if isinstance(choice, str):
        return [{}] if choice == "all" else []
    places = []
    for number, written in enumerate(choice):
        place = {}
        for key, value in written.items():
            here = f"{source}.{number}.{key}"
            names = [name for name, path in axis_paths.items() if f".{path}".endswith(f".{key}")]
            if len(names) != 1:
                told = "several axes end so" if names else "no such axis"
                raise DesignError(f"{here}: {told}; accepted: {', '.join(names or axes)}")
            (name,) = names
            if value not in axes[name]:
                listed = ", ".join(map(str, axes[name]))
                raise DesignError(f"{here}: is {value}; accepted: {listed}")
            place[name] = value
        places.append(place)
    return places


def _changed(design: Design, values: dict[str, float], source: str) -> Design:
    tree = design.model_dump()
    for path, value in values.items():
        set_value(tree, path, value)
    return validate(Design, tree, source)
