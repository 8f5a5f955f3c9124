"""The sensor mat: what it reads of loads that are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simcore.pressure import SensorMat

PITCH = 0.025  # [m]


def even(spacing, size=0.6):
    axis = np.arange(spacing / 2, size, spacing)
    return np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.006, 0.1))
def test_readings_add_up_to_the_force(seed, pitch):
    rng = np.random.default_rng(seed)
    points, force = rng.normal(size=(200, 2)), rng.uniform(0, 5, 200)
    mat = SensorMat(points, rng.uniform(0.001, 0.1, 2), pitch)
    assert mat.pressure(force).sum() * pitch**2 == pytest.approx(force.sum(), rel=1e-12)


@pytest.mark.parametrize("spacing", [0.005, 0.016, 0.04])
def test_even_pressure_is_read_as_it_is(spacing):
    points = even(spacing)
    mat = SensorMat(points, np.full(2, spacing), PITCH)
    reading = mat.pressure(np.full(len(points), 4e3 * spacing**2))
    assert reading[3:-3, 3:-3] == pytest.approx(4e3, rel=1e-9)


def test_a_small_tile_is_read_by_the_cell_that_holds_it():
    mat = SensorMat(np.array([[0.11, 0.21], [-0.3, 0.4]]), np.full(2, 0.004), PITCH)
    reading = mat.pressure(np.array([7.0, 0.0]))
    row, column = np.unravel_index(reading.argmax(), reading.shape)
    assert (mat.x[row], mat.y[column]) == pytest.approx((0.1125, 0.2125))
    assert reading.max() == pytest.approx(7.0 / PITCH**2)
    assert np.count_nonzero(reading > 1e-9) == 1


def test_peak_of_a_bump_converges_with_the_points():
    """A bump 60 mm wide: a tile blurs it by the square of its size, so that halving leaves 1/4."""
    peaks = []
    for spacing in (0.01, 0.005, 0.0025, 0.00125):
        points = even(spacing)
        pressure = 20e3 * np.exp(-((points - 0.31) ** 2).sum(axis=1) / 0.03**2)
        mat = SensorMat(points, np.full(2, spacing), PITCH)
        peaks.append(mat.pressure(pressure * spacing**2).max())
    first, second = np.diff(peaks[1:])  # points 10 mm apart are too few for the bump's law
    assert first / second == pytest.approx(4, rel=0.15)
    assert peaks[0] == pytest.approx(peaks[-1], rel=0.02)  # as docs/physics.md says
