"""What a body came out as: its segments beside de Leva's, and its picture as glTF."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from simcore.body.build import Body
from simcore.body.de_leva import SHARES
from simcore.body.segments import kind_of
from simcore.body.skeleton import segment_placements
from simcore.body.skin import blend

# Segments of each printed row; limbs are summed over both sides.
ROWS = {
    "head": ("head",),
    "trunk": ("pelvis", "lumbar", "thoracic"),
    "upper arms": ("upper_arm",),
    "forearms": ("forearm",),
    "hands": ("hand",),
    "thighs": ("thigh",),
    "shanks": ("shank",),
    "feet": ("foot", "toe"),
    "arms": ("upper_arm", "forearm", "hand"),
    "legs": ("thigh", "shank", "foot", "toe"),
}


@dataclass(frozen=True)
class MassRow:
    """Mass of a part of the body beside de Leva's average body of the same mass.

    Attributes
    ----------
    part : str
    mass : float
        [kg].
    share : float
        Of body mass.
    de_leva_share : float
        Of body mass, de Leva (1996).
    """

    part: str
    mass: float
    share: float
    de_leva_share: float

    @property
    def deviation(self) -> float:
        """Relative deviation from de Leva."""
        return self.share / self.de_leva_share - 1


def describe_body(body: Body, design) -> list[tuple[str, str, str, str]]:
    """Part, mass [kg], share [%] and de Leva's share [%] with the deviation from it, as text."""
    return [
        (row.part, f"{row.mass:.2f}", f"{100 * row.share:.1f}",
         f"{100 * row.de_leva_share:.1f} ({row.deviation:+.0%})")
        for row in segment_masses(body, design)
    ]


def segment_masses(body: Body, design) -> list[MassRow]:
    """Masses of head, trunk, limbs and their segments, both sides together."""
    table = SHARES[design.sex]
    masses = {
        name: body.model.inertias[joint + 1].mass for joint, name in enumerate(body.segment_names)
    }
    rows = []
    for part, kinds in ROWS.items():
        members = [name for name in masses if kind_of(name) in kinds]
        mass = sum(masses[name] for name in members)
        expected = sum(table[kind_of(name)].mass for name in members if kind_of(name) in table)
        rows.append(MassRow(part, mass, mass / body.mass, expected))
    return rows


def posed_vertices(body: Body, q: np.ndarray) -> np.ndarray:
    """Skin vertices (n, 3) [m] at a configuration q (60,), world axes."""
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, q)
    return blend(body.skin, *segment_placements(body.model, data))


def write_glb(body: Body, path: Path, q: np.ndarray | None = None) -> None:
    """Write the skin as binary glTF (y up), coloured by region, at q or at the rest pose."""
    import trimesh  # slow to import, and wanted only here

    vertices = posed_vertices(body, body.rest_configuration if q is None else q)
    mesh = trimesh.Trimesh(
        vertices[:, [1, 2, 0]],  # x forward, y left, z up → glTF's x left, y up, z forward
        body.skin.faces,
        vertex_colors=region_colours(len(body.region_names))[body.vertex_region],
        process=False,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    mesh.export(path, file_type="glb")


def region_colours(count: int) -> np.ndarray:
    """Distinct colours (count, 4) uint8, neighbours far apart in hue (golden-ratio steps)."""
    hue = (np.arange(count) * 0.618033988749895) % 1
    phase = hue[:, None] + np.array([0, 1, 2]) / 3
    rgb = 170 + 70 * np.cos(2 * np.pi * phase)
    return np.column_stack([rgb, np.full(count, 255)]).astype(np.uint8)
