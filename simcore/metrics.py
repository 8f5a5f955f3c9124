"""Trajectory → named figures; each is defined in docs/physics.md under its name."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from simcore.body.build import posed_skin
from simcore.body.segments import SEGMENTS
from simcore.energy import energy_residual
from simcore.joint_metrics import joint_range_margin, lifting_speed, neck_moment
from simcore.recorder import FALL_DISPLACEMENT, Trajectory, sensor_cells
from simcore.region_metrics import load_at_rest, peaks, slip_share
from simcore.scene import Scene
from simcore.sheet.outline import distance_to_sides

REST_WINDOW = 0.5
"""Length of the last part of the hold over which figures at rest are averaged [s]."""

SPREAD_WINDOW = 1.0
"""Length of the part over which the support force must be steady [s]."""

LYING_WINDOW = 0.2
"""Length of the last part of the settling, likewise [s]."""

JOINTS = tuple(segment.anatomy for segment in SEGMENTS[1:])
"""Names of the joints below the root, in the order of their segments."""


@dataclass(frozen=True)
class Metric:
    """Name, unit and meaning of one figure; `per` names its dimension beside the study's axes."""

    units: str
    long_name: str
    per: str | None = None


METRICS = {
    "fell": Metric("1", "body fell off its support"),
    "fall_time": Metric("s", "time of the fall after the device started, NaN without one"),
    "fall_margin": Metric("1", "displacement never used, or minus the time missing after a fall"),
    "topple_margin": Metric("rad", "least backward lean of the upper body over the hips"),
    "slide_distance": Metric("m", "largest slide of the body along what carries it"),
    "peak_pressure": Metric("Pa", "highest pressure over a sensor cell while supported"),
    "lying_peak_pressure": Metric("Pa", "highest pressure at rest before the device moves"),
    "region_peak_pressure": Metric("Pa", "highest pressure over a sensor cell", per="region"),
    "peak_shear": Metric("Pa", "highest shear over a sensor cell while supported"),
    "region_peak_shear": Metric("Pa", "highest shear over a sensor cell", per="region"),
    "contact_area": Metric("m2", "skin area where a sensor cell reads load, at rest"),
    "region_contact_area": Metric(
        "m2", "skin area of the region that reads load, at rest", per="region"
    ),
    "region_load": Metric("N", "sum of normal forces on the region's skin, at rest", per="region"),
    "slip_share": Metric("1", "share of the load on skin that slips, while supported"),
    "rest_slip_share": Metric("1", "share of the load on skin that slips, at rest"),
    "support_force_ratio": Metric(
        "1", "vertical support force over weight, at rest; a sheet counts"
    ),
    "support_force_spread": Metric("1", "standard deviation of the same over the last second"),
    "peak_edge_distance": Metric("m", "place of the highest pressure on the sheet from its edge"),
    "peak_strap_force": Metric("N", "greatest tension of a strap"),
    "max_penetration": Metric("m", "deepest penetration of device or sheet into skin"),
    "joint_excursion": Metric("rad", "largest turn of a joint from its posture", per="joint"),
    "joint_range_margin": Metric("1", "least margin of a joint within its range", per="joint"),
    "neck_moment": Metric("N m", "largest torque of the neck's joint while supported"),
    "lifting_speed": Metric("m s-1", "greatest upward speed of what carries the body"),
    "energy_residual": Metric("1", "energy that no account explains over the energy exchanged"),
    "settled": Metric("1", "body came to rest before the device moved"),
    "simulated_time": Metric("s", "simulated time, settling included"),
    "cpu_time": Metric("s", "processor time of the simulation"),
}

STATUS = {
    "ok": "simulated to its end",
    "initial_penetration": "body starts inside the device",
    "misses_device": "body cannot be placed on the device",
    "blow_up": "integration diverged",
    "slip_through": "sheet passed into the body",
}
"""Accepted values of a candidate's status."""


def skin_pressure(scene: Scene, trajectory: Trajectory) -> np.ndarray:
    """Return the cell pressure on the skin, (T, n) [Pa]: Eq. P1."""
    return sensor_cells(scene).pressure(trajectory.normal_force)


def supported_frames(time: np.ndarray, fall_time: float) -> np.ndarray:
    """Return flags (T,) of the frames that peaks are taken over: up to the fall, if any (NaN)."""
    end = time[-1] if np.isnan(fall_time) else fall_time
    # A fall before the device moved leaves only the settling to judge.
    return (time <= end) & (time >= 0) if end >= 0 else time <= end


def rest_frames(supported_time: np.ndarray) -> np.ndarray:
    """Return flags of the last half second of the times (k,) [s] of supported frames."""
    return supported_time >= supported_time[-1] - REST_WINDOW


