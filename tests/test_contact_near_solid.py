"""Skin near a solid: clusters that hold their vertices, and lists that nothing passes unseen."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from pressed_skin import half_space

from simcore.body.build import posed_skin
from simcore.body.segments import SEGMENTS
from simcore.body.skin_clusters import skin_carriers, skin_clusters
from simcore.body.skin_listed import segment_balls
from simcore.contact.near_solid import NearSolid
from simcore.contact.segment_motion import cluster_ball, write_relative
from simcore.device.motion import STILL
from simcore.dynamics.pinocchio_views import view_segments


class MadeUpSkin(SimpleNamespace):
    """What of a `Skin` clusters are made of; itself, however equal another may be."""

    __hash__ = object.__hash__


class TwoSegments:
    """Points on two segments, each third on both, that move freely."""

    def __init__(self, rng, count, height):
        local = rng.uniform(-0.1, 0.1, (count, 3))
        self.rotations, self.velocities = np.tile(np.eye(3), (2, 1, 1)), np.zeros((2, 6))
        self.positions = np.array([[0, 0, height], [0.02, 0, height + 0.13]])
        self.weights = np.zeros((count, 2))
        self.weights[:, 0] = np.arange(count) < count / 2
        self.weights[::3, 0] = rng.uniform(0.01, 0.99, len(self.weights[::3]))
        self.weights[:, 1] = 1 - self.weights[:, 0]
        main = self.weights.argmax(axis=1)
        self.local = (local + self.positions[main])[:, None] - self.positions
        owner, segment = np.nonzero(self.weights)
        skin = MadeUpSkin(
            vertex_count=count, influence_segment=segment,
            influence_offsets=np.concatenate([[0], np.cumsum(np.bincount(owner))]),
            influence_weight=self.weights[owner, segment],
            influence_point=self.local[owner, segment],
        )
        influences = (skin.influence_offsets, skin.influence_segment, skin.influence_weight,
                      skin.influence_point)
        clusters = tuple(vars(skin_clusters(skin, 2, 16)).values())
        carriers = tuple(vars(skin_carriers(skin)).values())
        self.near = NearSolid(
            *half_space(), influences, clusters, carriers, *segment_balls(skin, 2)
        )

    def move(self, twist, step):
        for j in (0, 1):
            way = pin.exp6(pin.Motion(step * twist[j]))
            self.positions[j] += self.rotations[j] @ way.translation
            self.rotations[j] = self.rotations[j] @ way.rotation
        self.velocities[:] = twist

    @property
    def world(self):
        each = np.einsum("jab,njb->nja", self.rotations, self.local) + self.positions
        return np.einsum("nj,nja->na", self.weights, each)

    @property
    def velocity(self):
        own = self.velocities[:, :3] + np.cross(self.velocities[:, 3:], self.local)
        return np.einsum("nj,jab,njb->na", self.weights, self.rotations, own)


@pytest.mark.parametrize("seed", range(4))
def test_no_vertex_touches_unseen(seed):
    """Two segments of skin in random motion over a solid: listed is all that touches or would, as
    it moves now, within the lag; and lists last for many steps."""
    rng = np.random.default_rng(seed)
    step, lag = 0.004, 0.003
    skin, touched = TwoSegments(rng, 300, 0.12), 0
    for k in range(400):
        twist = rng.normal(scale=0.05, size=(2, 6)) + np.sin(0.05 * k) * np.array([[0, 0, -0.3]*2])
        skin.move(twist, step)
        skin.near.update(skin, STILL, lag)
        listed = skin.near.listed
        assert np.all(np.diff(listed) > 0)
        touches = skin.world[:, 2] <= -lag * skin.velocity[:, 2]
        assert set(np.flatnonzero(touches)) <= set(listed)
        touched += np.count_nonzero(touches)
    assert touched > 1000 and len(listed) < 300
    assert 1 < skin.near.looks < 100


@pytest.mark.parametrize("seed", range(3))
def test_no_skin_moves_farther_than_told_within_the_pace(seed):
    """Free segments over a plane: a point moves no farther than allowed, or half of its way."""
    rng = np.random.default_rng(seed)
    skin = TwoSegments(rng, 200, 0.1)
    skin.velocities[:] = rng.normal(size=(2, 6))
    skin.near.update(skin, STILL, 0.01)
    motion = 0.02
    pace = skin.near.pace(skin, STILL, motion)
    speed = np.linalg.norm(skin.velocity, axis=1)
    assert np.all(pace * speed <= np.maximum(motion, skin.world[:, 2] / 2) * (1 + 1e-6))
    assert pace > 0.2 * motion / speed.max()


@pytest.mark.parametrize("size", (8, 32))
def test_clusters_hold_their_vertices_in_any_posture(size, coarse_body):
    """However joints turn, beyond their ranges too; and balls are small in the rest posture."""
    model, skin, count = coarse_body.model, coarse_body.skin, len(SEGMENTS)
    clusters = skin_clusters(skin, count, size)
    assert np.array_equal(np.sort(clusters.vertex), np.arange(skin.vertex_count))
    assert np.diff(clusters.offsets).max() <= size
    shapes = tuple(vars(clusters).values())[2:]
    data = model.createData()
    views, pose = view_segments(model, data), np.empty((count, 3, 4))
    rng = np.random.default_rng(size)
    widest = []
    for k in range(6):
        turn = (0.0 if k == 0 else 1.0) * rng.normal(scale=0.8, size=model.nv)
        q = pin.integrate(model, coarse_body.rest_configuration, turn)
        pin.forwardKinematics(model, data, q)
        write_relative(views.rotations, views.positions, np.eye(3), np.zeros(3), pose)
        vertices = posed_skin(coarse_body, q)
        for c in range(len(clusters.radius)):
            *middle, radius = cluster_ball(*shapes, pose, c)
            inside = clusters.vertex[clusters.offsets[c] : clusters.offsets[c + 1]]
            away = np.linalg.norm(vertices[inside] - middle, axis=1).max()
            assert away <= radius + 1e-12
            if k == 0:
                widest.append((radius, away))
    radius, away = np.array(widest).T
    assert np.median(radius) < 1.5 * np.median(away)


def test_carriers_are_the_segments_of_each_vertex(coarse_body):
    skin = coarse_body.skin
    carriers = skin_carriers(skin)
    ends = zip(skin.influence_offsets, skin.influence_offsets[1:], strict=False)
    for carrier, (start, end) in zip(carriers.of_vertex, ends, strict=True):
        own = carriers.segment[carriers.offsets[carrier] : carriers.offsets[carrier + 1]]
        assert set(own) == set(skin.influence_segment[start:end])
    assert len(carriers.offsets) < 100
