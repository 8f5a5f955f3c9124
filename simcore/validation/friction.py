"""Friction that sticks (Eq. S6): on an incline, and around a cylinder."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, exp, pi, sin, tan

import numpy as np

from simcore.config.sling_lift import EdgeAttachment, HangingDesign
from simcore.sheet import (
    STILL_BAR,
    ExplicitSolver,
    Sheet,
    SheetSolver,
    SheetState,
    build_net,
    build_straps,
    lay_flat,
    make_sheet,
)
from simcore.sheet.solver import GRAVITY
from simcore.validation.energy import Accounts, energy_criterion
from simcore.validation.incline import (
    CREEP_ANGLE,
    CREEP_TIME,
    INCLINE_FRICTION,
    ONSET,
    STUCK,
    measure_onset,
)
from simcore.validation.sheet_scenes import (
    FOUNDATION,
    HEAVY,
    SUBSTEP,
    fabric,
    heavy_square,
    plane,
    rectangular,
)
from simcore.validation.table import Check, Criterion, Curve, Measurement, Plot

CAPSTAN_FRICTION = 0.3

SLIDE_TIME, SLIDE_STEP = 0.8, 2e-3
"""A sheet is let go on an incline for so long [s], in outer steps of [s]."""

CREEP_STEP = 0.05
"""An outer step [s]."""

RADIUS, STRAIGHT, BAR = 0.15, 0.2, -0.3
"""Of the cylinder, of either end that hangs down, and height of the straps' bar [m]."""

PULL = 0.1
"""[m/s]"""


def on_incline(angle: float, count: int = 225) -> tuple[Sheet, SheetState]:
    """Return a heavy square on an incline [rad], as deep in it as its weight presses it.

    The incline is z = 0, and x leads downhill.
    """
    tilted = np.array([GRAVITY * sin(angle), 0.0, -GRAVITY * cos(angle)])
    sheet = replace(heavy_square(count), gravity=tilted, drag_rate=0.0)
    depth = HEAVY * GRAVITY * cos(angle) / FOUNDATION
    return sheet, lay_flat(sheet.net, np.array([0, 0, -depth]))


@dataclass(frozen=True, eq=False)
class Slide:
    """A sheet on an incline: time (n,) [s], and mean way (n,) [m] and speed (n,) [m/s] downhill.

    `residual` is that of its energy (Eq. E6).
    """

    time: np.ndarray
    way: np.ndarray
    speed: np.ndarray
    residual: float

    @property
    def acceleration(self) -> float:
        """Of the second half [m/s²]; zero once it sticks.

        Let go with slack anchors the sheet gets some speed even where it then comes to rest.
        """
        half = len(self.time) // 2
        if abs(self.speed[-1]) < STUCK:
            return 0.0
        return (self.speed[-1] - self.speed[half]) / (self.time[-1] - self.time[half])


def short_substeps(sheet: Sheet) -> ExplicitSolver:
    """Return the solver whose sub-steps need no added inertia of a heavy sheet."""
    return ExplicitSolver(sheet, SUBSTEP)


def slide(
    angle: float,
    make_solver: Callable[[Sheet], SheetSolver] = short_substeps,
    count: int = 225,
    duration: float = SLIDE_TIME,
    step: float = SLIDE_STEP,
) -> Slide:
    """Let a sheet of `count` vertices go on an incline of µ = INCLINE_FRICTION.

    Parameters
    ----------
    angle : float
        [rad]
    make_solver : callable
        Sheet → solver.
    duration, step : float
        Of all, and of one outer step [s].
    """
    sheet, state = on_incline(angle, count)
    contact = plane(sheet.net, friction=INCLINE_FRICTION)
    contact.anchor[:] = state.position
    accounts = Accounts(make_solver(sheet), state, contact, STILL_BAR)
    start, told = state.position[:, 0].mean(), []
    for _ in range(round(duration / step)):
        accounts.advance(state, step, contact, STILL_BAR)
        told.append((state.position[:, 0].mean() - start, state.velocity[:, 0].mean()))
    way, speed = np.array(told).T
    return Slide(step * np.arange(1, len(way) + 1), way, speed, accounts.residual)


def measure_slip() -> Measurement:
    """Find the incline at which a sheet lets go."""

    def let_go(angle: float) -> tuple[float, float]:
        told = slide(angle)
        return told.acceleration, told.residual

    return measure_onset("", "sheet", let_go)


def measure_creep() -> Measurement:
    """Leave a sheet on an incline that is nine tenths of the angle at which it lets go."""
    left = slide(CREEP_ANGLE, count=9, duration=CREEP_TIME, step=CREEP_STEP)
    return Measurement({"creep": 1e3 * left.way[-1], "creep_energy": left.residual})


@dataclass(frozen=True, eq=False)
class Capstan:
    """A strip that slides over a cylinder, as means over the time told.

    Attributes
    ----------
    slack, taut : float
        Tension of its ends [N].
    turn, tension : (n,) float64
        Where rows of vertices touch the cylinder, from the slack end [rad], and the tension there:
        that of the slack end and the friction of all rows up to the middle of this one [N].
    residual : float
        Of the energy, the start included (Eq. E6).
    """

    slack: float
    taut: float
    turn: np.ndarray
    tension: np.ndarray
    residual: float


