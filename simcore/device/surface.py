"""The surface of a rigid device: an even triangle mesh in the device frame.

Device frame: origin where the planes of seat and backrest meet, in the middle; x forward along the
seat, y left, z up from the seat.
"""

from dataclasses import dataclass
from math import cos, sin, tan

import numpy as np

from simcore.config.robotic_lift import CORNER_RADIUS_MIN, SeatAndBackrest

SOLID_DEPTH = 0.12
"""Depth to which matter is thought behind a carrying side [m]: flesh pressed less than half as
deep is pushed back to the side it came from.  ASSUME: flesh gives way by 2 to 4 cm."""

FLARE = 0.5
"""How far the sides of that matter run outwards on the way down.  ASSUME: steep enough to leave
room for arms beside the seat."""


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
    spacing : float
        Distance between neighbouring contact points [m].
    recline : float
        Recline of the trunk that the surface supports [rad].
    """

    vertices: np.ndarray
    faces: np.ndarray
    contact_points: np.ndarray
    spacing: float
    recline: float


def mat_coordinates(surface: Surface) -> np.ndarray:
    """Return where each contact point lies on a mat over seat and backrest (N, 2) [m].

    The mat is hinged at the origin: its x counts forward along the seat from there, and negative
    up the backrest; y is the device's.
    """
    points, recline = surface.contact_points, surface.recline
    along_back = cos(recline) * points[:, 2] - sin(recline) * points[:, 0]
    along = np.where(points[:, 0] >= along_back, points[:, 0], -along_back)
    return np.column_stack([along, points[:, 1]])


def seat_and_backrest(design: SeatAndBackrest) -> Surface:
    """Return a slab bent along its side profile and dished over its width.

    A box grid is mapped on to it. The dish rises as the fourth power of y, flat in the middle and
    steep at the sides; the profile of each grid line is that of its rise, and the thickness lies
    below it, along the profile's normal.
    """
    return _slab(design, solid=False)


def support_solid(design: SeatAndBackrest) -> Surface:
    """Return the slab with its carrying side as it is and more matter behind it.

    Flesh pressed deeper than half a slab's thickness is nearer to the lower side, and distances
    to the slab would push it out there. The solid is `SOLID_DEPTH` thick behind seat and backrest,
    or more where fillet and dish are large. At the front edge it begins with nothing and at the
    top with the slab's thickness, and grows from either by about 45°, so that legs that hang or
    bend back stay free of it. Its sides flare out: raised sides of a dish are thin, and what leans
    on them from within would come out on their other side.
    """
    return _slab(design, solid=True)


def _slab(design: SeatAndBackrest, solid: bool) -> Surface:
    across = _dish(design.width_m, design.dish_depth_m)
    middle = np.array([piece.length for piece in _profile(design, 0.0)])
    length, width, thickness = middle.sum(), across[-1, 0], design.thickness_m
    area = 2 * (length * width + length * thickness + width * thickness)
    spacing = np.sqrt(area / design.vertex_count)
    counts = [max(2, round(extent / spacing) + 1) for extent in (length, width, thickness)]

    grid, faces = _box_grid(*counts)
    # Grid lines across the slab meet the profile of every rise at the same share of each piece.
    ends = np.concatenate([[0], np.cumsum(middle)]) / length
    piece = np.clip(np.searchsorted(ends, grid[:, 0], side="right") - 1, 0, len(middle) - 1)
    share = (grid[:, 0] - ends[piece]) / np.diff(ends)[piece]
    sideways, rise = (np.interp(grid[:, 1] * width, across[:, 0], across[:, i]) for i in (1, 2))
    upper, normal = np.empty((len(grid), 2)), np.empty((len(grid), 2))
    for line in np.unique(grid[:, 1]):
        on_line = grid[:, 1] == line
        profile = _profile(design, rise[on_line][0])
        for index, each in enumerate(profile):
            here = on_line & (piece == index)
            upper[here], normal[here] = each.at(share[here] * each.length)
            if solid:
                normal[here] = _way_down(design, profile, index, share[here]) / thickness
    side = upper - (grid[:, 2] * thickness)[:, None] * normal
    if solid:
        down = np.linalg.norm(upper - side, axis=1)
        sideways = sideways * (1 + FLARE * down / (design.width_m / 2))
    vertices = np.column_stack([side[:, 0], sideways, side[:, 1]])
    return Surface(vertices, faces, vertices, spacing, design.recline_rad)


def _way_down(design, profile: tuple["_Piece", ...], index: int, share) -> np.ndarray:
    """Return the vectors (n, 2) [m] from the solid's lower side to points of its upper side."""
    lengths = np.array([piece.length for piece in profile])
    limit = max(SOLID_DEPTH, design.fillet_radius_m + design.dish_depth_m)

    def depth(along):
        # The front edge turns by a quarter: from its start, 45° lead to two radii below its end.
        from_front = 2 / profile[0].curvature + along - lengths[0]
        from_top = design.thickness_m + lengths.sum() - along
        return np.minimum(limit, np.minimum(from_front, from_top))

    upper, normal = profile[index].at(share * lengths[index])
    if index:
        return depth(lengths[:index].sum() + share * lengths[index])[:, None] * normal
    start, (end,), (end_normal,) = profile[0].start, *profile[0].at(lengths[:1])
    under_end = end - depth(lengths[0]) * end_normal
    return upper - start - share[:, None] * (under_end - start)


def _profile(design: SeatAndBackrest, rise: float) -> tuple["_Piece", ...]:
    """Return the upper side at a rise [m], from front to top, in the x–z plane.

    A quarter circle round the front edge, the seat, the corner's fillet and the backrest, all
    raised along their normals. Where the rise exceeds the fillet's radius the corner stays sharp
    but for `CORNER_RADIUS_MIN`.
    """
    recline, radius = design.recline_rad, design.fillet_radius_m
    seat, back = np.array([1.0, 0.0]), np.array([-sin(recline), cos(recline)])
    turn = np.pi / 2 - recline  # from the seat's direction to the backrest's
    corner = np.array([rise * (1 - sin(recline)) / cos(recline), rise])
    corner_radius = max(radius - rise, CORNER_RADIUS_MIN)
    tangent = corner_radius * tan(turn / 2)
    front = design.seat_depth_m - radius
    return (
        _arc(radius + rise, np.pi / 2, np.array([front + radius + rise, -radius]), np.pi / 2),
        _line(front - corner[0] - tangent, np.array([front, rise]), -seat),
        _arc(corner_radius, turn, corner + tangent * seat, np.pi, clockwise=True),
        _line(
            design.backrest_height_m - corner @ back - tangent, corner + tangent * back, back
        ),
    )


def _dish(width: float, depth: float) -> np.ndarray:
    """Return length along the dish, y and rise (m, 3) [m], from its left side to its right."""
    y = np.linspace(width / 2, -width / 2, 1001)
    rise = depth * (2 * y / width) ** 4
    length = np.concatenate([[0], np.cumsum(np.hypot(np.diff(y), np.diff(rise)))])
    return np.column_stack([length, y, rise])


@dataclass(frozen=True)
class _Piece:
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
    return _Piece(length, start, float(np.arctan2(direction[1], direction[0])), 0.0)


def _arc(radius: float, turn: float, start: np.ndarray, angle: float, clockwise: bool = False):
    return _Piece(radius * turn, start, angle, (-1 if clockwise else 1) / radius)


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
