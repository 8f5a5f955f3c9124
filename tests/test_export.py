"""Runs as glTF and CSV: read back by other means, they are the run."""

import csv
import io
import json
import os
import shutil
import subprocess

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from made_up_runs import STEP, make_run
from scipy.spatial.transform import Rotation

from simcore.body.build import posed_skin
from simcore.body.posture import joint_angles
from simcore.errors import DesignError
from simcore.export.gltf import SHEET_BYTES_MAX, four_influences, shape_frames, to_glb
from simcore.export.recording import joint_quaternions, one_sign, open_recording
from simcore.export.shapes import tube_placements, unit_tube
from simcore.export.tables import tables_of
from simcore.export.whole_file import write_whole
from simcore.metrics import METRICS
from simcore.pressure_scale import UNLOADED_COLOUR, pressure_colours

KINDS = ("robotic_lift", "sling_reclined", "sling_stretcher")
DTYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}

VALIDATOR = """
const report = require('gltf-validator').validateBytes(require('fs').readFileSync(0));
report.then((told) => console.log(JSON.stringify(told.issues)));
"""


class Reader:
    """A glTF binary evaluated as the specification says, on nothing but its bytes."""

    def __init__(self, content: bytes):
        length = int.from_bytes(content[12:16], "little")
        self.tree = json.loads(content[20 : 20 + length])
        self.binary = content[20 + length + 8 :]
        nodes = list(enumerate(self.tree["nodes"]))
        self.named = {node["name"]: i for i, node in nodes}
        self.above = {child: i for i, node in nodes for child in node.get("children", [])}

    def array(self, accessor: int) -> np.ndarray:
        told = self.tree["accessors"][accessor]
        view = self.tree["bufferViews"][told["bufferView"]]
        width = WIDTHS[told["type"]]
        flat = np.frombuffer(self.binary, DTYPES[told["componentType"]], told["count"] * width,
                             view["byteOffset"])
        return flat.reshape(-1, width) if width > 1 else flat

    def attributes(self, name: str) -> dict[str, np.ndarray]:
        (primitive,) = self._mesh(name)["primitives"]
        return {key: self.array(at) for key, at in primitive["attributes"].items()}

    def animated(self, node: int, path: str, frame: int) -> np.ndarray:
        (animation,) = self.tree["animations"]
        for channel in animation["channels"]:
            if channel["target"] == {"node": node, "path": path}:
                sampler = animation["samplers"][channel["sampler"]]
                values = self.array(sampler["output"])
                return values.reshape(len(self.array(sampler["input"])), -1)[frame]
        default = {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]}
        return np.array(self.tree["nodes"][node].get(path, default[path]))

    def placed(self, node: int, frame: int) -> np.ndarray:
        """World matrix of a node."""
        local = np.eye(4)
        turn = Rotation.from_quat(self.animated(node, "rotation", frame)).as_matrix()
        local[:3, :3] = turn * self.animated(node, "scale", frame)
        local[:3, 3] = self.animated(node, "translation", frame)
        return self.placed(self.above[node], frame) @ local if node in self.above else local

    def vertices(self, name: str, frame: int) -> np.ndarray:
        """A mesh as it stands at a frame."""
        (primitive,) = self._mesh(name)["primitives"]
        position = self.attributes(name)["POSITION"].astype(float)
        if "targets" in primitive:
            weights = self.animated(self.named[name], "weights", frame)
            for weight, target in zip(weights, primitive["targets"], strict=True):
                position = position + weight * self.array(target["POSITION"])
        matrix = self.placed(self.named[name], frame)
        return position @ matrix[:3, :3].T + matrix[:3, 3]

    def skinned(self, frame: int) -> np.ndarray:
        (skin,) = self.tree["skins"]
        binds = self.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        moves = [self.placed(joint, frame) @ bind
                 for joint, bind in zip(skin["joints"], binds, strict=True)]
        told = self.attributes("body")
        blended = np.einsum("nk,nkij->nij", told["WEIGHTS_0"], np.array(moves)[told["JOINTS_0"]])
        rest = np.column_stack([told["POSITION"], np.ones(len(told["POSITION"]))])
        return np.einsum("nij,nj->ni", blended, rest)[:, :3]

    def _mesh(self, name: str) -> dict:
        return self.tree["meshes"][self.tree["nodes"][self.named[name]]["mesh"]]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    return {kind: open_recording(make_run(folder / f"{kind}.nc", kind)) for kind in KINDS}


