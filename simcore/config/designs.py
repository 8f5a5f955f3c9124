"""The validated models of every design file: the single source of truth of all keys.

Devices have modules of their own. The JSON schemas under workflow/schemas and the key tables of
config/README.md are generated from these models (`simcore.config.reference`). Keys carry their
unit; angles are degrees in YAML and radians everywhere else (`Angle` fields are read through the
`*_rad` properties).
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from simcore.config.robotic_lift import RoboticLift
from simcore.config.sling_lift import SlingLift
from simcore.config.values import (
    Direction,
    Finite,
    NotNegative,
    Positive,
    Strict,
    Vector,
    Whole,
)
from simcore.config.yaml_file import read_yaml, shown, validate
from simcore.errors import DesignError

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


DEVICES = {"robotic_lift": RoboticLift, "sling_lift": SlingLift}
"""Kind of device → its model."""

DeviceDesign = Annotated[RoboticLift | SlingLift, Field(discriminator="kind")]


def read_device(path: Path) -> RoboticLift | SlingLift:
    """Return the validated device in a YAML file, of the kind that it says it is."""
    data = read_yaml(path)
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in DEVICES:
        told = f"is {kind}" if "kind" in data else "missing"
        raise DesignError(f"{shown(path)}: kind: {told}; accepted: {', '.join(DEVICES)}")
    return validate(DEVICES[kind], data, shown(path))


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
    """Gains by joint, left and right alike, and what the joints do by themselves."""

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
    passive: Annotated[
        Literal["none", "anatomical"],
        Field(description="moments of ligaments and muscles at rest, and ends of ranges (Eqs. J1 "
              "to J5), or none"),
    ] = "none"
    muscle_tone: Annotated[
        NotNegative, Field(description="factor on all springs to the posture; 0 is limp")
    ] = 1.0


class PenaltyContact(Strict):
    """Penalty and regularised friction, one spring per device vertex (Eqs. 6 and 7)."""

    law: Annotated[Literal["penalty"], Field(description="one spring a device vertex")]
    stiffness_n_per_m: Annotated[Positive, Field(description="k_contact, per device vertex")]
    damping_ns_per_m: Annotated[NotNegative, Field(description="normal damping, per contact")]
    friction_force_n: Annotated[NotNegative, Field(description="F_c, per contact")]
    friction_velocity_m_per_s: Annotated[Positive, Field(description="threshold ε")]
    search_radius_m: Annotated[
        Finite, Field(ge=0.02, le=0.2, description="device vertices farther from the skin are free")
    ]
    initial_penetration_limit_m: Annotated[Positive, Field(description="a deeper start is refused")]


class UniformFlesh(Strict):
    """The same flesh all over the body."""

    modulus_pa: Annotated[
        Positive, Field(description="E: pressure over strain, where it is small")
    ]
    thickness_m: Annotated[Positive, Field(description="less where a limb is thinner")]


class FoundationContact(Strict):
    """Pressure as a function of depth, and friction that sticks (Eqs. C1 and C2)."""

    law: Annotated[Literal["foundation"], Field(description="pressure over depth")]
    tissue: Annotated[
        Literal["linear", "stiffening"],
        Field(description="pressure E ε, or E ε/(1 − ε), at the strain ε of the flesh"),
    ]
    flesh: Annotated[
        UniformFlesh | None, Field(description="of all the body; none: that of each region")
    ] = None
    damping_time_s: Annotated[NotNegative, Field(description="damping over stiffness")]
    friction_coefficient: Annotated[NotNegative, Field(description="µ of skin and device")]
    initial_penetration_limit_m: Annotated[Positive, Field(description="a deeper start is refused")]


class SelfContact(Strict):
    """Penalty between parts of the body, each a capsule (Eq. 13)."""

    flesh_modulus_pa: Annotated[
        Positive, Field(description="stiffness of a pair over the thinner part's diameter")
    ]
    damping_time_s: Annotated[NotNegative, Field(description="damping over stiffness")]


class SheetPenalty(Strict):
    """The paper's contact at each sheet vertex (Eqs. 6 and 7): results change with the mesh.

    On a bed the sheet has the same; the bed's own stiffness and friction are for the skin.
    """

    law: Annotated[Literal["penalty"], Field(description="one spring a sheet vertex")]
    stiffness_n_per_m: Annotated[Positive, Field(description="k_contact, per sheet vertex")]
    damping_ns_per_m: Annotated[NotNegative, Field(description="normal damping, per contact")]
    friction_force_n: Annotated[NotNegative, Field(description="F_c, per contact")]
    friction_velocity_m_per_s: Annotated[Positive, Field(description="threshold ε")]


class ExplicitSheet(Strict):
    """Explicit sub-steps, contact implicit on the vertex."""

    kind: Annotated[Literal["explicit"], Field(description="sub-steps on the grid of the net")]
    substep_s: Annotated[
        Positive | None, Field(description="length of a sub-step; none: the longest that is safe")
    ] = None


class LiuSheet(Strict):
    """Backward Euler by local and global steps (Liu et al. 2013), the paper's method."""

    kind: Annotated[Literal["liu"], Field(description="local and global steps")]
    tolerance: Annotated[
        Finite, Field(gt=0, le=0.1, description="change of an iteration over that of the step")
    ]


