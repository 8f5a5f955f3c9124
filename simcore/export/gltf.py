"""A run → an animated, skinned glTF binary."""

from importlib.metadata import version

import numpy as np
from scipy.spatial.transform import Rotation

from simcore.body.build import Body, posed_skin
from simcore.body.segments import PARENTS
from simcore.export.glb import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, Glb
from simcore.export.recording import Recording, joint_quaternions, one_sign
from simcore.export.shapes import (
    BAR_RADIUS,
    STRAP_RADIUS,
    mattress,
    tube_placements,
    unit_tube,
    vertex_normals,
)
from simcore.pressure_scale import pressure_colours, scale_end

UPRIGHT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""World to glTF: x forward, y left, z up become z forward, x left, y up (glTF 2.0, 3.4)."""

INFLUENCES = 4
"""Segments that glTF blends at a vertex; the pruning of skin weights (simcore.body.construct)
leaves no shipped body more. Of more, the heaviest count."""

SHEET_SHAPES_MAX, SHEET_BYTES_MAX = 60, 6_000_000
"""Shapes between which a sheet is blended, and what they may take of the file. ASSUME: six shapes a
second over ten seconds; a sheet of 4000 vertices just has them."""

COLOURS = {
    "body": (1.0, 1.0, 1.0), "device": (0.40, 0.52, 0.64), "bed": (0.66, 0.69, 0.72),
    "sheet": (0.20, 0.55, 0.50), "strap": (0.86, 0.58, 0.22), "bar": (0.40, 0.52, 0.64),
}
"""sRGB; the body's is that of its vertices."""


def to_glb(recording: Recording) -> bytes:
    """Return a run as a glTF binary [m, s]; y is up, time begins with the first frame.

    The body is a skin on its 18 segments, coloured by the highest pressure on each vertex; the
    device, the spreader bar and the straps are moved nodes; the sheet blends between shapes.
    """
    writer = _Writer(recording)
    writer.body()
    if recording.net is None:
        writer.device()
    else:
        writer.bed()
        writer.bar()
        writer.straps()
        writer.sheet()
    return writer.finished()


