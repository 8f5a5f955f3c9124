"""Mass, centre of mass and inertia of each segment: from the mesh, or from de Leva's table."""

from dataclasses import dataclass

import numba
import numpy as np
from scipy.spatial import cKDTree

from simcore.body.de_leva import LENGTHS, SHARES
from simcore.body.segments import INDEX, SEGMENT_NAMES, kind_of
from simcore.body.skeleton import DOWN, Skeleton

# [m]; 0.006 changes hands by 1 %, toes by 6 % and every other segment's mass by under 0.5 %.
VOXEL = 0.009
NEIGHBOURS = 12  # surface vertices an interior voxel takes its weights from

HIP_PLANE = np.radians(37.0)  # de Leva (1996), after Zatsiorsky and Seluyanov (from memory)
HALF_FOOT_WIDTH = 0.1  # [m] generous; feet at rest are some 0.4 m apart
TOE_SHARE = 0.1  # ASSUME: of the foot's mass; the mesh of the average male gives 0.10

# Density [kg/m³] after Dempster (1955), as tabulated by Winter, Biomechanics and Motor Control of
# Human Movement, Table 4.1 (from memory: unverified).  Only their ratios matter: the sum is
# scaled to the body's mass.
DENSITY = {
    "head": 1110.0, "thoracic": 920.0, "lumbar": 1010.0, "pelvis": 1010.0, "upper_arm": 1070.0,
    "forearm": 1130.0, "hand": 1160.0, "thigh": 1050.0, "shank": 1090.0, "foot": 1100.0,
    "toe": 1100.0,
}


@dataclass(frozen=True, eq=False)
class SegmentInertias:
    """Inertial parameters in the segment frames.

    Attributes
    ----------
    masses : (18,) float64
        [kg].
    coms : (18, 3) float64
        Centres of mass [m].
    inertias : (18, 3, 3) float64
        About the centres of mass [kg m²].
    """

    masses: np.ndarray
    coms: np.ndarray
    inertias: np.ndarray


def inertia_from_mesh(
    vertices: np.ndarray, faces: np.ndarray, weights: np.ndarray, skeleton: Skeleton, mass: float
) -> SegmentInertias:
    """Inertias of the volume inside a surface, each point shared out by blend weights.

    Parameters
    ----------
    vertices, faces : (n, 3), (f, 3)
        Closed surface in the rest pose, world axes [m].
    weights : (n, 18)
        Blend weights.
    skeleton : Skeleton
        In the same pose.
    mass : float
        Of the whole body [kg]; the sum is scaled to it.
    """
    points = interior_points(vertices, faces, VOXEL)
    shares = _interior_shares(points, vertices, weights, skeleton)
    densities = np.array([DENSITY[kind_of(name)] for name in SEGMENT_NAMES])
    point_masses = shares * densities * VOXEL**3
    point_masses *= mass / point_masses.sum()
    masses = point_masses.sum(axis=0)
    coms, inertias = np.empty((len(masses), 3)), np.empty((len(masses), 3, 3))
    for j in range(len(masses)):
        local = (points - skeleton.origins[j]) @ skeleton.rest_rotations[j]
        coms[j] = point_masses[:, j] @ local / masses[j]
        arms = local - coms[j]
        second = np.einsum("i,ik,il->kl", point_masses[:, j], arms, arms)
        second += masses[j] * VOXEL**2 / 12 * np.eye(3)  # each voxel is a cube, not a point
        inertias[j] = np.trace(second) * np.eye(3) - second
    return SegmentInertias(masses, coms, inertias)


def interior_points(vertices: np.ndarray, faces: np.ndarray, spacing: float) -> np.ndarray:
    """Centres (m, 3) [m] of the voxels inside a closed surface."""
    # Voxels mirror each other in y = 0, so that the halves of a symmetric body agree.  No vertical
    # ray lies in that plane, full of vertices; an irrational shift keeps rays off others in x.
    low = vertices.min(axis=0) - spacing * np.array([np.pi, 0.0, 1.0]) / 4
    low[1] = spacing * np.floor(low[1] / spacing)
    shape = np.ceil((vertices.max(axis=0) - low) / spacing).astype(int) + 1
    inside = _fill(vertices, faces, low, spacing, shape[0], shape[1], shape[2])
    return low + spacing * (np.argwhere(inside) + 0.5)


@numba.njit(cache=True, error_model="numpy", fastmath=False)
def _fill(vertices, faces, low, spacing, nx, ny, nz):
    """Flags (nx, ny, nz) of voxel centres inside, by counting crossings along vertical rays."""
    inside = np.zeros((nx, ny, nz), np.bool_)
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        first_x = int(np.floor((min(a[0], b[0], c[0]) - low[0]) / spacing - 0.5))
        last_x = int(np.ceil((max(a[0], b[0], c[0]) - low[0]) / spacing - 0.5))
        first_y = int(np.floor((min(a[1], b[1], c[1]) - low[1]) / spacing - 0.5))
        last_y = int(np.ceil((max(a[1], b[1], c[1]) - low[1]) / spacing - 0.5))
        for i in range(max(first_x, 0), min(last_x, nx - 1) + 1):
            x = low[0] + spacing * (i + 0.5)
            for j in range(max(first_y, 0), min(last_y, ny - 1) + 1):
                y = low[1] + spacing * (j + 0.5)
                u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                w = 1.0 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                z = u * a[2] + v * b[2] + w * c[2]
                for k in range(nz):
                    if low[2] + spacing * (k + 0.5) > z:
                        break
                    inside[i, j, k] = not inside[i, j, k]
    return inside