class SheetMethod(Strict):
    """How a sheet is simulated."""

    step_s: Annotated[
        Finite,
        Field(gt=0, le=0.02, description="sheet and body exchange forces so often, a whole number "
              "of steps of the body; of adaptive ones, which have one each, the longest"),
    ]
    solver: Annotated[
        ExplicitSheet | LiuSheet, Field(discriminator="kind", description="what moves the sheet")
    ]
    contact: Annotated[
        SheetPenalty | None,
        Field(description="what skin and bed do to the sheet; none: as the method's contact"),
    ] = None


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


class AdaptiveStep(Strict):
    """Steps that are shorter where the body moves fast (Eqs. I3 and I4)."""

    longest_s: Annotated[
        Finite,
        Field(gt=0, le=0.02, description="step of a body at rest; in a sling sheet.step_s"),
    ]
    shortest_s: Annotated[
        Positive, Field(description="no step is shorter; all are multiples, longest_s too")
    ]
    motion_m: Annotated[
        Positive,
        Field(description="no skin that touches moves farther in a step; sideways twice, with rk4"),
    ]

    @model_validator(mode="after")
    def _multiples(self):
        if not _is_multiple(self.longest_s, self.shortest_s):
            raise ValueError(
                f"shortest_s is {self.shortest_s:g}; accepted: longest_s, {self.longest_s:g}, or "
                "a whole part of it"
            )
        return self


class Method(Strict):
    """How a candidate is simulated: designs/methods/NAME.yaml."""

    integrator: Annotated[
        Literal["rk4", "implicit"],
        Field(description="explicit Runge–Kutta of order 4, or the linearly implicit midpoint"),
    ]
    time_step_s: Annotated[
        Annotated[Finite, Field(gt=0, le=0.02)] | None,
        Field(description="step of the integrator; none: adaptive_step"),
    ] = None
    adaptive_step: Annotated[
        AdaptiveStep | None,
        Field(description="steps as long as the motion allows; none: time_step_s"),
    ] = None
    record_rate_hz: Annotated[
        Finite, Field(ge=1, le=1000, description="frames kept of each simulated second")
    ]
    sensor_pitch_m: Annotated[
        Finite, Field(ge=0.005, le=0.1, description="edge of the cells that pressure is told over")
    ] = 0.025
    hold_s: Annotated[NotNegative, Field(description="time simulated after the last keyframe")]
    stop_after_fall_s: Annotated[
        NotNegative, Field(description="time simulated after the body has fallen")
    ]
    settling: Annotated[Settling, Field(description="the time before the device moves")]
    joints: Annotated[Joints, Field(description="gains of the joints")]
    contact: Annotated[
        FoundationContact | PenaltyContact,
        Field(discriminator="law", description="contact of skin and device"),
    ]
    self_contact: Annotated[
        SelfContact | None, Field(description="contact of body parts; none: they pass through")
    ] = None
    sheet: Annotated[
        SheetMethod | None, Field(description="the sheet of a sling lift; none: no sling lift")
    ] = None

    @model_validator(mode="after")
    def _laws_fit(self):
        if (self.contact.law == "foundation") != (self.integrator == "implicit"):
            raise ValueError(
                f"integrator is {self.integrator}; accepted: implicit with contact.law foundation, "
                "rk4 with penalty"
            )
        if self.sheet and not self.sheet.contact and self.contact.law == "penalty":
            raise ValueError("sheet.contact is missing; accepted: a law, as contact is penalty")
        return self

    @model_validator(mode="after")
    def _steps_fit(self):
        if (self.time_step_s is None) == (self.adaptive_step is None):
            told = "both are given" if self.adaptive_step else "neither is given"
            raise ValueError(f"time_step_s, adaptive_step: {told}; accepted: one of them")
        if not self.sheet:
            return self
        adaptive = self.adaptive_step
        name, step = (
            ("adaptive_step.shortest_s", adaptive.shortest_s) if adaptive
            else ("time_step_s", self.time_step_s)
        )
        if not _is_multiple(self.sheet.step_s, step):
            raise ValueError(
                f"sheet.step_s is {self.sheet.step_s:g}; accepted: a whole number of "
                f"{name}, {step:g}"
            )
        if adaptive and self.sheet.solver.kind != "explicit":
            raise ValueError(
                f"sheet.solver.kind is {self.sheet.solver.kind}; accepted: explicit, or "
                "time_step_s instead of adaptive_step"
            )
        return self


def _is_multiple(step: float, part: float) -> bool:
    """Return whether a step is a whole number of parts, but for rounding."""
    count = step / part
    return round(count) >= 1 and abs(count - round(count)) < 1e-6


class Design(Strict):
    """Everything that decides the outcome of one candidate."""

    device: DeviceDesign
    body: BodyDesign
    posture: Posture
    method: Method

    @model_validator(mode="after")
    def _sheet_has_a_method(self):
        if isinstance(self.device, SlingLift) and self.method.sheet is None:
            raise ValueError("method.sheet is missing; accepted: a method that has one")
        return self