class _Writer:
    def __init__(self, recording: Recording):
        self.recording = recording
        self.glb = Glb(f"simcore {version('simcore')}")
        self.time = recording.time - recording.time[0]
        self.world = self.glb.add(
            "nodes", name="world", rotation=Rotation.from_matrix(UPRIGHT).as_quat().tolist(),
            children=[],
        )
        self.roots = [self.world]
        self.materials, self.channels, self.samplers = {}, [], []
        self.clock = self._times(self.time)
        self.tube = None
        self.notes = {}

    def body(self) -> None:
        recording, glb = self.recording, self.glb
        body, quaternions = recording.body, recording.joint_quaternions
        offsets = np.array([each.translation for each in body.model.jointPlacements[1:]])
        root = recording.column("q")[:, :3]
        first = len(glb.tree["nodes"])
        for segment, name in enumerate(body.segment_names):
            children = [first + child for child, above in enumerate(PARENTS) if above == segment]
            at = offsets[segment] if PARENTS[segment] >= 0 else root[0]
            node = glb.add("nodes", name=name, translation=at.tolist(), children=children or None,
                           rotation=quaternions[0, segment].tolist())
            self._animate(node, "rotation", quaternions[:, segment])
        self._animate(first, "translation", root)
        glb.tree["nodes"][self.world]["children"].append(first)
        skin = glb.add(
            "skins", name=body.name, joints=list(range(first, first + len(PARENTS))),
            inverseBindMatrices=glb.add_array(_inverse_binds(body)),
        )
        rest = posed_skin(body, body.rest_configuration)
        peak = recording.pressure_peak
        scale = scale_end(float(peak.max()))
        segments, weights = four_influences(body)
        mesh = self._mesh(
            "body", rest @ UPRIGHT.T, vertex_normals(rest, body.skin.faces) @ UPRIGHT.T,
            body.skin.faces,
            COLOR_0=glb.add_array(_linear(pressure_colours(peak, scale)), ARRAY_BUFFER,
                                  normalized=True),
            JOINTS_0=glb.add_array(segments, ARRAY_BUFFER),
            WEIGHTS_0=glb.add_array(weights, ARRAY_BUFFER),
            _PRESSURE_PEAK=glb.add_array(peak.astype(np.float32), ARRAY_BUFFER),
        )
        # A skin stands where its joints put it, whatever is above its node: hence a root.
        self.roots.append(glb.add("nodes", name="body", mesh=mesh, skin=skin))
        self.notes |= {"pressure_scale_pa": scale, "pressure_peak_pa": float(peak.max())}

    def device(self) -> None:
        surface = self.recording.surface
        normals = vertex_normals(surface.vertices, surface.faces)
        node = self._node("device", self._mesh("device", surface.vertices, normals, surface.faces))
        self._move_with_program(node)

    def bed(self) -> None:
        self._node("bed", self._mesh("bed", *mattress(self.recording.surface.vertices)))

    def bar(self) -> None:
        placed = tube_placements(self.recording.bar_tubes, BAR_RADIUS)
        children = [self._tube("bar", *each) for each in zip(*placed, strict=True)]
        node = self._node("spreader_bar", children=children or None)
        self._move_with_program(node)

    def straps(self) -> None:
        ends = self.recording.strap_ends
        for i in range(ends.shape[1]):
            moves = tube_placements(ends[:, i], STRAP_RADIUS)
            node = self._tube("strap", *(each[0] for each in moves))
            self.glb.tree["nodes"][self.world]["children"].append(node)
            for path, values in zip(("translation", "rotation", "scale"), moves, strict=True):
                self._animate(node, path, one_sign(values) if path == "rotation" else values)

    def sheet(self) -> None:
        recording, glb = self.recording, self.glb
        shapes, faces = recording.column("sheet_position"), recording.net.faces
        kept = shape_frames(*shapes.shape[:2])
        normals = [vertex_normals(shapes[frame], faces) for frame in kept]
        targets = [
            {
                "POSITION": self._vertices(shapes[frame] - shapes[kept[0]], bounds=True),
                "NORMAL": self._vertices(normal - normals[0]),
            }
            for frame, normal in zip(kept[1:], normals[1:], strict=True)
        ]
        mesh = self._mesh("sheet", shapes[kept[0]], normals[0], faces, targets=targets or None)
        node = self._node("sheet", mesh)
        if targets:
            weights = np.eye(len(kept))[:, 1:]  # at each kept frame its own shape alone
            clock = self._times(self.time[kept])
            self._sample(node, "weights", clock, glb.add_array(weights.ravel().astype(np.float32)))
        self.notes |= {"sheet_shapes": len(kept)}

    def finished(self) -> bytes:
        recording, glb = self.recording, self.glb
        glb.tree["animations"] = [
            {"name": "run", "channels": self.channels, "samplers": self.samplers}
        ]
        glb.tree["scenes"] = [{"name": recording.name, "nodes": self.roots}]
        glb.tree["scene"] = 0
        # Where the device starts to move, on the timeline of the animation.
        self.notes |= {"device_start_s": float(-recording.time[0]), "place": recording.place}
        glb.tree["asset"]["extras"] = self.notes
        return glb.to_bytes()

    def _move_with_program(self, node: int) -> None:
        self._animate(node, "translation", self.recording.column("device_position"))
        self._animate(node, "rotation", one_sign(self.recording.column("device_quaternion")))

    def _node(self, name: str, mesh: int | None = None, children: list | None = None) -> int:
        node = self.glb.add("nodes", name=name, mesh=mesh, children=children)
        self.glb.tree["nodes"][self.world]["children"].append(node)
        return node

    def _tube(self, name: str, translation, rotation, scale) -> int:
        vertices, normals, faces = unit_tube()
        if self.tube is None:
            self.tube = self._vertices(vertices, bounds=True), self._vertices(normals)
        mesh = self.glb.add("meshes", name=name, primitives=[{
            "attributes": dict(zip(("POSITION", "NORMAL"), self.tube, strict=True)),
            "indices": self._indices(faces), "material": self._material(name),
        }])
        return self.glb.add("nodes", name=name, mesh=mesh, translation=translation.tolist(),
                            rotation=rotation.tolist(), scale=scale.tolist())

    def _mesh(self, name: str, vertices, normals, faces, targets=None, **attributes) -> int:
        primitive = {
            "attributes": {
                "POSITION": self._vertices(vertices, bounds=True),
                "NORMAL": self._vertices(normals),
                **attributes,
            },
            "indices": self._indices(faces),
            "material": self._material(name),
        }
        if targets:
            primitive["targets"] = targets
        return self.glb.add("meshes", name=name, primitives=[primitive])

    def _material(self, name: str) -> int:
        if name not in self.materials:
            colour = _linear(np.array([COLOURS[name]]))[0] / 65535
            self.materials[name] = self.glb.add(
                "materials", name=name, doubleSided=name == "sheet" or None,
                pbrMetallicRoughness={
                    "baseColorFactor": colour.tolist(), "metallicFactor": 0.0,
                    "roughnessFactor": 0.8,
                },
            )
        return self.materials[name]

    def _vertices(self, values: np.ndarray, bounds: bool = False) -> int:
        return self.glb.add_array(values.astype(np.float32), ARRAY_BUFFER, bounds=bounds)

    def _indices(self, faces: np.ndarray) -> int:
        kind = np.uint16 if faces.max() < 2**16 - 1 else np.uint32
        return self.glb.add_array(faces.ravel().astype(kind), ELEMENT_ARRAY_BUFFER)

    def _times(self, time: np.ndarray) -> int:
        return self.glb.add_array(time.astype(np.float32), bounds=True)

    def _animate(self, node: int, path: str, values: np.ndarray) -> None:
        self._sample(node, path, self.clock, self.glb.add_array(values.astype(np.float32)))

    def _sample(self, node: int, path: str, clock: int, output: int) -> None:
        self.channels.append(
            {"sampler": len(self.samplers), "target": {"node": node, "path": path}}
        )
        self.samplers.append({"input": clock, "output": output, "interpolation": "LINEAR"})


