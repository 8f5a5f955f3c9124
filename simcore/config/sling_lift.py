"""The sling lift: a sheet hung from a spreader bar that takes the body off a bed."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from simcore.config.motion import MotionProgram
from simcore.config.values import Finite, NotNegative, Positive, Strict, Vector, Whole

SheetPoint = tuple[Finite, Finite]


class RectangleOutline(Strict):
    """A rectangle: x from the head edge at 0 to the foot edge, y to the left.

    A head part, if it has a length, continues it over the head edge to x below 0.
    """

    shape: Annotated[Literal["rectangle"], Field(description="rectangle, perhaps a head part")]
    length_m: Annotated[Positive, Field(description="from the head edge to the foot edge")]
    width_m: Annotated[Positive, Field(description="left to right")]
    head_length_m: Annotated[NotNegative, Field(description="head part beyond the head edge")] = 0.0
    head_width_m: Annotated[NotNegative, Field(description="its width, 0 without one")] = 0.0


class UShapeOutline(Strict):
    """A rectangle with a gap in the middle of its foot edge, which leaves two leg parts."""

    shape: Annotated[Literal["u_shape"], Field(description="rectangle with two leg parts")]
    length_m: Annotated[Positive, Field(description="from the head edge to the end of the legs")]
    width_m: Annotated[Positive, Field(description="left to right")]
    leg_length_m: Annotated[Positive, Field(description="depth of the gap")]
    gap_width_m: Annotated[Positive, Field(description="width of the gap")]
    head_length_m: Annotated[NotNegative, Field(description="head part beyond the head edge")] = 0.0
    head_width_m: Annotated[NotNegative, Field(description="its width, 0 without one")] = 0.0


class PolygonOutline(Strict):
    """A simple polygon."""

    shape: Annotated[Literal["polygon"], Field(description="any outline that does not cross")]
    corners_m: Annotated[
        tuple[SheetPoint, ...],
        Field(min_length=3, description="corners [x, y] in order, the first not repeated"),
    ]


class PaperMaterial(Strict):
    """Table I of the paper: one stiffness for every spring, one mass for the whole sheet.

    Stretch and sag change with the number of vertices.
    """

    kind: Annotated[Literal["paper"], Field(description="one stiffness for every spring")]
    stiffness_n_per_m: Annotated[Positive, Field(description="k_sheet, of each spring")]
    mass_kg: Annotated[Positive, Field(description="ΣM, of the whole sheet")]


class Fabric(Strict):
    """A fabric as it is measured: what it does depends on neither mesh nor size."""

    kind: Annotated[Literal["fabric"], Field(description="a fabric, whatever the mesh")]
    stiffness_per_width_n_per_m: Annotated[
        Positive, Field(description="tension per width over strain")
    ]
    areal_density_kg_per_m2: Annotated[Positive, Field(description="mass over area")]
    # ASSUME: a fabric keeps its stiffness down to the lateral contraction that 3 % of stretch
    # brings; without that, ν and E_w would not be those asked for. Beyond, it buckles in creases
    # finer than the net, and 5 % keeps the net from folding flat.
    buckling_strain: Annotated[
        NotNegative, Field(description="compression at which a spring of the net buckles")
    ] = 0.01
    compression_share: Annotated[
        Finite, Field(ge=0, le=1, description="share of its stiffness that a buckled spring keeps")
    ] = 0.05


class SheetDesign(Strict):
    """A sheet: what it is cut from, in what outline, and where the body lies on it."""

    outline: Annotated[
        RectangleOutline | UShapeOutline | PolygonOutline,
        Field(discriminator="shape", description="cut of the sheet"),
    ]
    material: Annotated[
        PaperMaterial | Fabric, Field(discriminator="kind", description="what it is made of")
    ]
    vertex_count: Annotated[
        int, Field(ge=9, le=100_000, description="vertices of the net, about"), Whole
    ]
    pelvis_x_m: Annotated[
        Finite, Field(description="x of the point of the sheet under the pelvis joint")
    ]


class LoopAttachment(Strict):
    """A strap from a point of the sheet to a point of the spreader bar."""

    kind: Annotated[Literal["loop"], Field(description="a strap at a point of the sheet")]
    name: Annotated[str, Field(min_length=1, description="name of the strap")]
    sheet_point_m: Annotated[SheetPoint, Field(description="[x, y] on or inside the outline")]
    bar_point_m: Annotated[Vector, Field(description="where it is hooked, bar frame")]
    strap_length_m: Annotated[NotNegative, Field(description="unstretched length")]


class EdgeAttachment(Strict):
    """A whole edge of the outline tied to a straight pole of the bar.

    Edges left and right run along the pole from head to foot, edges head and foot from right to
    left.
    """

    kind: Annotated[Literal["edge"], Field(description="an edge tied to a pole")]
    name: Annotated[str, Field(min_length=1, description="name of the pole")]
    edge: Annotated[
        Literal["head", "foot", "left", "right"], Field(description="edge of the outline")
    ]
    bar_start_m: Annotated[Vector, Field(description="start of the pole, bar frame")]
    bar_end_m: Annotated[Vector, Field(description="end of the pole, bar frame")]
    strap_length_m: Annotated[
        NotNegative, Field(description="from the edge to the pole; 0 ties it on to the pole")
    ]


class HangingDesign(Strict):
    """The attachments of a sheet and the stiffness of its straps."""

    strap_stiffness_n_per_m: Annotated[
        Positive, Field(description="tension over elongation of a strap, or of all of an edge")
    ]
    strap_damping_ns_per_m: Annotated[NotNegative, Field(description="damping of the same")]
    attachments: Annotated[
        tuple[
            Annotated[LoopAttachment | EdgeAttachment, Field(discriminator="kind")], ...
        ],
        Field(min_length=1, description="what ties the sheet to the bar"),
    ]

    @model_validator(mode="after")
    def _names_differ(self):
        names = [attachment.name for attachment in self.attachments]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"attachments holds {name} twice; accepted: different names")
        return self


class Bed(Strict):
    """A flat mattress that springs under each of its points; it stands still.

    Bed frame, which is the world: origin in the middle of the upper side, x from head to foot.
    """

    length_m: Annotated[Positive, Field(description="head to foot")]
    width_m: Annotated[Positive, Field(description="left to right")]
    pressure_stiffness_pa_per_m: Annotated[
        Positive, Field(description="pressure over depth of the mattress")
    ]
    damping_time_s: Annotated[NotNegative, Field(description="its damping over its stiffness")]
    friction_coefficient: Annotated[
        NotNegative, Field(description="µ of the mattress with skin and sheet")
    ]


class SlingLift(Strict):
    """A sheet that a rising spreader bar takes off a bed: designs/devices/NAME.yaml."""

    kind: Annotated[Literal["sling_lift"], Field(description="kind of device")]
    bed: Annotated[Bed, Field(description="where the body lies at the start")]
    sheet: Annotated[SheetDesign, Field(description="what carries the body")]
    hanging: Annotated[HangingDesign, Field(description="how the sheet hangs from the bar")]
    motion: Annotated[
        MotionProgram,
        Field(description="how the bar moves; at the start its frame is that of the bed"),
    ]

    @property
    def rigid_part(self) -> Bed:
        """What of the device is rigid."""
        return self.bed

    @property
    def support_angle_rad(self) -> float:
        """Inclination of the bed [rad]: none."""
        return 0.0