@pytest.fixture(scope="module")
def glbs(runs):
    return {kind: to_glb(run) for kind, run in runs.items()}


def upright(world: np.ndarray) -> np.ndarray:
    """x forward, y left, z up → glTF's z forward, x left, y up."""
    return world[:, [1, 2, 0]]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("frame", [0, 4, 8])
def test_the_skin_follows_the_skeleton(runs, glbs, kind, frame):
    run = runs[kind]
    expected = upright(posed_skin(run.body, run.column("q")[frame]))
    assert np.abs(Reader(glbs[kind]).skinned(frame) - expected).max() < 1e-4  # 0.1 mm


def test_the_rest_pose_stands_upright_without_its_skin(runs, glbs):
    body = runs["robotic_lift"].body
    rest = Reader(glbs["robotic_lift"]).attributes("body")["POSITION"]
    assert np.abs(rest - upright(posed_skin(body, body.rest_configuration))).max() < 1e-6
    assert np.ptp(rest[:, 1]) == pytest.approx(body.stature, abs=1e-5)


@pytest.mark.parametrize("frame", [0, 3, 8])
def test_device_and_sheet_are_where_they_were(runs, glbs, frame):
    lift, sling = runs["robotic_lift"], runs["sling_reclined"]
    turn = Rotation.from_quat(lift.column("device_quaternion")[frame]).as_matrix()
    moved = lift.surface.vertices @ turn.T + lift.column("device_position")[frame]
    device = Reader(glbs["robotic_lift"]).vertices("device", frame)
    assert np.abs(device - upright(moved)).max() < 1e-6
    sheet = Reader(glbs["sling_reclined"]).vertices("sheet", frame)
    assert np.abs(sheet - upright(sling.column("sheet_position")[frame])).max() < 1e-6


def test_straps_reach_from_sheet_to_bar(runs, glbs):
    run, reader = runs["sling_reclined"], Reader(glbs["sling_reclined"])
    straps = [i for i, node in enumerate(reader.tree["nodes"]) if node["name"] == "strap"]
    assert len(straps) == run.strap_ends.shape[1] == 4
    for frame in (0, 5):
        for strap, ends in zip(straps, run.strap_ends[frame], strict=True):
            matrix = reader.placed(strap, frame)
            found = np.array([matrix[:3, 3], matrix[:3, 3] + matrix[:3, 2]])
            assert np.abs(found - upright(ends)).max() < 1e-6


def test_edges_tied_to_poles_are_no_straps(runs):
    assert runs["sling_stretcher"].strap_ends.shape[1] == 0
    assert len(runs["sling_stretcher"].bar_tubes) == 2


def test_the_timeline_begins_with_the_run(runs, glbs):
    tree = Reader(glbs["robotic_lift"]).tree
    reader, sampler = Reader(glbs["robotic_lift"]), tree["animations"][0]["samplers"][0]
    assert reader.array(sampler["input"]) == pytest.approx(STEP * np.arange(9), abs=1e-6)
    assert tree["asset"]["extras"]["device_start_s"] == pytest.approx(0.08)
    assert [node["name"] for node in tree["nodes"]][1:19] == list(
        runs["robotic_lift"].body.segment_names
    )