def four_influences(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Return the segments (n, 4) uint8 and weights (n, 4) float32 of each vertex's heaviest four.

    Weights sum to 1; those left out, if a body has any, are shared out.
    """
    skin, count = body.skin, body.skin.vertex_count
    owner = np.repeat(np.arange(count), np.diff(skin.influence_offsets))
    order = np.lexsort([-skin.influence_weight, owner])
    rank = np.arange(len(owner)) - skin.influence_offsets[owner]
    kept = rank < INFLUENCES
    segments, weights = np.zeros((count, INFLUENCES), np.uint8), np.zeros((count, INFLUENCES))
    segments[owner[kept], rank[kept]] = skin.influence_segment[order][kept]
    weights[owner[kept], rank[kept]] = skin.influence_weight[order][kept]
    return segments, (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)


def shape_frames(count: int, vertex_count: int) -> np.ndarray:
    """Return the frames, evenly spaced and with both ends, at which a sheet's shape is kept."""
    shape_bytes = 2 * 3 * 4 * vertex_count  # positions and normals
    shapes = max(2, min(SHEET_SHAPES_MAX, SHEET_BYTES_MAX // shape_bytes))
    return np.unique(np.linspace(0, count - 1, shapes).round().astype(int))


def _inverse_binds(body: Body) -> np.ndarray:
    """Return the matrices (18, 4, 4), columns first, from the upright rest pose to each segment."""
    placements = [np.eye(4)] * len(PARENTS)
    q = body.rest_configuration
    turns = Rotation.from_quat(joint_quaternions(body, q[None])[0]).as_matrix()
    upright = np.eye(4)
    upright[:3, :3] = UPRIGHT
    for segment, above in enumerate(PARENTS):
        local = np.eye(4)
        local[:3, :3] = turns[segment]
        local[:3, 3] = body.model.jointPlacements[segment + 1].translation
        if above < 0:
            local[:3, 3] = q[:3]
        placements[segment] = (upright if above < 0 else placements[above]) @ local
    return np.linalg.inv(placements).transpose(0, 2, 1).astype(np.float32)


def _linear(srgb: np.ndarray) -> np.ndarray:
    """Return opaque linear colours (n, 4), uint16 shares, of sRGB (n, 3): IEC 61966-2-1."""
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return np.column_stack([np.round(65535 * linear), np.full(len(srgb), 65535)]).astype(np.uint16)
