"""Foundation contact on solids whose distance is known, against its own law and its derivatives."""

from math import atan, cos, degrees, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pressed_skin import AREA, D, E, Skin

from simcore.body.tissue import Tissue, linear_pressure, stiffening_pressure
from simcore.contact.distance_lookup import distance_and_gradient
from simcore.contact.foundation_law import LOOKED_AHEAD
from simcore.contact.layer import SHEAR_SHARE, pressure_and_slope

varied = settings(max_examples=40, deadline=None)


@varied
@given(strain=st.floats(0.01, 1.2), stiffening=st.booleans())
def test_pressure_is_that_of_the_flesh(strain, stiffening):
    """As the tissue's own room has it, beyond the greatest strain too."""
    skin = Skin([[0.01, -0.02, -strain * D]], stiffening=stiffening)
    count, depth, deepest = skin.evaluate()
    law = stiffening_pressure if stiffening else linear_pressure
    expected = law(strain * D, Tissue(D, E))
    assert skin.normal[0] == pytest.approx(AREA * expected, rel=1e-5)
    assert skin.force[0] == pytest.approx([0, 0, skin.normal[0]], abs=1e-9)
    assert (count, deepest) == (1, 0) and depth == pytest.approx(strain * D, rel=1e-5)


def test_what_is_clear_is_not_touched_and_what_leaves_is_not_held():
    skin = Skin([[0, 0, 0.001], [0, 0, -0.001]], damping=0.1)
    skin.velocities[1, 2] = 0.1  # leaves faster than its damper lets it
    assert skin.evaluate() == (0, 0.0, -1)
    assert not skin.force.any() and not skin.closed.any()


def test_an_impact_is_seen_before_it_comes_and_without_a_jump():
    """Just outside and just inside, at a speed: the same force; none where it takes longer."""
    lag, speed = 0.003, 0.5
    skin = Skin([[0, 0, 1e-9], [0, 0, -1e-9], [0, 0, 1.01 * lag * speed]], damping=0.02)
    skin.velocities[:, 2] = -speed
    skin.evaluate(lag)
    assert skin.normal[0] == pytest.approx(skin.normal[1], rel=1e-4)
    assert skin.normal[0] == pytest.approx(AREA * E / D * 0.02 * speed, rel=1e-4)
    assert skin.normal[2] == 0


