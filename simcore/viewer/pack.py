"""A recording → blocks of bytes that viewer/payload.js unpacks: bodies, devices and runs."""

import gzip
import hashlib
import json
import struct
from itertools import product

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from simcore.body.build import Body, posed_skin
from simcore.body.segments import PARENTS
from simcore.config.robotic_lift import SeatAndBackrest
from simcore.device.build import build_surface
from simcore.device.surface import Surface
from simcore.export.gltf import four_influences
from simcore.export.recording import (
    Recording,
    joint_quaternions,
    one_sign,
    rotation_matrices,
)
from simcore.export.shapes import MATTRESS_THICKNESS

MESH_QUANTUM, SHEET_QUANTUM = 1e-4, 5e-4
"""Positions are whole multiples of these [m]: 16 bits reach 3.3 m and 16 m."""

DEVICE_VERTICES = 3000
"""Of a parametric device as drawn: its shape does not depend on them. ASSUME: 3 cm apart is fine
enough for fillets of 5 cm with smooth normals."""

GZIP_LEVEL = 6
"""Level 9 takes five times as long for 2 % less."""

OUTERMOST_STEP = 5
"""The space that a run takes is found from every so many frames."""

OVERVIEW = {"robotic_lift": np.radians(45), "sling_lift": np.radians(62)}
"""Least turn of the overview's camera from ahead towards the left side [rad]; of a sling more from
the side, for the sheet hides a body between its hems."""

VIEWS = {
    "robotic_lift": {"front": "front", "back": "back"},
    "sling_lift": {"front": "feet", "back": "head"},
}
"""What the views along the world's x are called."""


def pack(header: dict, arrays: dict[str, np.ndarray]) -> bytes:
    """Return a block: gzip of the header's length, the header, and the arrays, each on 4 bytes.

    Arrays are uint8, uint16, uint32, int16 or float32, little-endian. The same input gives the
    same bytes.
    """
    body, places = bytearray(), {}
    for name, values in arrays.items():
        body += bytes(-len(body) % 4)
        places[name] = {
            "type": values.dtype.str[1:], "offset": len(body), "count": int(values.size)
        }
        body += np.ascontiguousarray(values).tobytes()
    text = json.dumps({**header, "arrays": places}, separators=(",", ":")).encode()
    text += b" " * (-(4 + len(text)) % 4)
    content = struct.pack("<I", len(text)) + text + bytes(body)
    return gzip.compress(content, GZIP_LEVEL, mtime=0)


def name_of(kind: str, block: bytes) -> str:
    """Return the id of a block by what it holds, so that equal ones are sent once."""
    return f"{kind}-{hashlib.sha256(block).hexdigest()[:12]}"


def pack_body(body: Body) -> bytes:
    """Return the skin in its rest pose, its weights, and the bones with that pose."""
    q = body.rest_configuration
    segments, weights = four_influences(body)
    offset = np.array([each.translation for each in body.model.jointPlacements[1:]])
    offset[0] = q[:3]
    return pack(
        {"kind": "body", "name": body.name, "quantum": MESH_QUANTUM, "parents": list(PARENTS)},
        {
            "position": _steps(posed_skin(body, q), MESH_QUANTUM),
            "faces": _indices(body.skin.faces),
            "segments": segments,
            "weights": _shares(weights),
            "offset": offset.astype(np.float32),
            "rest": joint_quaternions(body, q[None])[0].astype(np.float32),
        },
    )


def pack_device(recording: Recording) -> bytes:
    """Return the rigid support of a robotic lift, coarser than it is simulated."""
    surface = recording.surface
    design = recording.design.device.rigid_part
    if isinstance(design, SeatAndBackrest) and design.vertex_count > DEVICE_VERTICES:
        coarse = design.model_copy(update={"vertex_count": DEVICE_VERTICES})
        surface: Surface = build_surface(coarse, None)
    return pack(
        {"kind": "device", "quantum": MESH_QUANTUM},
        {"position": _steps(surface.vertices, MESH_QUANTUM), "faces": _indices(surface.faces)},
    )


def pack_run(
    recording: Recording, scale: float, labels: dict, body: str, device: str | None
) -> bytes:
    """Return the frames of a run.

    Parameters
    ----------
    recording : Recording
    scale : float
        End of the pressure scale [Pa]: 255 stands for it and above.
    labels : dict
        Texts: `title`, `verdict`, `outcome`.
    body, device : str, str or None
        Ids of the blocks that it moves.
    """
    pressure = recording.column("skin_pressure")
    touched = recording.frames["skin_vertex"].values
    regions = recording.body.vertex_region[touched]
    highest = pressure.argmax(axis=1) if len(touched) else np.zeros(len(pressure), int)
    design = recording.design.device
    header = {
        "kind": "run", **labels, "body": body, "device": device, "bed": None, "sheet": None,
        "bar": recording.bar_tubes.round(4).tolist(),
        "outermost": _outermost(recording).round(3).tolist(),
        "azimuth": _azimuth(recording),
        "views": {view: view for view in ("overview", "side", "above", "below")}
        | VIEWS[design.kind],
        "moves_until": design.motion.keyframes[-1].time_s,
        "places": [name.replace("_", " ") for name in recording.body.region_names],
    }
    shares = np.round(255 * np.clip(pressure / scale, 0, 1)).astype(np.uint8)
    arrays = {
        "time": recording.time.astype(np.float32),
        "root": recording.column("q")[:, :3].astype(np.float32),
        "joints": recording.joint_quaternions.astype(np.float32),
        "device_position": recording.column("device_position").astype(np.float32),
        "device_turn": one_sign(recording.column("device_quaternion")).astype(np.float32),
        "straps": recording.strap_ends.astype(np.float32),
        "touched": touched.astype(np.uint32),
        # Steps in time, a vertex after another: mostly zeros, which gzip makes little of.
        "pressure": np.diff(shares, axis=0, prepend=np.uint8(0)).T,
        "peak": pressure.max(axis=1, initial=0.0).astype(np.float32),
        "peak_place": (regions[highest] if len(touched) else highest).astype(np.uint8),
    }
    if recording.net is not None:
        header["bed"] = _bed(recording.surface)
        header["sheet"] = {
            "quantum": SHEET_QUANTUM, "vertices": len(recording.net.rest_position),
            "pressed_in": recording.column("depth_max").max(),
        }
        arrays |= _sheet(recording)
    return pack(header, arrays)


