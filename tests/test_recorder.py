"""Frames of the recorder, of forces that are known."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.device.motion import STILL
from simcore.recorder import Recorder


class Known:
    """An interaction whose only force is told from outside."""

    segment_wrench = np.zeros((18, 6))
    contact_count, depth_max = 0, 0.0
    contact = SimpleNamespace()

    def __init__(self):
        self.support_force = np.zeros(3)

    def add_skin_impulses(self, duration, on_skin):
        return 0.0

    def add_mat_impulses(self, duration, on_mat):
        return 0.0

    def share_impulses(self, on_mat, on_skin):
        pass

    def place(self, q, moved):
        return np.zeros((1, 3))

    def sheet_frame(self):
        return {}


@pytest.fixture(scope="module")
def scene(scene_with):
    return scene_with(record_rate_hz=25)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(1, 90), min_size=8, max_size=40), st.integers(0, 2**32 - 1))
def test_frames_are_means_over_the_period_whatever_the_steps(scene, ticks, seed):
    """Of a force that is constant over each step; told with the first step after its end."""
    interaction, period = Known(), 0.04
    recorder = Recorder(scene, interaction)
    steps = 1e-3 * np.array(ticks)
    starts = np.concatenate([[0.0], np.cumsum(steps)])
    forces = np.random.default_rng(seed).normal(size=(len(steps), 3))
    kept = []
    for start, step, force in zip(starts, steps, forces, strict=False):
        interaction.support_force = force
        if recorder.observe(start, step, np.zeros(60), np.zeros(47), STILL):
            kept.append(start)
    run = recorder.trajectory(0.0, False, 0.0, "ok", "")
    assert run.time == pytest.approx(kept)
    assert run.support_force[0] == pytest.approx(forces[0])
    impulse = np.concatenate([np.zeros((1, 3)), np.cumsum(steps[:, None] * forces, axis=0)])
    ends, end = [], period  # of the periods, but for those that lie within one step
    for after in starts[1:]:
        if after > end - 1e-9:
            ends.append(end)
            end = period * (np.floor((after + 1e-9) / period) + 1)
    edges = np.array([0.0, *ends])
    at = np.array([np.interp(edges, starts, impulse[:, a]) for a in range(3)]).T
    means = np.diff(at, axis=0) / np.diff(edges)[:, None]
    assert run.support_force[1:] == pytest.approx(means[: len(kept) - 1], abs=1e-9)
    assert len(means) - 1 <= len(kept) - 1 <= len(means)
