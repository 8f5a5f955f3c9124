"""A candidate's design → the scene to simulate: body and device, placed."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from simcore.body.build import Body, build_body, posed_skin
from simcore.body.flesh import flesh_under_skin
from simcore.body.posture import configuration
from simcore.body.skin import vertex_normals
from simcore.body.tissue import Tissue
from simcore.config.designs import Design, Method, Placement, Posture, UniformFlesh
from simcore.config.robotic_lift import MeshSurface, SeatAndBackrest
from simcore.config.sling_lift import Bed, SlingLift
from simcore.contact.reference import find_penetration
from simcore.device.bed import bed_distance
from simcore.device.build import build_surface
from simcore.device.distance import DistanceField, device_distance
from simcore.device.motion import STILL, DeviceState, Motion
from simcore.device.surface import Surface, mat_coordinates
from simcore.errors import SimulationError
from simcore.sheet.sling import Sling, build_sling

APPROACH_GAP = 1e-3
"""Clearance that an approach leaves, so that the next one can slide along the device [m]."""

PENETRATION_SEARCH_RADIUS = 0.1
"""Radius of the search for penetration at the start [m]: half a thigh's thickness, so that no
device vertex inside the body is missed."""


@dataclass(frozen=True, eq=False)
class Mat:
    """Points that carry the body, as they lie on a flat mat.

    Attributes
    ----------
    points : (N, 2) float64
        [m].
    tile : (2,) float64
        Size of the part of the mat that each of them stands for [m].
    """

    points: np.ndarray
    tile: np.ndarray


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that `simulate` needs.

    Attributes
    ----------
    body : Body
    surface : Surface
        What is rigid: the lift's support, or the bed of a sling lift.
    motion : Motion
        Of the lift's support, or of the sling lift's spreader bar.
    sling : Sling or None
        What hangs from that bar.
    flesh : Tissue or None
        Under each skin vertex, where the method's contact is with flesh.
    distance : DistanceField or None
        Of the lift's support, likewise; of a sling lift's bed always.
    method : Method
    configuration : (60,) float64
        Where the body starts; also the reference of its posture control.
    """

    body: Body
    surface: Surface
    motion: Motion
    sling: Sling | None
    flesh: Tissue | None
    distance: DistanceField | None
    method: Method
    configuration: np.ndarray

    @property
    def weight(self) -> float:
        """Of the body, and of the sheet if any [N]."""
        sheet = self.sling.solver.sheet.net.mass.sum() if self.sling else 0.0
        return float((self.body.mass + sheet) * -self.body.model.gravity.linear[2])

    @property
    def mat(self) -> Mat:
        """The mat over what carries the body: the sheet, if any."""
        if self.sling:
            net = self.sling.solver.sheet.net
            return Mat(net.rest_position, net.spacing)
        return _mat(self.surface)

    def surface_state(self, moved: DeviceState) -> DeviceState:
        """Return where the rigid surface is when the motion program is at `moved`."""
        return STILL if self.sling else moved


@lru_cache(maxsize=4)
def _mat(surface: Surface) -> Mat:
    return Mat(mat_coordinates(surface), np.full(2, surface.spacing))


def build_scene(design: Design, body_name: str, root: Path) -> Scene:
    """Return the placed scene of a design; mesh files are sought under `root`.

    Raises
    ------
    DesignError
        The body cannot be reached, the mesh file is broken, or the sling cannot hang so.
    SimulationError
        The body misses the device, or starts inside it beyond the method's limit.
    """
    body, device, method = _body(design.body, body_name), design.device, design.method
    surface = _surface(device.rigid_part, root)
    motion = Motion(device.motion, device.support_angle_rad)
    sling = _sling(design, motion)
    start = STILL if sling else motion(0.0)
    posture = _posture(body, design.posture, surface.recline)
    limit = method.contact.initial_penetration_limit_m
    q = _carry(_place(body, posture.tobytes(), surface, design.posture.placement, limit), start)
    flesh = distance = None
    if method.contact.law == "foundation":
        flesh = _flesh(body, method.contact.flesh)
    if sling or flesh:
        distance = _distance(device.rigid_part, root)
    return Scene(body, surface, motion, sling, flesh, distance, method, q)


def check_device(design: Design, root: Path) -> None:
    """Raise DesignError where the device cannot be built; places no body on it."""
    _surface(design.device.rigid_part, root)
    _sling(design, Motion(design.device.motion, design.device.support_angle_rad))


def _sling(design: Design, motion: Motion) -> Sling | None:
    if not isinstance(design.device, SlingLift):
        return None
    pelvis_x = design.posture.placement.pelvis_m[0]
    return build_sling(design.device, design.method, pelvis_x, motion(0.0))


