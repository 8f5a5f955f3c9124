"""What several files of tests share: a coarse man on a coarse lift, and a browser."""

from pathlib import Path

import pytest
from chromium import Chromium
from hypothesis import settings

from simcore.body import build_body
from simcore.config import BodyDesign, Design, Method, Posture, read_design
from simcore.config.paths import resolve_path, set_value
from simcore.config.robotic_lift import RoboticLift
from simcore.scene import build_scene
from simcore.simulate import simulate

ROOT = Path(__file__).parents[1]
MAN = "male_172_70"
COARSE = {
    "skin_vertices": 3000, "vertex_count": 3000,
    # a seventh of the shipped contact points: each carries, and holds, about seven times as much
    "stiffness_n_per_m": 6000.0, "friction_force_n": 3.0,
}

LONGEST = ("test_validation", "test_workflow", "test_certificate", "test_body_build", "test_energy")
"""Files to begin with, so that no process is left with one of them at the end."""

settings.register_profile("untimed", deadline=None)  # the machine may be busy
settings.load_profile("untimed")


def pytest_collection_modifyitems(items):
    place = {name: i for i, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.stem, len(LONGEST)))


@pytest.fixture(scope="session")
def design_with():
    """Return a function: values by the end of their path → the shipped design with those."""
    designs = ROOT / "designs"
    tree = Design(
        device=read_design(RoboticLift, designs / "devices" / "robotic_lift.yaml"),
        body=read_design(BodyDesign, designs / "bodies" / f"{MAN}.yaml"),
        posture=read_design(Posture, designs / "postures" / "seated.yaml"),
        method=read_design(Method, designs / "methods" / "paper.yaml").model_copy(
            update={"adaptive_step": None, "time_step_s": 0.002}  # or as long as a test says
        ),
    )

    def make(changes: dict | None = None, **values) -> Design:
        wanted = tree.model_dump()
        for key, value in (COARSE | (changes or {}) | values).items():
            set_value(wanted, resolve_path(wanted, key, "test") if "." not in key else key, value)
        return Design.model_validate(wanted)

    return make


@pytest.fixture(scope="session")
def scene_with(design_with):
    """Return a function: as `design_with`, but the placed scene."""
    return lambda changes=None, **values: build_scene(design_with(changes, **values), MAN, ROOT)


@pytest.fixture(scope="session")
def coarse_body(design_with):
    return build_body(design_with().body, MAN)


@pytest.fixture(scope="session")
def scene(scene_with):
    return scene_with()


@pytest.fixture(scope="session")
def held(scene_with):
    """A reclined lift that holds the man from start to end: scene and trajectory."""
    scene = scene_with(support_angle_deg=20, recline_deg=20)
    return scene, simulate(scene)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    started = Chromium(tmp_path_factory.mktemp("profile"))
    yield started
    started.close()
