"""From a body design to the arrays of a body: phenotype, surface, skeleton, inertia, skin."""

from dataclasses import astuple
from functools import lru_cache

import numpy as np
import scipy.sparse as sparse

from simcore.body.inertia import SegmentInertias, inertia_from_de_leva, inertia_from_mesh
from simcore.body.makehuman import DATA, SOURCES, load_template
from simcore.body.phenotype import BodyFamily, Phenotype, body_family, fit_phenotype
from simcore.body.regions import vertex_regions
from simcore.body.remesh import area_normals, remesh
from simcore.body.skeleton import Skeleton, build_skeleton, joint_placements
from simcore.body.skin import SKIN_FIELDS, build_skin, vertex_normals
from simcore.body.surface import closing_operator, remesh_operator
from simcore.body.through import way_through
from simcore.cache import cache_folder, cached_arrays, content_key
from simcore.errors import DesignError

SMALLEST_WEIGHT = 0.01  # ASSUME: skin weights below this are dropped and the rest renormalised


DIGITS = 2  # of the phenotype that the remesh goes by; the body itself is fitted through it


def family_of(sex: str, age_years: float) -> BodyFamily:
    """All bodies of a sex and age, as closed surfaces."""
    return body_family(sex, age_years, _closing(), load_template().faces)


def construct_body(design, name: str) -> dict[str, np.ndarray]:
    """Everything a body is rebuilt from, by name.

    Raises
    ------
    DesignError
        If stature or mass is out of reach.
    """
    template, closing = load_template(), _closing()
    whole = family_of(design.sex, design.age_years)
    target = (name, design.stature_m, design.mass_kg)
    first = _rounded(fit_phenotype(whole, *target))
    evenly = remesh(whole.surface_vertices(first), template.faces, design.skin_vertices)
    mapping = remesh_operator(evenly, template.faces, closing.shape[0])
    # Chords cut volume and stature a little: fit again through the remesh itself, so that both
    # hold for the surface that is simulated.
    seen = whole.through((mapping @ closing).tocsr(), evenly.faces)
    phenotype = fit_phenotype(seen, *target)
    vertices = seen.surface_vertices(phenotype)
    weights = _pruned(mapping @ template.segment_weights)
    skeleton = build_skeleton(template, seen.vertices(phenotype))
    surface = whole.surface_vertices(phenotype)
    vertices, surface, skeleton = _stand_on_origin(vertices, surface, skeleton)
    inertias = _inertias(design, name, surface, skeleton)
    skin = build_skin(
        vertices, evenly.faces, weights, skeleton.origins, skeleton.rest_rotations
    )
    # Of the surface before the remesh, like inertias: chords make fingers and heels thinner.
    outward = mapping @ _unit_normals(surface, template.faces)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    through = way_through(vertices, outward, surface, template.faces)
    regions = vertex_regions(vertices, vertex_normals(skin, vertices), weights, skeleton)
    return {
        "stature": np.array(np.ptp(vertices[:, 2])),
        "placements": joint_placements(skeleton),
        "masses": inertias.masses,
        "coms": inertias.coms,
        "inertias": inertias.inertias,
        "rest_rotations": skeleton.rest_rotations,
        "rest_root": skeleton.origins[0],
        "vertex_region": regions,
        "way_through": through,
        **{field: getattr(skin, field) for field in SKIN_FIELDS},
    }


def _rounded(phenotype: Phenotype) -> Phenotype:
    """Return a phenotype without its last digits.

    These go by the machine and its number of threads, and would decide about single triangles, and
    they about all that follow: every machine is to have the same mesh.
    """
    return Phenotype(*(round(axis, DIGITS) for axis in astuple(phenotype)))


@lru_cache(maxsize=1)
def _closing() -> sparse.csr_matrix:
    key = content_key("body", (*SOURCES, "surface"), DATA)
    path = cache_folder() / "makehuman" / f"closing-{key}.npz"

    def make():
        operator = closing_operator(load_template())
        return {"data": operator.data, "indices": operator.indices, "indptr": operator.indptr,
                "shape": np.array(operator.shape)}

    stored = cached_arrays(path, make)
    return sparse.csr_matrix(
        (stored["data"], stored["indices"], stored["indptr"]), shape=tuple(stored["shape"])
    )


def _inertias(design, name, surface, skeleton) -> SegmentInertias:
    # Of the surface before the remesh: it is as symmetric as MakeHuman's, while even triangles
    # cut a toe's volume by up to half, left and right by different amounts.
    if design.inertia == "mesh":
        template = load_template()
        weights = _pruned(template.segment_weights)
        return inertia_from_mesh(surface, template.faces, weights, skeleton, design.mass_kg)
    if design.inertia == "de_leva":
        return inertia_from_de_leva(
            design.sex, design.stature_m, design.mass_kg, skeleton, surface
        )
    raise DesignError(
        f"body {name}: inertia {design.inertia!r} is not one of mesh, de_leva"
    )


def _unit_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return area-weighted vertex normals (n, 3), zero where no triangle has an area."""
    normals = area_normals(points, faces)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def _pruned(weights: np.ndarray) -> np.ndarray:
    kept = np.where(weights < SMALLEST_WEIGHT, 0.0, weights)
    return kept / kept.sum(axis=1, keepdims=True)


def _stand_on_origin(
    vertices: np.ndarray, surface: np.ndarray, skeleton: Skeleton
) -> tuple[np.ndarray, np.ndarray, Skeleton]:
    """Shift a rest pose so that its lowest vertex is at z = 0 and its root above the origin."""
    shift = np.array([*skeleton.origins[0, :2], vertices[:, 2].min()])
    placed = Skeleton(skeleton.origins - shift, skeleton.rest_rotations)
    return vertices - shift, surface - shift, placed
