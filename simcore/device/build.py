"""The rigid surface of a device's design."""

from pathlib import Path

from simcore.config.robotic_lift import MeshSurface, SeatAndBackrest
from simcore.config.sling_lift import Bed
from simcore.device.bed import flat_bed
from simcore.device.mesh_file import surface_from_file
from simcore.device.surface import Surface, seat_and_backrest


def build_surface(design: SeatAndBackrest | MeshSurface | Bed, root: Path) -> Surface:
    """Return the surface of a design; mesh files are sought under `root`."""
    match design:
        case MeshSurface():
            return surface_from_file(design, root)
        case Bed():
            return flat_bed(design)
    return seat_and_backrest(design)
