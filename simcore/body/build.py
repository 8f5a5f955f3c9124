"""Bodies ready to simulate, built once and then read from the cache."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from simcore.body.makehuman import DATA
from simcore.body.reach import check_body
from simcore.body.regions import REGION_NAMES
from simcore.body.segments import SEGMENT_NAMES
from simcore.body.skeleton import build_model, configuration_of
from simcore.body.skin import SKIN_FIELDS, Skin, blend
from simcore.cache import cache_folder, cached_arrays, content_key

# Modules that use a finished body; any other module of this package may change what is cached.
CONSUMERS = {
    "__init__", "build", "capsules", "describe", "flesh", "posture", "reach", "skin_clusters",
    "skin_listed", "tissue",
}


@dataclass(frozen=True, eq=False)
class Body:
    """A patient ready to simulate.

    Attributes
    ----------
    name : str
    stature : float
        Vertical extent of the skin in the rest pose [m].
    mass : float
        [kg].
    model : pin.Model
        18 joints, nq = 60, nv = 47; see `simcore.body.skeleton`.
    skin : Skin
    rest_configuration : (60,) float64
        q of MakeHuman's rest pose, soles at z = 0 and the hips' midpoint above the origin.
    segment_names : tuple of str
        Segment i is joint i + 1 of the model.
    vertex_region : (n,) int
        Index into `region_names`.
    way_through : (n,) float64
        From each skin vertex straight through the body to the other side, at rest [m].
    region_names : tuple of str
    """

    name: str
    stature: float
    mass: float
    model: pin.Model
    skin: Skin
    rest_configuration: np.ndarray
    segment_names: tuple[str, ...]
    vertex_region: np.ndarray
    way_through: np.ndarray
    region_names: tuple[str, ...]


def build_body(design, name: str | None = None) -> Body:
    """The body of a design; built once and then read from the cache.

    Parameters
    ----------
    design
        Has `sex`, `age_years`, `stature_m`, `mass_kg`, `inertia` and `skin_vertices`.
    name : str, optional
        Name of the body; by default `design.name`.

    Raises
    ------
    DesignError
        If no body of this sex and age has the stature and mass; the message names the range.
    """
    name = name or design.name
    check_body(design, name)
    values = {
        key: getattr(design, key)
        for key in ("sex", "age_years", "stature_m", "mass_kg", "inertia", "skin_vertices")
    }
    producers = {source.stem for source in Path(__file__).parent.glob("*.py")} - CONSUMERS
    key = content_key("body", producers, DATA, json.dumps(values, sort_keys=True))

    def construct():
        from simcore.body.construct import construct_body  # scipy: only when there is work

        return construct_body(design, name)

    arrays = cached_arrays(cache_folder() / "bodies" / f"body-{key}.npz", construct)
    inertial = (arrays[field] for field in ("placements", "masses", "coms", "inertias"))
    model = build_model(name, *inertial)
    return Body(
        name=name,
        stature=float(arrays["stature"]),
        mass=float(arrays["masses"].sum()),
        model=model,
        skin=Skin(**{field: arrays[field] for field in SKIN_FIELDS}),
        rest_configuration=configuration_of(model, arrays["rest_rotations"], arrays["rest_root"]),
        segment_names=SEGMENT_NAMES,
        vertex_region=arrays["vertex_region"],
        way_through=arrays["way_through"],
        region_names=REGION_NAMES,
    )


def posed_skin(body: Body, q: np.ndarray) -> np.ndarray:
    """Return the skin vertices (n, 3) of a configuration, world frame [m]."""
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, q)
    rotations = np.array([placement.rotation for placement in data.oMi[1:]])
    positions = np.array([placement.translation for placement in data.oMi[1:]])
    return blend(body.skin, rotations, positions)
