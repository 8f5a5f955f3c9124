"""The peers' scenes are simcore's, as far as MuJoCo can have them."""

from types import SimpleNamespace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import trimesh

from benchmarks.peers import runs, scenes
from simcore.bench import case_scene
from simcore.body.build import posed_skin
from simcore.dynamics.joints import PostureControl
from simcore.joint_torque import joint_gains

STEP = runs.STEP


@pytest.fixture(scope="module")
def hulls(scene):
    return scenes.hulls_on_lift(scene, STEP)


@pytest.fixture(scope="module")
def flex(scene):
    return scenes.skin_on_lift(scene, STEP, *runs.STIFF)


def started(body, scene):
    data = body.data_at(scene.configuration, np.zeros(scene.body.model.nv))
    mujoco.mj_forward(body.model, data)
    return data


def test_height_field_is_the_carrying_side(hulls, scene):
    """Rays along its axis meet it where they meet the device, but for its grid's spacing."""
    data = started(hulls, scene)
    start, surface = scene.motion(0.0), scene.surface
    towards = np.array([np.sin(scenes.VIEW), 0.0, np.cos(scenes.VIEW)])
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    inside = np.abs(surface.vertices[:, 1]) < 0.8 * surface.vertices[:, 1].max()
    origins = surface.vertices[inside][::17] + 0.6 * towards
    hits, rays, _ = mesh.ray.intersects_location(
        origins, np.tile(-towards, (len(origins), 1)), multiple_hits=False
    )
    expected = np.linalg.norm(hits - origins[rays], axis=1)
    only_lift = np.array([1, 0, 0, 0, 0, 0], np.uint8)
    hulls.model.geom_group[:] = [
        0 if kind == mujoco.mjtGeom.mjGEOM_HFIELD else 1 for kind in hulls.model.geom_type
    ]
    found = np.array([
        mujoco.mj_ray(
            hulls.model, data, start.rotation @ origin + start.position,
            start.rotation @ -towards, only_lift, 1, -1, np.zeros(1, np.int32), None,
        )
        for origin in origins[rays]
    ])
    assert len(found) > 50
    assert np.median(np.abs(found - expected)) < 5e-4
    # Beyond the ends of the slab the grid falls to its lowest within one spacing.
    assert np.quantile(np.abs(found - expected), 0.9) < scene.surface.spacing


def test_skin_starts_where_simcores_does(flex, scene):
    data = started(flex, scene)
    # A vertex that several segments share is where blending has it: at the start only.
    assert np.abs(data.flexvert_xpos - posed_skin(scene.body, scene.configuration)).max() < 1e-9


def test_hulls_lie_within_the_bounds_of_the_skin(hulls, scene):
    data = started(hulls, scene)
    skin = posed_skin(scene.body, scene.configuration)
    for geom in np.flatnonzero(hulls.model.geom_type == mujoco.mjtGeom.mjGEOM_MESH):
        mesh = hulls.model.geom_dataid[geom]
        first = hulls.model.mesh_vertadr[mesh]
        count = hulls.model.mesh_vertnum[mesh]
        local = hulls.model.mesh_vert[first : first + count]
        world = local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        assert (world > skin.min(axis=0) - 1e-6).all()
        assert (world < skin.max(axis=0) + 1e-6).all()


def test_springs_and_dampers_are_simcores(hulls, scene):
    """Along one axis a joint: a spherical one's shortest arc is that axis in both engines."""
    model = scene.body.model
    control = PostureControl(
        model, scene.configuration, *joint_gains(model, scene.method.joints)
    )
    change = np.zeros(model.nv)
    for joint in list(model.joints)[2:]:
        change[joint.idx_v] = 0.2
    q, v = pin.integrate(model, scene.configuration, change), 0.3 * change
    data = hulls.data_at(q, v)
    mujoco.mj_forward(hulls.model, data)
    assert hulls.from_dofs(data.qfrc_passive) == pytest.approx(control.torque(q, v), abs=1e-9)


def test_contact_forces_are_shared_by_place(flex, scene):
    data = started(flex, scene)
    corners = flex.model.flex_elem.reshape(-1, 3)[[5, 9]]
    place = data.flexvert_xpos[corners]

    inside = np.array([0.2, 0.3, 0.5]) @ place[0]
    found = SimpleNamespace(
        flexvert_xpos=data.flexvert_xpos,
        contact=SimpleNamespace(
            elem=np.array([[-1, 5], [-1, 9]]), pos=np.array([inside, place[1, 2]])
        ),
    )
    force = np.zeros(scene.body.skin.vertex_count)
    runs._add_to_vertices(flex.model, found, np.array([10.0, 4.0]), force)
    expected = np.zeros_like(force)
    np.add.at(expected, corners[0], [2.0, 3.0, 5.0])
    expected[corners[1, 2]] += 4.0
    assert force == pytest.approx(expected, abs=1e-9)


def test_hulls_come_to_be_carried(hulls, scene):
    found = runs._run(hulls, scene, "hulls", 1.0)
    assert found.support_ratio == pytest.approx(1.0, abs=0.05)
    assert found.contacts > 3
    assert found.peak_pressure is None


def test_cloth_hangs_by_its_long_sides(monkeypatch):
    monkeypatch.setattr(scenes, "CLOTH_COUNT", 8)
    scene = case_scene("sling")
    body = scenes.hulls_on_cloth(scene, STEP, runs.FABRIC)
    model, data = body.model, started(body, scene)
    sheet = scene.sling.start.position
    held = model.body_dofnum[model.flex_vertbodyid] == 0
    assert held.sum() == 16
    assert np.abs(data.flexvert_xpos[held, 1]) == pytest.approx(np.abs(sheet[:, 1]).max())
    assert np.abs(data.flexvert_xpos[~held, 1]).max() < 0.99 * np.abs(sheet[:, 1]).max()
    assert np.ptp(data.flexvert_xpos[:, 0]) == pytest.approx(np.ptp(sheet[:, 0]))
    below = data.flexvert_xpos[:, 2].max() + scenes.CLOTH_RADIUS
    assert below < posed_skin(scene.body, scene.configuration)[:, 2].min()
    mass = model.body_mass.sum() - scene.body.mass
    assert mass == pytest.approx(scene.sling.solver.sheet.net.mass.sum(), rel=1e-6)