def _interior_shares(
    points: np.ndarray, vertices: np.ndarray, weights: np.ndarray, skeleton: Skeleton
) -> np.ndarray:
    """Share (m, 18) of each interior point that moves with each segment."""
    distances, nearest = cKDTree(vertices).query(points, k=NEIGHBOURS)
    closeness = 1 / (distances**2 + VOXEL**2)
    closeness /= closeness.sum(axis=1, keepdims=True)
    shares = np.einsum("mk,mkj->mj", closeness, weights[nearest])
    origins = skeleton.origins
    neck, pelvis, thoracic = INDEX["head"], INDEX["pelvis"], INDEX["thoracic"]
    _cut(shares, points, origins[neck], np.array([0.0, 0.0, -1.0]), neck, thoracic)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        arm, thigh = INDEX[f"upper_arm_{side}"], INDEX[f"thigh_{side}"]
        along_arm = skeleton.rest_rotations[arm] @ [0.0, 0.0, -1.0]
        _cut(shares, points, origins[arm], -along_arm, arm, thoracic)
        # De Leva's thigh ends at a plane through the hip joint, 37° from the sagittal plane.
        outward = np.array([0.0, sign * np.cos(HIP_PLANE), -np.sin(HIP_PLANE)])
        same_side = sign * points[:, 1] > 0
        _cut(shares, points, origins[thigh], outward, pelvis, thigh, same_side)
    return shares


def _cut(shares, points, origin, normal, giver, taker, eligible=True):
    """Hand a segment's shares to another beyond a plane, in place."""
    beyond = ((points - origin) @ normal > 0) & eligible
    shares[beyond, taker] += shares[beyond, giver]
    shares[beyond, giver] = 0.0


def inertia_from_de_leva(
    sex: str, stature: float, mass: float, skeleton: Skeleton, rest_vertices: np.ndarray
) -> SegmentInertias:
    """Inertias of de Leva's average body at this mass [kg], on this skeleton.

    Limb lengths are the skeleton's; those of head, trunk, hand and foot are the table's, scaled
    by stature [m], because their end points are not joint centres.
    """
    table, origins = SHARES[sex], skeleton.origins
    lengths = {kind: share * stature for kind, share in LENGTHS[sex].items()}
    up = origins[INDEX["head"]] - origins[INDEX["pelvis"]]
    up /= np.linalg.norm(up)
    below = {"pelvis": 0.0, "lumbar": lengths["pelvis"]}
    below["thoracic"] = below["lumbar"] + lengths["lumbar"]
    crown = rest_vertices[np.argmax(rest_vertices[:, 2])]
    count = len(SEGMENT_NAMES)
    masses, coms, inertias = np.empty(count), np.empty((count, 3)), np.empty((count, 3, 3))
    for j, name in enumerate(SEGMENT_NAMES):
        kind = kind_of(name)
        row = table["foot" if kind == "toe" else kind]
        to_local = skeleton.rest_rotations[j].T
        if kind in ("pelvis", "lumbar", "thoracic"):
            length = lengths[kind]
            centre = origins[INDEX["pelvis"]] + up * (below[kind] + (1 - row.com) * length)
            coms[j] = to_local @ (centre - origins[j])
        elif kind == "head":
            length = lengths["head"]
            coms[j] = (crown - origins[j]) * [0, 0, 1] - [0, 0, row.com * length]
        elif kind in ("foot", "toe"):
            length = lengths["foot"]
            coms[j] = _foot_centre(name, skeleton, rest_vertices, row.com * length)
        else:
            child = {"thigh": "shank", "shank": "foot", "upper_arm": "forearm",
                     "forearm": "hand"}.get(kind)
            bone = DOWN * lengths["hand"] if child is None else to_local @ (
                origins[INDEX[name.replace(kind, child)]] - origins[j]
            )
            length = np.linalg.norm(bone)
            coms[j] = row.com * bone
        share = {"toe": TOE_SHARE, "foot": 1 - TOE_SHARE}.get(kind, 1.0)
        masses[j] = share * row.mass
        x, y, long = row.radii
        # The foot's long axis is x; the table's other two then lie along z and y.
        radii = np.array([long, y, x] if kind in ("foot", "toe") else [x, y, long]) * length
        inertias[j] = masses[j] * np.diag(radii**2) * share
    scale = mass / masses.sum()
    return SegmentInertias(masses * scale, coms, inertias * scale)


def _foot_centre(
    name: str, skeleton: Skeleton, rest_vertices: np.ndarray, from_heel: float
) -> np.ndarray:
    """Centre of mass of foot or toes in their own frame [m]; heel and tip are both feet's."""
    feet = []
    for side in ("left", "right"):
        ankle = INDEX[f"foot_{side}"]
        local = (rest_vertices - skeleton.origins[ankle]) @ skeleton.rest_rotations[ankle]
        feet.append(local[(local[:, 2] < 0) & (abs(local[:, 1]) < HALF_FOOT_WIDTH)])
    lowest, highest = np.concatenate(feet).min(axis=0), np.concatenate(feet).max(axis=0)
    if name.startswith("foot"):
        return np.array([lowest[0] + from_heel, 0.0, lowest[2] / 2])
    ankle, toes = (INDEX[f"{part}_left"] for part in ("foot", "toe"))
    step = skeleton.rest_rotations[ankle].T @ (skeleton.origins[toes] - skeleton.origins[ankle])
    return np.array([(highest[0] - step[0]) / 2, 0.0, 0.0])
