"""glTF files: their structure is that of the specification, and their nodes move as the bodies do."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.body import body_geoms
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import unpack
from harness.core.skeleton import Pose, Skeleton, forward_kinematics
from harness.mocap.write.body_model import BodyModel, MountedStation
from harness.mocap.write.export import export_motion
from harness.mocap.write.gltf_builder import MAX_VERTICES, GltfBuilder
from harness.mocap.write.posed_motion import ExportableCell, PosedMotion
from tests.mocap.write.glb_file import GlbFile, read_glb
from tests.mocap.write.test_export import BELIEVED, FRAMES, RATE_HZ, SKELETON, Written, arbitrary_motion

STATION = MountedStation("wrist", "rwrist", np.array([0.0, -0.05, 0.03]), rotations.exp(np.array([0.1, 0.2, 0.3])))


def dressed(cell: ExportableCell, motion: PosedMotion) -> BodyModel:
    return BodyModel(body_geoms(motion.skeleton), [STATION])


@pytest.fixture
def cell(rng: np.random.Generator) -> Written:
    return Written(arbitrary_motion(rng), arbitrary_motion(rng))


@pytest.fixture
def glb(cell: Written, tmp_path: Path) -> GlbFile:
    (file,) = export_motion([cell], "glb", tmp_path, model=dressed)
    assert file.name == "walking_01_02@0.20-0.40-ik-pos+ori.glb"
    return read_glb(file)


def in_gltf(position: Floats) -> Floats:
    """Positions (..., 3) as x left, y up, z forward."""
    out: Floats = position[..., [1, 2, 0]]
    return out


def pose_of(skeleton: Skeleton, qpos: Floats) -> Pose:
    return forward_kinematics(skeleton, *unpack(qpos))


@pytest.mark.parametrize("kind", ["truth", "estimate"])
def test_bones_are_where_the_body_has_them(cell: Written, glb: GlbFile, kind: str) -> None:
    body, qpos = (SKELETON, cell.truth_qpos) if kind == "truth" else (BELIEVED, cell.estimate_qpos)
    pose = pose_of(body, qpos)
    for frame in (0, 1, 17, FRAMES - 1):
        for name in ("lowerback", "head", "lhand", "rwrist", "rtibia", "lfoot"):
            world, bone = glb.world(glb.node(f"{kind} {name}"), frame / RATE_HZ), body.index(name)
            np.testing.assert_allclose(world[:3, 3], in_gltf(pose.start_m[frame, bone]), atol=1e-5)
            turn = in_gltf(pose.world_from_bone[frame, bone].T).T
            np.testing.assert_allclose(world[:3, :3], turn, atol=1e-5)
        root = glb.world(glb.node(f"{kind} root"), frame / RATE_HZ)
        np.testing.assert_allclose(root[:3, 3], in_gltf(qpos[frame, :3]), atol=1e-5)


def test_a_still_viewer_shows_the_first_frame(glb: GlbFile) -> None:
    for name in ("truth root", "truth rhand", "estimate lfoot"):
        np.testing.assert_allclose(glb.world(glb.node(name)), glb.world(glb.node(name), 0.0), atol=1e-6)


def test_stations_ride_on_their_bones(cell: Written, glb: GlbFile) -> None:
    pose = pose_of(SKELETON, cell.truth_qpos)
    frame, bone = 9, SKELETON.index("rwrist")
    world = glb.world(glb.node("truth station wrist"), frame / RATE_HZ)
    place = pose.start_m[frame, bone] + pose.world_from_bone[frame, bone] @ STATION.position_m
    np.testing.assert_allclose(world[:3, 3], in_gltf(place), atol=1e-5)
    turn = pose.world_from_bone[frame, bone] @ rotations.to_matrix(STATION.bone_from_station)
    np.testing.assert_allclose(world[:3, :3], in_gltf(turn.T).T, atol=1e-5)


def test_the_structure_is_that_of_the_specification(glb: GlbFile) -> None:
    content = glb.content
    assert content["asset"]["version"] == "2.0"
    (buffer,) = content["buffers"]
    assert buffer["byteLength"] == len(glb.data)
    ends = 0
    for view in content["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] >= ends
        ends = view["byteOffset"] + view["byteLength"]
        assert ends <= buffer["byteLength"]
    for number, accessor in enumerate(content["accessors"]):
        values = glb.array(number)
        assert values.nbytes == content["bufferViews"][accessor["bufferView"]]["byteLength"]
        assert np.isfinite(values).all()
        if accessor["componentType"] == 5126:
            np.testing.assert_array_equal(np.float32(accessor["min"]), values.min(axis=0))
            np.testing.assert_array_equal(np.float32(accessor["max"]), values.max(axis=0))
    children = [child for node in content["nodes"] for child in node.get("children", ())]
    assert len(children) == len(set(children))
    tops = set(range(len(content["nodes"]))) - set(children)
    (scene,) = content["scenes"]
    assert {content["nodes"][top]["name"] for top in tops} == {"truth", "estimate"}
    assert set(scene["nodes"]) == tops
    assert not [node for node in content["nodes"] if node.get("children") == []]
    names = [node["name"] for node in content["nodes"]]
    assert len(names) == len(set(names)) == 2 * (1 + 25 + 1)


def test_rotations_are_unit_quaternions_without_jumps(glb: GlbFile) -> None:
    (animation,) = glb.content["animations"]
    targets = [(channel["target"]["node"], channel["target"]["path"]) for channel in animation["channels"]]
    assert len(targets) == len(set(targets)) == 2 * (1 + 1 + 22)  # two bones have no hinges
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        times, values = glb.array(sampler["input"]), glb.array(sampler["output"])
        assert times[0] == 0.0
        assert (np.diff(times[:, 0]) > 0.0).all()
        assert len(times) == len(values) == FRAMES
        if channel["target"]["path"] == "rotation":
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
            assert np.sum(values[1:] * values[:-1], axis=1).min() >= 0.0


def test_meshes_are_closed_and_face_outward(glb: GlbFile) -> None:
    for mesh in glb.content["meshes"]:
        (primitive,) = mesh["primitives"]
        place = glb.array(primitive["attributes"]["POSITION"]).astype(float)
        normal = glb.array(primitive["attributes"]["NORMAL"]).astype(float)
        corners = glb.array(primitive["indices"]).reshape(-1, 3)
        assert corners.max() < len(place) == len(normal)
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-6)
        a, b, c = (place[corners[:, k]] for k in range(3))
        area = np.cross(b - a, c - a)
        assert np.linalg.norm(area, axis=1).min() > 1e-9
        assert np.sum(area * normal[corners].sum(axis=1), axis=1).min() > 0.0
        np.testing.assert_allclose(area.sum(axis=0), 0.0, atol=1e-6)  # closed surfaces
        assert 1e-5 < np.sum(a * area) / 6.0 < 0.05  # their volume [m3]


def test_gaps_keep_their_time_and_one_frame_is_enough(cell: Written, tmp_path: Path) -> None:
    gappy = replace(cell, frame_index=np.r_[np.arange(20), np.arange(23, 23 + 30)])
    glb = read_glb(export_motion([gappy], "glb", tmp_path)[0])
    times = glb.array(glb.content["animations"][0]["samplers"][0]["input"])[:, 0]
    np.testing.assert_allclose(times, (gappy.frame_index - gappy.frame_index[0]) / RATE_HZ, atol=1e-6)
    assert glb.content["nodes"][glb.node("truth")]["extras"] == {"start_s": 3.0, "rate_hz": 40.0}
    estimate = np.full_like(cell.estimate_qpos, np.nan)
    estimate[5] = cell.estimate_qpos[5]
    single = read_glb(export_motion([replace(cell, estimate_qpos=estimate, key="1" * 16)], "glb", tmp_path / "one")[0])
    assert single.content["accessors"][single.content["animations"][0]["samplers"][0]["input"]]["count"] == 1


def test_without_a_model_bodies_are_sticks(cell: Written, tmp_path: Path) -> None:
    glb = read_glb(export_motion([cell], "glb", tmp_path)[0])
    (primitive,) = glb.content["meshes"][glb.content["nodes"][glb.node("truth lfemur")]["mesh"]]["primitives"]
    place = glb.array(primitive["attributes"]["POSITION"])
    bone = SKELETON.bone_m[SKELETON.index("lfemur")]
    along = place @ (bone / np.linalg.norm(bone))
    assert (along.min(), along.max()) == pytest.approx((-0.03, np.linalg.norm(bone) + 0.03), abs=1e-6)
    assert np.linalg.norm(np.cross(place, bone / np.linalg.norm(bone)), axis=1).max() == pytest.approx(0.03, abs=1e-6)


def test_a_mesh_of_too_many_vertices_is_refused() -> None:
    many = np.zeros((MAX_VERTICES + 1, 3))
    with pytest.raises(ValueError, match="65536 vertices in big"):
        GltfBuilder().add_mesh("big", many, many, np.zeros((1, 3), dtype=int), 0)


VTK = """
import sys
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImport import vtkGLTFImporter
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLRenderer
from vtkmodules.vtkRenderingCore import vtkRenderWindow
importer, window = vtkGLTFImporter(), vtkRenderWindow()
window.SetOffScreenRendering(True)
importer.SetFileName(sys.argv[1])
importer.SetRenderWindow(window)
importer.Update()
importer.EnableAnimation(0)
for time_s in sys.argv[2:]:
    importer.UpdateAtTimeValue(float(time_s))
    points = []
    for actor in importer.GetRenderer().GetActors():
        pose = np.array([[actor.GetMatrix().GetElement(r, c) for c in range(4)] for r in range(4)])
        local = vtk_to_numpy(actor.GetMapper().GetInput().GetPoints().GetData())
        points.append(local @ pose[:3, :3].T + pose[:3, 3])
    points = np.concatenate(points)
    print(len(points), *points.mean(axis=0), *points.min(axis=0), *points.max(axis=0))
"""


def test_vtk_places_every_vertex_as_we_do(cell: Written, tmp_path: Path) -> None:
    """Number, mean and bounds of all vertices at two times of the animation."""
    pytest.importorskip("vtkmodules", reason="VTK is not installed (extra `viz`)")
    (file,) = export_motion([cell], "glb", tmp_path, model=dressed)
    glb, times = read_glb(file), (0.0, 21 / RATE_HZ)
    command = [sys.executable, "-c", VTK, str(file), *map(str, times)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.strip().splitlines()[-len(times) :]
    for line, time_s in zip(lines, times, strict=True):
        points = glb.vertices(time_s)
        expected = [len(points), *points.mean(axis=0), *points.min(axis=0), *points.max(axis=0)]
        np.testing.assert_allclose(np.array(line.split(), dtype=float), expected, atol=1e-4)
