"""Exported files: other programs and this package read the same motion from them."""

import csv
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.humanoid24 import pack, standard_skeleton, unpack
from harness.core.skeleton import Skeleton, forward_kinematics, unwrap_angles
from harness.errors import BadInput, UnknownName
from harness.mocap import synthetic
from harness.mocap.clip_file import read_clip
from harness.mocap.read.bvh import read_bvh
from harness.mocap.write.bvh import euler_zyx_deg
from harness.mocap.write.export import EXPORT_FORMATS, export_motion
from harness.mocap.write.opensim import ROOT_COLUMNS, euler_zxy_rad
from harness.mocap.write.tables import POINTS
from harness.score import Pair, compute_poses, root_position_mm
from harness.testing.doctor import find_evo, run_evo_ape_m
from tests.core.leftovers import leave_behind

FRAMES, RATE_HZ = 50, 40.0
SKELETON = standard_skeleton().with_bones(standard_skeleton().bone_m * 1.1)
BELIEVED = standard_skeleton().with_bones(standard_skeleton().bone_m * 0.9)
"""Skeleton of the estimate, as after an inaccurate calibration."""
NAMES = ("root", *SKELETON.names)


@dataclass(frozen=True)
class Written:
    """The fields of a cell that an export needs."""

    truth_qpos: Floats
    estimate_qpos: Floats
    key: str = "0123456789abcdef"
    method: str = "ik"
    clip: str = "walking/01_02@0.20-0.40"
    inputs: str = "pos+ori"
    rate_hz: float = RATE_HZ
    bone_m: Floats = field(default_factory=lambda: SKELETON.bone_m)
    estimate_bone_m: Floats = field(default_factory=lambda: BELIEVED.bone_m)
    frame_index: Ints = field(default_factory=lambda: np.arange(FRAMES))
    status: Ints = field(default_factory=lambda: np.zeros(FRAMES, dtype=np.int64))
    angle_sigma_rad: Floats | None = None
    errors: Mapping[str, Floats] = field(default_factory=lambda: {"mpjpe_mm": np.full(FRAMES, 12.5)})

    @property
    def time_s(self) -> Floats:
        return 3.0 + self.frame_index / RATE_HZ


def arbitrary_motion(rng: np.random.Generator) -> Floats:
    """Configurations (F, 55), including upside-down poses and gimbal lock."""
    turns = np.cumsum(0.3 * rng.normal(size=(FRAMES, 3)), axis=0)
    return pack(rng.normal(size=(FRAMES, 3)), rotations.exp(turns), rng.uniform(-2.0, 2.0, (FRAMES, 48)))


@pytest.fixture
def cell(rng: np.random.Generator) -> Written:
    return Written(arbitrary_motion(rng), arbitrary_motion(rng))


def joints_m(qpos: Floats, skeleton: Skeleton) -> Floats:
    root_m, quaternion, angles_rad = unpack(qpos)
    pose = forward_kinematics(skeleton, root_m, quaternion, angles_rad)
    return np.concatenate([root_m[:, None], pose.end_m], axis=1)


