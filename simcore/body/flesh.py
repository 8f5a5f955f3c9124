"""How deep a body can be pressed, and how hard that is."""

import numpy as np
import trimesh

from simcore.body.build import Body, posed_skin
from simcore.body.skin import vertex_normals
from simcore.body.tissue import Tissue, skin_tissue, smoothing_operator
from simcore.config.designs import UniformFlesh

THICKNESS_SHARE = 0.9
"""Of the way to the middle of a limb that counts as its flesh; deeper a sheet has passed."""

LONGEST = 0.24
"""Way through the body that is told apart from longer ones [m]: a trunk's, and no flesh is thicker
than half of it."""

ASKEW = (7e-4, -4e-4, 9e-4)
"""By how much that way is not straight: a ray that meets an edge in a symmetric mesh may pass."""

BELOW_SKIN = 1e-3
"""How far below the skin that way is begun [m], so that it does not end where it begins."""


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
    normals = vertex_normals(skin, rest)
    half = way_through(rest, skin.faces, normals) / 2
    return THICKNESS_SHARE * (smoothing_operator(rest, normals, skin.vertex_area) @ half)


def way_through(vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return how far it is from each vertex (n,) through the inside to the other side [m].

    At most `LONGEST`.

    Parameters
    ----------
    vertices, faces : (n, 3) float64, (f, 3) int
        Closed surface [m].
    normals : (n, 3) float64
        Outward unit normals.
    """
    start = vertices - BELOW_SKIN * normals
    rays = trimesh.Trimesh(vertices, faces, process=False).ray
    ends, found, _ = rays.intersects_location(start, ASKEW - normals, multiple_hits=False)
    length = np.full(len(vertices), LONGEST)
    length[found] = BELOW_SKIN + np.linalg.norm(ends - start[found], axis=1)
    return np.minimum(length, LONGEST)


def _rest(body: Body) -> np.ndarray:
    """Return the skin of the rest pose (n, 3), limbs apart [m]."""
    return posed_skin(body, body.rest_configuration)