@varied
@given(st.integers(0, 2**32 - 2), st.booleans())
def test_force_and_impedance_are_those_of_a_turned_and_moving_solid(seed, stiffening):
    """Seen from a frame that moves along nothing changes; Z = lag² K + lag D by differences."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    still = Skin(rng.uniform(-0.05, 0.05, (6, 3)) * [1, 1, 0] - [0, 0, 0.01],
                 stiffening=stiffening, damping=0.02, friction=1e3)
    still.velocities[:] = rng.normal(scale=0.05, size=(6, 3))
    moving = Skin(still.points @ turn.T + [0.3, -0.2, 0.9], rotation=turn,
                  origin=[0.3, -0.2, 0.9], stiffening=stiffening, damping=0.02, friction=1e3)
    moving.linear, moving.turn = rng.normal(size=3), rng.normal(size=3)
    moving.velocities[:] = still.velocities @ turn.T + moving.linear + np.cross(
        moving.turn, moving.points - moving.origin)
    lag = 0.004
    still.evaluate(lag), moving.evaluate(lag)
    assert moving.force == pytest.approx(still.force @ turn.T, rel=1e-5, abs=1e-6)
    assert moving.normal == pytest.approx(still.normal, rel=1e-5, abs=1e-6)
    pressed = still.normal > 0
    for axis, impedance in ((0, still.across), (1, still.across), (2, still.along)):
        step, move = 1e-6, np.eye(3)[axis]
        other = Skin(still.points + step * lag * move, stiffening=stiffening, damping=0.02,
                     friction=1e3)
        other.velocities[:] = still.velocities + step * move
        other.anchor[:], other.closed[:] = still.anchor, still.closed
        other.evaluate(lag)
        rise = -lag * (other.force - still.force)[:, axis] / step
        if axis == 2 and stiffening:  # the damper's slope changes too, by what the depth does
            assert rise[pressed] == pytest.approx(impedance[pressed], rel=0.2)
        else:
            assert rise[pressed] == pytest.approx(impedance[pressed], rel=1e-3)


def one_by_one(skin, i, lag):
    """What Eqs. C1 and C2 make of a vertex of a still, unturned solid, as they are written down."""
    x, u, soft, tau = skin.points[i], skin.velocities[i], skin.tissue[1][i], skin.damping[i]
    distance, *gradient = distance_and_gradient(*skin.field, *x)
    gradient = np.array(gradient)
    depth, rate, length = -distance, -gradient @ u, np.linalg.norm(gradient)
    normal, stiffness = soft * tau * (rate + depth / lag), soft
    if depth > 0:
        pressure, slope = pressure_and_slope(
            depth, E, D, skin.give, skin.stiffening)
        stiffness = AREA * slope
        normal = AREA * pressure + tau * stiffness * rate
    near = depth + LOOKED_AHEAD * lag * rate > 0
    told = {"haste": np.linalg.norm(u) / max(distance, skin.motion) if near else 0.0}
    e, stretch = x - skin.anchor[i], skin.stretch[i]
    held = 0.5 * SHEAR_SHARE * soft * stretch @ stretch if skin.closed[i] else 0.0
    if normal <= 0:
        return told | {"force": np.zeros(3), "normal": 0, "along": 0, "across": 0, "spent": held,
                       "sticks": False}
    if not skin.closed[i]:
        e = stretch = np.zeros(3)
    n, shear = gradient / length, SHEAR_SHARE * soft
    friction = -shear * ((np.eye(3) - np.outer(n, n)) @ (e + tau * u))
    e, spent = e - (n @ e) * n, 0.5 * shear * (n @ stretch) ** 2
    share = min(1.0, skin.friction * normal * length / np.linalg.norm(friction))
    if share < 1:
        kept = -share * friction / shear
        spent += 0.5 * shear * (e - kept) @ (stretch + kept)
        e = kept
    return told | {
        "force": normal * gradient + share * friction, "normal": normal * length,
        "along": lag * stiffness * (lag + tau), "across": share * lag * shear * (lag + tau),
        "spent": spent, "sticks": share == 1, "anchor": x - e, "stretch": e,
    }


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 2), st.booleans(), st.sampled_from([0.0, 1e-6]))
def test_many_at_once_are_what_each_is(seed, stiffening, give):
    """More than are evaluated at a time; in two steps, so that ties are held, cut and let go."""
    rng, count, lag = np.random.default_rng(seed), 1203, 0.004
    skin = Skin(np.zeros((count, 3)), stiffening=stiffening, damping=0.02, friction=0.3, give=give)
    skin.motion = 0.01
    place = rng.uniform(-0.2, 0.2, (count, 3))
    for _ in range(2):
        place[:, 2] = rng.uniform(-0.036, 0.01, count)
        skin.points[:] = place
        place[:, :2] += rng.normal(scale=0.003, size=(count, 2))
        skin.velocities[:] = rng.normal(scale=0.3, size=(count, 3))
        expected = [one_by_one(skin, i, lag) for i in range(count)]
        skin.slid[0] = 0.0
        within, deepest, where = skin.evaluate(lag)
        for name in ("force", "normal", "along", "across", "sticks"):
            right = np.array([each[name] for each in expected])
            assert getattr(skin, name) == pytest.approx(right, rel=1e-9, abs=1e-12), name
        for name in ("anchor", "stretch"):
            for i in np.flatnonzero(skin.closed):
                assert getattr(skin, name)[i] == pytest.approx(expected[i][name], abs=1e-12)
        assert skin.slid[0] == pytest.approx(sum(each["spent"] for each in expected))
        assert skin.pace == pytest.approx(1 / max(each["haste"] for each in expected))
        assert np.array_equal(skin.closed, [each["normal"] > 0 for each in expected])
        assert np.array_equal(skin.pressed, np.flatnonzero(skin.closed | (skin.depths > 0)))
        assert within == np.count_nonzero(skin.closed & (skin.depths > 0))
        deep = np.where(skin.closed, skin.depths, 0)
        assert (deepest, where) == (deep.max(), deep.argmax())


def test_what_is_not_a_number_stays_so_and_harms_no_other():
    skin = Skin(np.tile([0.01, 0.0, -0.01], (20, 1)), damping=0.02)
    skin.points[7, 0] = np.nan
    skin.evaluate(0.004)
    assert np.isnan(skin.force[7]).all() and np.isnan(skin.normal[7])
    assert np.isfinite(np.delete(skin.force, 7, axis=0)).all()


def test_friction_springs_back_until_it_slips_and_takes_the_energy_of_the_way():
    """Out and back over s: stuck at first, then µN, and µN times the slipped way is lost."""
    friction, depth = 0.5, 0.01
    skin = Skin([[0, 0, -depth]], friction=friction)
    shear, limit = SHEAR_SHARE * AREA * E / D, friction * AREA * E * depth / D
    skin.evaluate()
    yields = limit / shear
    work, s, before = 0.0, 0.0, 0.0
    way = np.concatenate([np.linspace(0, 5 * yields, 400), np.linspace(5 * yields, 0, 400)])
    for s in way:
        skin.points[0, 0], last = s, skin.points[0, 0]
        skin.evaluate()
        if s == way[:400][abs(way[:400] - 0.5 * yields).argmin()] and s > last:
            assert skin.force[0, 0] == pytest.approx(-shear * s, rel=1e-6)
        work += (skin.force[0, 0] + before) / 2 * (s - last)
        before = skin.force[0, 0]
    assert skin.force[0, 0] == pytest.approx(limit, rel=1e-6)
    # Loop: slips 4 yields on the way out, 3 on the way back, and keeps one half limit²/shear.
    assert -work == pytest.approx(limit * (4 + 3) * yields + limit * yields / 2, rel=0.01)


def slide(angle, friction, seconds, step):
    """Way [m] and speed [m/s] of a block of 4 points on an incline, by linearly implicit steps."""
    down = np.array([sin(angle), 0.0, -cos(angle)]) * 9.80665
    mass, lag = 0.1, 0.55 * step
    soft = 4 * AREA * E / D
    rest = mass * 9.80665 * cos(angle) / soft
    block = Skin([[x, y, -rest] for x in (-0.01, 0.01) for y in (-0.01, 0.01)],
                 damping=0.02, friction=friction)
    start, v = block.points.copy(), np.zeros(3)
    for _ in range(round(seconds / step)):
        block.points += step / 2 * v
        block.velocities[:] = v
        block.evaluate(lag)
        z = np.diag([block.across.sum(), block.across.sum(), block.along.sum()])
        v = v + np.linalg.solve(
            mass * np.eye(3) + z, step * (block.force.sum(axis=0) + mass * down)
        )
        block.points += step / 2 * v
    return block.points[0, 0] - start[0, 0], v[0]


@pytest.mark.parametrize("friction", [0.3, 0.45])
def test_a_block_slips_at_the_friction_angle(friction):
    low, high = 0.5 * degrees(atan(friction)), 1.5 * degrees(atan(friction))
    for _ in range(8):
        middle = (low + high) / 2
        _, speed = slide(radians(middle), friction, 2.0, 0.005)
        low, high = (middle, high) if speed < 1e-3 else (low, middle)
    assert low == pytest.approx(degrees(atan(friction)), abs=0.5)


def test_a_held_block_does_not_creep():
    """A minute at 0.9 of the friction angle: what it moved after the first 3 s is nothing."""
    early, _ = slide(0.9 * atan(0.45), 0.45, 3.0, 0.01)
    late, speed = slide(0.9 * atan(0.45), 0.45, 60.0, 0.01)
    assert abs(late - early) < 1e-9 and abs(speed) < 1e-12
    assert 1e-3 < late < 3e-3  # the flesh shears; as it was let go suddenly, it slipped once
