"""Scene → trajectory: the only time loop."""

import time as clock
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from simcore.device.motion import DeviceState
from simcore.dynamics.adaptive import StepLadder, smooth_step
from simcore.dynamics.implicit import IMPLICITNESS, implicit_step
from simcore.dynamics.integrators import rk4_step
from simcore.energy import FLOWS
from simcore.errors import SimulationError
from simcore.interaction import Interaction
from simcore.recorder import Recorder, Trajectory
from simcore.scene import Scene
from simcore.sling_interaction import SlingInteraction

SPEED_LIMIT = 300.0
"""A joint faster than this has blown up [rad/s or m/s]: a free fall from 10 m ends at 14 m/s."""

Progress = Callable[[float], None]


def simulate(scene: Scene, progress: Progress | None = None) -> Trajectory:
    """Let the body settle on the device, move the device, and hold it.

    Parameters
    ----------
    scene : Scene
    progress : callable, optional
        Told the simulated time [s] at every recorded frame.

    Returns
    -------
    Trajectory
        Also of a run that failed: up to its last good frame, with status and reason. That a sheet
        passes into a body that has fallen is no failure; there the run ends.

    Raises
    ------
    SimulationError
        It failed before the first frame.
    """
    started = clock.process_time()
    run = _Run(scene, progress)
    status, reason = "ok", ""
    try:
        run.settle()
        run.follow_device()
    except SimulationError as error:
        if not run.recorder.frame_count:
            raise
        # A sheet may be squeezed through a hand as the body falls out of it: the verdict stands.
        if not (error.status == "slip_through" and np.isfinite(run.recorder.fall_time)):
            status, reason = error.status, error.reason
    return run.recorder.trajectory(
        device_start=run.device_start if np.isfinite(run.device_start) else run.time,
        settled=run.settled,
        cpu_time=clock.process_time() - started,
        status=status,
        reason=reason,
    )


def step_ladder(scene: Scene) -> StepLadder:
    """Return the steps of a scene; with a sheet none is longer than an exchange of forces."""
    method = scene.method
    steps = method.adaptive_step
    if not steps:
        return StepLadder(method.time_step_s, method.time_step_s)
    return StepLadder(scene.sling.step if scene.sling else steps.longest_s, steps.shortest_s)


class _Run:
    """State of one simulation; time runs from the start of settling."""

    def __init__(self, scene: Scene, progress: Progress | None):
        self.scene = scene
        self.progress = progress
        self.interaction = SlingInteraction(scene) if scene.sling else Interaction(scene)
        self.recorder = Recorder(scene, self.interaction)
        self.ladder = step_ladder(scene)
        self.h = self.ladder.longest
        self.smooth = np.inf  # how long the next step may be as the last one went [s]
        self.q = scene.configuration.copy()
        self.v = np.zeros(scene.body.model.nv)
        self.flows = np.zeros(len(FLOWS))  # since the start, of implicit steps
        self.ticks = 0
        self.settled = False
        self.device_start = np.inf  # the device stands still until the body has settled

    @property
    def time(self) -> float:
        """Time since the start of settling [s]; a multiple of a tick, not a sum of steps."""
        return self.ticks * self.ladder.tick

    def settle(self) -> None:
        """Run until the body is at rest on the still device, or for the longest time allowed."""
        limits = self.scene.method.settling
        while self.time < limits.duration_max_s and not self.fell_long_ago():
            if self.step() and self.time >= limits.duration_min_s:
                self.settled = self.rms_speed(self.v) < limits.rest_speed_m_per_s
                if self.settled:
                    break
        # A fall cuts the settling short, and the device would have started at its end.
        self.device_start = limits.duration_max_s if self.fell_long_ago() else self.time

    def follow_device(self) -> None:
        """Run the motion program and the hold after it; end early after a fall."""
        method, motion = self.scene.method, self.scene.motion
        end = self.device_start + motion.duration + method.hold_s
        while self.time < end and not self.fell_long_ago():
            self.step()

    def step(self) -> bool:
        """Advance one step; return whether it completed a recorded frame."""
        now, q, v = self.time, self.q, self.v
        moved = self.moved(now)
        ticks = self.ladder.choose(lambda: min(self.smooth, self.interaction.pace(moved, q, v)))
        self.h = ticks * self.ladder.tick
        self.interaction.exchange(moved, q, v, self.h)
        if self.scene.method.integrator == "implicit":
            self.q, self.v = implicit_step(
                self.scene.body.model, self.interaction.data, self.linearised, now, q, v, self.h
            )
            self.refuse_blow_up()
            self.interaction.conclude(self.v - v, self.h)
            after = self.moved((self.ticks + ticks) * self.ladder.tick)
            self.flows += self.interaction.account(v, self.v - v, self.h, after)
            recorded = self.recorder.observe(now, self.h, q, v, moved)
            if recorded:
                stored = self.interaction.stored_energy(self.q, self.v, after)
                self.recorder.tell_energy(np.concatenate([stored, self.flows]))
        else:
            acceleration = self.acceleration(now, q, v)
            recorded = self.recorder.observe(now, self.h, q, v, moved)
            self.q, self.v, apart = rk4_step(
                self.scene.body.model, self.acceleration, now, q, v, acceleration, self.h
            )
            self.refuse_blow_up()
            self.smooth = smooth_step(self.h, self.rms_speed(apart))
        self.ticks += ticks
        if recorded and self.progress:
            self.progress(self.time)
        return recorded

    def refuse_blow_up(self) -> None:
        """Raise where a joint is too fast, with its name, or no longer a number."""
        if self.v @ self.v < SPEED_LIMIT**2 or np.abs(self.v).max() < SPEED_LIMIT:
            return
        model = self.scene.body.model
        worst = int(np.argmax(np.nan_to_num(np.abs(self.v), nan=np.inf)))
        joint = next(j for j in range(1, model.njoints) if worst < model.idx_vs[j] + model.nvs[j])
        raise SimulationError(
            "blow_up",
            f"joint {model.names[joint]} passed {SPEED_LIMIT:g} rad/s at {self.time:.3f} s; "
            "shorter steps may hold it: method.time_step_s, or method.adaptive_step",
        )

    def moved(self, time: float) -> DeviceState:
        """Return where the motion program is at a time [s]."""
        return self.scene.motion(time - self.device_start)

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the joint acceleration (47,)."""
        return self.interaction.acceleration(self.moved(time), q, v)

    def linearised(
        self, time: float, q: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return torque (47,) and impedance (47, 47) for an implicit step."""
        return self.interaction.linearised(self.moved(time), q, v, IMPLICITNESS * self.h)

    def fell_long_ago(self) -> bool:
        """Return whether the body fell so long ago that there is no more to see."""
        return self.time > self.recorder.fall_time + self.scene.method.stop_after_fall_s

    def rms_speed(self, v: np.ndarray) -> float:
        """Return the root mean square speed of the body's mass [m/s] at a velocity (47,)."""
        model, data = self.interaction.model, self.interaction.data
        energy = pin.computeKineticEnergy(model, data, self.q, v)
        return float(np.sqrt(2 * energy / self.scene.body.mass))
