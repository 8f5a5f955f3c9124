"""What a sheet is made of and how it hangs, as plain numbers in SI units."""

from dataclasses import dataclass
from typing import Literal

EdgeName = Literal["head", "foot", "left", "right"]


@dataclass(frozen=True)
class RectangleOutline:
    """A rectangle: x from the head edge at 0 to the foot edge at length_m, y in ± width_m / 2.

    A head part, if it has a length, continues it over the head edge to x = −head_length_m.
    """

    length_m: float
    width_m: float
    head_length_m: float = 0.0
    head_width_m: float = 0.0


@dataclass(frozen=True)
class UShapeOutline:
    """A rectangle with a gap in the middle of its foot edge, which leaves two leg parts."""

    length_m: float
    width_m: float
    leg_length_m: float
    gap_width_m: float
    head_length_m: float = 0.0
    head_width_m: float = 0.0


@dataclass(frozen=True)
class PolygonOutline:
    """The corners (x, y) [m] of a simple polygon, in order, the first not repeated."""

    corners_m: tuple[tuple[float, float], ...]


Outline = RectangleOutline | UShapeOutline | PolygonOutline


@dataclass(frozen=True)
class PaperSheet:
    """Table I of the paper: one stiffness for every spring, one mass for the whole sheet.

    Stretch and sag change with the number of vertices.
    """

    stiffness_n_per_m: float = 1000.0
    mass_kg: float = 10.0


@dataclass(frozen=True)
class FabricSheet:
    """A fabric as it is measured: what it does depends on neither mesh nor size.

    Attributes
    ----------
    stiffness_per_width_n_per_m : float
        Tension per width over strain, E_w [N/m].
    areal_density_kg_per_m2 : float
    buckling_strain : float
        Compression of a spring at which it buckles.
    compression_share : float
        Share of the stiffness that a buckled spring keeps.
    """

    stiffness_per_width_n_per_m: float = 2.0e4
    areal_density_kg_per_m2: float = 0.3
    # ASSUME: a fabric keeps its stiffness down to the lateral contraction that 3 % of stretch
    # brings; without that, ν and E_w would not be those asked for. Beyond, it buckles in creases
    # finer than the net, and 5 % keeps the net from folding flat.
    buckling_strain: float = 0.01
    compression_share: float = 0.05


Material = PaperSheet | FabricSheet


@dataclass(frozen=True)
class SheetDesign:
    """A sheet: outline, number of vertices and material."""

    outline: Outline
    material: Material
    vertex_count: int = 4000


@dataclass(frozen=True)
class LoopAttachment:
    """A strap from a point of the sheet to a point of the spreader bar.

    Attributes
    ----------
    sheet_point_m : (x, y)
        In the sheet plane, on or inside the outline [m]; the load is spread over the vertices
        nearest to it.
    bar_point_m : (x, y, z)
        Bar frame [m].
    strap_length_m : float
    """

    name: str
    sheet_point_m: tuple[float, float]
    bar_point_m: tuple[float, float, float]
    strap_length_m: float


@dataclass(frozen=True)
class EdgeAttachment:
    """A whole edge of the outline tied to a straight pole of the bar, vertex by vertex.

    Attributes
    ----------
    bar_start_m, bar_end_m : (x, y, z)
        Pole in the bar frame [m]. Edges left and right run along it from head to foot, edges head
        and foot from right to left.
    strap_length_m : float
        Zero ties the edge on to the pole.
    """

    name: str
    edge: EdgeName
    bar_start_m: tuple[float, float, float]
    bar_end_m: tuple[float, float, float]
    strap_length_m: float


Attachment = LoopAttachment | EdgeAttachment


@dataclass(frozen=True)
class HangingDesign:
    """The attachments of a sheet and the stiffness of its straps.

    Attributes
    ----------
    strap_stiffness_n_per_m : float
        Tension over elongation of one strap, of all straps of an edge together [N/m].
    strap_damping_ns_per_m : float
        Of the same [N s/m].
    """

    attachments: tuple[Attachment, ...]
    strap_stiffness_n_per_m: float = 3.0e4
    strap_damping_ns_per_m: float = 30.0
