"""Pictures of triangle meshes by ray casting: no GPU, no display, the same bytes every time."""

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

SUPERSAMPLING = 2
"""Rays along each edge of a pixel."""

SKY_DIRECTIONS = 40
"""Directions from which the ambient light comes; shared by all vertices, so without noise."""

KEY_LIGHT, FILL_LIGHT, AMBIENT_LIGHT = 0.62, 0.16, 0.42
"""Irradiance of a surface that faces each light, as a share of white."""

KEY_SOFTNESS = 0.06
"""Half the angle under which the key light is seen [rad]: softens its shadows."""

KEY_RAYS = 4
"""Shadow rays of each sample: fewer leave grain in the wide penumbra of what hangs high."""

CREASE_COSINE = 0.8
"""Where the smooth normal leaves the triangle's by more than this, an edge is meant to be sharp."""

SHADOW_OFFSET = 2e-3
"""Distance from a surface at which a shadow ray starts [m]."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface to show.

    Attributes
    ----------
    vertices : (n, 3) float64
        World frame [m].
    faces : (f, 3) int
        Counter-clockwise seen from outside.
    colour : (n, 3) float64
        sRGB in [0, 1].
    """

    vertices: np.ndarray
    faces: np.ndarray
    colour: np.ndarray


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective camera.

    Attributes
    ----------
    eye : (3,) float64
        World frame [m].
    axes : (3, 3) float64
        Rows: right, up and viewing direction.
    half_extent : tuple of float
        Tangents of half the horizontal and half the vertical field of view.
    width, height : int
        [pixel].
    """

    eye: np.ndarray
    axes: np.ndarray
    half_extent: tuple[float, float]
    width: int
    height: int


def frame_points(
    points: np.ndarray,
    towards_eye: np.ndarray,
    width: int = 480,
    height: int = 400,
    field_of_view: float = 0.45,
    border: float = 0.04,
) -> Camera:
    """Return the camera closest to `points` (n, 3) [m] that sees all of them.

    Parameters
    ----------
    towards_eye : (3,)
        Direction from the points to the camera; world z is up in the picture.
    field_of_view : float
        Vertical [rad].
    border : float
        Share of the picture left free on each side.
    """
    view = -np.asarray(towards_eye, float) / np.linalg.norm(towards_eye)
    right = np.cross(view, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(right, view), view])
    tangent_y = np.tan(field_of_view / 2)
    half_extent = (tangent_y * width / height, tangent_y)
    seen = points @ axes.T
    # Each side of the view cone touches its outermost point: x ≤ t·z with the eye at the origin.
    eye = np.empty(3)
    depths = []
    for axis, tangent in enumerate(half_extent):
        inner = tangent * (1 - 2 * border)
        high = (seen[:, axis] - inner * seen[:, 2]).max()
        low = (-seen[:, axis] - inner * seen[:, 2]).max()
        eye[axis] = (high - low) / 2
        depths.append(-(high + low) / (2 * inner))
    eye[2] = min(depths)
    return Camera(eye @ axes, axes, half_extent, width, height)


def project(camera: Camera, points: np.ndarray) -> np.ndarray:
    """Return where points (n, 3) [m] appear: (n, 2) in pixels from the upper left corner."""
    seen = (points - camera.eye) @ camera.axes.T
    plane = seen[:, :2] / seen[:, 2:] / camera.half_extent
    return (plane * [0.5, -0.5] + 0.5) * [camera.width, camera.height]


def render(meshes: list[Mesh], camera: Camera) -> np.ndarray:
    """Return a picture (height, width, 4) uint8, sRGB with alpha; the background is transparent."""
    (picture,) = _render(meshes, camera, [[mesh.colour for mesh in meshes]])
    return picture


def render_coloured(
    vertices: np.ndarray, faces: np.ndarray, colours: list[np.ndarray], camera: Camera
) -> list[np.ndarray]:
    """Return a picture of one surface for each of its colourings (n, 3), in one and the same light.

    Light takes most of the time, and is cast once.
    """
    return _render([Mesh(vertices, faces, colours[0])], camera, [[each] for each in colours])


def _render(
    meshes: list[Mesh], camera: Camera, colourings: list[list[np.ndarray]]
) -> list[np.ndarray]:
    """Return a picture for each colouring, which has the colours (n, 3) of each mesh."""
    scene = EmbreeScene()
    for mesh in meshes:
        TriangleMesh(scene, mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32))
    normals = [vertex_normals(mesh.vertices, mesh.faces) for mesh in meshes]
    ambient = [
        _ambient(scene, mesh.vertices, normal, camera.eye)
        for mesh, normal in zip(meshes, normals, strict=True)
    ]
    pixels, directions = _camera_rays(camera, np.concatenate([mesh.vertices for mesh in meshes]))
    origins = np.broadcast_to(camera.eye.astype(np.float32), directions.shape)
    hits = scene.run(np.ascontiguousarray(origins), directions, output=True)
    hit = hits["geomID"] >= 0
    points = camera.eye + hits["tfar"][hit, None] * directions[hit]
    brightness = _brightness(scene, meshes, normals, ambient, hits, hit, points, camera)
    pictures = []
    for colours in colourings:
        albedo = _over_hits(meshes, hits, hit, colours)
        light = np.zeros((camera.height * camera.width * SUPERSAMPLING**2, 4), np.float32)
        light[pixels[hit]] = np.column_stack(
            [_to_linear(albedo) * brightness[:, None], np.ones(len(points))]
        )
        pictures.append(_resolved(light, camera))
    return pictures


def _resolved(light: np.ndarray, camera: Camera) -> np.ndarray:
    """Return the picture of linear samples with coverage (m, 4)."""
    shape = camera.height, SUPERSAMPLING, camera.width, SUPERSAMPLING, 4
    mean = light.reshape(shape).mean(axis=(1, 3))
    colour = mean[..., :3] / np.maximum(mean[..., 3:], 1e-6)
    return (np.dstack([_to_srgb(colour), mean[..., 3]]) * 255 + 0.5).astype(np.uint8)


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the normals (f, 3) of triangles, twice as long as their areas [m²]."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit normals (n, 3) of a mesh: area-weighted mean of the triangles at each vertex."""
    triangle = face_normals(vertices, faces)
    corners = faces.T.ravel()
    total = np.column_stack(
        [np.bincount(corners, np.tile(triangle[:, axis], 3), len(vertices)) for axis in range(3)]
    )
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)


