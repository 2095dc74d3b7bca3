"""OpenSim itself opens the exported files, and OpenSense finds the joint angles again."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack, unpack
from harness.mocap import synthetic
from harness.mocap.write.export import export_motion
from harness.mocap.write.opensim import ROOT_COLUMNS
from harness.score import compute_poses
from tests.mocap.write.test_export import BELIEVED, NAMES, SKELETON, Written, in_opensim, joints_m

RATE_HZ = 40.0


@pytest.fixture
def opensim(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """OpenSim writes a log into the working folder, and its wrappers warn on Python 3.12 and later."""
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        module = pytest.importorskip("opensim", reason="OpenSim is not installed (extra dev)")
    module.Logger.setLevelString("Error")
    return module


@pytest.fixture
def cell() -> Written:
    """One second of walking, and an estimate that is a little off."""
    motion = synthetic.generate("walking", "p2", 1, seed=7, duration_s=1.0, rate_hz=RATE_HZ)
    estimate = pack(motion.root_m + 0.02, motion.world_from_root, motion.angles_rad + 0.05)
    truth = pack(motion.root_m, motion.world_from_root, motion.angles_rad)
    frames = len(motion)
    status = np.zeros(frames, dtype=np.int64)
    return Written(truth, estimate, frame_index=np.arange(frames), status=status, errors={})


def table_of(opensim: Any, table: Any) -> Floats:
    """(F, C) numbers of a table."""
    return np.array([table.getRowAtIndex(row).to_numpy() for row in range(table.getNumRows())])


def test_opensim_reads_mot(opensim: Any, cell: Written, tmp_path: Path) -> None:
    _, estimate = export_motion([cell], "mot", tmp_path)
    storage, table = opensim.Storage(str(estimate)), opensim.TimeSeriesTable(str(estimate))
    assert (storage.isInDegrees(), storage.getSize()) == (True, len(cell.frame_index))
    assert table.getTableMetaDataString("inDegrees") == "yes"
    assert table.getColumnLabels()[:6] == ROOT_COLUMNS
    np.testing.assert_allclose(table.getIndependentColumn(), cell.time_s, atol=1e-6)
    root_m, _, angles_rad = unpack(cell.estimate_qpos)
    values = table_of(opensim, table)
    np.testing.assert_allclose(values[:, 3:6], in_opensim(root_m), atol=1e-6)
    np.testing.assert_allclose(values[:, 6:], np.rad2deg(angles_rad), atol=1e-6)


def test_opensim_reads_trc(opensim: Any, cell: Written, tmp_path: Path) -> None:
    _, estimate = export_motion([cell], "trc", tmp_path)
    table = opensim.TimeSeriesTableVec3(str(estimate))
    assert table.getColumnLabels() == NAMES
    assert (table.getTableMetaDataString("Units"), table.getNumRows()) == ("mm", len(cell.frame_index))
    found = table_of(opensim, table.flatten()).reshape(len(cell.frame_index), -1, 3)
    np.testing.assert_allclose(found, 1e3 * in_opensim(joints_m(cell.estimate_qpos, BELIEVED)), atol=1e-3)


def test_opensim_reads_sto(opensim: Any, cell: Written, tmp_path: Path) -> None:
    truth, _ = export_motion([cell], "sto", tmp_path)
    table = opensim.TimeSeriesTableQuaternion(str(truth))
    assert table.getColumnLabels()[:2] == ("pelvis_imu", "torso_imu")
    np.testing.assert_allclose(table.getIndependentColumn(), cell.time_s, atol=1e-6)
    pelvis = table_of(opensim, table.flatten())[:, :4]
    forward, left, up = (in_opensim(rotations.to_matrix(cell.truth_qpos[:, 3:7])[..., k]) for k in range(3))
    np.testing.assert_allclose(rotations.to_matrix(pelvis), np.stack([forward, up, -left], axis=-1), atol=1e-8)


def test_opensense_finds_the_hip_and_knee_again(opensim: Any, cell: Written, tmp_path: Path) -> None:
    """A model of pelvis, thigh and shank with free joints, calibrated with the first frame; to OpenSense's accuracy."""
    truth, _ = export_motion([cell], "sto", tmp_path)
    model = opensim.Model()
    bodies = {
        name: opensim.Body(name, 1.0, opensim.Vec3(0), opensim.Inertia(1, 1, 1))
        for name in ("pelvis", "femur_r", "tibia_r")
    }
    for body in bodies.values():
        model.addBody(body)
    model.addJoint(opensim.FreeJoint("free", model.getGround(), bodies["pelvis"]))
    model.addJoint(opensim.BallJoint("hip", bodies["pelvis"], bodies["femur_r"]))
    model.addJoint(opensim.BallJoint("knee", bodies["femur_r"], bodies["tibia_r"]))
    model.finalizeConnections()
    model.printToXML("model.osim")
    placer = opensim.IMUPlacer()
    placer.set_model_file("model.osim")
    placer.set_orientation_file_for_calibration(str(truth))
    placer.set_output_model_file("calibrated.osim")
    assert placer.run(False)
    tool = opensim.IMUInverseKinematicsTool()
    tool.set_model_file("calibrated.osim")
    tool.set_orientations_file(str(truth))
    tool.set_results_directory("imu")
    tool.set_output_motion_file("found.mot")
    tool.set_report_errors(False)
    for end, time_s in enumerate(cell.time_s[[0, -1]]):
        tool.set_time_range(end, time_s)
    assert tool.run(False)
    table = opensim.TimeSeriesTable("imu/found.mot")
    labels, values = table.getColumnLabels(), table_of(opensim, table)
    assert table.getTableMetaDataString("inDegrees") == "yes"
    hip, knee = (
        Rotation.from_euler("XYZ", values[:, [labels.index(f"{joint}_coord_{k}") for k in range(3)]], degrees=True)
        for joint in ("hip", "knee")
    )
    pelvis, femur, tibia = (since_first_frame(cell, bone) for bone in ("root", "rfemur", "rtibia"))
    assert np.rad2deg(knee.magnitude()).max() > 30.0
    assert np.rad2deg((hip.inv() * pelvis.inv() * femur).magnitude()).max() < 0.3
    assert np.rad2deg((knee.inv() * femur.inv() * tibia).magnitude()).max() < 0.3


def since_first_frame(cell: Written, bone: str) -> Rotation:
    """Rotation of a bone, or of the root, from its first frame on, in OpenSim's ground."""
    if bone == "root":
        turn = rotations.to_matrix(cell.truth_qpos[:, 3:7])
    else:
        turn = compute_poses(SKELETON, cell.truth_qpos).world_from_bone[:, SKELETON.index(bone)]
    ground_from_world = in_opensim(np.eye(3)).T
    return Rotation.from_matrix(ground_from_world @ turn @ turn[0].T @ ground_from_world.T)
