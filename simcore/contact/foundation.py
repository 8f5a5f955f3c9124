"""Foundation contact: pressure as a function of depth on the skin, and friction that sticks.

What its kernels take and write, for the n vertices of a skin, where listed; world axes unless told:

listed : (l,) int64, sorted
points, velocities : (n, 3) float64
    [m, m/s]
values, origin, spacing
    Distance φ in the frame of the solid (`simcore.contact.distance_lookup`).
rotation, position, linear_velocity, turn
    Of that frame, and its angular velocity [m, m/s, rad/s].
area, soft, modulus, thickness, damping_time : (n,) float64
    A [m²], A p′(0) [N/m], E [Pa], D [m] and τ [s].
give, stiffening
    Of `simcore.contact.layer.pressure_and_slope`.
friction, lag, motion : float
    µ; the time after which an implicit step wants to know the force [s]; how far skin that touches
    may move within a step [m].
anchor : (n, 3) float64
    Where the friction spring of each vertex is tied, frame of the solid [m]: put on the vertex when
    it touches, kept as deep as the vertex is, dragged along when it slips.
closed : (n,) bool
    Whether the vertex touches.
force : (n, 3), normal_force : (n,), normals : (n, 3) float64
    On the skin, its normal part [N], and where pressed the outward normal of the solid.
along, across : (n,) float64
    Impedance lag² K + lag D of the contact, normal and tangential [kg].
depths, steepness : (n,) float64
    d [m], and ‖∇φ‖ where pressed.
sticks : (n,) bool
    Whether friction is not cut.
stretch : (n, 3) float64
    Along the surface, of the friction spring of what touches, frame of the solid [m].
slid : (1,) float64
    Energy spent by friction springs, added to [J] (Eq. E5).
"""

import numpy as np

from simcore.compiled import compiled
from simcore.contact.distance_lookup import AT_ONCE, look_up
from simcore.contact.foundation_law import (
    ACROSS,
    ALONG,
    ANCHOR,
    AREA,
    CLOSED,
    DAMPING_TIME,
    DISTANCE,
    FORCE,
    HASTE,
    KEPT,
    LENGTH,
    MODULUS,
    NORMAL,
    NORMAL_FORCE,
    POINT,
    PRESS,
    ROWS,
    SOFT,
    SPENT,
    STRETCH,
    THICKNESS,
    VELOCITY,
    press,
    rub,
    see_from_solid,
    turn_to_world,
)
from simcore.contact.layer import SHEAR_SHARE


@compiled
def foundation_forces(
    listed, points, velocities, values, origin, spacing, rotation, position, linear_velocity,
    turn, area, soft, modulus, thickness, give, stiffening, damping_time, friction, lag, motion,
    anchor, closed, force, normal_force, normals, along, across, depths, steepness, sticks,
    stretch, slid,
):
    """Write the force of a solid on each listed skin vertex.

    With φ the distance of the vertex from the solid, d = −φ, and p the pressure of its flesh (and
    of the mattress, if that is the solid) at this depth (Eqs. C1 and C3):

        N = A max(p(d) + τ p′(d) ḋ, 0)

    along the gradient of φ. A vertex that will touch within the lag has N = A p′(0) τ (ḋ + d/lag),
    so that an impact does not come as a surprise. Friction is that of a spring which shears with
    the flesh, tied to the solid, and slips at µ N (Eq. C2):

        F = −A p′(0)/3 (e + τ ė),   cut to ‖F‖ ≤ µ N, and e with it

    Returns
    -------
    contact_count, depth_max, deepest
        Of what is inside; the deepest vertex is −1 without contact.
    pressed : (p,) int64, vertices that bear force or are inside
    pace : float
        Time within which none that touches, or will within `LOOKED_AHEAD` lags, moves farther than
        `motion`, or than it is away [s] (Eq. I3).
    """
    count, depth_max, deepest, fastest = 0, 0.0, -1, 0.0
    pressed, pressed_count = np.empty(listed.size, np.int64), 0
    rows = np.empty((ROWS, AT_ONCE))
    for first in range(0, listed.size, AT_ONCE):
        block = listed[first : first + AT_ONCE]
        last = np.uint64(block.size)
        _gather(
            block, points, velocities, area, soft, modulus, thickness, damping_time, anchor,
            stretch, closed, rows,
        )
        see_from_solid(rows, last, rotation, position, linear_velocity, turn)
        look_up(values, origin, spacing, rows[: POINT + 3], last, rows[DISTANCE:])
        press(rows, last, give, stiffening, lag, motion)
        rub(rows, last, friction, lag)
        turn_to_world(rows, last, NORMAL, rotation)
        turn_to_world(rows, last, FORCE, rotation)
        spent, many = _scatter(
            block, rows, anchor, closed, force, normal_force, normals, along, across, depths,
            steepness, sticks, stretch, pressed[pressed_count:],
        )
        slid[0] += spent
        pressed_count += many
        haste = rows[HASTE]
        for p in range(block.size):
            fastest = max(fastest, haste[p])
    for i in pressed[:pressed_count]:
        if closed[i] and depths[i] > 0.0:
            count += 1
            if depths[i] > depth_max:
                depth_max, deepest = depths[i], i
    return count, depth_max, deepest, pressed[:pressed_count].copy(), 1.0 / np.sqrt(fastest)


