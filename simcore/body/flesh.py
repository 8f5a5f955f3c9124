"""How deep a body can be pressed, and how hard that is."""

import numpy as np
from scipy.spatial import cKDTree

from simcore.body.build import Body, posed_skin
from simcore.body.inscribed import inscribed_radius
from simcore.body.skin import vertex_normals
from simcore.body.tissue import Tissue, skin_tissue, smoothing_operator
from simcore.config.designs import FoundationContact

THICKNESS_SHARE = 0.9
"""Of the way to the middle of a limb that counts as its flesh; deeper a sheet has passed."""

DEEPEST = 0.12
"""Largest ball that is looked for [m]: a trunk, and no flesh is as thick."""


def flesh_under_skin(body: Body, law: FoundationContact) -> Tissue:
    """Return the flesh under each skin vertex (n,): that of the law, or of each region.

    It is no thicker than most of the way to the middle of a limb.
    """
    skin, rest = body.skin, _rest(body)
    if law.flesh:
        count = skin.vertex_count
        flesh = Tissue(
            np.full(count, law.flesh.thickness_m), np.full(count, law.flesh.modulus_pa)
        )
    else:
        flesh = skin_tissue(
            body.vertex_region, rest, vertex_normals(skin, rest), skin.vertex_area,
            body.mass / body.stature**2,
        )
    return Tissue(np.minimum(flesh.thickness, limb_depth(body)), flesh.modulus)


def limb_depth(body: Body) -> np.ndarray:
    """Return how deep each skin vertex (n,) can be pressed at most [m].

    The radius of the balls inscribed there, smooth as the flesh is: along a fold of the skin, such
    as under the buttocks, single balls are as small as the fold is sharp, and smaller yet on a
    finer mesh.
    """
    skin, rest = body.skin, _rest(body)
    normals = vertex_normals(skin, rest)
    radius = inscribed_radius(cKDTree(rest), rest, normals, DEEPEST)
    return THICKNESS_SHARE * (smoothing_operator(rest, normals, skin.vertex_area) @ radius)


def _rest(body: Body) -> np.ndarray:
    """Return the skin of the rest pose (n, 3), limbs apart [m]."""
    return posed_skin(body, body.rest_configuration)
