"""The robotic lift: a rigid surface, moved by a program."""

from math import pi, radians, tan
from typing import Annotated, Literal

from pydantic import Field, model_validator

from simcore.config.motion import MotionProgram
from simcore.config.values import Finite, Positive, Strict, Whole

CORNER_RADIUS_MIN = 0.005
"""Least radius of the corner between a raised seat and its backrest [m]: about a grid spacing."""


class SeatAndBackrest(Strict):
    """A seat and a reclined backrest joined by a fillet, one slab of even thickness.

    Both may be dished: flat in the middle, raised at their sides.
    """

    shape: Annotated[Literal["seat_and_backrest"], Field(description="parametric surface")]
    seat_depth_m: Annotated[Positive, Field(description="seat, from its front to the backrest")]
    backrest_height_m: Annotated[Positive, Field(description="backrest, along its slope")]
    width_m: Annotated[Positive, Field(description="seat and backrest, left to right")]
    recline_deg: Annotated[
        Finite, Field(ge=-10, le=85, description="backrest from the normal of the seat, backwards")
    ]
    fillet_radius_m: Annotated[
        Positive, Field(description="radius of the corner and of the front edge")
    ]
    thickness_m: Annotated[Positive, Field(description="thickness of the slab")]
    dish_depth_m: Annotated[
        Finite, Field(ge=0, le=0.2, description="rise of the sides over the middle")
    ]
    vertex_count: Annotated[
        int, Field(ge=500, le=500_000, description="contact points, about"), Whole
    ]

    @property
    def recline_rad(self) -> float:
        """Backrest recline [rad]."""
        return radians(self.recline_deg)

    @model_validator(mode="after")
    def _fillets_fit(self):
        # The corner, rounded in the middle and raised at the sides, takes its share of seat and
        # backrest; the front edge takes a radius of the seat.
        share = tan((pi / 2 - self.recline_rad) / 2)
        corner = share * max(self.fillet_radius_m, self.dish_depth_m + CORNER_RADIUS_MIN)
        for name, needed in (
            ("seat_depth_m", corner + self.fillet_radius_m), ("backrest_height_m", corner)
        ):
            if getattr(self, name) <= needed:
                raise ValueError(
                    f"{name} must exceed the {needed:.3f} m that fillet_radius_m and dish_depth_m "
                    "take of it"
                )
        if self.thickness_m >= self.fillet_radius_m:
            raise ValueError("thickness_m must be less than fillet_radius_m")
        return self


class MeshSurface(Strict):
    """A surface from CAD (STL, OBJ, PLY …), resampled to an even vertex spacing."""

    shape: Annotated[Literal["mesh"], Field(description="surface from a file")]
    file: Annotated[str, Field(description="path of the mesh, from the folder above designs/")]
    unit: Annotated[Literal["m", "cm", "mm"], Field(description="length unit of the file")]
    recline_deg: Annotated[
        Finite, Field(ge=-10, le=90, description="recline of the trunk that the mesh supports")
    ]
    vertex_count: Annotated[
        int, Field(ge=500, le=500_000, description="contact points, about"), Whole
    ]

    @property
    def recline_rad(self) -> float:
        """Trunk recline [rad]."""
        return radians(self.recline_deg)


class RoboticLift(Strict):
    """A rigid support moved in two degrees of freedom: designs/devices/NAME.yaml."""

    kind: Annotated[Literal["robotic_lift"], Field(description="kind of device")]
    support_angle_deg: Annotated[
        Finite, Field(ge=-30, le=60, description="inclination of the whole support, front edge up")
    ]
    surface: Annotated[
        SeatAndBackrest | MeshSurface,
        Field(discriminator="shape", description="what carries the body"),
    ]
    motion: Annotated[MotionProgram, Field(description="how the device moves")]

    @property
    def rigid_part(self) -> SeatAndBackrest | MeshSurface:
        """What of the device is rigid."""
        return self.surface

    @property
    def support_angle_rad(self) -> float:
        """Inclination of the whole support [rad]."""
        return radians(self.support_angle_deg)
