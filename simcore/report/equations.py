"""Dataset → the equations that were computed, as the study's method and devices need them."""

import xarray as xr

from simcore.body.tissue import STRAIN_MAX
from simcore.dynamics.implicit import IMPLICITNESS
from simcore.recorder import FALL_DISPLACEMENT
from simcore.report.physics import VARIED, device_kinds, devices_of, first_design, varied_paths

Equation = tuple[str, str, str]
"""Part, number, what is computed."""

STEP_EQUATIONS = {
    "rk4": (
        ("Forward dynamics", "Eq. 1",
         "articulated-body algorithm, 47 degrees of freedom; Runge–Kutta steps of fourth order"),
    ),
    "implicit": (
        ("Forward dynamics", "Eq. 1",
         "mass matrix by the composite-rigid-body algorithm, 47 degrees of freedom"),
        ("Steps", "Eqs. I1, I2",
         "linearly implicit midpoint: stiffness and damping of joints and contact act after "
         f"{IMPLICITNESS:g} of the step"),
    ),
}

JOINT_EQUATIONS = (
    ("Joints", "Eq. 2", "proportional–derivative torques towards the starting posture"),
)

PASSIVE_EQUATION = (
    "Passive joints", "Eqs. J1–J5", "moments of ligaments and muscles at rest, ends of the ranges",
)

SKIN_EQUATIONS = (
    ("Skin", "Eq. 3", "linear blend skinning of the surface by 18 segments"),
    ("Contact on to joints", "Eqs. 8–12", "transpose of the skin's Jacobian"),
)

SELF_CONTACT_EQUATION = (
    "Contact of body parts", "Eq. 13", "penalty between capsules that stand for the segments",
)

LIFT_EQUATIONS = {
    "penalty": (
        ("Normal contact", "Eq. 6", "penalty from each device vertex to its nearest skin vertex"),
        ("Friction", "Eq. 7", "regularised, opposite to the sliding velocity"),
    ),
    "foundation": (
        ("Shape of the device", "Eqs. D1–D3",
         "signed distance by look-up on a grid, with matter behind the carrying side"),
        ("Normal contact", "Eq. C1", "pressure over depth on the area of each skin vertex"),
        ("Friction", "Eq. C2", "sticks by a spring that shears with the flesh, slides at µ N"),
    ),
}

LIFT_FALL = (
    "Fall", "", f"the centre of mass is {FALL_DISPLACEMENT:g} m from its place on the device",
)

BED_EQUATIONS = (
    ("Body on the bed", "Eq. C3", "flesh in series with the mattress, friction that sticks"),
)

SHEET_EQUATIONS = (
    ("Motion of the sheet", "Eq. 4", "a mass at each vertex of a net; weight and drag"),
    ("Springs of the sheet", "Eqs. 5, S1",
     "along the sides and diagonals of the net's cells, and over two cells against bending"),
)

MATERIAL_EQUATIONS = {
    "fabric": (
        ("Fabric", "Eq. S2", "springs of an isotropic fabric, whatever the spacing of the net"),
        ("Buckling", "Eq. S3", "a spring that is compressed gives way"),
    ),
    "paper": (("Material", "Eq. S2", "not used: every spring has the one stiffness given"),),
}

HANGING_EQUATIONS = (
    ("Straps", "Eq. S4", "springs and dampers that only pull, from a patch of the sheet to a hook"),
)

SHEET_CONTACT_EQUATIONS = {
    "foundation": (
        ("Sheet on the body", "Eq. S5", "pressure over depth, implicit on each vertex"),
        ("Friction of the sheet", "Eq. S6", "sticks by a spring to an anchor, slides at µ N"),
        ("Sheet on the bed", "Eqs. S5, S6", "springs of the mattress, friction that sticks"),
    ),
    "penalty": (
        ("Sheet on body and bed", "Eqs. 6, S5", "one spring a vertex, implicit on each vertex"),
        ("Friction of the sheet", "Eqs. 7, S7", "regularised, does not depend on the pressure"),
    ),
}

