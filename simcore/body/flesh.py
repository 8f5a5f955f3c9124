"""How deep a body can be pressed, and how hard that is."""

import numpy as np

from simcore.body.build import Body, posed_skin
from simcore.body.skin import vertex_normals
from simcore.body.tissue import Tissue, skin_tissue, smoothing_operator
from simcore.config.designs import UniformFlesh

THICKNESS_SHARE = 0.9
"""Of the way to the middle of a limb that counts as its flesh; deeper a sheet has passed."""

def flesh_under_skin(body: Body, layer: UniformFlesh | None) -> Tissue:
    """Return the flesh under each skin vertex (n,): one layer for all, or that of each region.

    It is no thicker than most of the way to the middle of a limb.
    """
    skin, rest = body.skin, _rest(body)
    if layer:
        count = skin.vertex_count
        flesh = Tissue(np.full(count, layer.thickness_m), np.full(count, layer.modulus_pa))
    else:
        flesh = skin_tissue(
            body.vertex_region, rest, vertex_normals(skin, rest), skin.vertex_area,
            body.mass / body.stature**2,
        )
    return Tissue(np.minimum(flesh.thickness, limb_depth(body)), flesh.modulus)


def limb_depth(body: Body) -> np.ndarray:
    """Return how deep each skin vertex (n,) can be pressed at most [m].

    Half the way straight through the limb, as a mean over the flesh around: folds of the skin are
    no limbs. It does not depend on the mesh, as the balls inscribed there would, which shrink in
    every unevenness that a finer mesh shows.
    """
    skin, rest = body.skin, _rest(body)
    mean = smoothing_operator(rest, vertex_normals(skin, rest), skin.vertex_area)
    return THICKNESS_SHARE * (mean @ (body.way_through / 2))


def _rest(body: Body) -> np.ndarray:
    """Return the skin of the rest pose (n, 3), limbs apart [m]."""
    return posed_skin(body, body.rest_configuration)