def _camera_rays(camera: Camera, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sample indices (m,) and unit directions (m, 3) of the rays that may hit the points."""
    corners = project(camera, points)
    size = np.array([camera.width, camera.height])
    low = np.clip(np.floor(corners.min(axis=0)), 0, size).astype(int) * SUPERSAMPLING
    high = np.clip(np.ceil(corners.max(axis=0)), 0, size).astype(int) * SUPERSAMPLING
    columns, rows = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    across = (columns.ravel() + 0.5) / (camera.width * SUPERSAMPLING) * 2 - 1
    down = (rows.ravel() + 0.5) / (camera.height * SUPERSAMPLING) * 2 - 1
    directions = (
        across[:, None] * camera.half_extent[0] * camera.axes[0]
        - down[:, None] * camera.half_extent[1] * camera.axes[1]
        + camera.axes[2]
    )
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    samples = rows.ravel() * camera.width * SUPERSAMPLING + columns.ravel()
    return samples, directions.astype(np.float32)


def _ambient(
    scene: EmbreeScene, vertices: np.ndarray, normals: np.ndarray, eye: np.ndarray
) -> np.ndarray:
    """Return the share (n,) of an even sky that each vertex turned to the eye sees."""
    seen = np.zeros(len(vertices))
    facing = np.flatnonzero(np.einsum("ij,ij->i", normals, eye - vertices) > -0.3)
    for direction in _even_directions(SKY_DIRECTIONS):
        cosine = normals[facing] @ direction
        lit = np.flatnonzero(cosine > 0)
        starts = vertices[facing[lit]] + SHADOW_OFFSET * normals[facing[lit]]
        free = _is_free(scene, starts, np.broadcast_to(direction, starts.shape))
        # A brighter upper half tells above from below.
        seen[facing[lit]] += free * cosine[lit] * (1 + 0.5 * direction[2])
    return seen * 4 / SKY_DIRECTIONS


def _over_hits(meshes, hits, hit, columns: list[np.ndarray]) -> np.ndarray:
    """Return a value of vertices, one column (n, …) a mesh, at the points that rays hit."""
    geometry, triangle = hits["geomID"][hit], hits["primID"][hit]
    u, v = hits["u"][hit], hits["v"][hit]
    weights = np.column_stack([1 - u - v, u, v])
    values = np.empty((len(geometry), *columns[0].shape[1:]))
    for index, (mesh, column) in enumerate(zip(meshes, columns, strict=True)):
        here = geometry == index
        corners = column[mesh.faces[triangle[here]]]
        values[here] = np.einsum("ij,ij...->i...", weights[here], corners)
    return values


def _brightness(scene, meshes, normals, ambient, hits, hit, points, camera) -> np.ndarray:
    """Return the light (m,) on the points (m, 3) [m] that rays hit, as a share of white."""
    normal = _over_hits(meshes, hits, hit, normals)
    sky = _over_hits(meshes, hits, hit, ambient)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    flat = hits["Ng"][hit].astype(float)
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    flat *= np.sign(np.einsum("ij,ij->i", flat, normal))[:, None]
    creased = np.einsum("ij,ij->i", flat, normal) < CREASE_COSINE
    normal[creased] = flat[creased]

    key = _unit(camera.axes.T @ [-0.55, 0.75, -0.6])  # over the viewer's left shoulder
    fill = _unit(camera.axes.T @ [0.9, 0.1, -0.6])
    cosine = np.maximum(normal @ key, 0)
    facing = np.flatnonzero(cosine > 0)
    # Some directions within the lamp for each sample of a pixel; their mean is a soft shadow.
    random = np.random.default_rng(0)
    starts = points[facing] + SHADOW_OFFSET * normal[facing]
    free = np.zeros(len(facing))
    for _ in range(KEY_RAYS):
        jitter = random.normal(scale=KEY_SOFTNESS / 2, size=(len(facing), 3))
        free += _is_free(scene, starts, key + jitter)
    cosine[facing] *= free / KEY_RAYS
    return (
        KEY_LIGHT * cosine
        + FILL_LIGHT * np.maximum(normal @ fill, 0)
        + AMBIENT_LIGHT * np.minimum(sky, 1.3)
    )


def _is_free(scene: EmbreeScene, starts: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return whether rays (m, 3) leave the scene without a hit."""
    origins = np.ascontiguousarray(starts, np.float32)
    return scene.run(origins, np.ascontiguousarray(directions, np.float32), query="OCCLUDED") < 0


def _even_directions(count: int) -> np.ndarray:
    """Return unit vectors (count, 3) spread over the sphere on a Fibonacci spiral."""
    step = np.arange(count) + 0.5
    turn = np.pi * (1 + np.sqrt(5)) * step
    height = 1 - 2 * step / count
    radius = np.sqrt(1 - height**2)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _to_linear(srgb: np.ndarray) -> np.ndarray:
    return srgb**2.2


def _to_srgb(linear: np.ndarray) -> np.ndarray:
    return np.clip(linear, 0, 1) ** (1 / 2.2)