def test_what_a_killed_export_left_is_removed_by_the_next(cell: Written, tmp_path: Path) -> None:
    stem = export_motion([cell], "glb", tmp_path)[0].stem
    left = leave_behind(tmp_path / f"{stem}.truth.bvh")
    assert left.is_file()
    files = export_motion([cell], "bvh", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {f"{stem}.glb", *(path.name for path in files)}


def test_pymotion_reads_the_same_joint_centres_from_bvh(cell: Written, tmp_path: Path) -> None:
    from pymotion.io.bvh import BVH
    from pymotion.ops.skeleton import fk

    motions = (cell.truth_qpos, SKELETON), (cell.estimate_qpos, BELIEVED)
    for file, motion in zip(export_motion([cell], "bvh", tmp_path), motions, strict=True):
        bvh = BVH()
        bvh.load(str(file))
        turned, position, parents, offsets, ends, end_parents = bvh.get_data()
        assert bvh.data["frame_time"] == pytest.approx(1 / RATE_HZ)
        assert list(bvh.data["names"]) == list(NAMES)
        place_cm, rotation = fk(turned, position[:, 0], offsets, parents)
        expected_cm = 100.0 * joints_m(*motion)[..., [1, 2, 0]]  # x left, y up, z forward
        np.testing.assert_allclose(place_cm[:, 0], expected_cm[:, 0], atol=1e-3)
        for bone, parent in enumerate(SKELETON.parents):
            np.testing.assert_allclose(place_cm[:, 1 + bone], expected_cm[:, 1 + parent], atol=1e-3)
        tips_cm = place_cm[:, end_parents] + np.einsum("tjab,jb->tja", rotation[:, end_parents], ends)
        np.testing.assert_allclose(tips_cm, expected_cm[:, end_parents], atol=1e-3)
        assert sorted(NAMES[p] for p in end_parents) == ["head", "lfoot", "lhand", "rfoot", "rhand"]


@pytest.mark.parametrize("behaviour", ["walking", "golf"])
def test_bvh_is_read_back_to_the_precision_of_its_numbers(
    behaviour: str, tmp_path: Path, rng: np.random.Generator
) -> None:
    """A clip of the motion generator, and an estimate of it on other bones; pymotion rounds angles to float32."""
    motion = synthetic.generate(behaviour, "p2", 1, seed=7, duration_s=1.0, rate_hz=RATE_HZ)
    truth = pack(motion.root_m, motion.world_from_root, motion.angles_rad)
    angles_rad = motion.angles_rad + 0.1 * rng.normal(size=motion.angles_rad.shape)
    turns = rotations.multiply(rotations.exp(0.1 * rng.normal(size=(len(motion), 3))), motion.world_from_root)
    cell = Written(
        truth,
        pack(motion.root_m + 0.01 * rng.normal(size=(len(motion), 3)), turns, angles_rad),
        bone_m=motion.skeleton.bone_m,
        frame_index=np.arange(len(motion)),
        status=np.zeros(len(motion), dtype=np.int64),
        errors={},
    )
    skeletons = motion.skeleton, BELIEVED
    for file, qpos, skeleton in zip(
        export_motion([cell], "bvh", tmp_path), (truth, cell.estimate_qpos), skeletons, strict=True
    ):
        back = read_clip(file)
        root_m, quaternion, angles_rad = unpack(qpos)
        assert (back.rate_hz, len(back)) == (RATE_HZ, len(motion))
        np.testing.assert_allclose(back.root_m, root_m, atol=1e-8)
        np.testing.assert_allclose(back.skeleton.bone_m, skeleton.bone_m, atol=1e-8)
        assert np.rad2deg(rotations.angle_between_rad(back.world_from_root, quaternion)).max() < 1e-4
        np.testing.assert_allclose(np.rad2deg(back.angles_rad - unwrap_angles(skeleton, angles_rad)), 0.0, atol=2e-4)
        joints = joints_m(pack(back.root_m, back.world_from_root, back.angles_rad), back.skeleton)
        np.testing.assert_allclose(joints, joints_m(qpos, skeleton), atol=1e-6)


def test_arbitrary_rotations_in_bvh_are_read_back(cell: Written, tmp_path: Path) -> None:
    for file, qpos in zip(export_motion([cell], "bvh", tmp_path), (cell.truth_qpos, cell.estimate_qpos), strict=True):
        back, clip = read_bvh(file), read_clip(file)
        assert back.rate_hz == RATE_HZ
        assert back.unit_evidence == "centimetres, as this package writes"
        np.testing.assert_allclose(back.root_m, qpos[:, :3], atol=1e-7)
        assert rotations.angle_between_rad(back.parent_from_joint[:, 0], qpos[:, 3:7]).max() < 1e-6
        joints = joints_m(pack(clip.root_m, clip.world_from_root, clip.angles_rad), clip.skeleton)
        skeleton = SKELETON if qpos is cell.truth_qpos else BELIEVED
        np.testing.assert_allclose(joints, joints_m(qpos, skeleton), atol=1e-4)


def test_euler_angles_rebuild_every_rotation(rng: np.random.Generator) -> None:
    quaternions = rotations.exp(rng.normal(size=(500, 3)) * 2.0)
    locked = rotations.multiply(
        rotations.about_z(rng.normal(size=50)), rotations.exp(np.tile([0.0, np.pi / 2, 0.0], (50, 1)))
    )
    matrices = rotations.to_matrix(np.concatenate([quaternions, locked, locked * [1, -1, -1, 1]]))
    z, y, x = np.deg2rad(euler_zyx_deg(matrices)).T
    axes = np.eye(3)
    back = [rotations.to_matrix(rotations.exp(a[:, None] * axes[i])) for a, i in ((z, 2), (y, 1), (x, 0))]
    np.testing.assert_allclose(back[0] @ back[1] @ back[2], matrices, atol=2e-7)


def test_trc_has_the_joint_centres_y_up(cell: Written, tmp_path: Path) -> None:
    files = export_motion([cell], "trc", tmp_path)
    assert [f.name.split(".", 2)[-1] for f in files] == ["40-ik-pos+ori.truth.trc", "40-ik-pos+ori.estimate.trc"]
    lines = files[1].read_text().split("\n")
    assert lines[2].split("\t") == ["40", "40", "50", "25", "mm", "40", "1", "50"]
    assert [name for name in lines[3].split("\t") if name] == ["Frame#", "Time", *NAMES]
    assert len(lines[4].split("\t")) == len(lines[6].split("\t")) == 2 + 3 * 25
    assert lines[4].split("\t")[2:5] == ["X1", "Y1", "Z1"]
    table = np.array([[float(x) for x in line.split("\t")] for line in lines[6:-1]])
    np.testing.assert_array_equal(table[:, 0], np.arange(1, FRAMES + 1))
    np.testing.assert_allclose(table[:, 1], cell.time_s, atol=1e-6)
    place = table[:, 2:].reshape(FRAMES, 25, 3)
    np.testing.assert_allclose(place, 1e3 * in_opensim(joints_m(cell.estimate_qpos, BELIEVED)), atol=1e-3)


def in_opensim(position: Floats) -> Floats:
    """Positions (..., 3) as x forward, y up, z right."""
    out: Floats = np.stack([position[..., 0], position[..., 2], -position[..., 1]], axis=-1)
    return out


def storage_table(file: Path) -> tuple[set[str], list[str], list[list[str]]]:
    """Lines of the header, names of the columns and words of the rows of a file for OpenSim."""
    head, _, body = file.read_text().partition("endheader\n")
    names, *rows = body.strip().split("\n")
    return set(head.split("\n")), names.split("\t"), [row.split("\t") for row in rows]


def test_mot_has_the_root_and_the_angles(cell: Written, tmp_path: Path) -> None:
    truth, estimate = export_motion([cell], "mot", tmp_path)
    assert (truth.suffix, estimate.suffix) == (".mot", ".mot")
    head, names, rows = storage_table(estimate)
    assert {"version=1", "nRows=50", "nColumns=55", "inDegrees=yes"} <= head
    assert names[:8] == ["time", *ROOT_COLUMNS, "lowerback_rx"]
    table = np.array(rows, dtype=float)
    root_m, quaternion, angles_rad = unpack(cell.estimate_qpos)
    np.testing.assert_allclose(table[:, 0], cell.time_s, atol=1e-6)
    np.testing.assert_allclose(table[:, 4:7], in_opensim(root_m), atol=1e-6)
    np.testing.assert_allclose(np.deg2rad(table[:, 7:]), angles_rad, atol=1e-7)
    assert np.abs(np.diff(table[:, [1, 3]], axis=0)).max() <= 180.0
    for row, q in zip(table, rotations.to_matrix(quaternion), strict=True):
        turn = Rotation.from_euler("ZXY", row[1:4], degrees=True).as_matrix()
        forward, left, up = (in_opensim(q[:, k]) for k in range(3))
        np.testing.assert_allclose(turn, np.stack([forward, up, -left], axis=1), atol=1e-7)


def test_zxy_angles_rebuild_rotations_at_gimbal_lock(rng: np.random.Generator) -> None:
    locked = Rotation.from_euler(
        "ZXY", [[z, x, y] for z, y in rng.normal(size=(50, 2)) for x in (np.pi / 2, -np.pi / 2)]
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        back = Rotation.from_euler("ZXY", euler_zxy_rad(locked.as_matrix()))
    np.testing.assert_allclose(back.as_matrix(), locked.as_matrix(), atol=1e-7)


def test_sto_has_orientations_of_segments_named_for_opensense(cell: Written, tmp_path: Path) -> None:
    truth, estimate = export_motion([cell], "sto", tmp_path)
    assert (truth.suffix, estimate.suffix) == (".sto", ".sto")
    head, names, rows = storage_table(truth)
    assert {"DataRate=40.000000", "DataType=Quaternion", "version=3", "OpenSimVersion=4.1"} <= head
    assert names[0] == "time"
    assert {"pelvis_imu", "torso_imu", "femur_r_imu", "calcn_l_imu", "radius_l_imu"} <= set(names)
    np.testing.assert_allclose([float(row[0]) for row in rows], cell.time_s, atol=1e-6)
    pose = compute_poses(SKELETON, cell.truth_qpos)
    for bone, column in (("rfemur", "femur_r_imu"), ("lwrist", "radius_l_imu"), ("thorax", "torso_imu")):
        found = np.array([[float(x) for x in row[names.index(column)].split(",")] for row in rows])
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-8)
        assert np.sum(found[1:] * found[:-1], axis=1).min() >= 0.0
        turn = pose.world_from_bone[:, SKELETON.index(bone)]
        forward, left, up = (in_opensim(turn[..., k]) for k in range(3))
        np.testing.assert_allclose(rotations.to_matrix(found), np.stack([forward, up, -left], axis=-1), atol=1e-7)


def test_csv_has_a_row_a_frame_with_units_in_its_columns(cell: Written, tmp_path: Path) -> None:
    errors = {"mpjpe_mm": np.where(np.arange(FRAMES) == 3, np.nan, 12.5)}
    truth, estimate = export_motion([replace(cell, errors=errors)], "csv", tmp_path)
    with estimate.open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == FRAMES
    assert float(rows[7]["lhand_z_m"]) == pytest.approx(
        joints_m(cell.estimate_qpos, BELIEVED)[7, NAMES.index("lhand"), 2]
    )
    dof = SKELETON.dof_names.index("lradius.rx")
    assert float(rows[7]["lradius.rx_deg"]) == pytest.approx(np.rad2deg(unpack(cell.estimate_qpos)[2][7, dof]))
    assert (rows[7]["frame"], rows[7]["status"], rows[7]["mpjpe_mm"], rows[3]["mpjpe_mm"]) == ("7", "0", "12.5", "")
    assert "mpjpe_mm" not in truth.read_text().split("\n")[0]


def test_csv_has_the_standard_deviations_of_a_method_that_states_them(cell: Written, tmp_path: Path) -> None:
    sigma_rad = np.deg2rad(1.0 + np.arange(48.0)) * np.ones((FRAMES, 1))
    marked = pack(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.arange(48.0))
    _, estimate = export_motion([replace(cell, angle_sigma_rad=sigma_rad)], "csv", tmp_path)
    with estimate.open() as file:
        row = next(csv.DictReader(file))
    for dof, name in enumerate(SKELETON.dof_names):
        (place,) = np.flatnonzero(marked[7:] == dof)
        assert float(row[f"{name}_sigma_deg"]) == pytest.approx(1.0 + place)


def test_tum_has_a_trajectory_a_point(cell: Written, tmp_path: Path) -> None:
    files = export_motion([cell], "tum", tmp_path)
    assert [f.name.split(".", 3)[-1] for f in files if "truth" in f.name] == [f"truth.{p}.tum" for p in POINTS]
    for point in ("root", "rfoot"):
        table = np.loadtxt(next(f for f in files if f.name.endswith(f"estimate.{point}.tum")))
        np.testing.assert_allclose(table[:, 0], cell.time_s)
        np.testing.assert_allclose(
            table[:, 1:4], joints_m(cell.estimate_qpos, BELIEVED)[:, NAMES.index(point)], atol=1e-8
        )
        pose = compute_poses(SKELETON, cell.estimate_qpos)
        bone = rotations.from_matrix(pose.world_from_bone[:, SKELETON.index("rfoot")])
        expected = cell.estimate_qpos[:, 3:7] if point == "root" else bone
        assert rotations.angle_between_rad(table[:, [7, 4, 5, 6]], expected).max() < 1e-7


def test_evo_finds_our_root_position_error(cell: Written, tmp_path: Path) -> None:
    program = find_evo()
    if program is None:
        pytest.skip("evo is not installed (extra dev)")
    files = export_motion([cell], "tum", tmp_path)
    truth, estimate = (next(f for f in files if f.name.endswith(f"{kind}.root.tum")) for kind in ("truth", "estimate"))
    pair = Pair(
        compute_poses(SKELETON, cell.truth_qpos), compute_poses(SKELETON, cell.estimate_qpos), cell.frame_index, RATE_HZ
    )
    ours_m = 1e-3 * root_position_mm(pair).mean()
    assert ours_m > 0.1
    assert run_evo_ape_m(program, truth, estimate) == pytest.approx(ours_m, abs=6e-7)  # evo prints six digits


def test_gaps_and_broken_estimates(cell: Written, tmp_path: Path) -> None:
    """BVH has no times, so it repeats the frame before a gap; the other formats leave the gap out."""
    estimate = cell.estimate_qpos.copy()
    estimate[10] = np.nan
    gappy = replace(cell, estimate_qpos=estimate, frame_index=np.r_[np.arange(20), np.arange(23, 23 + 30)])
    truth, _ = export_motion([gappy], "bvh", tmp_path)
    text = truth.read_text().split("\n")
    assert "Frames: 53" in text
    rows = text[text.index("Frames: 53") + 2 :]
    assert rows[9] == rows[10] != rows[11]
    assert rows[19] == rows[20] == rows[22] != rows[23]
    tum = export_motion([gappy], "tum", tmp_path)[0]
    assert len(tum.read_text().split("\n")) - 1 == FRAMES - 1


@pytest.mark.parametrize("fmt", EXPORT_FORMATS)
def test_a_file_is_written_over_only_when_told(cell: Written, tmp_path: Path, fmt: str) -> None:
    folder = tmp_path / "deep" / "out"
    files = export_motion([cell], fmt, folder)
    assert sorted(folder.iterdir()) == sorted(files)
    files[-1].write_bytes(b"edited by hand")
    with pytest.raises(BadInput, match="--force"):
        export_motion([cell], fmt, folder)
    assert files[-1].read_bytes() == b"edited by hand"
    assert export_motion([cell], fmt, folder, force=True) == files
    assert files[-1].read_bytes() != b"edited by hand"


def test_names_of_files_are_safe_and_unlike(cell: Written, tmp_path: Path) -> None:
    files = export_motion([cell, replace(cell, key="fedcba9876543210")], "csv", tmp_path)
    assert len(set(files)) == 4
    assert all(file.parent == tmp_path for file in files)
    assert files[0].name == "walking_01_02@0.20-0.40-ik-pos+ori.truth.csv"


def test_what_cannot_be_exported_is_refused(cell: Written, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="bvh"):
        export_motion([cell], "fbx", tmp_path)
    with pytest.raises(BadInput, match="No cell"):
        export_motion([], "csv", tmp_path)
    with pytest.raises(BadInput, match="No cell"):
        export_motion([replace(cell, estimate_qpos=cell.estimate_qpos * np.nan)], "bvh", tmp_path)


def test_files_are_written_together_or_not_at_all(cell: Written, tmp_path: Path) -> None:
    there = replace(cell, clip="there", key="1" * 16)
    export_motion([there], "csv", tmp_path)
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    with pytest.raises(BadInput, match="exists"):
        export_motion([cell, there], "csv", tmp_path)
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before
    assert len(export_motion([cell, there], "csv", tmp_path, force=True)) == 4