def compute_metrics(scene: Scene, trajectory: Trajectory, pressure: np.ndarray) -> dict:
    """Return every metric by name: floats, and arrays over regions and joints.

    Parameters
    ----------
    scene : Scene
    trajectory : Trajectory
    pressure : (T, n) float64
        From `skin_pressure` [Pa].
    """
    body, time = scene.body, trajectory.time
    fallen = np.flatnonzero(trajectory.displacement > FALL_DISPLACEMENT)
    fell = len(fallen) > 0
    end = fallen[0] if fell else len(time) - 1
    supported = supported_frames(time, time[end])
    rest = slice(np.searchsorted(time, time[end] - REST_WINDOW), end + 1)
    rests = not fell and trajectory.status == "ok"

    lying = slice(*np.searchsorted(time, (-LYING_WINDOW, 0)))
    upward = trajectory.support_force[:, 2] / scene.weight
    second = slice(np.searchsorted(time, time[end] - SPREAD_WINDOW), end + 1)
    return {
        "fell": float(fell),
        "fall_time": float(time[end]) if fell else np.nan,
        "fall_margin": _fall_margin(scene, trajectory, float(time[end]), fell),
        "topple_margin": _topple_margin(scene, trajectory, supported),
        "slide_distance": _slide_distance(scene, trajectory, supported),
        **peaks(body, pressure[supported], "pressure"),
        **peaks(body, trajectory.shear[supported], "shear"),
        "lying_peak_pressure": float(pressure[lying].max(initial=0.0)),
        **load_at_rest(body, pressure[rest], trajectory.normal_force[rest], rests),
        "slip_share": slip_share(trajectory, supported),
        "rest_slip_share": slip_share(trajectory, rest) if rests else np.nan,
        "support_force_ratio": float(upward[rest].mean()) if rests else np.nan,
        "support_force_spread": float(upward[second].std()) if rests else np.nan,
        "peak_edge_distance": _peak_edge_distance(scene, trajectory, pressure, rest),
        "peak_strap_force": _peak_strap_force(trajectory),
        "max_penetration": float(trajectory.depth_max[supported].max()),
        "joint_excursion": _joint_excursion(scene, trajectory.q[supported]),
        "joint_range_margin": joint_range_margin(scene, trajectory, supported),
        "neck_moment": neck_moment(scene, trajectory, supported),
        "lifting_speed": lifting_speed(scene),
        "energy_residual": energy_residual(trajectory.energy),
        "settled": float(trajectory.settled),
        "simulated_time": float(time[-1] - time[0]),
        "cpu_time": trajectory.cpu_time,
    }


def _fall_margin(scene: Scene, trajectory: Trajectory, end: float, fell: bool) -> float:
    """Return the margin in [−1, 1], continuous where a fall comes ever later: Eq. M1."""
    if not fell:
        return float(1 - trajectory.displacement.max() / FALL_DISPLACEMENT)
    begin = float(trajectory.time[0])
    full = scene.motion.duration + scene.method.hold_s - begin
    return (end - begin) / full - 1


def _topple_margin(scene: Scene, trajectory: Trajectory, frames: np.ndarray) -> float:
    """Return the least angle by which the upper body leans back over the hips [rad]: Eq. M2."""
    model, data = scene.body.model, scene.body.model.createData()
    waist = model.getJointId("lumbar")
    leans = []
    for q, rotation in zip(trajectory.q[frames], trajectory.device_rotation[frames], strict=True):
        pin.centerOfMass(model, data, q, True)
        from_hips = data.oMi[waist].act(data.com[waist]) - q[:3]
        backward = -rotation[:2, 0] / np.linalg.norm(rotation[:2, 0])
        leans.append(np.arctan2(from_hips[:2] @ backward, from_hips[2]))
    return float(min(leans))


def _slide_distance(scene: Scene, trajectory: Trajectory, frames: np.ndarray) -> float:
    """Return the largest way of the pelvis in the plane of the support, or on the sheet [m]."""
    if scene.sling:
        return float(trajectory.displacement[frames].max())
    from_device = trajectory.q[frames, :3] - trajectory.device_position[frames]
    pelvis = np.einsum("tji,tj->ti", trajectory.device_rotation[frames], from_device)
    return float(np.linalg.norm(pelvis[:, :2] - pelvis[0, :2], axis=1).max())


def _peak_edge_distance(
    scene: Scene, trajectory: Trajectory, pressure: np.ndarray, frames: slice
) -> float:
    """Return how far from the sheet's edge the skin is pressed most at rest [m]; NaN without one.

    The place on the sheet is between the four of its vertices next to the pressed skin vertex.
    """
    if not scene.sling:
        return np.nan
    last = frames.stop - 1
    pressed = posed_skin(scene.body, trajectory.q[last])[pressure[frames].mean(axis=0).argmax()]
    distance = np.linalg.norm(trajectory.sheet_position[last] - pressed, axis=1)
    net = scene.sling.solver.sheet.net
    near = np.argsort(distance)[:4]
    place = np.average(net.rest_position[near], axis=0, weights=1 / (distance[near] + 1e-6) ** 2)
    return distance_to_sides(net.outline, place)


def _peak_strap_force(trajectory: Trajectory) -> float:
    if trajectory.strap_force is None:
        return np.nan
    return float(np.linalg.norm(trajectory.strap_force, axis=-1).max())


def _joint_excursion(scene: Scene, configurations: np.ndarray) -> np.ndarray:
    """Return the largest angle between each joint and its posture (17,) [rad]."""
    model = scene.body.model
    turns = np.array([pin.difference(model, scene.configuration, q) for q in configurations])
    joints = [model.joints[index] for index in range(2, model.njoints)]
    return np.array(
        [
            np.linalg.norm(turns[:, joint.idx_v : joint.idx_v + joint.nv], axis=1).max()
            for joint in joints
        ]
    )
