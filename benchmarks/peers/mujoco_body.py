"""A body of simcore's as MuJoCo would have it: an engine that shares no code with Pinocchio."""

from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from simcore.body.segments import PARENTS, SEGMENTS

GRAVITY = 9.80665  # [m/s²] standard acceleration, CGPM 1901
KINDS = {
    "free": mujoco.mjtJoint.mjJNT_FREE,
    "spherical": mujoco.mjtJoint.mjJNT_BALL,
    "flexion": mujoco.mjtJoint.mjJNT_HINGE,
    "extension": mujoco.mjtJoint.mjJNT_HINGE,
}
HINGE_AXES = {"flexion": (0, 1, 0), "extension": (0, -1, 0)}
QUATERNION = (3, 0, 1, 2)  # MuJoCo's w, x, y, z among simcore's x, y, z, w


@dataclass(frozen=True, eq=False)
class MujocoBody:
    """The same body for MuJoCo: limp joints, no geometry, no damping.

    MuJoCo numbers joints depth first and puts a quaternion's real part first. All else means
    the same in both: the root's linear velocity is in world axes, angular velocities are in
    those of the child. So the maps are permutations, of forces and accelerations too.

    Attributes
    ----------
    model : mujoco.MjModel
        nq = 60, nv = 47.
    q_order : (60,) int
        qpos = q[q_order].
    v_order : (47,) int
        qvel = v[v_order].
    body_ids : (18,) int
        MuJoCo's body of each segment.
    """

    model: mujoco.MjModel
    q_order: np.ndarray
    v_order: np.ndarray
    body_ids: np.ndarray

    def data_at(self, q: np.ndarray, v: np.ndarray) -> mujoco.MjData:
        """Return new data in the state q (60,), v (47,); nothing else is computed yet."""
        data = mujoco.MjData(self.model)
        data.qpos[: len(q)] = q[self.q_order]
        data.qvel[: len(v)] = v[self.v_order]
        return data

    def state_of(self, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
        """Return q (60,) and v (47,)."""
        return data.qpos[np.argsort(self.q_order)], self.from_dofs(data.qvel)

    def from_dofs(self, values: np.ndarray) -> np.ndarray:
        """Return MuJoCo's (47,) or (47, 47) by degrees of freedom in the order of v."""
        back = np.argsort(self.v_order)
        return values[np.ix_(*[back] * values.ndim)]


def mujoco_body(model: pin.Model) -> MujocoBody:
    """Return the body of `model` for MuJoCo; tree, kinds and axes come from SEGMENTS."""
    spec, _ = body_spec(model)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    return compiled_body(spec, model)


def body_spec(model: pin.Model) -> tuple[mujoco.MjSpec, list[mujoco.MjsBody]]:
    """Return the body of `model` before it is compiled, and its bodies in the order of SEGMENTS."""
    spec = mujoco.MjSpec()
    spec.option.gravity = (0, 0, -GRAVITY)
    bodies = []
    for index, segment in enumerate(SEGMENTS):
        parent = spec.worldbody if PARENTS[index] < 0 else bodies[PARENTS[index]]
        inertia = model.inertias[index + 1]
        body = parent.add_body(
            name=segment.name, pos=model.jointPlacements[index + 1].translation,
            explicitinertial=True, mass=inertia.mass, ipos=inertia.lever,
            fullinertia=inertia.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
        )
        body.add_joint(
            name=segment.name, type=KINDS[segment.joint],
            axis=HINGE_AXES.get(segment.joint, (0, 0, 1)),
        )
        bodies.append(body)
    return spec, bodies


def compiled_body(spec: mujoco.MjSpec, model: pin.Model) -> MujocoBody:
    """Compile what `body_spec` returned; whatever was added to it comes after the body."""
    compiled = spec.compile()
    ids = np.array([compiled.body(segment.name).id for segment in SEGMENTS])
    return MujocoBody(compiled, *_orders(model, compiled), ids)


def _orders(model: pin.Model, compiled: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Return q_order and v_order, joint by joint."""
    q_order, v_order = np.zeros(model.nq, int), np.zeros(model.nv, int)
    for index, segment in enumerate(SEGMENTS):
        ours, theirs = model.joints[index + 1], compiled.joint(segment.name)
        places = np.arange(ours.nq)
        if segment.joint in ("free", "spherical"):
            places[-4:] = places[-4:][list(QUATERNION)]
        q_start, v_start = theirs.qposadr[0], theirs.dofadr[0]
        q_order[q_start : q_start + ours.nq] = ours.idx_q + places
        v_order[v_start : v_start + ours.nv] = ours.idx_v + np.arange(ours.nv)
    return q_order, v_order
