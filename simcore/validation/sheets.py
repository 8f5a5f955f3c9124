"""The sheet alone: its sag, its momenta, and its implicit step."""

from dataclasses import replace
from math import cosh, sinh

import numpy as np
from scipy.optimize import brentq

from simcore.config.sling_lift import SheetDesign, UShapeOutline
from simcore.sheet import STILL_BAR, ExplicitSolver, Sheet, SheetState, build_net, lay_flat
from simcore.sheet.solver import GRAVITY
from simcore.validation.energy import Accounts, energy_criterion
from simcore.validation.newton import FABRIC, PAPER, hanging_sheet, step_errors
from simcore.validation.sheet_scenes import SUBSTEP, fabric, free_sheet, rectangular, untouched
from simcore.validation.table import Check, Criterion, Curve, Measurement, Plot

LENGTH, SPAN = 2.0, 1.6
"""Of the hanging strip [m]."""

MEMBRANE_LOAD = 600.0
"""Weight per area of the membrane [N/m²]."""

MEMBRANE_COUNTS = (1000, 4000, 16000)

STEP = 4e-3
"""After which the heat of moving sheets is looked at [s]."""


def catenary_parameter() -> float:
    """Return a [m] of the catenary: 2 a sinh(l/2a) = L."""
    return brentq(lambda a: 2 * a * sinh(SPAN / 2 / a) - LENGTH, 0.1, 10)


def hang_strip() -> tuple[SheetState, float]:
    """Return a strip held at both ends, at rest, and the residual of its energy (Eq. E6)."""
    net = build_net(rectangular(LENGTH, 0.1, fabric(1e5, 10.0), 400))
    ends = np.isin(net.rest_position[:, 0], [0.0, net.rest_position[:, 0].max()])
    sheet = replace(free_sheet(net, ends), drag_rate=8.0)
    x, y = net.rest_position.T
    depth = np.sqrt(LENGTH**2 - SPAN**2) / 2
    vee = np.column_stack([x * SPAN / LENGTH, y, -depth * (1 - np.abs(2 * x / LENGTH - 1))])
    state = SheetState(vee, np.zeros_like(vee))
    return state, _let_go(sheet, state, 4.0)


def _let_go(sheet: Sheet, state: SheetState, duration: float) -> float:
    """Advance a sheet by a duration [s]; return the residual of its energy (Eq. E6)."""
    contact = untouched(sheet)
    accounts = Accounts(ExplicitSolver(sheet, SUBSTEP), state, contact, STILL_BAR)
    for _ in range(round(duration / STEP)):
        accounts.advance(state, STEP, contact, STILL_BAR)
    return accounts.residual


def measure_catenary() -> Measurement:
    """Hang a strip of length L over a span l: its sag is a (cosh(l/2a) − 1)."""
    (state, residual), a = hang_strip(), catenary_parameter()
    exact = a * (cosh(SPAN / 2 / a) - 1)
    x = np.linspace(0, SPAN, 101)
    curve = a * (np.cosh((x - SPAN / 2) / a) - cosh(SPAN / 2 / a))
    middle = np.abs(state.position[:, 1]) < 0.02
    plot = Plot(
        "validation_catenary", "A strip of 2 m between points 1.6 m apart", "x [m]", "z [m]",
        (Curve("catenary", x, curve),
         Curve("sheet", state.position[middle, 0], state.position[middle, 2], marked=True)),
    )
    sag = -state.position[:, 2].min() / exact
    return Measurement({"catenary_sag": sag, "catenary_energy": residual}, (plot,))


def membrane_sags() -> tuple[list[float], float, float]:
    """Return the sags [m] of 1 m² held on all edges, by mesh, and of all the greatest speed left.

    Last comes the greatest residual of their energies (Eq. E6).
    """
    sags, speeds, residuals = [], [], []
    for count in MEMBRANE_COUNTS:
        net = build_net(rectangular(1.0, 1.0, fabric(density=MEMBRANE_LOAD / GRAVITY), count))
        sheet = replace(free_sheet(net, pinned=net.on_edge), drag_rate=30.0)
        state = lay_flat(net, np.zeros(3))
        residuals.append(_let_go(sheet, state, 1.2))
        sags.append(-state.position[:, 2].min())
        speeds.append(np.abs(state.velocity).max())
    return sags, max(speeds), max(residuals)


