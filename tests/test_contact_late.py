"""Forces on the skin as they are told, of what an implicit step had of them on its mean: Eq. I6."""

import numpy as np
import pytest
from pressed_skin import Block, G


def test_forces_as_they_are_told_are_the_change_of_momentum():
    """Of a block that falls on its flesh, steep and damped, while it touches: Eq. I6."""
    block, told = Block(angle=0.2, depth=-0.01, damping=0.02, friction=5.0), []
    for _ in range(60):
        before = block.v
        block.advance(block.step)
        force = block.mass * ((block.v - before) / block.step - block.down)
        assert block.told[0] == pytest.approx(force, abs=1e-9)
        told.append(block.told[1])
    assert max(told) > 2 * block.mass * G


def test_friction_as_it_is_told_stays_within_what_the_normal_force_allows():
    """On a slope too steep, from an impact to the slide."""
    block = Block(angle=0.6, depth=-0.01, friction=0.3)
    for _ in range(100):
        block.advance(block.step)
        force, normal = block.told
        along = np.linalg.norm(force - normal * np.array([0.0, 0.0, 1.0]))
        assert normal >= 0
        assert along <= 0.3 * normal * (1 + 1e-12)
    assert along == pytest.approx(0.3 * normal)
