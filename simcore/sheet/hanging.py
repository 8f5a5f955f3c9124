"""How a sheet hangs: straps from patches of its vertices to points of a moving bar (Eq. S4)."""

from dataclasses import dataclass

import numpy as np

from simcore.compiled import compiled
from simcore.config.sling_lift import EdgeAttachment, HangingDesign, LoopAttachment
from simcore.errors import DesignError
from simcore.sheet.net import Net
from simcore.sheet.outline import contains, distance_to_sides

# ASSUME: a strap is sewn on over a disc of this radius, its load falling off towards the rim, so
# that no vertex carries a strap alone.
PATCH_RADIUS = 0.04
"""[m]"""

PATCH_VERTICES_MIN = 3
"""A coarse net takes the nearest so many, even outside the disc."""

REACH_TOLERANCE = 0.01
"""How far a strap may be stretched at the start [m]."""


@dataclass(frozen=True, eq=False)
class BarState:
    """Pose and velocity of the spreader bar; any object with these attributes will do.

    Attributes
    ----------
    rotation : (3, 3) float64
        Bar frame to world.
    position : (3,) float64
        Bar origin in the world [m].
    linear_velocity, angular_velocity : (3,) float64
        World axes [m/s, rad/s].
    """

    rotation: np.ndarray
    position: np.ndarray
    linear_velocity: np.ndarray
    angular_velocity: np.ndarray