GIVEN_BACK = (
    "Exchange of forces", "Eqs. S13, S15",
    "what an implicit step of the body does not take is given back to the sheet",
)

FLESH = {
    "linear": "pressure in proportion to the strain",
    "stiffening": f"stiffens with the strain, linear beyond one of {STRAIN_MAX:g}",
    VARIED: "linear, or stiffening with the strain: varied in this study",
}

SOLVER_EQUATIONS = {
    "explicit": (
        ("Solver of the sheet", "Eqs. S8, S14",
         "semi-implicit sub-steps; inertia is added where they need it, not to the whole"),
    ),
    "liu": (
        ("Solver of the sheet", "Eqs. S9–S11",
         "backward Euler by local and global steps, accelerated"),
    ),
}

SLING_FALL = (
    "Fall", "", f"pelvis or chest is {FALL_DISPLACEMENT:g} m from its place on the sheet",
)

PRESSURE_EQUATIONS = (
    ("Pressure on the skin", "Eq. P1", "force over area, averaged over the cells of a sensor"),
    ("Shear on the skin", "Eq. P3", "the same of tangential forces, averaged as vectors"),
    ("Sensor mat", "Eq. P2", "force over area of square cells on what carries the body"),
)

KIND_TITLES = {"robotic_lift": "robotic lift", "sling_lift": "sling lift"}


def equations_of(ds: xr.Dataset) -> list[Equation]:
    """Return part, equation and what is computed: those that the study's designs need."""
    method, kinds, varied = first_design(ds).get("method", {}), device_kinds(ds), varied_paths(ds)
    parts = [*STEP_EQUATIONS[method.get("integrator", "rk4")], *JOINT_EQUATIONS]
    if "method.joints.passive" in varied:
        part, number, what = PASSIVE_EQUATION
        parts.append((part, number, f"{what}, or none: {VARIED}"))
    elif method.get("joints", {}).get("passive") == "anatomical":
        parts.append(PASSIVE_EQUATION)
    parts += SKIN_EQUATIONS
    if method.get("self_contact"):
        parts.append(SELF_CONTACT_EQUATION)
    for kind in kinds:
        sling = kind == "sling_lift"
        its = _sling_equations(ds, method, varied) if sling else _lift_equations(method, varied)
        of = f" ({KIND_TITLES[kind]})" if len(kinds) > 1 else ""
        parts += [(part + of, equation, what) for part, equation, what in its]
    return [*parts, *PRESSURE_EQUATIONS]


def _lift_equations(method: dict, varied: set[str]) -> list[Equation]:
    law = method["contact"].get("law", "penalty")
    flesh = [_flesh("Eq. C1", method, varied)] if law == "foundation" else []
    return [*LIFT_EQUATIONS[law], *flesh, LIFT_FALL]


def _sling_equations(ds: xr.Dataset, method: dict, varied: set[str]) -> list[Equation]:
    """Return the equations of a sling lift with the material, solver and contact law it has."""
    materials = dict.fromkeys(
        device["sheet"]["material"]["kind"]
        for device in devices_of(ds).values() if device["kind"] == "sling_lift"
    )
    sheet = method["sheet"]
    own_law = sheet.get("contact")
    return [
        *BED_EQUATIONS,
        *SHEET_EQUATIONS,
        *(part for material in materials for part in MATERIAL_EQUATIONS[material]),
        *HANGING_EQUATIONS,
        *SHEET_CONTACT_EQUATIONS[own_law["law"] if own_law else "foundation"],
        *([] if own_law else [_flesh("Eq. S12", method, varied)]),
        *([GIVEN_BACK] if method["integrator"] == "implicit" else []),
        *SOLVER_EQUATIONS[sheet["solver"]["kind"]],
        SLING_FALL,
    ]


def _flesh(number: str, method: dict, varied: set[str]) -> Equation:
    contact = method["contact"]
    tissue = VARIED if "method.contact.tissue" in varied else contact["tissue"]
    where = "alike all over the body" if contact.get("flesh") else "its values by body region"
    return "Flesh", number, f"{FLESH[tissue]}; {where}"