def _sheet(recording: Recording) -> dict[str, np.ndarray]:
    """Return positions (3, T, m) as steps in time, low and high bytes apart, and the faces.

    Steps 0, −1, 1, −2 … are folded to 0, 1, 2, 3 …: high bytes are then nearly all zero, and gzip
    makes a quarter of what it makes of whole positions.
    """
    steps = _steps(recording.column("sheet_position"), SHEET_QUANTUM).transpose(2, 0, 1)
    steps = np.diff(steps, axis=1, prepend=np.int16(0))
    folded = ((steps << 1) ^ (steps >> 15)).astype(np.uint16)
    return {
        "sheet_low": (folded & 255).astype(np.uint8),
        "sheet_high": (folded >> 8).astype(np.uint8),
        "sheet_faces": _indices(recording.net.faces),
    }


def _bed(surface: Surface) -> list[list[float]]:
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    return [(low - [0, 0, MATTRESS_THICKNESS]).tolist(), high.tolist()]


def _outermost(recording: Recording) -> np.ndarray:
    """Return the points (k, 3) of body and device that reach farthest in the run [m].

    A point for each of many directions: what a camera has to frame, seen from anywhere.
    """
    last = len(recording.time) - 1
    frames = np.unique(np.append(np.arange(0, last, OUTERMOST_STEP), last))
    directions = np.array([each for each in product((-2.0, -1, 0, 1, 2), repeat=3) if any(each)])
    points = [_carried(recording.body, recording.column("q")[frames], directions)]
    if recording.net is None:
        moved = recording.surface.vertices
    else:
        low, high = np.array(_bed(recording.surface))
        corners = np.array(list(product((0, 1), repeat=3)))
        points += [low + corners * (high - low), *recording.column("sheet_position")[frames]]
        moved = recording.bar_tubes.reshape(-1, 3)
    if len(moved):
        moved = _farthest(moved, directions)
        turns = rotation_matrices(recording.column("device_quaternion")[frames])
        turned = np.einsum("tij,sj->tsi", turns, moved)
        places = recording.column("device_position")[frames, None]
        points.append((turned + places).reshape(-1, 3))
    return _farthest(np.concatenate([_farthest(each, directions) for each in points]), directions)


def _carried(body: Body, q: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return points (k, 3) that the skin of configurations (T, 60) lies between [m].

    A skin vertex is a mean of where each of its segments carries it: taken are those points
    whose segment has half of the weight, in each segment those that reach farthest.
    """
    skin, data = body.skin, body.model.createData()
    heavy = skin.influence_weight >= 0.5
    points = [
        _farthest(skin.influence_point[heavy & (skin.influence_segment == segment)], directions)
        for segment in range(len(PARENTS))
    ]
    carried = []
    for configuration in q:
        pin.forwardKinematics(body.model, data, configuration)
        for placement, own in zip(data.oMi[1:], points, strict=True):
            carried.append(own @ placement.rotation.T + placement.translation)
    return np.concatenate(carried)


def _farthest(points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return those of the points (n, 3) that reach farthest in any of the directions (d, 3)."""
    # One after another: of all at once BLAS makes threads that wait for each other.
    return np.unique(points[[(points @ each).argmax() for each in directions]], axis=0)


def _azimuth(recording: Recording) -> float:
    """Return where the overview's camera stands [rad]: between start and end, or aside."""
    turns = Rotation.from_quat(recording.column("device_quaternion")[[0, -1]]).as_matrix()
    (start, end) = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    turned = float(np.angle(np.exp(1j * (end - start))))
    aside = OVERVIEW[recording.design.device.kind]
    return float(start + turned / 2 + max(aside - abs(turned) / 2, 0.0))


def _steps(values: np.ndarray, quantum: float) -> np.ndarray:
    """Return values as multiples of a quantum in 16 bits, those beyond their reach cut off."""
    return np.clip(np.round(values / quantum), -(2**15), 2**15 - 1).astype(np.int16)


def _shares(weights: np.ndarray) -> np.ndarray:
    """Return weights (n, 4) as 16-bit shares that still sum to 1: the first takes the rest."""
    shares = np.round(65535 * weights.astype(float)).astype(np.int64)
    shares[:, 0] += 65535 - shares.sum(axis=1)
    return shares.astype(np.uint16)


def _indices(faces: np.ndarray) -> np.ndarray:
    return faces.astype(np.uint16 if faces.max() < 2**16 - 1 else np.uint32)
