"""The planes that sheet vertices are given of the skin: how they move, how long a step may be."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sling_scenes import sling_scene, watched

from simcore.contact.foundation_law import LOOKED_AHEAD
from simcore.contact.skin_planes import set_skin_planes
from simcore.simulate import simulate

UP = np.array([[0.0, 0.0, 1.0]])
LAG, MOTION = 0.005, 0.002


class Vertex:
    """One sheet vertex above one skin vertex; planes from step to step."""

    def __init__(self):
        self.planes = SimpleNamespace(
            normal=UP, active=np.zeros(1, bool), offset=np.zeros(1),
            surface_velocity=np.zeros((1, 3)), anchor=np.zeros((1, 3)), force=np.zeros((1, 3)),
            lead=np.zeros((1, 3)), last_velocity=np.zeros((1, 3)),
        )  # fmt: skip

    def meet(self, gap, skin_velocity, step=0.01, step_before=0.01, sheet_velocity=(0, 0, 0)):
        """Set the plane for a step; return how long that may be [s]."""
        met, pace = set_skin_planes(
            np.zeros(1, np.int64), np.array([gap]), np.zeros((1, 3)), np.array([skin_velocity]),
            np.array([[0.0, 0.0, gap]]), np.array([sheet_velocity], float), step, LAG,
            step / (2 * step_before), MOTION, *vars(self.planes).values(),
        )
        assert len(met) == self.planes.active.sum()
        return pace


speeds = st.floats(-3, 3)


@given(st.lists(speeds, min_size=3, max_size=3), st.lists(speeds, min_size=3, max_size=3),
       st.lists(st.floats(0.001, 0.02), min_size=3, max_size=3))
def test_a_plane_moves_as_skin_that_speeds_up_evenly_does_on_the_mean(start, rate, steps):
    """Whatever the lengths of the steps: Eq. S15 is of second order."""
    vertex, time, start, rate = Vertex(), 0.0, np.array(start), np.array(rate)
    vertex.meet(-0.001, start, steps[0], steps[0])
    for before, step in itertools.pairwise(steps):
        time += before
        vertex.meet(-0.001, start + time * rate, step, before)
        middle = start + (time + step / 2) * rate
        assert vertex.planes.surface_velocity[0] == pytest.approx(middle, abs=1e-12)


def test_a_plane_that_is_new_moves_as_its_skin():
    vertex = Vertex()
    vertex.meet(0.005, [0.1, 0.2, 0.3])
    assert vertex.planes.surface_velocity[0] == pytest.approx([0.1, 0.2, 0.3])
    assert not vertex.planes.lead.any()


def test_a_step_is_as_long_as_what_touches_takes_for_a_motion():
    """Past each other in any direction: Eq. I3."""
    assert Vertex().meet(-0.001, [0.3, 0, 0.4]) == pytest.approx(MOTION / 0.5)
    told = Vertex().meet(-0.001, [0, 0, 0.01], sheet_velocity=[0, 0.1, 0])
    assert told == pytest.approx(MOTION / np.hypot(0.1, 0.01))
    assert Vertex().meet(-0.001, [0, 0, -0.4]) == np.inf  # it leaves


def test_what_touches_has_a_plane_however_fast_it_leaves():
    vertex = Vertex()
    vertex.meet(-0.001, [0, 0, -3.0], step=0.02)
    assert vertex.planes.active


def test_what_comes_near_may_come_as_far_as_it_is_away():
    speed = 1.0
    reach = LOOKED_AHEAD * LAG * speed
    assert reach < 0.02  # else it would have no plane at all
    near, far = reach * 0.9, reach * 1.1
    assert Vertex().meet(near, [0, 0, speed]) == pytest.approx(near / speed)
    assert Vertex().meet(far, [0, 0, speed]) == np.inf
    assert Vertex().meet(near, [0, 0, -speed]) == np.inf


def landing(changes):
    """The man lands on sheet and bed: exchanges, and the highest force that carries him [N]."""
    scene, solver = watched(
        sling_scene(changes | {"duration_min_s": 0.4, "duration_max_s": 0.4, "record_rate_hz": 50})
    )
    run = simulate(scene)
    return len(solver.reactions), run.support_force[:, 2].max()


def fixed(step):
    return {"time_step_s": step, "method.sheet.step_s": step}


def test_exchanges_are_short_where_body_and_sheet_meet_fast():
    """As with 1 ms, to 1 % in the force of the landing: 10 ms all along are not."""
    steps = {"longest_s": 0.016, "shortest_s": 0.001, "motion_m": 0.004}
    short, exact = landing(fixed(0.001))
    long, rough = landing(fixed(0.01))
    count, force = landing(
        {"time_step_s": None, "method.adaptive_step": steps, "method.sheet.step_s": 0.01}
    )
    assert long < count < short / 4
    assert force == pytest.approx(exact, rel=0.01)
    assert rough != pytest.approx(exact, rel=0.02)