def measure_sag() -> Measurement:
    """Compare the sags of a membrane of 1,000 and 4,000 vertices with that of 16,000."""
    sags, _, residual = membrane_sags()
    return Measurement({
        "sheet_mesh": max(abs(sag / sags[-1] - 1) for sag in sags), "membrane_energy": residual,
    })


def shake(precision: type) -> tuple[float, float]:
    """Return what a sheet that waves and spins in free space loses in 0.1 s.

    The greatest change of its momenta, linear and angular about the origin, by components, over
    its inertia [m/s, m²/s]; and the residual of its energy. The waves are long enough for
    dashpots that are told at the ends of steps.
    """
    outline = UShapeOutline(
        shape="u_shape", length_m=1.3, width_m=0.8, leg_length_m=0.5, gap_width_m=0.3
    )
    net = build_net(
        SheetDesign(outline=outline, material=fabric(), vertex_count=800, pelvis_x_m=0.5)
    )
    sheet = replace(free_sheet(net), gravity=np.zeros(3), drag_rate=0.0)
    solver = ExplicitSolver(sheet, precision=precision)
    state = lay_flat(net, np.array([0.3, -0.2, 0.1]))
    state.velocity += np.cross(SPIN, state.position) + WAVE * np.sin(state.position @ WAVES)

    def momenta():
        p = solver.inertia.momenta(state.velocity)
        return np.concatenate([p.sum(axis=0), np.cross(state.position, p).sum(axis=0)])

    before = momenta()
    accounts = Accounts(solver, state, untouched(sheet), STILL_BAR)
    for _ in range(round(0.1 / SHAKE_STEP)):
        accounts.advance(state, SHAKE_STEP, untouched(sheet), STILL_BAR)
    return np.abs(momenta() - before).max() / solver.inertia.local.sum(), accounts.residual


def measure_momentum() -> Measurement:
    """Let a sheet wave and spin in free space."""
    exact, _ = shake(np.float64)
    momentum, residual = shake(np.float32)
    return Measurement({
        "sheet_momentum": exact, "sheet_momentum_single": momentum,
        "sheet_momentum_energy": residual,
    })


def measure_newton() -> Measurement:
    """Take four backward Euler steps with the local/global iteration and with Newton's method."""
    errors = [max(step_errors(hanging_sheet(material))[0]) for material in (PAPER, FABRIC)]
    return Measurement({"sheet_newton": max(errors)})


SHAKE_STEP = 1e-4
"""Between two looks at the dashpots [s]: fabric rings within milliseconds."""

SPIN = np.array([1.0, -2.0, 3.0])
"""[rad/s]"""

WAVE, WAVES = np.array([0, 0, 0.5]), np.array([[5.0, 2.0, 4.0], [3.0, 4.0, 4.0], [0, 0, 0]])
"""Speed of the waves by component [m/s], and how many radians a metre along x and y has [rad/m]:
out of the plane, for waves within it ring faster than any outer step."""

CHECKS = (
    Check(
        (Criterion("catenary_sag", "sag of a hanging strip over that of the catenary",
                   0.98, 1.02, "", "closed form"),
         energy_criterion("catenary", "the strip as it comes to rest")),
        measure_catenary,
    ),
    Check(
        (Criterion("sheet_mesh", "sag of a membrane with 1,000 or 4,000 vertices against 16,000, "
                   "relative", 0.0, 0.02, "", "independence of the mesh"),
         energy_criterion("membrane", "the membranes as they come to rest, greatest of three")),
        measure_sag,
    ),
    Check(
        (Criterion("sheet_momentum", "change of linear and angular momentum of a free sheet in "
                   "0.1 s, over its inertia, in double precision", 0.0, 1e-12, "m/s, m²/s",
                   "conservation, to rounding"),
         Criterion("sheet_momentum_single", "the same in single precision, as sheets are "
                   "simulated", 0.0, 1e-6, "m/s, m²/s", "conservation, to rounding"),
         energy_criterion("sheet_momentum", "the same sheet, which waves and spins")),
        measure_momentum,
    ),
    Check(
        (Criterion("sheet_newton", "backward Euler step by local/global iteration against "
                   "Newton's method, relative to the step", 0.0, 1e-4, "",
                   "one equation, one solution (Liu et al. 2013)"),),
        measure_newton,
    ),
)
