"""The validated models of every design file: the single source of truth of all keys.

The JSON schemas under workflow/schemas and the key tables of config/README.md are generated
from these models (`simcore.config.reference`). Keys carry their unit; angles are degrees in
YAML and radians everywhere else (`Angle` fields are read through the `*_rad` properties).
"""

import itertools
from math import pi, radians, tan
from typing import Annotated, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError


def _not_bool_or_text(value: object) -> object:
    if isinstance(value, bool | str):
        raise PydanticCustomError("whole_number_type", "not a whole number")
    return value


def _not_zero(vector: tuple) -> tuple:
    if not any(vector):
        raise ValueError("is [0, 0, 0]; accepted: a direction")
    return vector


# A quoted number, `yes` and `true` are mistakes, not numbers; 5.0, as in a range, is a whole one.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0)]
NotNegative = Annotated[Finite, Field(ge=0)]
Whole = BeforeValidator(_not_bool_or_text)
Vector = tuple[Finite, Finite, Finite]
Direction = Annotated[Vector, AfterValidator(_not_zero)]

TRUNK_ANGLES = ("flexion", "lateral_bend", "rotation")
LIMB_ANGLES = ("flexion", "abduction", "rotation")
JOINT_ANGLES = {
    "lumbar": TRUNK_ANGLES,
    "thoracic": TRUNK_ANGLES,
    "neck": ("flexion",),
    "shoulder": LIMB_ANGLES,
    "elbow": ("flexion", "abduction", "pronation"),
    "wrist": ("flexion", "deviation", "pronation"),
    "hip": LIMB_ANGLES,
    "knee": ("flexion",),
    "ankle": ("dorsiflexion", "inversion", "rotation"),
    "toe": ("extension",),
}
"""Joint → its angles; `simcore.body.posture` says what each one turns."""

PAIRED_JOINTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe")
"""Joints with a left and a right."""


class Strict(BaseModel):
    """A model that knows all of its keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class BodyDesign(Strict):
    """A person: designs/bodies/NAME.yaml."""

    sex: Annotated[Literal["female", "male"], Field(description="which of the two body shapes")]
    age_years: Annotated[Finite, Field(ge=18, le=90, description="age")]
    stature_m: Annotated[
        Finite,
        Field(ge=1.2, le=2.2, description="standing height; the range depends on sex and age"),
    ]
    mass_kg: Annotated[
        Finite, Field(ge=25, le=250, description="body mass; the range depends on the stature")
    ]
    inertia: Annotated[
        Literal["mesh", "de_leva"],
        Field(description="segment inertia from the body's own surface or from de Leva 1996"),
    ] = "mesh"
    skin_vertices: Annotated[
        int, Field(ge=2000, le=100_000, description="vertices of the even skin mesh, about"), Whole
    ] = 14_000


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


class Keyframe(Strict):
    """Where the device stands at a time."""

    time_s: Annotated[NotNegative, Field(description="time after settling")]
    translation_m: Annotated[Finite, Field(description="along translation_axis")]
    rotation_deg: Annotated[Finite, Field(description="about rotation_axis")]


class MotionProgram(Strict):
    """The two degrees of freedom of the robotic lift, from keyframe to keyframe."""

    translation_axis: Annotated[Direction, Field(description="direction in the world")]
    rotation_axis: Annotated[Direction, Field(description="direction in the world")]
    rotation_point_m: Annotated[Vector, Field(description="a point of the axis, device frame")]
    keyframes: Annotated[
        tuple[Keyframe, ...],
        Field(min_length=2, description="places the device passes, at rest in each"),
    ]

    @model_validator(mode="after")
    def _in_order(self):
        times = [keyframe.time_s for keyframe in self.keyframes]
        if times[0] != 0 or any(b <= a for a, b in itertools.pairwise(times)):
            raise ValueError("keyframes must start at time_s 0 and rise in time")
        return self


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
        tuple[Direction, ...],
        Field(description="directions in the device frame, one after another"),
    ] = ()


Degrees = Annotated[Finite, Field(ge=-180, le=180)]


class Posture(Strict):
    """Joint angles from the anatomical zero, upright on the device: designs/postures/NAME.yaml.

    The trunk is tilted back by the recline of the device, and the hips opened by as much.
    """

    placement: Annotated[Placement, Field(description="where the body starts")]
    angles_deg: Annotated[
        dict[str, dict[str, Degrees]],
        Field(description="joint → angle → degrees; a joint without a side means both sides"),
    ]

    @field_validator("angles_deg")
    @classmethod
    def _joints_are_known(cls, angles):
        for joint, named in angles.items():
            kind = joint.removesuffix("_left").removesuffix("_right")
            if kind not in JOINT_ANGLES or (joint != kind and kind not in PAIRED_JOINTS):
                raise ValueError(
                    f"unknown joint {joint}; accepted: {', '.join(JOINT_ANGLES)}, and with _left "
                    f"or _right: {', '.join(PAIRED_JOINTS)}"
                )
            if joint != kind != "hip" and kind in angles:
                raise ValueError(f"{kind} is given with and without its side; accepted: one way")
            for angle in named:
                if angle not in JOINT_ANGLES[kind]:
                    raise ValueError(
                        f"{joint} has no angle {angle}; accepted: {', '.join(JOINT_ANGLES[kind])}"
                    )
        return angles


class JointGains(Strict):
    """Proportional–derivative gains of one kind of joint (Eq. 2)."""

    stiffness_nm_per_rad: Annotated[NotNegative, Field(description="spring to the posture")]
    damping_nms_per_rad: Annotated[NotNegative, Field(description="damping of the joint's turn")]


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
        Finite, Field(ge=0.02, le=0.2, description="device vertices farther from the skin are free")
    ]
    initial_penetration_limit_m: Annotated[Positive, Field(description="a deeper start is refused")]


class Settling(Strict):
    """The time before the device moves, in which the body comes to rest on it."""

    duration_min_s: Annotated[NotNegative, Field(description="settles at least so long")]
    duration_max_s: Annotated[Positive, Field(description="settles at most so long, rest or not")]
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

    integrator: Annotated[Literal["rk4"], Field(description="explicit Runge–Kutta of order 4")]
    time_step_s: Annotated[Finite, Field(gt=0, le=0.02, description="step of the integrator")]
    record_rate_hz: Annotated[
        Finite, Field(ge=1, le=1000, description="frames kept of each simulated second")
    ]
    hold_s: Annotated[NotNegative, Field(description="time simulated after the last keyframe")]
    stop_after_fall_s: Annotated[
        NotNegative, Field(description="time simulated after the body has fallen")
    ]
    settling: Annotated[Settling, Field(description="the time before the device moves")]
    joints: Annotated[Joints, Field(description="gains of the joints")]
    contact: Annotated[PenaltyContact, Field(description="contact of skin and device")]


class Design(Strict):
    """Everything that decides the outcome of one candidate."""

    device: DeviceDesign
    body: BodyDesign
    posture: Posture
    method: Method