def test_colours_are_linear_and_on_the_scale_it_tells(runs, glbs):
    run, reader = runs["robotic_lift"], Reader(glbs["robotic_lift"])
    told = reader.attributes("body")
    assert np.allclose(told["_PRESSURE_PEAK"], run.pressure_peak, rtol=1e-6)
    scale = reader.tree["asset"]["extras"]["pressure_scale_pa"]
    assert scale >= run.pressure_peak.max()
    linear = told["COLOR_0"][:, :3] / 65535
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.abs(srgb - pressure_colours(run.pressure_peak, scale)).max() < 1 / 255
    untouched = np.setdiff1d(np.arange(len(srgb)), run.frames["skin_vertex"].values)
    assert np.abs(srgb[untouched] - UNLOADED_COLOUR).max() < 1 / 255


def test_peak_pressure_leaves_out_settling_and_what_follows_a_fall(tmp_path):
    run = open_recording(make_run(tmp_path / "fell.nc", margin=-0.2))
    expected = run.column("skin_pressure")[2:8].max(axis=0)  # 0 s to the fall, a frame before last
    peak = run.pressure_peak[run.frames["skin_vertex"].values]
    assert np.abs(peak - expected).max() <= 25.01  # frames are kept to half a step of 50 Pa


@pytest.mark.parametrize("kind", KINDS)
def test_trimesh_reads_it(runs, glbs, kind):
    scene = trimesh.load(io.BytesIO(glbs[kind]), file_type="glb")
    body = scene.geometry["body"]
    assert len(body.vertices) == runs[kind].body.skin.vertex_count
    assert body.is_watertight and body.volume > 0.05
    assert set(runs[kind].body.segment_names) <= set(scene.graph.nodes)


@pytest.mark.parametrize("kind", KINDS)
def test_khronos_validator_has_no_complaint(glbs, kind):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    modules = os.environ.get("NODE_PATH", "")
    if shutil.which("npm"):
        found = subprocess.run(["npm", "root", "-g"], capture_output=True, text=True, check=False)
        modules = os.pathsep.join(filter(None, [modules, found.stdout.strip()]))
    done = subprocess.run([node, "-e", VALIDATOR], input=glbs[kind], capture_output=True,
                          check=False, env=os.environ | {"NODE_PATH": modules})
    if b"Cannot find module 'gltf-validator'" in done.stderr:
        pytest.skip("Khronos validator not found; npm install --global gltf-validator")
    issues = json.loads(done.stdout)
    assert (issues["numErrors"], issues["numWarnings"], issues["messages"]) == (0, 0, [])


def test_four_influences_keep_a_body_within_a_tenth_of_a_millimetre(coarse_body):
    segments, weights = four_influences(coarse_body)
    offsets, skin = coarse_body.skin.influence_offsets, coarse_body.skin
    assert np.allclose(weights.sum(axis=1), 1, atol=1e-6)
    for vertex in range(0, len(weights), 97):
        own = slice(offsets[vertex], offsets[vertex + 1])
        full = np.zeros(18)
        full[skin.influence_segment[own]] = skin.influence_weight[own]
        kept = np.zeros(18)
        np.add.at(kept, segments[vertex], weights[vertex])
        reach = 2.0  # [m] no vertex is farther from a segment's joint
        assert np.abs(full - kept).sum() * reach < 1e-4


@given(count=st.integers(1, 400), vertices=st.integers(9, 100_000))
def test_kept_shapes_fit_and_hold_both_ends(count, vertices):
    kept = shape_frames(count, vertices)
    assert (kept[0], kept[-1]) == (0, count - 1)
    assert (np.diff(kept) > 0).all()
    assert len(kept) <= 2 or 24 * vertices * len(kept) <= SHEET_BYTES_MAX


@given(st.lists(st.lists(st.floats(-1, 1), min_size=4, max_size=4), min_size=2, max_size=9))
def test_quaternions_of_one_sign_are_the_same_rotations(rows):
    raw = np.array(rows)
    raw[np.linalg.norm(raw, axis=1) < 1e-3] = [0, 0, 0, 1]
    steady = one_sign(raw)
    assert (np.einsum("ti,ti->t", steady[1:], steady[:-1]) >= -1e-12).all()
    same = Rotation.from_quat(raw).as_matrix() - Rotation.from_quat(steady).as_matrix()
    assert np.abs(same).max() < 1e-9


