"""The bed of a sling lift: a flat surface."""

import numpy as np

from simcore.config.sling_lift import Bed
from simcore.device.distance import DistanceField
from simcore.device.surface import Surface

SPACING = 0.025
"""Of the grid by which a bed is drawn and a body laid on it [m], and of its distances."""

BELOW, ABOVE = 0.2, 0.1
"""How far the grid of those reaches [m]: deeper no body lies in a mattress."""


def flat_bed(design: Bed) -> Surface:
    """Return the upper side of a mattress as an even grid at z = 0, head towards −x."""
    counts = [round(extent / SPACING) + 1 for extent in (design.length_m, design.width_m)]
    x = np.linspace(-design.length_m / 2, design.length_m / 2, counts[0])
    y = np.linspace(-design.width_m / 2, design.width_m / 2, counts[1])
    vertices = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros(counts)], axis=-1)
    index = np.arange(counts[0] * counts[1], dtype=np.int32).reshape(counts)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate(
        [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    )
    points = vertices.reshape(-1, 3)
    return Surface(points, faces, points, SPACING, np.pi / 2)


def bed_distance(design: Bed) -> DistanceField:
    """Return the distance of the upper side of a mattress, z over its rectangle.

    Flat, so that a grid of any spacing has it exactly; the rectangle is that of `flat_bed` to half
    a spacing.
    """
    z = np.arange(round((BELOW + ABOVE) / SPACING) + 1) * SPACING - BELOW
    counts = [round(extent / SPACING) for extent in (design.length_m, design.width_m)]
    shape = counts[0] + 1, counts[1] + 1, len(z)
    origin = np.array([-counts[0] * SPACING / 2, -counts[1] * SPACING / 2, -BELOW])
    return DistanceField(np.broadcast_to(z, shape).astype(np.float32, order="C"), origin, SPACING)
