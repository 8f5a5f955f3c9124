"""A device surface from CAD: read, checked and covered with evenly spaced contact points."""

from pathlib import Path

import numpy as np
import trimesh

from simcore.config.robotic_lift import MeshSurface
from simcore.device.surface import Surface
from simcore.errors import DesignError

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
OVERSAMPLING = 8
"""Random points per point kept; more fill the surface more evenly."""

EXTENT_MIN, EXTENT_MAX = 0.05, 5.0
"""Accepted size of a device [m]: outside it the unit is almost surely wrong."""


def surface_from_file(design: MeshSurface, root: Path) -> Surface:
    """Return the mesh file of a design as a surface.

    Raises
    ------
    DesignError
        Missing, unreadable, empty, or of a size that no device has.
    """
    path, where = root / design.file, f"{design.file}: device.surface"
    try:
        mesh = trimesh.load(path, force="mesh")
    except Exception as error:  # the readers of trimesh raise whatever their format's parser does
        raise DesignError(f"{where}.file: cannot be read as a mesh ({error})") from None
    if not isinstance(mesh, trimesh.Trimesh) or not mesh.area > 0:  # also where it is not a number
        raise DesignError(f"{where}.file: holds no triangles")
    mesh.apply_scale(METRES[design.unit])
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    extent = float(mesh.extents.max())
    if not EXTENT_MIN <= extent <= EXTENT_MAX:
        raise DesignError(
            f"{where}.unit: the mesh is {extent:.4g} m large in {design.unit}; "
            f"accepted: {EXTENT_MIN} to {EXTENT_MAX} m"
        )
    points = _even_points(mesh, design.vertex_count)
    return Surface(
        vertices=np.array(mesh.vertices),
        faces=mesh.faces.astype(np.int32),
        contact_points=points,
        spacing=float(np.sqrt(mesh.area / len(points))),
        recline=design.recline_rad,
    )


def _even_points(mesh: trimesh.Trimesh, count: int) -> np.ndarray:
    """Return points (n, 3) spread evenly over a mesh, about `count` of them [m].

    Of many random points, those too close to others are removed; the distance is bisected until
    about `count` are left.
    """
    spacing = np.sqrt(mesh.area / count)
    random, _ = trimesh.sample.sample_surface(mesh, OVERSAMPLING * count, seed=0)
    low, high = 0.5 * spacing, 1.2 * spacing
    for _ in range(12):
        middle = (low + high) / 2
        points, _ = trimesh.points.remove_close(random, middle)
        low, high = (middle, high) if len(points) > count else (low, middle)
    return np.array(points)