def strip_over_cylinder() -> tuple[Sheet, SheetState]:
    """Return a strip laid over the upper half of a cylinder about y, with a strap at each end."""
    half, length = 0.03, 2 * STRAIGHT + pi * RADIUS
    net = build_net(rectangular(length, 2 * half, fabric(), 300))
    ends = tuple(
        EdgeAttachment(
            kind="edge", name=edge, edge=edge, strap_length_m=0.1,
            bar_start_m=(x, -half, BAR), bar_end_m=(x, half, BAR),
        )
        for edge, x in (("head", -RADIUS), ("foot", RADIUS))
    )
    straps = build_straps(net, HangingDesign(
        attachments=ends, strap_stiffness_n_per_m=500.0, strap_damping_ns_per_m=1.0
    ))
    s, y = net.rest_position.T
    turn = np.clip((s - STRAIGHT) / RADIUS, 0, pi)
    below = np.minimum(s - STRAIGHT, 0) - np.maximum(s - STRAIGHT - pi * RADIUS, 0)
    position = np.column_stack([-RADIUS * np.cos(turn), y, RADIUS * np.sin(turn) + below])
    sheet = replace(make_sheet(net, straps), gravity=np.zeros(3))
    return sheet, SheetState(position, np.zeros_like(position))


def pull_over_cylinder() -> Capstan:
    """Pull the strip over the cylinder for 1.5 s; told is the last half second.

    The start sets the strip swinging along itself, by 5 % of the tensions at any one time.
    """
    sheet, state = strip_over_cylinder()
    straps, rest = sheet.straps, sheet.net.rest_position
    contact = plane(sheet.net, friction=CAPSTAN_FRICTION)
    contact.anchor[:] = state.position
    accounts = Accounts(short_substeps(sheet), state, contact, STILL_BAR)
    # The head strap hangs from the still bar; the foot strap's part of the bar is pulled down.
    pulled = np.array([name == "foot" for name in straps.names])
    step, count, told = 1e-3, 1500, 500
    ends, friction, turn, touching = np.zeros(2), *np.zeros((3, len(rest)))
    for i in range(count):
        contact.normal[:] = state.position * (1, 0, 1)
        contact.normal[:] /= np.linalg.norm(contact.normal, axis=1)[:, None]
        contact.offset[:] = RADIUS
        contact.active[:] = state.position[:, 2] > 0
        straps.bar_point[pulled, 2] = BAR - PULL * step * i
        reaction = accounts.advance(state, step, contact, STILL_BAR)
        if i >= count - told:
            ends += [np.linalg.norm(reaction.strap_force[end].sum(axis=0)) / told
                     for end in (~pulled, pulled)]
            onward = contact.normal[:, [2, 1, 0]] * (1, 0, -1)  # from the slack end to the taut
            friction -= (reaction.contact.force * onward).sum(axis=1) / told
            turn += np.arctan2(state.position[:, 2], -state.position[:, 0]) / told
            touching += contact.active / told
    _, row = np.unique(rest[:, 0], return_inverse=True)
    size, by_row = np.bincount(row), np.bincount(row, friction)
    always = np.bincount(row, touching) / size > 1 - 1e-9
    tension = ends[0] + np.cumsum(by_row) - by_row / 2
    turned = (np.bincount(row, turn) / size)[always]
    return Capstan(*ends, turned, tension[always], accounts.residual)


def measure_capstan() -> Measurement:
    """Compare the tensions of both ends with T2/T1 = e^(µ π)."""
    strip = pull_over_cylinder()
    turn = np.linspace(0, pi, 101)
    plot = Plot(
        "validation_capstan", f"A strip with µ = {CAPSTAN_FRICTION} pulled over a cylinder",
        "turn [°]", "tension over that of the slack end",
        (Curve("e^(µθ)", np.degrees(turn), np.exp(CAPSTAN_FRICTION * turn)),
         Curve("sheet", np.degrees(strip.turn), strip.tension / strip.slack, marked=True)),
    )
    ratio = strip.taut / strip.slack / exp(CAPSTAN_FRICTION * pi)
    return Measurement({"capstan": ratio, "capstan_energy": strip.residual}, (plot,))


CHECKS = (
    Check(
        (Criterion("slip_onset", f"incline at which a sheet with µ = {INCLINE_FRICTION} lets go",
                   ONSET - 0.5, ONSET + 0.5, "°", "atan µ ± 0.5°"),
         energy_criterion("slip", "the sheets on all these inclines, greatest")),
        measure_slip,
    ),
    Check(
        (Criterion("creep", f"way of a sheet in {CREEP_TIME:.0f} s simulated, at an incline of "
                   f"tan = {tan(CREEP_ANGLE):.3f} with µ = {INCLINE_FRICTION}", 0.0, 1.0, "mm",
                   "what sticks does not creep; it settles onto the springs of Eq. S6"),
         energy_criterion("creep", "the same")),
        measure_creep,
    ),
    Check(
        (Criterion("capstan", f"T2/T1 over e^(µπ), half a turn around a cylinder, "
                   f"µ = {CAPSTAN_FRICTION}", 0.95, 1.05, "", "Euler and Eytelwein, closed form"),
         energy_criterion("capstan", "the same")),
        measure_capstan,
    ),
)
