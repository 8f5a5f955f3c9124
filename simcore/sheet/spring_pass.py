"""Forces of the springs of a net on its grid, in a form that compilers vectorise (Eqs. 5, S3)."""

import numpy as np

from simcore.compiled import fused

TINY = np.float32(1e-24)
"""Added to squared lengths [m²]: no division by zero between absent grid points."""


@fused
def add_spring_forces(
    position, velocity, force, offsets, stiffness, rest_length, buckling_strain, share,
    damping_time, factor, pad,
):
    """Add the force of every spring to both of its ends.

    A spring from grid point a to b with d = x_b − x_a, l = ‖d‖ pulls a by s d and b by −s d:

        s = k (l − r)/l + β k (d · ḋ)/l²                                        (Eqs. 5, S3)

    where l − r below −(buckling strain) r counts by its share only.

    s is computed in single precision and d in double: the forces of a spring are exactly opposite
    and parallel to it, so that both momenta are kept to the rounding of doubles. All loops run over
    slices; with offset indices they do not vectorise.

    Parameters
    ----------
    position : (3, N) float64
        Flattened grid, with at least `pad` absent points before and after [m].
    velocity : (3, N) float32
        [m/s]
    force : (3, N) float64
        Added to [N].
    offsets : (6,) int64
        Step of each direction in the flattened grid, at most `pad`.
    stiffness, rest_length : (6, N) float32
        Of the spring that starts at a grid point, 0 where there is none [N/m], [m].
    buckling_strain : float
        Compression over rest length at which a spring buckles.
    share : (6,) float32
        Share of the stiffness beyond it, by direction.
    damping_time : float
        β [s].
    factor : (6, N) float32
        s of the springs [N/m]; overwritten, 0 in the pads.
    """
    end = position.shape[1] - pad
    for i in range(offsets.size):
        step = offsets[i]
        _factors(
            position[0, pad:end], position[1, pad:end], position[2, pad:end],
            position[0, pad + step : end + step], position[1, pad + step : end + step],
            position[2, pad + step : end + step],
            velocity[0, pad:end], velocity[1, pad:end], velocity[2, pad:end],
            velocity[0, pad + step : end + step], velocity[1, pad + step : end + step],
            velocity[2, pad + step : end + step],
            stiffness[i, pad:end], rest_length[i, pad:end], np.float32(buckling_strain), share[i],
            np.float32(damping_time), factor[i, pad:end],
        )
    for axis in range(3):
        x = position[axis]
        for i in (0, 3):
            j, k = i + 1, i + 2
            a, b, c = offsets[i], offsets[j], offsets[k]
            _gather(
                force[axis, pad:end], x[pad:end],
                x[pad + a : end + a], x[pad - a : end - a],
                x[pad + b : end + b], x[pad - b : end - b],
                x[pad + c : end + c], x[pad - c : end - c],
                factor[i, pad:end], factor[i, pad - a : end - a],
                factor[j, pad:end], factor[j, pad - b : end - b],
                factor[k, pad:end], factor[k, pad - c : end - c],
            )


@fused
def _factors(
    ax, ay, az, bx, by, bz, au, av, aw, bu, bv, bw, stiffness, rest_length, buckling, share,
    damping_time, factor,
):
    """Write s of each spring [N/m]."""
    for p in range(factor.size):
        dx = np.float32(bx[p] - ax[p])
        dy = np.float32(by[p] - ay[p])
        dz = np.float32(bz[p] - az[p])
        rate = dx * (bu[p] - au[p]) + dy * (bv[p] - av[p]) + dz * (bw[p] - aw[p])
        inverse = np.float32(1.0) / np.sqrt(dx * dx + dy * dy + dz * dz + TINY)
        ratio = rest_length[p] * inverse
        stretch = np.float32(1.0) - ratio
        beyond = stretch + buckling * ratio
        if beyond < np.float32(0.0):
            stretch -= (np.float32(1.0) - share) * beyond
        factor[p] = stiffness[p] * (stretch + damping_time * rate * inverse * inverse)


@fused
def _gather(
    force, x, x_a, a_x, x_b, b_x, x_c, c_x, from_a, to_a, from_b, to_b, from_c, to_c
):
    """Add one axis of the force of three springs from, and three to, each point."""
    for p in range(force.size):
        here = x[p]
        force[p] += (
            from_a[p] * (x_a[p] - here) + from_b[p] * (x_b[p] - here) + from_c[p] * (x_c[p] - here)
        ) - (to_a[p] * (here - a_x[p]) + to_b[p] * (here - b_x[p]) + to_c[p] * (here - c_x[p]))
