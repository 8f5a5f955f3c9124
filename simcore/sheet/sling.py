"""A sling lift's design → the sheet as it lies under the body, hung and ready to simulate."""

from dataclasses import dataclass

import numpy as np

from simcore.config.designs import Method, SheetPenalty
from simcore.config.sling_lift import Bed, SlingLift
from simcore.errors import DesignError
from simcore.sheet.bed import BedContact, springy_bed
from simcore.sheet.explicit import ExplicitSolver
from simcore.sheet.hanging import BarState, build_straps, check_reach
from simcore.sheet.liu import LiuSolver
from simcore.sheet.net import Net, build_net
from simcore.sheet.solver import SheetSolver, SheetState, lay_flat, make_sheet

SHEAR_SHARE = 1 / 3
"""Stiffness of a mattress along its surface over that across it.

# ASSUME: as of what is incompressible; of foam it is nearer to 0.4.
"""

CLEARANCE = 5e-4
"""Height of the sheet over the bed at the start [m]: half of what a placed body leaves."""


@dataclass(frozen=True, eq=False)
class Sling:
    """A sheet under a body.

    Attributes
    ----------
    solver : SheetSolver
        Holds the sheet, net and straps.
    start : SheetState
        Where the sheet lies at the start; copy it before use.
    law : SheetPenalty or None
        Contact of the sheet with skin and bed; none: the method's contact, and the bed's own.
    step : float
        Time between exchanges of forces with the body, the longest where steps are adaptive [s].
    bed : Bed
    """

    solver: SheetSolver
    start: SheetState
    law: SheetPenalty | None
    step: float
    bed: Bed


def build_sling(design: SlingLift, method: Method, pelvis_x: float, bar: BarState) -> Sling:
    """Return the sling of a design.

    Parameters
    ----------
    pelvis_x : float
        Of the pelvis joint in the world [m]: there lies `sheet.pelvis_x_m` of the sheet.
    bar : BarState
        Where the bar is at the start.

    Raises
    ------
    DesignError
        A sheet that cannot be cut, cannot be hung so, or a step that it cannot hold.
    """
    net = build_net(design.sheet)
    low, high = net.rest_position[:, 0].min(), net.rest_position[:, 0].max()
    if not low <= design.sheet.pelvis_x_m <= high:
        raise DesignError(
            f"device.sheet.pelvis_x_m: {design.sheet.pelvis_x_m:g} lies outside the sheet; "
            f"accepted: {low:g} to {high:g}"
        )
    straps = build_straps(net, design.hanging)
    start = lay_flat(net, np.array([pelvis_x - design.sheet.pelvis_x_m, 0.0, CLEARANCE]))
    check_reach(straps, start.position, bar)
    sheet = make_sheet(net, straps, bed=_bed_contact(net, design.bed, method.sheet.contact))
    if method.sheet.solver.kind == "explicit":
        solver = ExplicitSolver(sheet, method.sheet.solver.substep_s)
    else:
        solver = LiuSolver(sheet, method.sheet.step_s, method.sheet.solver.tolerance)
    return Sling(
        solver=solver,
        start=start,
        law=method.sheet.contact,
        step=method.sheet.step_s,
        bed=design.bed,
    )


def _bed_contact(net: Net, bed: Bed, law: SheetPenalty | None) -> BedContact:
    """Return the bed as the sheet meets it: its own law, or the paper's at each vertex."""
    stiffness = bed.pressure_stiffness_pa_per_m * net.vertex_area
    contact = springy_bed(
        bed.length_m / 2, bed.width_m / 2, stiffness, bed.damping_time_s,
        bed.friction_coefficient, SHEAR_SHARE * stiffness,
    )
    if law:
        contact.law.set_penalty(law)
    return contact
