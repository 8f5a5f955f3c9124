"""The shipped lift and sling as MuJoCo can have them.

Rigid hulls or the skin on the carrying side of the lift, which stands still; a cloth under the
hulls. The body has the joints, springs and dampers of the scene. Left out: passive joint moments,
contact of the body's own parts, the blending of the skin (a vertex moves with one segment).
"""

import warnings

import mujoco
import numpy as np
import pinocchio as pin
import trimesh

from benchmarks.peers.mujoco_body import MujocoBody, body_spec, compiled_body
from simcore.body.build import posed_skin
from simcore.body.segments import SEGMENTS
from simcore.body.skeleton import segment_placements
from simcore.joint_torque import joint_gains
from simcore.scene import Scene

MEMORY = 3 << 30
"""For contacts and the solver [byte]; what is not used costs nothing."""

FRICTION = (0.45, 0.005, 1e-4)
"""Sliding as of the method production; torsion and rolling by default, unused by `CONDIM`."""

CONDIM = 3  # normal force and sliding friction

HULL_VERTICES = 40
"""Most vertices of a hull; with all of them a step takes a sixth longer and does the same."""

VIEW = np.radians(45.0)
"""Direction from which seat and backrest are one height field, from the seat's normal to the
front."""

CLOTH_COUNT, CLOTH_RADIUS, CLOTH_THICKNESS = 64, 0.003, 1e-3  # vertices along a side; [m], [m]
CLOTH_POISSON, CLOTH_DAMPING = 0.3, 0.02  # ASSUME: any woven sheet; damping time [s]

CLOTH_CONTACT = (-4e4, -400.0), (0.99, 0.99, 0.001, 0.5, 2.0)
"""Stiff enough for MuJoCo, which measures contact in accelerations: with its default hulls of 70 kg
fall through vertices of 0.15 g."""


def hulls_on_lift(scene: Scene, step: float) -> MujocoBody:
    """Return the convex hulls of the 18 segments on the height field."""
    spec, bodies = _spec(scene, step)
    _add_height_field(spec, scene)
    _add_hulls(spec, bodies, scene)
    return _with_springs(compiled_body(spec, scene.body.model), scene)


def skin_on_lift(
    scene: Scene, step: float, solref: tuple[float, float], solimp: tuple[float, float]
) -> MujocoBody:
    """Return the skin as a flex of triangles on the height field.

    Parameters
    ----------
    scene : Scene
    step : float
        [s].
    solref : (2,)
        MuJoCo's reference: time constant [s] and damping ratio, or minus stiffness and damping.
    solimp : (2,)
        Its impedance, least and greatest.
    """
    spec, bodies = _spec(scene, step)
    _add_height_field(spec, scene)
    segment, place = _vertices_by_segment(scene)
    flex = spec.add_flex(
        name="skin", dim=2, radius=1e-4, contype=0, conaffinity=1, condim=CONDIM,
        friction=FRICTION, solref=solref, solimp=(*solimp, 0.001, 0.5, 2.0),
        selfcollide=mujoco.mjtFlexSelf.mjFLEXSELF_NONE,
    )
    flex.vertbody = [bodies[each].name for each in segment]
    flex.vert = place.ravel()
    flex.elem = scene.body.skin.faces.ravel()
    with warnings.catch_warnings():
        # That the flex has no elasticity of its own: its vertices are held by the segments.
        warnings.simplefilter("ignore", UserWarning)
        return _with_springs(compiled_body(spec, scene.body.model), scene)


def hulls_on_cloth(scene: Scene, step: float, stiffness_per_width: float) -> MujocoBody:
    """Return the hulls on a flex cloth of the sling's size and mass, held along its long sides.

    Its membrane forces (stiffness per width [N/m]) are those of finite elements, which the
    integrator `discrete` takes implicitly. As equality constraints of the edges, MuJoCo's other
    way, a cloth of 0.6 kg does not carry 70 kg: it follows the falling body.
    """
    spec, bodies = _spec(scene, step)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.option.solver = mujoco.mjtSolver.mjSOL_CG
    _add_hulls(spec, bodies, scene)
    sheet = scene.sling.start.position
    low, high = sheet.min(axis=0), sheet.max(axis=0)
    net = scene.sling.solver.sheet.net
    cloth = spec.worldbody.make_flex(
        "cloth", "grid", dim=2, count=[CLOTH_COUNT, CLOTH_COUNT, 1],
        spacing=[*(high - low)[:2] / (CLOTH_COUNT - 1), 1.0], radius=CLOTH_RADIUS,
        mass=float(net.mass.sum()), elastic2d=2,
        pos=[*(low + high)[:2] / 2, -4 * CLOTH_RADIUS],
    )
    cloth.contype, cloth.conaffinity, cloth.condim, cloth.friction = 1, 0, CONDIM, FRICTION
    cloth.selfcollide = mujoco.mjtFlexSelf.mjFLEXSELF_NONE
    cloth.young, cloth.poisson = stiffness_per_width / CLOTH_THICKNESS, CLOTH_POISSON
    cloth.thickness, cloth.damping = CLOTH_THICKNESS, CLOTH_DAMPING
    cloth.priority, (cloth.solref, cloth.solimp) = 1, CLOTH_CONTACT
    for row in range(CLOTH_COUNT):
        for column in (0, CLOTH_COUNT - 1):
            vertex = spec.body(f"cloth_{row * CLOTH_COUNT + column}")
            for joint in list(vertex.joints):
                spec.delete(joint)
    return _with_springs(compiled_body(spec, scene.body.model), scene)


