"""The surface of a rigid device: an even triangle mesh in the device frame.

Device frame: origin where the planes of seat and backrest meet, in the middle; x forward along the
seat, y left, z up from the seat.
"""

from dataclasses import dataclass
from math import cos, sin, tan

import numpy as np

from simcore.config.designs import SeatAndBackrest


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh, and the points of it that a body can touch.

    Attributes
    ----------
    vertices : (n, 3) float64
        Positions in the device frame [m].
    faces : (f, 3) int32
        Counter-clockwise seen from outside.
    contact_points : (N, 3) float64
        Evenly spaced points of the surface, device frame [m]: the p_k of the paper.
    recline : float
        Recline of the trunk that the surface supports [rad].
    """

    vertices: np.ndarray
    faces: np.ndarray
    contact_points: np.ndarray
    recline: float


def seat_and_backrest(design: SeatAndBackrest) -> Surface:
    """Return a slab bent along its side profile, as a box grid mapped on to it.

    The profile runs on the upper side from the front edge, rounded downwards by a quarter circle,
    along the seat, through the corner fillet and up the backrest. Every surface point is
    `profile(s) + (rise(y) − depth) · normal(s)`, where the dish rises as the fourth power of y:
    flat in the middle, steep at the sides. Grid lines are even along both curves.
    """
    recline, radius = design.recline_rad, design.fillet_radius_m
    seat, back = np.array([1.0, 0.0]), np.array([-sin(recline), cos(recline)])
    # The corner turns by 90° − recline from the seat's direction to the backrest's.
    turn = np.pi / 2 - recline
    tangent = radius * tan(turn / 2)
    flat = design.seat_depth_m - radius - tangent
    segments = [
        _arc(radius, np.pi / 2, np.array([design.seat_depth_m, -radius]), np.pi / 2),
        _line(flat, np.array([tangent + flat, 0.0]), -seat),
        _arc(radius, turn, np.array([tangent, 0.0]), np.pi, clockwise=True),
        _line(design.backrest_height_m - tangent, tangent * back, back),
    ]
    lengths = np.array([segment.length for segment in segments])
    total = lengths.sum()
    across = _dish(design.width_m, design.dish_depth_m)
    width, thickness = across[-1, 0], design.thickness_m
    area = 2 * (total * width + total * thickness + width * thickness)
    spacing = np.sqrt(area / design.vertex_count)
    counts = [max(2, round(extent / spacing) + 1) for extent in (total, width, thickness)]

    grid, faces = _box_grid(*counts)
    along = grid[:, 0] * total
    profile, normal = np.empty((len(grid), 2)), np.empty((len(grid), 2))
    starts = np.concatenate([[0], np.cumsum(lengths)])
    which = np.clip(np.searchsorted(starts, along, side="right") - 1, 0, len(segments) - 1)
    for index, segment in enumerate(segments):
        here = which == index
        profile[here], normal[here] = segment.at(along[here] - starts[index])
    sideways, rise = (np.interp(grid[:, 1] * width, across[:, 0], across[:, i]) for i in (1, 2))
    side = profile + (rise - grid[:, 2] * thickness)[:, None] * normal
    vertices = np.column_stack([side[:, 0], sideways, side[:, 1]])
    return Surface(vertices, faces, vertices, recline)


def _dish(width: float, depth: float) -> np.ndarray:
    """Return length along the dish, y and rise (m, 3) [m], from its left side to its right."""
    y = np.linspace(width / 2, -width / 2, 1001)
    rise = depth * (2 * y / width) ** 4
    length = np.concatenate([[0], np.cumsum(np.hypot(np.diff(y), np.diff(rise)))])
    return np.column_stack([length, y, rise])


@dataclass(frozen=True)
class _Segment:
    """A piece of constant curvature of the profile in the x–z plane."""

    length: float
    start: np.ndarray
    angle: float  # of the direction of travel, from x towards z [rad]
    curvature: float  # positive to the left of travel [1/m]

    def at(self, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points (n, 2) and outward (upper-side) normals (n, 2) at a travelled distance."""
        angle = self.angle + self.curvature * distance
        if self.curvature:
            chord = np.column_stack(
                [np.sin(angle) - sin(self.angle), cos(self.angle) - np.cos(angle)]
            )
            points = self.start + chord / self.curvature
        else:
            points = self.start + distance[:, None] * np.array([cos(self.angle), sin(self.angle)])
        return points, np.column_stack([np.sin(angle), -np.cos(angle)])


def _line(length: float, start: np.ndarray, direction: np.ndarray):
    return _Segment(length, start, float(np.arctan2(direction[1], direction[0])), 0.0)


def _arc(radius: float, turn: float, start: np.ndarray, angle: float, clockwise: bool = False):
    return _Segment(radius * turn, start, angle, (-1 if clockwise else 1) / radius)


def _box_grid(n_u: int, n_v: int, n_w: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface of the unit cube as a grid: points (n, 3) in [0, 1], faces (f, 3)."""
    index = np.full((n_u, n_v, n_w), -1, dtype=np.int64)
    shell = np.zeros(index.shape, dtype=bool)
    for axis in range(3):
        for end in (0, -1):
            shell[(slice(None),) * axis + (end,)] = True
    index[shell] = np.arange(shell.sum())
    points = np.argwhere(shell) / (np.array([n_u, n_v, n_w]) - 1)
    faces = []
    for axis in range(3):
        for end in (0, -1):
            patch = index[(slice(None),) * axis + (end,)]
            a, b, c, d = patch[:-1, :-1], patch[1:, :-1], patch[1:, 1:], patch[:-1, 1:]
            quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
            # In (u, v, w) the outward winding alternates with the axis and the end.
            if (axis == 1) != (end == -1):
                quads = quads[:, ::-1]
            faces.append(np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
    return points, np.concatenate(faces).astype(np.int32)
