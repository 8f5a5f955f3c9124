"""One design to simulate, and the digest that names its result."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from simcore.config.designs import Design
from simcore.config.robotic_lift import MeshSurface, RoboticLift
from simcore.errors import DesignError

Scalar = bool | int | float | str


@dataclass(frozen=True)
class Candidate:
    """One design to simulate.

    Attributes
    ----------
    id : str
        Digest of the design's content; equal designs have equal ids in every study.
    coordinates : dict
        Its place in the study: axis name → value, `body` first, then `device` if several; last
        `variant`, if it is one of a certificate.
    design : Design
    """

    id: str
    coordinates: dict[str, Scalar]
    design: Design


def content_id(design: Design, root: Path, mesh_digests: dict[str, str], source: str) -> str:
    """Return the digest of all that decides the outcome, the bytes of a mesh file included.

    Parameters
    ----------
    mesh_digests : dict
        Digests of the mesh files read so far; those that this one needs are added.
    source : str
        Says in a message where the design came from.
    """
    content = json.dumps(design.model_dump(mode="json"), sort_keys=True)
    device = design.device
    if isinstance(device, RoboticLift) and isinstance(device.surface, MeshSurface):
        surface = device.surface
        if surface.file not in mesh_digests:
            mesh = root / surface.file
            if not mesh.is_file():
                raise DesignError(
                    f"{source}: device.surface.file: no such mesh: {surface.file}; "
                    "accepted: a path from the folder above designs/"
                )
            mesh_digests[surface.file] = hashlib.sha256(mesh.read_bytes()).hexdigest()
        content += mesh_digests[surface.file]
    return hashlib.sha256(content.encode()).hexdigest()[:12]
