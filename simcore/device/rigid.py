"""A rigid device: a surface that follows a motion program."""

from dataclasses import dataclass
from pathlib import Path

from simcore.config.designs import MeshSurface, SeatAndBackrest
from simcore.device.mesh_file import surface_from_file
from simcore.device.motion import Motion
from simcore.device.surface import Surface, seat_and_backrest


@dataclass(frozen=True, eq=False)
class RigidDevice:
    """A surface and the motion that carries it."""

    surface: Surface
    motion: Motion


def build_surface(design: SeatAndBackrest | MeshSurface, root: Path) -> Surface:
    """Return the surface of a design; mesh files are sought under `root`."""
    if isinstance(design, MeshSurface):
        return surface_from_file(design, root)
    return seat_and_backrest(design)
