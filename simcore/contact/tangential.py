"""Contact forces as a recorder adds them up: normal, tangential, and what of it slips."""

import numpy as np

from simcore.compiled import compiled

# ASSUME: friction of a sheet is a mean over sub-steps, some of which stick; 1 % takes those in that
# slip all the same.
AT_LIMIT = 0.99
"""From this share of µN on, friction counts as slipping."""


@compiled
def add_parts(listed, force, normal_force, normals, friction, normal_total, tangential_total):
    """Add the parts of each listed point's force; return the normal force of those that slip.

    Parameters
    ----------
    listed : (l,) int64
    force : (n, 3), normal_force : (n,), normals : (n, 3) float64
        Whole force, world axes, its normal part [N] and the direction in which that pushes;
        where listed.
    friction : float
        µ; negative: a law that knows none.
    normal_total : (n,), tangential_total : (n, 3) float64
        Have normal and tangential force added [N].

    Returns
    -------
    slipping : float
        Σ N where ‖F‖ ≥ `AT_LIMIT` µN [N]; NaN without µ.
    """
    slipping = 0.0
    for i in listed:
        normal, square = normal_force[i], 0.0
        for a in range(3):
            tangential = force[i, a] - normal * normals[i, a]
            tangential_total[i, a] += tangential
            square += tangential * tangential
        normal_total[i] += normal
        limit = AT_LIMIT * friction * normal
        if square >= limit * limit:
            slipping += normal
    return slipping if friction >= 0.0 else np.nan
