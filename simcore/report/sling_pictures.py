"""A moment of a sling lift → meshes: bed, sheet, straps and spreader bar."""

import numpy as np
from scipy.spatial import cKDTree

from simcore.report.render import Mesh, face_normals, vertex_normals
from simcore.report.runs import Run
from simcore.sheet.hanging import bar_points

SHEET_COLOUR, STRAP_COLOUR = (0.20, 0.55, 0.50), (0.86, 0.58, 0.22)
BED_COLOUR, BAR_COLOUR = (0.66, 0.69, 0.72), (0.40, 0.52, 0.64)

SHEET_THICKNESS = 3e-3
"""As drawn [m]: the two sides are meshes of their own, so that each is lit from where it faces."""

BED_THICKNESS = 0.12
"""As drawn [m]; nothing touches a mattress from below."""

STRAP_RADIUS, BAR_RADIUS = 0.007, 0.018
"""As drawn [m]."""

TUBE_SIDES, TUBE_STEP = 12, 0.04
"""Faces around a tube, and the length of a piece along it [m]; lit by its vertices."""

FLESH_REACH = 0.06
"""Skin farther than this from a vertex of the sheet is not pressed by it [m]."""


def sling_meshes(run: Run, moment: str, skin_colour: tuple[float, float, float]) -> list[Mesh]:
    """Return the meshes of a moment, the body first."""
    sheet, net = run.sheet(moment), run.net
    normal = vertex_normals(sheet, net.faces)
    state = run.moved(moment)
    hooks, _ = bar_points(run.straps, state)
    bar = run.bar_tubes @ state.rotation.T + state.position
    straps = zip(run.straps.patch_centres(sheet), hooks, strict=True)
    return [
        _mesh(press_skin(run.skin(moment), run.body.skin.faces, sheet, normal),
              run.body.skin.faces, skin_colour),
        _mesh(run.rigid(moment), run.surface.faces, BED_COLOUR),
        _mattress(run.surface.vertices),
        *_two_sided(sheet, net.faces, normal),
        *(_tube(start, end, STRAP_RADIUS, STRAP_COLOUR) for start, end in straps),
        *(_tube(start, end, BAR_RADIUS, BAR_COLOUR) for start, end in bar),
    ]


def press_skin(
    skin: np.ndarray, faces: np.ndarray, sheet: np.ndarray, sheet_normal: np.ndarray
) -> np.ndarray:
    """Return the skin (n, 3) [m] pressed in where a sheet lies inside it.

    The contact lets sheet and skin pass each other by the depth to which the flesh gives (Eq. S5);
    drawn so, patches of bare skin would cover the sheet.
    """
    near = cKDTree(sheet)
    distance, vertex = near.query(skin, distance_upper_bound=FLESH_REACH)
    close = np.flatnonzero(np.isfinite(distance))
    normal = sheet_normal[vertex[close]]
    height = np.einsum("ij,ij->i", skin[close] - sheet[vertex[close]], normal)
    facing = np.einsum("ij,ij->i", vertex_normals(skin, faces)[close], normal) < 0
    beyond = np.maximum(2 * SHEET_THICKNESS - height, 0) * facing
    pressed = skin.copy()
    pressed[close] += beyond[:, None] * normal
    # A hand is thinner than that depth: what would turn inside out stays as it is.
    turned = np.einsum(
        "ij,ij->i", face_normals(skin, faces), face_normals(pressed, faces)
    ) < 0
    restored = faces[turned].ravel()
    pressed[restored] = skin[restored]
    return pressed


def _two_sided(sheet: np.ndarray, faces: np.ndarray, normal: np.ndarray) -> list[Mesh]:
    """Return the upper and the lower side of a sheet (m, 3) [m]."""
    shift = SHEET_THICKNESS / 2 * normal
    return [
        _mesh(sheet + shift, faces, SHEET_COLOUR),
        _mesh(sheet - shift, faces[:, ::-1], SHEET_COLOUR),
    ]


def _mattress(top: np.ndarray) -> Mesh:
    """Return the four sides under the upper side (n, 3) of a bed [m]; each has its own corners."""
    (x0, y0, z), (x1, y1, _) = top.min(axis=0), top.max(axis=0)
    upper = np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]])
    lower = upper - [0, 0, BED_THICKNESS]
    after = np.roll(np.arange(4), -1)
    corners = np.stack([upper, lower, lower[after], upper[after]], axis=1).reshape(-1, 3)
    first = 4 * np.arange(4)[:, None]
    faces = np.concatenate([first + np.array(corner) for corner in ([0, 1, 2], [0, 2, 3])])
    return _mesh(corners, faces, BED_COLOUR)


def _tube(
    start: np.ndarray, end: np.ndarray, radius: float, colour: tuple[float, float, float]
) -> Mesh:
    """Return a tube with closed ends between two points (3,) [m]."""
    length = max(float(np.linalg.norm(end - start)), 1e-6)
    along = (end - start) / length
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    angle = 2 * np.pi * np.arange(TUBE_SIDES) / TUBE_SIDES
    ring = radius * (np.outer(np.cos(angle), across)
                     + np.outer(np.sin(angle), np.cross(along, across)))
    steps = np.linspace(0, length, max(2, round(length / TUBE_STEP) + 1))
    rings = start + steps[:, None, None] * along + ring
    index = np.arange(len(steps) * TUBE_SIDES).reshape(len(steps), TUBE_SIDES)
    a, b = index[:-1], index[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    faces = [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, d, c), (a, c, b))]
    low, high = index.size, index.size + 1
    first, last = index[0], index[-1]
    faces.append(np.column_stack([np.full(TUBE_SIDES, low), np.roll(first, -1), first]))
    faces.append(np.column_stack([np.full(TUBE_SIDES, high), last, np.roll(last, -1)]))
    return _mesh(np.vstack([rings.reshape(-1, 3), start, end]), np.concatenate(faces), colour)


def _mesh(vertices: np.ndarray, faces: np.ndarray, colour: tuple[float, float, float]) -> Mesh:
    return Mesh(vertices, faces, np.tile(colour, (len(vertices), 1)))