@compiled
def _gather(
    block, points, velocities, area, soft, modulus, thickness, damping_time, anchor, stretch,
    closed, rows,
):
    """Bring together what belongs to the vertices of a block."""
    for p in range(block.size):
        i = block[p]
        for a in range(3):
            rows[POINT + a, p] = points[i, a]
            rows[VELOCITY + a, p] = velocities[i, a]
            rows[ANCHOR + a, p] = anchor[i, a]
            rows[STRETCH + a, p] = stretch[i, a]
        rows[AREA, p], rows[SOFT, p] = area[i], soft[i]
        rows[MODULUS, p], rows[THICKNESS, p] = modulus[i], thickness[i]
        rows[DAMPING_TIME, p], rows[CLOSED, p] = damping_time[i], closed[i]


@compiled
def _scatter(
    block, rows, anchor, closed, force, normal_force, normals, along, across, depths, steepness,
    sticks, stretch, pressed,
):
    """Put back what was found; return the energy that springs spent [J], and how many are pressed.

    Those are written down; their normals are of the solid, and anchors are of what touches.
    """
    spent, many = 0.0, 0
    for p in range(block.size):
        i = block[p]
        for a in range(3):
            force[i, a] = rows[FORCE + a, p]
        normal_force[i] = rows[NORMAL_FORCE, p]
        along[i], across[i] = rows[ALONG, p], rows[ACROSS, p]
        depths[i], sticks[i] = -rows[DISTANCE, p], rows[KEPT, p] == 1.0
        closed[i] = not rows[PRESS, p] <= 0.0
        spent += rows[SPENT, p]
        if closed[i] or depths[i] > 0.0:
            pressed[many] = i
            many += 1
            steepness[i] = rows[LENGTH, p]
            for a in range(3):
                normals[i, a] = rows[NORMAL + a, p]
        if closed[i]:
            for a in range(3):
                anchor[i, a] = rows[ANCHOR + a, p]
                stretch[i, a] = rows[STRETCH + a, p]
    return spent, many


@compiled
def write_late_forces(
    pressed, before, mean, step, friction, normals, along, across, force, normal_force
):
    """Make of the forces half-way what an implicit step had of them on its mean: Eq. I6.

    With the impedance of each vertex (Eq. I2) and the change Δv of its velocity,

        N ← max(N − a_n n·Δv / h, 0),    F ← F − a_t Δv_t / h,   cut to ‖F‖ ≤ µ N

    so that an impact is not told as if nothing slowed down within the step.

    Parameters
    ----------
    before, mean : (n, 3) float64
        Velocities of the skin, where pressed, that the forces were told and that the step took
        [m/s].
    step : float
        h [s]
    """
    rate = 2.0 / step  # of the change over the step, twice that to the mean velocity
    for i in pressed:
        x, y, z = normals[i, 0], normals[i, 1], normals[i, 2]
        u, v, w = (rate * (mean[i, 0] - before[i, 0]), rate * (mean[i, 1] - before[i, 1]),
                   rate * (mean[i, 2] - before[i, 2]))
        normal, out = normal_force[i], x * u + y * v + z * w
        fx = force[i, 0] - normal * x - across[i] * (u - out * x)
        fy = force[i, 1] - normal * y - across[i] * (v - out * y)
        fz = force[i, 2] - normal * z - across[i] * (w - out * z)
        normal = max(normal - along[i] * out, 0.0)
        limit, size = friction * normal, np.sqrt(fx * fx + fy * fy + fz * fz)
        kept = limit / size if size > limit else 1.0
        normal_force[i] = normal
        force[i, 0] = normal * x + kept * fx
        force[i, 1] = normal * y + kept * fy
        force[i, 2] = normal * z + kept * fz


@compiled
def release(before, now, soft, normal_force, closed, stretch, slid):
    """Let go of the vertices that were listed and are no longer, and of what their ties hold."""
    at = 0
    for i in before:
        while at < now.size and now[at] < i:
            at += 1
        if at == now.size or now[at] != i:
            if closed[i]:
                slid[0] += 0.5 * SHEAR_SHARE * soft[i] * (
                    stretch[i, 0] ** 2 + stretch[i, 1] ** 2 + stretch[i, 2] ** 2)
            normal_force[i], closed[i] = 0.0, False