@lru_cache(maxsize=4)
def _body(design, name: str) -> Body:
    return build_body(design, name)


@lru_cache(maxsize=4)
def _flesh(body: Body, layer: UniformFlesh | None) -> Tissue:
    return flesh_under_skin(body, layer)


@lru_cache(maxsize=4)
def _distance(design: SeatAndBackrest | MeshSurface | Bed, root: Path) -> DistanceField:
    if isinstance(design, Bed):
        return bed_distance(design)
    return device_distance(design, _surface(design, root))


@lru_cache(maxsize=4)
def _surface(design: SeatAndBackrest | MeshSurface | Bed, root: Path) -> Surface:
    return build_surface(design, root)


def _posture(body: Body, posture: Posture, recline: float) -> np.ndarray:
    """Return the configuration with the trunk reclined and the thighs where they were."""
    angles = {
        joint: {name: np.radians(value) for name, value in each.items()}
        for joint, each in posture.angles_deg.items()
    }
    common = angles.pop("hip", {})
    for side in ("hip_left", "hip_right"):
        hip = {**common, **angles.get(side, {})}
        angles[side] = {**hip, "flexion": hip.get("flexion", 0.0) - recline}
    q = configuration(body, angles)
    q[3:7] = Rotation.from_rotvec([0, -recline, 0]).as_quat()
    return q


@lru_cache(maxsize=16)
def _place(
    body: Body, posture: bytes, surface: Surface, placement: Placement, limit: float
) -> np.ndarray:
    """Move the body to its start in the device frame, then along each approach until it touches.

    Inclined or not, a device has its body in the same place: a sweep asks once.
    """
    q = np.frombuffer(posture).copy()
    q[:3] = placement.pelvis_m
    skin = posed_skin(body, q)
    for direction in placement.approach:
        unit = np.array(direction) / np.linalg.norm(direction)
        gap = _gap_along(unit, skin, body.skin.faces, surface)
        if not np.isfinite(gap):
            raise SimulationError(
                "misses_device", f"moved along {list(direction)}, the body misses the device"
            )
        shift = (gap - APPROACH_GAP) * unit
        skin += shift
        q[:3] += shift
    _refuse_penetration(body, skin, surface, limit)
    q.flags.writeable = False
    return q


def _carry(q: np.ndarray, start: DeviceState) -> np.ndarray:
    """Return a configuration in the device frame as one in the world."""
    q = q.copy()
    q[:3] = start.rotation @ q[:3] + start.position
    q[3:7] = (Rotation.from_matrix(start.rotation) * Rotation.from_quat(q[3:7])).as_quat()
    return q


def _gap_along(unit: np.ndarray, skin: np.ndarray, faces: np.ndarray, device: Surface) -> float:
    """Return how far the skin can move along a direction before it meets the device [m].

    Exact between the skin's vertices and the device's faces, and between the device's contact
    points and the skin's faces; infinite where they never meet.
    """
    gap = np.inf
    pairs = (
        (skin, device.vertices, device.faces, unit),
        (device.contact_points, skin, faces, -unit),
    )
    for origins, vertices, triangles, ray in pairs:
        target = trimesh.Trimesh(vertices, triangles, process=False)
        hits, rays, _ = target.ray.intersects_location(
            origins, np.tile(ray, (len(origins), 1)), multiple_hits=False
        )
        if len(hits):
            gap = min(gap, float(((hits - origins[rays]) @ ray).min()))
    return gap


def _refuse_penetration(body: Body, skin: np.ndarray, surface: Surface, limit: float) -> None:
    """Raise where skin (n, 3) in the device frame starts deeper than a limit [m] in the device."""
    found = find_penetration(
        skin, vertex_normals(body.skin, skin), surface.contact_points, PENETRATION_SEARCH_RADIUS
    )
    if len(found.depth) and found.depth.max() > limit:
        vertex = found.skin_vertex[found.depth.argmax()]
        raise SimulationError(
            "initial_penetration",
            f"{segment_of_vertex(body, vertex)} starts {1e3 * found.depth.max():.1f} mm inside the "
            f"device (limit {1e3 * limit:.1f} mm); change posture.placement or the geometry",
        )


def segment_of_vertex(body: Body, vertex: int) -> str:
    """Return the name of the segment that carries most of a skin vertex."""
    skin = body.skin
    influences = slice(skin.influence_offsets[vertex], skin.influence_offsets[vertex + 1])
    heaviest = skin.influence_weight[influences].argmax()
    return body.segment_names[skin.influence_segment[influences][heaviest]]
