"""Flesh on a mattress: the closed forms of Eq. C3 against the two laws they join."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pressed_skin import AREA, D, E, Skin
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from sling_scenes import sling_scene

from simcore.body.tissue import Tissue, linear_pressure, stiffening_pressure
from simcore.config.sling_lift import Bed
from simcore.contact.distance_lookup import distance_and_gradient
from simcore.contact.layer import pressure_and_slope, work_of_pressing
from simcore.device.bed import bed_distance
from simcore.foundation_contact import FoundationContact

varied = settings(max_examples=60, deadline=None)
layers = {
    "modulus": st.floats(5e3, 2e5), "thickness": st.floats(2e-3, 0.15),
    "stiffness": st.floats(2e4, 5e6), "depth": st.floats(1e-4, 0.2), "stiffening": st.booleans(),
}


@varied
@given(**layers)
def test_flesh_and_mattress_bear_the_same_pressure(
    modulus, thickness, stiffness, depth, stiffening
):
    """The flesh alone takes what the mattress leaves of the depth, by the tissue's own room."""
    law = stiffening_pressure if stiffening else linear_pressure
    tissue = Tissue(thickness, modulus)
    of_flesh = brentq(lambda d: float(law(d, tissue)) - stiffness * (depth - d), 0, depth,
                      xtol=1e-16, rtol=1e-14)
    told, _ = pressure_and_slope(depth, modulus, thickness, 1 / stiffness, stiffening)
    assert told == pytest.approx(float(law(of_flesh, tissue)), rel=1e-6)


@varied
@given(**layers)
def test_slope_and_work_are_those_of_the_pressure(
    modulus, thickness, stiffness, depth, stiffening
):
    flesh = modulus, thickness, 1 / stiffness, stiffening
    _, slope = pressure_and_slope(depth, *flesh)
    h = 1e-6 * depth
    bend = 0.8 * thickness + 4 * modulus / stiffness
    if abs(depth - bend) > 2 * h:  # there the law has a corner in its slope
        around = [pressure_and_slope(depth + s * h, *flesh)[0] for s in (-1, 1)]
        assert slope == pytest.approx((around[1] - around[0]) / (2 * h), rel=1e-4)
    told, _ = quad(lambda d: pressure_and_slope(d, *flesh)[0], 0, depth,
                   points=[bend] if stiffening and bend < depth else None)
    pressure, _ = pressure_and_slope(depth, *flesh)
    assert work_of_pressing(depth, pressure, *flesh) == pytest.approx(told, rel=1e-6)


def test_without_flesh_the_mattress_gives_way_alone():
    flesh = 1.0, 0.0, 1 / 4e5, False
    assert pressure_and_slope(0.01, *flesh) == pytest.approx((4e3, 4e5))
    assert work_of_pressing(0.01, 4e3, *flesh) == pytest.approx(4e5 * 0.01**2 / 2)


def test_force_of_a_vertex_is_that_of_the_layer():
    """On a plane, with friction that is as soft as flesh and mattress together."""
    give, depth, way = 1 / 4e5, 0.012, 1e-4
    skin = Skin([[0, 0, -depth]], give=give, friction=10.0, stiffening=True)
    skin.evaluate()
    pressure, _ = pressure_and_slope(depth, E, D, give, True)
    assert skin.normal[0] == pytest.approx(AREA * pressure, rel=1e-5)
    skin.points[0, 0] += way
    skin.evaluate()
    assert skin.force[0, 0] == pytest.approx(-AREA / (D / E + give) / 3 * way, rel=1e-5)


@pytest.fixture(scope="module")
def on_bed():
    return sling_scene()


def test_damping_is_that_of_both_in_a_slow_motion(on_bed):
    """Two dashpots in series with springs, pressed back and forth within a second."""
    contact, bed = FoundationContact(on_bed), on_bed.sling.bed
    _, _, modulus, thickness, give, _, damping_time = contact._flesh
    i = int(on_bed.flesh.thickness.argmax())
    of_flesh, of_bed = modulus[i] / thickness[i], bed.pressure_stiffness_pa_per_m
    flesh_time = on_bed.method.contact.damping_time_s
    omega, depth = 2 * np.pi, 1e-3

    def rates(t, y):
        """Depth of the flesh, and the heat: both layers bear the same pressure."""
        d, u = depth * (1 - np.cos(omega * t)), depth * omega * np.sin(omega * t)
        flesh = (of_bed * (d - y[0]) - of_flesh * y[0] + bed.damping_time_s * of_bed * u) / (
            flesh_time * of_flesh + bed.damping_time_s * of_bed)
        return [flesh, flesh_time * of_flesh * flesh**2
                + bed.damping_time_s * of_bed * (u - flesh) ** 2]

    heat = solve_ivp(rates, (0, 1), [0, 0], rtol=1e-9, atol=1e-15).y[1, -1]
    both = 1 / (1 / of_flesh + give)
    told = damping_time[i] * both * depth**2 * omega**2 / 2
    assert told == pytest.approx(heat, rel=0.05)


def test_the_distance_of_a_bed_is_height_over_its_rectangle():
    bed = Bed(length_m=2.0, width_m=1.0, pressure_stiffness_pa_per_m=4e5, damping_time_s=0.1,
              friction_coefficient=0.3)
    field = bed_distance(bed)
    rng = np.random.default_rng(5)
    for x, y, z in rng.uniform([-0.99, -0.49, -0.19], [0.99, 0.49, 0.09], (50, 3)):
        told = distance_and_gradient(field.values, field.origin, field.spacing, x, y, z)
        assert told == pytest.approx((z, 0, 0, 1), abs=1e-6)
    for beside in ([1.01, 0, -0.05], [0, -0.51, -0.05]):
        distance, *_ = distance_and_gradient(field.values, field.origin, field.spacing, *beside)
        assert distance == pytest.approx(0.01)  # not farther: it may come in from the side
