"""Where the time of a step goes: a stopwatch around the calls of each stage.

The calls are replaced by timed ones while a profile is taken and put back after it, so that a
simulation knows nothing of it. A tracing profiler would charge each small call several times its
cost.
"""

import importlib
import sys
import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from simcore.scene import Scene
from simcore.simulate import simulate

STAGES = {
    "kinematics": (
        "pinocchio:forwardKinematics", "pinocchio:computeJointJacobians", "pinocchio:integrate",
    ),
    "device motion": ("simcore.device.motion:Motion.__call__",),
    "near lists": (
        "simcore.contact.near_solid:NearSolid.update",
        "simcore.contact.neighbours:Neighbours.update",
        "simcore.sling_contact:SheetOnSkin.find",
    ),
    "posing of the skin": (
        "simcore.body.skin_listed:blend_listed", "simcore.body.skin_listed:blend_motion_listed",
        "simcore.body.skin_listed:blend_velocity_listed",
    ),
    "contact": (
        "simcore.contact.foundation:foundation_forces", "simcore.point_contact:_touch",
    ),
    "self-contact": ("simcore.contact.self_contact:add_self_contact",),
    "joint torques": (
        "simcore.dynamics.joints:PostureControl.torque",
        "simcore.dynamics.passive:PassiveJoints.add_torque",
    ),
    "wrenches to torques": (
        "simcore.body.skin_listed:wrench_listed", "simcore.body.skin_listed:torque_of_wrenches",
    ),
    "impedance and its projection": (
        "simcore.dynamics.impedance:add_point_impedance",
        "simcore.dynamics.impedance:add_pair_impedance",
        "simcore.dynamics.impedance:project_blocks",
    ),
    "dynamics": (
        "pinocchio:crba", "pinocchio:nonLinearEffects", "pinocchio:aba",
        "simcore.dynamics.implicit:velocity_change",
    ),
    "sheet": (
        "simcore.sheet.explicit:ExplicitSolver.advance", "simcore.sheet.liu:LiuSolver.advance",
    ),
    "sheet and skin": (
        "simcore.sling_contact:SheetOnSkin.give_back",
        "simcore.sling_contact:SheetOnSkin.set_planes",
        "simcore.sling_contact:SheetOnSkin.refuse_passing",
        "simcore.sling_contact:SheetOnSkin.press",
    ),
    "energy": (
        "simcore.interaction:Interaction.account", "simcore.interaction:Interaction.stored_energy",
    ),
    "recorder": ("simcore.recorder:Recorder.observe",),
}
"""Stage → functions and methods, by module and name; what one calls of another stage counts
there."""

SETUP = {"set-up": ("simcore.simulate:_Run.__init__",)}
"""What is made once a run, before the first step."""

REST = "the rest, in Python"


@dataclass(frozen=True)
class Profile:
    """Wall times, medians of the repeats.

    Attributes
    ----------
    stages : dict
        Of each stage without that of the stages it calls, in the order of a step; only what was
        called [µs a step of the body].
    step : float
        Of a whole step, the stopwatch running [µs].
    step_unwatched : float
        And without it [µs].
    setup : float
        Of what is made once a run [ms].
    """

    stages: dict[str, float]
    step: float
    step_unwatched: float
    setup: float


def profile_scene(scene: Scene, repeats: int) -> Profile:
    """Return the profile of a whole run: settling, every move, and the hold."""
    simulate(scene)  # compiles, or loads what was compiled
    per_step, setups, unwatched = [], [], []
    for _ in range(repeats):
        with watch(STAGES | SETUP) as stopwatch:
            simulate(scene)
        (setup,) = SETUP
        setups.append(stopwatch.spent.pop(setup))
        steps = stopwatch.calls["recorder"]  # told of every step, however long it is
        unwatched.append(_run_time(scene) / steps)
        per_step.append({name: spent / steps for name, spent in stopwatch.spent.items()})
    return Profile(
        stages={
            name: 1e6 * float(np.median([each[name] for each in per_step]))
            for name in (*STAGES, REST) if name in per_step[0]
        },
        step=1e6 * float(np.median([sum(each.values()) for each in per_step])),
        step_unwatched=1e6 * float(np.median(unwatched)),
        setup=1e3 * float(np.median(setups)),
    )


class Stopwatch:
    """Charges time to the stage that was entered last.

    Attributes
    ----------
    spent : dict
        Time by stage, that of `REST` outside all [s].
    calls : dict
        How often each stage was entered.
    """

    def __init__(self, now: Callable[[], float] = clock.perf_counter):
        self._now = now
        self._open = [REST]
        self._since = now()
        self.spent, self.calls = {REST: 0.0}, {}

    def charge(self) -> None:
        """Charge the time since the last change to the present stage."""
        now = self._now()
        stage = self._open[-1]
        self.spent[stage] = self.spent.get(stage, 0.0) + now - self._since
        self._since = now

    def timed(self, stage: str, function: Callable) -> Callable:
        """Return a function that does the same and is charged to a stage."""

        def call(*arguments, **named):
            self.charge()
            self._open.append(stage)
            self.calls[stage] = self.calls.get(stage, 0) + 1
            try:
                return function(*arguments, **named)
            finally:
                self.charge()
                self._open.pop()

        return call


@contextmanager
def watch(stages: dict[str, tuple[str, ...]]) -> Iterator[Stopwatch]:
    """Time all calls of stages from Python, until the end of the block.

    A kernel that calls another does so in machine code, unseen: the other is charged with it.

    Raises
    ------
    AttributeError
        A stage names what is not there.
    """
    stopwatch, undo = Stopwatch(), []
    try:
        for stage, targets in stages.items():
            for target in targets:
                for holder, name in holders(target):
                    function = vars(holder)[name]
                    undo.append((holder, name, function))
                    setattr(holder, name, stopwatch.timed(stage, function))
        yield stopwatch
        stopwatch.charge()
    finally:
        for holder, name, function in undo:
            setattr(holder, name, function)


def holders(target: str) -> list[tuple[object, str]]:
    """Return who calls "module:function" by which name: the modules that hold it.

    Of "module:Class.method" it is the class.
    """
    module_name, _, path = target.partition(":")
    module = importlib.import_module(module_name)
    *owners, name = path.split(".")
    if owners:
        return [(getattr(module, owners[0]), name)]
    function = getattr(module, name)
    own = [each for key, each in sys.modules.items() if key.split(".")[0] == "simcore"]
    return [
        (each, name) for each in {id(each): each for each in (module, *own)}.values()
        if vars(each).get(name) is function
    ]


def _run_time(scene: Scene) -> float:
    """Return the wall time of a run [s], from the first recorded frame to the last."""
    stamps = []
    simulate(scene, lambda time: stamps.append(clock.perf_counter()))
    return stamps[-1] - stamps[0]