def _spec(scene: Scene, step: float) -> tuple[mujoco.MjSpec, list[mujoco.MjsBody]]:
    spec, bodies = body_spec(scene.body.model)
    spec.memory = MEMORY
    option = spec.option
    option.timestep = step
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    return spec, bodies


def _add_hulls(spec: mujoco.MjSpec, bodies: list[mujoco.MjsBody], scene: Scene) -> None:
    segment, place = _vertices_by_segment(scene)
    for index, body in enumerate(bodies):
        hull = trimesh.convex.convex_hull(place[segment == index])
        spec.add_mesh(
            name=body.name, uservert=hull.vertices.ravel(), userface=hull.faces.ravel(),
            maxhullvert=HULL_VERTICES,
        )
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=body.name, contype=0, conaffinity=1,
            condim=CONDIM, friction=FRICTION, mass=0.0,
        )


def _add_height_field(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add the carrying side of the lift at its start, sampled as densely as its contact points.

    Seen at `VIEW` it hides nothing of itself. Where there is no device the field is at its lowest.
    """
    surface, start = scene.surface, scene.motion(0.0)
    towards = np.array([np.sin(VIEW), 0.0, np.cos(VIEW)])
    frame = np.column_stack([np.cross([0.0, 1.0, 0.0], towards), [0.0, 1.0, 0.0], towards])
    seen = surface.vertices @ frame
    low, high = seen.min(axis=0), seen.max(axis=0)
    count = np.round((high - low)[:2] / surface.spacing).astype(int) + 1
    x, y = np.meshgrid(*(np.linspace(low[i], high[i], count[i]) for i in (0, 1)))
    above = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, high[2] + 0.1)]) @ frame.T
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    hits, rays, _ = mesh.ray.intersects_location(
        above, np.tile(-towards, (len(above), 1)), multiple_hits=False
    )
    height = np.full(x.size, np.inf)
    height[rays] = (hits @ frame)[:, 2]
    bottom = height.min()
    height[np.isinf(height)] = bottom
    rise = height.max() - bottom
    spec.add_hfield(
        name="lift", nrow=count[1], ncol=count[0],
        size=[*(high - low)[:2] / 2, rise, 0.1], userdata=(height - bottom) / rise,
    )
    middle = frame @ np.array([*(low + high)[:2] / 2, bottom])
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, (start.rotation @ frame).ravel())
    spec.worldbody.add_geom(
        name="lift", type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="lift", contype=1,
        conaffinity=0, friction=FRICTION, pos=start.rotation @ middle + start.position,
        quat=quaternion,
    )


def _vertices_by_segment(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the segment (n,) that carries most of each vertex, and where in its frame (n, 3)."""
    body, skin = scene.body, scene.body.skin
    offsets = skin.influence_offsets
    owner = np.repeat(np.arange(skin.vertex_count), np.diff(offsets))
    order = np.lexsort([-skin.influence_weight, owner])
    segment = skin.influence_segment[order[offsets[:-1]]]
    data = body.model.createData()
    pin.forwardKinematics(body.model, data, scene.configuration)
    rotations, origins = segment_placements(body.model, data)
    away = posed_skin(body, scene.configuration) - origins[segment]
    return segment, np.einsum("nji,nj->ni", rotations[segment], away)


def _with_springs(body: MujocoBody, scene: Scene) -> MujocoBody:
    """Give the body's joints stiffness and damping of the scene's, about its start."""
    model, ours = body.model, scene.body.model
    stiffness, damping = joint_gains(ours, scene.method.joints)
    model.dof_damping[: ours.nv] = damping[body.v_order]
    first = model.jnt_dofadr[1 : len(SEGMENTS)]  # the root has no spring
    model.jnt_stiffness[1 : len(SEGMENTS)] = stiffness[body.v_order][first]
    model.qpos_spring[: ours.nq] = scene.configuration[body.q_order]
    return body
