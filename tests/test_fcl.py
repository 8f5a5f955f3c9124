"""Distances against FCL, which shares no code with ours: capsules, and solids on a grid."""

import fcl
import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from test_device_distance import nodes
from test_self_contact import Parts

from simcore.contact.self_contact import add_self_contact
from simcore.device.distance import BAND, mesh_distance

seeds = st.integers(0, 2**32 - 2)

BALL = 0.05
"""Probes with a ball that always cuts the surface where a grid is exact [m]: what FCL finds apart
is right to a millimetre only, and how deep two solids are in each other to a micrometre."""

SOLIDS = {
    "box": lambda rng: trimesh.creation.box(rng.uniform(0.04, 0.3, 3)),
    "cylinder": lambda rng: trimesh.creation.cylinder(*rng.uniform(0.04, 0.2, 2), sections=24),
    "cone": lambda rng: trimesh.creation.cone(*rng.uniform(0.06, 0.2, 2), sections=24),
    "hull": lambda rng: trimesh.convex.convex_hull(rng.normal(scale=0.08, size=(20, 3))),
}


@pytest.fixture(autouse=True, scope="module")
def own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMCORE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def signed_distance(first, second, signed: bool) -> tuple[float, np.ndarray]:
    """Return FCL's distance and nearest points (2, 3) of two objects.

    Only a request that is not `signed` is answered by its formula for two capsules, overlap too.
    """
    result = fcl.DistanceResult()
    request = fcl.DistanceRequest(enable_nearest_points=True, enable_signed_distance=signed)
    return fcl.distance(first, second, request, result), np.array(result.nearest_points)


def as_capsule(parts: Parts, part: int) -> fcl.CollisionObject:
    ends = parts.points(part, [0, 1])
    axis = ends[1] - ends[0]
    length = np.linalg.norm(axis)
    turn, _ = Rotation.align_vectors([axis / length], [[0, 0, 1]])
    place = fcl.Transform(turn.as_matrix(), ends.mean(axis=0))
    return fcl.CollisionObject(fcl.Capsule(parts.radius[part, 0], length), place)


@settings(max_examples=300)
@given(seeds)
def test_capsules_meet_where_fcl_has_them_meet(seed):
    """Apart or overlapping: distance, nearest points of both axes, and the line between them."""
    parts = Parts.random(np.random.default_rng(seed), tapered=False, reach=0.3)
    distance, (p, q) = signed_distance(as_capsule(parts, 0), as_capsule(parts, 1), signed=False)
    assert parts.overlaps()[0] == pytest.approx(-distance, abs=1e-10)

    direction = (q - p) / distance
    first, second = parts.radius[:, 0]
    axes = np.array([parts.points(part, [1])[0] - parts.points(part, [0])[0] for part in (0, 1)])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    # Points of parallel axes are not unique, and the line has none where the axes or skins meet.
    assume(np.linalg.norm(np.cross(*axes)) > 0.03)
    assume(abs(distance) > 1e-4 and distance + first + second > 1e-4)
    force, (place, normal, _) = np.zeros((2, 6)), parts.met()
    add_self_contact(
        parts.pairs, parts.ends, parts.radius, np.array([-10.0]), parts.rotations,
        parts.positions, np.zeros((2, 6)), np.ones(1), np.zeros(1), 0.0, force, place, normal,
        np.zeros(1),
    )  # what is allowed is negative, so that what is apart pushes too
    assert normal[0] == pytest.approx(direction, abs=1e-8)
    middle = (p - first * direction + q + second * direction) / 2
    assert place[0] == pytest.approx(middle, abs=1e-8)


@pytest.mark.parametrize("solid", SOLIDS)
@settings(max_examples=8)
@given(seed=seeds)
def test_grids_hold_the_distance_that_fcl_finds(solid, seed):
    """Of convex solids in any place, inside and up to where a grid is exact."""
    rng = np.random.default_rng(seed)
    mesh = SOLIDS[solid](rng)
    turn, shift = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-1, 1, 3)
    field = mesh_distance(mesh.vertices @ turn.T + shift, mesh.faces, 0.02)
    faces = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).astype(np.int32)
    body = fcl.CollisionObject(
        fcl.Convex(np.array(mesh.vertices), len(faces), faces.ravel()), fcl.Transform(turn, shift)
    )
    near = np.flatnonzero(field.values < BAND)
    chosen = rng.choice(near, min(200, len(near)), replace=False)
    for place, told in zip(nodes(field)[chosen], field.values.ravel()[chosen], strict=True):
        ball = fcl.CollisionObject(fcl.Sphere(BALL), fcl.Transform(np.eye(3), place))
        distance, _ = signed_distance(body, ball, signed=True)
        assert told == pytest.approx(distance + BALL, abs=5e-6)
