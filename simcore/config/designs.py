"""The validated models of every design file: the single source of truth of all keys.

The JSON schemas under workflow/schemas and the key tables of config/README.md are generated
from these models (`simcore.config.reference`). Keys carry their unit; angles are degrees in
YAML and radians everywhere else (`Angle` fields are read through the `*_rad` properties).
"""

import itertools
from math import pi, radians, tan
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]


class Strict(BaseModel):
    """A model that knows all of its keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class BodyDesign(Strict):
    """A person: designs/bodies/NAME.yaml."""

    sex: Literal["female", "male"]
    age_years: Annotated[float, Field(ge=18, le=90, description="age")]
    stature_m: Annotated[float, Field(ge=1.2, le=2.2, description="standing height")]
    mass_kg: Annotated[float, Field(ge=25, le=250, description="body mass")]
    inertia: Annotated[
        Literal["mesh", "de_leva"],
        Field(description="segment inertia from the body's own surface or from de Leva 1996"),
    ] = "mesh"
    skin_vertices: Annotated[
        int, Field(ge=2000, le=100_000, description="vertices of the even skin mesh")
    ] = 14_000


class SeatAndBackrest(Strict):
    """A seat and a reclined backrest joined by a fillet, one slab of even thickness.

    Both may be dished: flat in the middle, raised at their sides.
    """

    shape: Literal["seat_and_backrest"]
    seat_depth_m: Annotated[Positive, Field(description="seat, from its front to the backrest")]
    backrest_height_m: Annotated[Positive, Field(description="backrest, along its slope")]
    width_m: Annotated[Positive, Field(description="seat and backrest, left to right")]
    recline_deg: Annotated[
        float, Field(ge=-10, le=85, description="backrest from the normal of the seat, backwards")
    ]
    fillet_radius_m: Annotated[
        Positive, Field(description="radius of the corner and of the front edge")
    ]
    thickness_m: Annotated[Positive, Field(description="thickness of the slab")]
    dish_depth_m: Annotated[
        float, Field(ge=0, le=0.2, description="rise of the sides over the middle")
    ]
    vertex_count: Annotated[int, Field(ge=500, le=500_000, description="vertices, about")]

    @property
    def recline_rad(self) -> float:
        """Backrest recline [rad]."""
        return radians(self.recline_deg)

    @model_validator(mode="after")
    def _fillets_fit(self):
        # The corner's fillet takes r·tan((90° − recline)/2) of the seat, the front edge another r.
        needed = self.fillet_radius_m * (1 + tan((pi / 2 - self.recline_rad) / 2))
        if needed >= min(self.seat_depth_m, self.backrest_height_m):
            raise ValueError(
                f"the fillets take {needed:.3f} m of seat_depth_m and backrest_height_m, "
                "which must be longer"
            )
        if self.thickness_m > self.fillet_radius_m:
            raise ValueError("thickness_m must not exceed fillet_radius_m")
        return self


class MeshSurface(Strict):
    """A surface from CAD (STL, OBJ, PLY …), resampled to an even vertex spacing."""

    shape: Literal["mesh"]
    file: Annotated[str, Field(description="path of the mesh, from the folder above designs/")]
    unit: Annotated[Literal["m", "cm", "mm"], Field(description="length unit of the file")]
    recline_deg: Annotated[
        float, Field(ge=-10, le=90, description="recline of the trunk that the mesh supports")
    ]
    vertex_count: Annotated[int, Field(ge=500, le=500_000, description="vertices, about")]

    @property
    def recline_rad(self) -> float:
        """Trunk recline [rad]."""
        return radians(self.recline_deg)


class Keyframe(Strict):
    """Where the device stands at a time."""

    time_s: Annotated[NotNegative, Field(description="time after settling")]
    translation_m: Annotated[Finite, Field(description="along translation_axis")]
    rotation_deg: Annotated[Finite, Field(description="about rotation_axis")]


class MotionProgram(Strict):
    """The two degrees of freedom of the robotic lift, from keyframe to keyframe."""

    translation_axis: Annotated[Vector, Field(description="direction in the world")]
    rotation_axis: Annotated[Vector, Field(description="direction in the world")]
    rotation_point_m: Annotated[Vector, Field(description="a point of the axis, device frame")]
    keyframes: Annotated[tuple[Keyframe, ...], Field(min_length=2)]

    @model_validator(mode="after")
    def _in_order(self):
        times = [keyframe.time_s for keyframe in self.keyframes]
        if times[0] != 0 or any(b <= a for a, b in itertools.pairwise(times)):
            raise ValueError("keyframes must start at time_s 0 and rise in time")
        for name in ("translation_axis", "rotation_axis"):
            if not any(getattr(self, name)):
                raise ValueError(f"{name} must not be zero")
        return self


class RoboticLift(Strict):
    """A rigid support moved in two degrees of freedom: designs/devices/NAME.yaml."""

    kind: Literal["robotic_lift"]
    support_angle_deg: Annotated[
        float, Field(ge=-30, le=60, description="inclination of the whole support, front edge up")
    ]
    surface: Annotated[SeatAndBackrest | MeshSurface, Field(discriminator="shape")]
    motion: MotionProgram

    @property
    def support_angle_rad(self) -> float:
        """Inclination of the whole support [rad]."""
        return radians(self.support_angle_deg)


DeviceDesign = RoboticLift


class Placement(Strict):
    """Where the body starts: it is moved from a start point along each direction until it touches.

    Without `approach` the body stays at the start point, and a penetration beyond the
    method's limit is refused.
    """

    pelvis_m: Annotated[Vector, Field(description="pelvis joint at the start, device frame")]
    approach: Annotated[
        tuple[Vector, ...], Field(description="directions in the device frame, one after another")
    ] = ()


Degrees = Annotated[float, Field(ge=-180, le=180)]


class Posture(Strict):
    """Joint angles from the anatomical zero, upright on the device: designs/postures/NAME.yaml.

    The trunk is tilted back by the recline of the device, and the hips opened by as much.
    """

    placement: Placement
    angles_deg: Annotated[
        dict[str, dict[str, Degrees]],
        Field(description="joint → angle → degrees; a joint without a side means both sides"),
    ]


class JointGains(Strict):
    """Proportional–derivative gains of one kind of joint (Eq. 2)."""

    stiffness_nm_per_rad: NotNegative
    damping_nms_per_rad: NotNegative


class Joints(Strict):
    """Gains by joint; left and right are alike."""

    lumbar: JointGains
    thoracic: JointGains
    neck: JointGains
    shoulder: JointGains
    elbow: JointGains
    wrist: JointGains
    hip: JointGains
    knee: JointGains
    ankle: JointGains
    toe: JointGains


class PenaltyContact(Strict):
    """Penalty and regularised friction, one spring per device vertex (Eqs. 6 and 7)."""

    stiffness_n_per_m: Annotated[Positive, Field(description="k_contact, per device vertex")]
    damping_ns_per_m: Annotated[NotNegative, Field(description="normal damping, per contact")]
    friction_force_n: Annotated[NotNegative, Field(description="F_c, per contact")]
    friction_velocity_m_per_s: Annotated[Positive, Field(description="threshold ε")]
    search_radius_m: Annotated[
        float, Field(ge=0.02, le=0.2, description="device vertices farther from the skin are free")
    ]
    initial_penetration_limit_m: Annotated[
        Positive, Field(description="a deeper start is refused")
    ]


class Settling(Strict):
    """The time before the device moves, in which the body comes to rest on it."""

    duration_min_s: NotNegative
    duration_max_s: Positive
    rest_speed_m_per_s: Annotated[
        Positive, Field(description="root mean square speed of the body's mass, called rest")
    ]

    @model_validator(mode="after")
    def _in_order(self):
        if self.duration_min_s > self.duration_max_s:
            raise ValueError("duration_min_s must not exceed duration_max_s")
        return self


class Method(Strict):
    """How a candidate is simulated: designs/methods/NAME.yaml."""

    integrator: Literal["rk4"]
    time_step_s: Annotated[float, Field(gt=0, le=0.02)]
    record_rate_hz: Annotated[float, Field(ge=1, le=1000)]
    hold_s: Annotated[NotNegative, Field(description="time simulated after the last keyframe")]
    stop_after_fall_s: Annotated[
        NotNegative, Field(description="time simulated after the body has fallen")
    ]
    settling: Settling
    joints: Joints
    contact: PenaltyContact


class Design(Strict):
    """Everything that decides the outcome of one candidate."""

    device: DeviceDesign
    body: BodyDesign
    posture: Posture
    method: Method