def test_joint_quaternions_are_pinocchios(runs):
    import pinocchio as pin

    run = runs["robotic_lift"]
    q = pin.normalize(run.body.model, run.column("q")[5])  # single precision has unit norm to 1e-7
    data = run.body.model.createData()
    pin.forwardKinematics(run.body.model, data, q)
    turns = Rotation.from_quat(joint_quaternions(run.body, q[None])[0]).as_matrix()
    for joint in range(1, run.body.model.njoints):
        assert np.abs(turns[joint - 1] - data.liMi[joint].rotation).max() < 1e-9


@given(st.lists(st.floats(-2, 2), min_size=6, max_size=6))
def test_tubes_run_from_end_to_end(numbers):
    ends = np.array(numbers).reshape(2, 3)
    ends[1] += [0, 0, -0.5] if np.linalg.norm(ends[1] - ends[0]) < 1e-2 else 0
    translation, rotation, scale = tube_placements(ends, 0.01)
    turn = Rotation.from_quat(rotation)
    found = turn.apply(np.array([[0, 0, 0], [0, 0, 1]]) * scale) + translation
    assert np.abs(found - ends).max() < 1e-6


def test_a_tube_is_closed_and_faces_outwards():
    vertices, normals, faces = unit_tube()
    mesh = trimesh.Trimesh(vertices, faces)  # merges what only normals keep apart
    assert mesh.is_watertight and 2.9 < mesh.volume < np.pi
    across = np.cross(*(vertices[faces[:, i]] - vertices[faces[:, 0]] for i in (1, 2)))
    assert (np.einsum("fj,fj->f", across, normals[faces[:, 0]]) > 0).all()


def table(content: bytes) -> list[dict]:
    return list(csv.DictReader(io.StringIO(content.decode())))


def test_tables_hold_the_run(runs):
    run = runs["sling_reclined"]
    tables = {name: table(content) for name, content in tables_of(run).items()}
    assert set(tables) == {"figures", "series", "segments", "joints", "straps"}
    assert {row["figure"] for row in tables["figures"]} >= set(METRICS)
    peak = next(row for row in tables["figures"] if row["figure"] == "peak_pressure")
    assert (float(peak["value"]), peak["unit"]) == (10e3, "Pa")
    assert [float(row["time_s"]) for row in tables["series"]] == pytest.approx(run.time.tolist())
    up = [float(row["support_force_z_n"]) for row in tables["series"]]
    assert up == pytest.approx(run.column("support_force")[:, 2].tolist(), rel=1e-6)
    assert len(tables["segments"]) == 9 * 18 and len(tables["straps"]) == 9 * 4
    flexion = next(row for row in reversed(tables["joints"])
                   if (row["joint"], row["angle"]) == ("knee_left", "flexion"))
    expected = joint_angles(run.body, run.column("q")[-1])["knee_left"]["flexion"]
    assert float(flexion["value_rad"]) == pytest.approx(expected, rel=1e-6)
    assert "straps" not in tables_of(runs["robotic_lift"])


def test_a_run_of_another_body_is_refused(tmp_path, runs):
    path = make_run(tmp_path / "run.nc")
    frames = runs["robotic_lift"].frames.copy()
    design = json.loads(frames.attrs["design"])
    design["body"]["skin_vertices"] = 2000
    frames.attrs["design"] = json.dumps(design)
    path.unlink()
    frames.drop_encoding().to_netcdf(path)
    with pytest.raises(DesignError, match="another body"):
        open_recording(path)


def test_a_file_is_whole_or_untouched(tmp_path):
    path = tmp_path / "new" / "file.glb"
    write_whole(path, b"old")
    with pytest.raises(TypeError):
        write_whole(path, "no bytes")
    assert path.read_bytes() == b"old"
    assert list(path.parent.iterdir()) == [path]