STILL_BAR = BarState(np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
"""The bar frame is the world frame."""


@dataclass(frozen=True, eq=False)
class Straps:
    """Tension-only spring–dampers from patches of sheet vertices to bar points.

    The damper never exceeds the spring, so that tension starts from zero (Eq. S4).

    Attributes
    ----------
    names : tuple of str
        Attachment of each strap.
    bar_point : (s, 3) float64
        Bar frame [m].
    length : (s,) float64
        Unstretched [m].
    stiffness, damping : (s,) float64
        [N/m], [N s/m]
    patch_start : (s + 1,) int32
        Strap i holds `patch_vertex[patch_start[i]:patch_start[i + 1]]`.
    patch_vertex : (e,) int32
    patch_weight : (e,) float64
        Share of the strap's load; sums to 1 for each strap.
    """

    names: tuple[str, ...]
    bar_point: np.ndarray
    length: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    patch_start: np.ndarray
    patch_vertex: np.ndarray
    patch_weight: np.ndarray

    def patch_centres(self, position: np.ndarray) -> np.ndarray:
        """Return the weighted centres (s, 3) of the patches [m] for vertex positions (n, 3)."""
        if not self.names:
            return np.empty((0, 3))
        weighted = self.patch_weight[:, None] * position[self.patch_vertex]
        return np.add.reduceat(weighted, self.patch_start[:-1], axis=0)


def bar_points(straps: Straps, bar: BarState) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity (s, 3) of the bar points in the world [m, m/s]."""
    return _carried(
        straps.bar_point, bar.rotation, bar.position, bar.linear_velocity, bar.angular_velocity
    )


@compiled
def _carried(points, rotation, position, velocity, turn):
    """Return position and velocity of points of a frame that moves."""
    at, moving = np.empty(points.shape), np.empty(points.shape)
    arm = np.empty(3)
    for s in range(points.shape[0]):
        for a in range(3):
            arm[a] = (rotation[a, 0] * points[s, 0] + rotation[a, 1] * points[s, 1]
                      + rotation[a, 2] * points[s, 2])
            at[s, a] = position[a] + arm[a]
        moving[s, 0] = velocity[0] + turn[1] * arm[2] - turn[2] * arm[1]
        moving[s, 1] = velocity[1] + turn[2] * arm[0] - turn[0] * arm[2]
        moving[s, 2] = velocity[2] + turn[0] * arm[1] - turn[1] * arm[0]
    return at, moving


def build_straps(net: Net, design: HangingDesign) -> Straps:
    """Return the straps of a hanging.

    Raises
    ------
    DesignError
        An attachment outside the outline, or at an edge that the sheet does not have.
    """
    names, bar, length, share, vertices, weights = [], [], [], [], [], []
    for attachment in design.attachments:
        for point, part, patch, weight in _straps_of(net, attachment):
            names.append(attachment.name)
            bar.append(point)
            length.append(attachment.strap_length_m)
            share.append(part)
            vertices.append(patch)
            weights.append(weight)
    share = np.array(share)
    return Straps(
        names=tuple(names),
        bar_point=np.array(bar, dtype=float).reshape(-1, 3),
        length=np.array(length, dtype=float),
        stiffness=share * design.strap_stiffness_n_per_m,
        damping=share * design.strap_damping_ns_per_m,
        patch_start=np.cumsum([0, *map(len, vertices)], dtype=np.int32),
        patch_vertex=np.concatenate([*vertices, np.empty(0, np.int32)]).astype(np.int32),
        patch_weight=np.concatenate([*weights, np.empty(0)]),
    )


def check_reach(straps: Straps, position: np.ndarray, bar: BarState) -> None:
    """Refuse straps that are shorter than the way from the sheet to the bar.

    Parameters
    ----------
    position : (n, 3) float64
        Sheet vertices at the start, world [m].

    Raises
    ------
    DesignError
        Names the strap that falls short the most, its length and the distance.
    """
    if not straps.names:
        return
    points, _ = bar_points(straps, bar)
    distance = np.linalg.norm(points - straps.patch_centres(position), axis=1)
    missing = distance - straps.length
    worst = int(missing.argmax())
    if missing[worst] > REACH_TOLERANCE:
        raise DesignError(
            f"device.hanging.attachments.{straps.names[worst]}.strap_length_m: the strap cannot "
            f"reach: it is {straps.length[worst]:.3f} m long and the bar is "
            f"{distance[worst]:.3f} m away"
        )


def _straps_of(net: Net, attachment: LoopAttachment | EdgeAttachment):
    """Yield bar point (3,), share of the stiffness, vertices and weights of each strap."""
    if isinstance(attachment, LoopAttachment):
        yield np.array(attachment.bar_point_m), 1.0, *_patch(net, attachment)
        return
    vertices = _edge_vertices(net, attachment)
    along = net.rest_position[vertices, 0 if attachment.edge in ("left", "right") else 1]
    step = np.diff(along) / 2
    tributary = np.concatenate([step, [0]]) + np.concatenate([[0], step])
    fraction = (along - along[0]) / (along[-1] - along[0])
    start, end = np.array(attachment.bar_start_m), np.array(attachment.bar_end_m)
    for vertex, part, at in zip(vertices, tributary / tributary.sum(), fraction, strict=True):
        yield start + at * (end - start), part, np.array([vertex]), np.ones(1)


def _patch(net: Net, attachment: LoopAttachment) -> tuple[np.ndarray, np.ndarray]:
    point = np.array(attachment.sheet_point_m, dtype=float)
    near = 0.5 * float(net.spacing.max())
    if not contains(net.outline, point[None])[0] and distance_to_sides(net.outline, point) > near:
        low, high = net.outline.min(axis=0), net.outline.max(axis=0)
        raise DesignError(
            f"device.hanging.attachments.{attachment.name}.sheet_point_m: {point.tolist()} lies "
            f"outside the sheet, which is smaller than its attachments; accepted: a point of the "
            f"outline, x from {low[0]:.3f} to {high[0]:.3f}, y from {low[1]:.3f} to "
            f"{high[1]:.3f}"
        )
    distance = np.linalg.norm(net.rest_position - point, axis=1)
    vertices = np.flatnonzero(distance < PATCH_RADIUS)
    if len(vertices) < PATCH_VERTICES_MIN:
        vertices = np.sort(np.argsort(distance, kind="stable")[:PATCH_VERTICES_MIN])
    reach = max(PATCH_RADIUS, 1.5 * distance[vertices].max())
    weight = net.vertex_area[vertices] * (1 - distance[vertices] / reach)
    return vertices, weight / weight.sum()


def _edge_vertices(net: Net, attachment: EdgeAttachment) -> np.ndarray:
    """Return the vertices of an edge, from head to foot or from right to left."""
    axis, last = {"head": (0, False), "foot": (0, True), "right": (1, False), "left": (1, True)}[
        attachment.edge
    ]
    at = net.rest_position[:, axis]
    end = at.max() if last else at.min()
    vertices = np.flatnonzero(np.abs(at - end) < 1e-6)
    if len(vertices) < 2:
        raise DesignError(
            f"device.hanging.attachments.{attachment.name}.edge: the sheet has no straight edge "
            f"at its {attachment.edge} end"
        )
    return vertices[np.argsort(net.rest_position[vertices, 1 - axis], kind="stable")]
