"""Linear-blend skinning, its velocity and its transpose: the readable path over all vertices.

With α_ij the skin weight of vertex i on segment j and p_ij the vertex in that segment's frame,

    Eq. 3    v_i = Σ_j α_ij (R_j p_ij + x_j)
    Eq. 8    v̇_i = Σ_j α_ij (ẋ_j + ω_j × R_j p_ij)     (the paper's sign reads the same)
    Eq. 12   τ = Jᵀ f, through the wrench Σ_i α_ij (f_i, R_j p_ij × f_i) on each segment
"""

from dataclasses import dataclass, fields

import numpy as np
import pinocchio as pin

from simcore.body.segments import PARENTS
from simcore.compiled import compiled


@dataclass(frozen=True, eq=False)
class Skin:
    """Skin surface, its blend weights and its one-rings; n vertices, f triangles.

    Attributes
    ----------
    faces : (f, 3) int32
        Outward winding.
    influence_offsets : (n + 1,) int32
        Influences of vertex i are the entries from `[i]` to `[i + 1]`.
    influence_segment : (nnz,) int32
        Segment 0 to 17, which is the joint id − 1.
    influence_weight : (nnz,) float64
        α_ij; sums to 1 over each vertex.
    influence_point : (nnz, 3) float64
        p_ij, the vertex in the segment's frame [m].
    vertex_area : (n,) float64
        One third of the one-ring's area at rest [m²].
    ring_offsets : (n + 1,) int32
        One-ring pairs of vertex i are the entries from `[i]` to `[i + 1]`.
    ring_next : (3 f, 2) int32
        Pairs (b, c) so that the normal of i is Σ (v_b − v_i) × (v_c − v_i).
    """

    faces: np.ndarray
    influence_offsets: np.ndarray
    influence_segment: np.ndarray
    influence_weight: np.ndarray
    influence_point: np.ndarray
    vertex_area: np.ndarray
    ring_offsets: np.ndarray
    ring_next: np.ndarray

    @property
    def vertex_count(self) -> int:
        """Number of skin vertices n."""
        return len(self.influence_offsets) - 1


SKIN_FIELDS = tuple(field.name for field in fields(Skin))


def blend(skin: Skin, rotations: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Posed vertices (n, 3) [m], Eq. 3, for segment frames (18, 3, 3) and origins (18, 3) [m]."""
    return _blend(
        skin.influence_offsets, skin.influence_segment, skin.influence_weight,
        skin.influence_point, rotations, positions,
    )


def blend_velocity(
    skin: Skin,
    rotations: np.ndarray,
    linear_velocities: np.ndarray,
    angular_velocities: np.ndarray,
) -> np.ndarray:
    """Vertex velocities (n, 3) [m/s], Eq. 8.

    Parameters
    ----------
    rotations : (18, 3, 3)
        Segment frames to world.
    linear_velocities, angular_velocities : (18, 3)
        Of the segment origins [m/s] and of the segments [rad/s], world axes.
    """
    return _blend_velocity(
        skin.influence_offsets, skin.influence_segment, skin.influence_weight,
        skin.influence_point, rotations, linear_velocities, angular_velocities,
    )


def wrench_on_segments(skin: Skin, rotations: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Force [N] and moment about each segment origin [N m], world axes, (18, 6): J_Sᵀ f, Eq. 9.

    `forces` (n, 3) act on the skin vertices, world axes [N].
    """
    return _wrench(
        skin.influence_offsets, skin.influence_segment, skin.influence_weight,
        skin.influence_point, rotations, forces,
    )


def joint_torque(
    skin: Skin, model: pin.Model, data: pin.Data, q: np.ndarray, forces: np.ndarray
) -> np.ndarray:
    """Generalised force τ (47,) of forces (n, 3) [N] on the skin at configuration q, Eq. 12."""
    jacobian = pin.computeJointJacobians(model, data, q)  # world axes, about the world origin
    placements = [data.oMi[joint] for joint in range(1, model.njoints)]
    wrenches = wrench_on_segments(skin, np.array([m.rotation for m in placements]), forces)
    for wrench, placement in zip(wrenches, placements, strict=True):
        wrench[3:] += np.cross(placement.translation, wrench[:3])
    torque = np.empty(model.nv)
    for segment in range(len(PARENTS) - 1, -1, -1):
        joint = model.joints[segment + 1]
        columns = slice(joint.idx_v, joint.idx_v + joint.nv)
        torque[columns] = jacobian[:, columns].T @ wrenches[segment]
        if PARENTS[segment] >= 0:
            wrenches[PARENTS[segment]] += wrenches[segment]
    return torque


def vertex_normals(skin: Skin, vertices: np.ndarray) -> np.ndarray:
    """Unit outward normals (n, 3): the area-weighted mean of the one-ring's triangles."""
    return _vertex_normals(skin.ring_offsets, skin.ring_next, vertices)


def build_skin(
    vertices: np.ndarray,
    faces: np.ndarray,
    weights: np.ndarray,
    origins: np.ndarray,
    rest_rotations: np.ndarray,
) -> Skin:
    """Skin from its rest pose.

    Parameters
    ----------
    vertices : (n, 3)
        Rest vertices, world axes [m].
    faces : (f, 3)
    weights : (n, 18)
        Skin weights; rows sum to 1.
    origins, rest_rotations : (18, 3), (18, 3, 3)
        Segment frames in the rest pose.
    """
    owner, segment = np.nonzero(weights)
    local = np.einsum(
        "kji,kj->ki", rest_rotations[segment], vertices[owner] - origins[segment]
    )
    # The pair (b, c) of vertex a in triangle (a, b, c), for each of its three corners.
    pairs = np.concatenate([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]])
    corner = np.concatenate([faces[:, 0], faces[:, 1], faces[:, 2]])
    order = np.argsort(corner, kind="stable")
    edges = vertices[pairs] - vertices[corner][:, None]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    return Skin(
        faces=np.ascontiguousarray(faces, np.int32),
        influence_offsets=_offsets(owner, len(vertices)),
        influence_segment=segment.astype(np.int32),
        influence_weight=weights[owner, segment],
        influence_point=local,
        vertex_area=np.bincount(corner, areas, len(vertices)) / 3,
        ring_offsets=_offsets(corner, len(vertices)),
        ring_next=np.ascontiguousarray(pairs[order], np.int32),
    )


