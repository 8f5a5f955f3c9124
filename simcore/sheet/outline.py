"""Outlines of a sheet as polygons in the sheet plane: x towards the feet, y to the left."""

import numpy as np

from simcore.config.sling_lift import PolygonOutline, RectangleOutline, UShapeOutline
from simcore.errors import DesignError


def corners(outline: RectangleOutline | UShapeOutline | PolygonOutline) -> np.ndarray:
    """Return the corners (m, 2) of an outline in order [m].

    Raises
    ------
    DesignError
        Parts that do not fit, or an outline that crosses or touches itself.
    """
    polygon = isinstance(outline, PolygonOutline)
    points = np.array(outline.corners_m if polygon else _rectangular(outline), dtype=float)
    crossing = _crossing(points)
    if crossing is not None:
        first, second = (f"{points[i].round(3).tolist()}" for i in crossing)
        raise DesignError(
            f"device.sheet.outline: crosses itself (the sides from corners {first} and {second} "
            "meet)"
        )
    return points


def contains(polygon: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which points (n, 2) lie inside a polygon (m, 2), by the parity of crossings."""
    inside = np.zeros(len(points), bool)
    x, y = points.T
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        straddles = (ay > y) != (by > y)
        if ay != by:
            inside ^= straddles & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return inside


def distance_to_sides(polygon: np.ndarray, point: np.ndarray) -> float:
    """Return the distance of a point (2,) from the sides of a polygon (m, 2) [m]."""
    side = np.roll(polygon, -1, axis=0) - polygon
    along = ((point - polygon) * side).sum(1) / (side**2).sum(1)
    nearest = polygon + np.clip(along, 0, 1)[:, None] * side
    return float(np.linalg.norm(point - nearest, axis=1).min())


def area(polygon: np.ndarray) -> float:
    """Return the area of a simple polygon (m, 2) [m²], by the shoelace formula."""
    x, y = polygon.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


def _rectangular(outline: RectangleOutline | UShapeOutline) -> list[tuple[float, float]]:
    length, half = outline.length_m, outline.width_m / 2
    points = [(length, -half), (length, half)]
    if isinstance(outline, UShapeOutline):
        leg, gap = outline.leg_length_m, outline.gap_width_m / 2
        if leg >= length:
            raise DesignError(
                f"device.sheet.outline.leg_length_m: is {leg:g}; accepted: below length_m, "
                f"{length:g}"
            )
        if gap >= half:
            raise DesignError(
                f"device.sheet.outline.gap_width_m: is {2 * gap:g}; accepted: below width_m, "
                f"{2 * half:g}"
            )
        inner = [(length, -gap), (length - leg, -gap), (length - leg, gap), (length, gap)]
        points = [points[0], *inner, points[1]]
    points.append((0.0, half))
    head, head_half = outline.head_length_m, outline.head_width_m / 2
    if (head > 0) != (head_half > 0) or head_half > half:
        raise DesignError(
            "device.sheet.outline.head_length_m, head_width_m: accepted: both 0, or both above 0 "
            "with a head part no wider than the sheet"
        )
    if head > 0:
        points += [(0.0, head_half)] if head_half < half else []
        points += [(-head, head_half), (-head, -head_half)]
        points += [(0.0, -head_half)] if head_half < half else []
    points.append((0.0, -half))
    return points


def _crossing(points: np.ndarray) -> tuple[int, int] | None:
    """Return two sides, by their first corners, that meet elsewhere than in a common corner."""
    count = len(points)
    ends = np.roll(points, -1, axis=0)
    for i in range(count):
        if np.allclose(points[i], ends[i]):
            return i, i
        for j in range(i + 1, count):
            adjacent = j == i + 1 or (i == 0 and j == count - 1)
            if adjacent:
                shared, one, other = (
                    (ends[i], points[i], ends[j]) if j == i + 1 else (points[0], ends[0], points[j])
                )
                u, w = one - shared, other - shared
                folded = abs(_cross(u, w)) < 1e-12 and u @ w > 0
                if folded:
                    return i, j
            elif _meet(points[i], ends[i], points[j], ends[j]):
                return i, j
    return None


def _cross(u: np.ndarray, w: np.ndarray) -> float:
    return float(u[0] * w[1] - u[1] * w[0])


def _meet(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    """Return whether the closed segments ab and cd have a point in common."""
    turns = [_cross(b - a, c - a), _cross(b - a, d - a), _cross(d - c, a - c), _cross(d - c, b - c)]
    if turns[0] * turns[1] < 0 and turns[2] * turns[3] < 0:
        return True
    for turn, (p, q, r) in zip(
        turns, ((a, b, c), (a, b, d), (c, d, a), (c, d, b)), strict=True
    ):
        on_line = abs(turn) < 1e-12
        if on_line and (r >= np.minimum(p, q) - 1e-12).all() and (
            r <= np.maximum(p, q) + 1e-12
        ).all():
            return True
    return False