def _offsets(owners: np.ndarray, count: int) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.bincount(owners, minlength=count))]).astype(np.int32)


@compiled
def _blend(offsets, segments, weights, points, rotations, positions):
    vertices = np.zeros((len(offsets) - 1, 3))
    for i in range(len(vertices)):
        for k in range(offsets[i], offsets[i + 1]):
            rotation, position, p = rotations[segments[k]], positions[segments[k]], points[k]
            for d in range(3):
                arm = rotation[d, 0] * p[0] + rotation[d, 1] * p[1] + rotation[d, 2] * p[2]
                vertices[i, d] += weights[k] * (arm + position[d])
    return vertices


@compiled
def _blend_velocity(offsets, segments, weights, points, rotations, linear, angular):
    velocities = np.zeros((len(offsets) - 1, 3))
    for i in range(len(velocities)):
        for k in range(offsets[i], offsets[i + 1]):
            j = segments[k]
            arm = rotations[j] @ points[k]
            velocities[i] += weights[k] * (linear[j] + np.cross(angular[j], arm))
    return velocities


@compiled
def _wrench(offsets, segments, weights, points, rotations, forces):
    wrench = np.zeros((len(rotations), 6))
    for i in range(len(offsets) - 1):
        for k in range(offsets[i], offsets[i + 1]):
            j = segments[k]
            force = weights[k] * forces[i]
            wrench[j, :3] += force
            wrench[j, 3:] += np.cross(rotations[j] @ points[k], force)
    return wrench


@compiled
def _vertex_normals(offsets, pairs, vertices):
    # Number by number: operations on arrays take 2 s more to compile.
    normals = np.zeros(vertices.shape)
    for i in range(len(normals)):
        x, y, z, normal = vertices[i, 0], vertices[i, 1], vertices[i, 2], normals[i]
        for k in range(offsets[i], offsets[i + 1]):
            b, c = pairs[k, 0], pairs[k, 1]
            p, q, r = vertices[b, 0] - x, vertices[b, 1] - y, vertices[b, 2] - z
            u, v, w = vertices[c, 0] - x, vertices[c, 1] - y, vertices[c, 2] - z
            normal[0] += q * w - r * v
            normal[1] += r * u - p * w
            normal[2] += p * v - q * u
        length = np.sqrt(normal @ normal)
        for a in range(3):
            normal[a] /= length
    return normals
