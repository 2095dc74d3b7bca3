"""The verdict in words, for calibrations whose figures are known."""

from dataclasses import replace

import numpy as np
import pytest

from harness.calibrate.calibration_report import pose_verdict, poses_to_repeat, report_pose_calibration, tpose_verdict
from harness.calibrate.pose_calibration import PoseCalibration, calibrate_poses
from harness.calibrate.poses import POSES
from harness.calibrate.tpose_calibration import TPoseCalibration
from tests.calibrate.standing_model import SIX, Model, somebody, space


@pytest.fixture(scope="module")
def found() -> PoseCalibration:
    model = Model(somebody(0), miss_rad=np.deg2rad(1.0))
    return calibrate_poses(model.held(), space(), model.mounts)


def with_figures(found: PoseCalibration, mount_mm: float, mount_deg: float, pose_deg: list[float]) -> PoseCalibration:
    """The calibration with the worst mount at the head, and errors of the poses; distances of 2 cm, once of 7 cm."""
    ones = np.ones(6)
    distance_m = np.full((8, 6), 0.02)
    distance_m[2, 1] = 0.07
    return replace(
        found,
        mount_sd_m=1e-3 * np.array([*ones[:5], mount_mm]),
        mount_sd_rad=np.deg2rad([*(0.1 * ones[:5]), mount_deg]),
        pose_error_rad=np.deg2rad(pose_deg),
        pose_distance_m=distance_m,
    )


@pytest.mark.parametrize(
    ("mount_mm", "mount_deg", "pose_deg", "verdict"),
    [
        (4.0, 0.8, [1.0] * 8, "good: every station's mount is known to 4 mm and 0.8 deg (standard deviation)"),
        (
            4.0,
            0.8,
            [1.0, 1.0, 3.4, 1.0, 1.0, 1.0, 1.0, 1.0],
            "good: every station's mount is known to 4 mm and 0.8 deg (standard deviation); "
            f"pose 3 (arms down) was missed: {SIX[1]} was 7 cm from its place, hinges 3.4 deg off",
        ),
        (
            22.0,
            2.0,
            [2.0] * 8,
            "usable: every station's mount is known to 22 mm and 2.0 deg (standard deviation); "
            "hold the poses more exactly",
        ),
        (
            5.0,
            7.0,
            [4.0] * 8,
            "poor: every station's mount is known to 5 mm and 7.0 deg (standard deviation); "
            "hold the poses more exactly",
        ),
    ],
)
def test_the_verdict(
    found: PoseCalibration, mount_mm: float, mount_deg: float, pose_deg: list[float], verdict: str
) -> None:
    assert pose_verdict(with_figures(found, mount_mm, mount_deg, pose_deg)) == verdict


def test_small_misses_are_not_repeated(found: PoseCalibration) -> None:
    assert poses_to_repeat(with_figures(found, 4.0, 0.8, [0.5, 2.9, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5])) == []
    assert poses_to_repeat(with_figures(found, 4.0, 0.8, [3.0, 4.6, 3.0, 5.0, 3.0, 3.0, 3.0, 3.0])) == [3, 1]


def test_poses_keep_their_names_where_others_are_left_out() -> None:
    model = Model(somebody(0), miss_rad=np.deg2rad(1.0))
    held = [rows if number not in (2, 4) else [] for number, rows in enumerate(model.held())]
    some = calibrate_poses(held, space(), model.mounts)
    diagnostics, lines = report_pose_calibration(some)
    assert list(diagnostics["miss_deg_of_pose"]) == [pose.name for n, pose in enumerate(POSES) if n not in (2, 4)]
    assert any("6 poses held for" in line for line in lines)
    missed = replace(some, pose_error_rad=np.deg2rad([1.0, 1.0, 1.0, 1.0, 3.4, 1.0]))
    assert "pose 7 (squat) was missed" in pose_verdict(missed)


def test_distances_are_those_of_the_missed_pose() -> None:
    """Of a performer who holds the poses exactly each station is in its place."""
    model = Model(somebody(0, own_directions=False))
    found = calibrate_poses(model.held(), space(), model.mounts)
    assert found.pose_distance_m.shape == (8, 6)
    assert found.pose_distance_m.max() < 0.005
    missed = Model(somebody(0), miss_rad=np.deg2rad(4.0))
    assert calibrate_poses(missed.held(), space(), missed.mounts).pose_distance_m.max() > 0.03


@pytest.mark.parametrize(("far_m", "word"), [(0.05, "good"), (0.15, "usable"), (0.25, "poor")])
def test_the_verdict_on_a_tpose(found: PoseCalibration, far_m: float, word: str) -> None:
    result = TPoseCalibration(
        found.calibration, np.array([0.01, far_m, *[0.01] * 4]), np.zeros(6), 3.0, np.deg2rad(4.5)
    )
    verdict = tpose_verdict(result)
    assert verdict.startswith(f"{word} T-pose: {SIX[1]} is {1e2 * far_m:.0f} cm from its place")
    assert "heading is known to 4.5 deg" in verdict
    assert ("hold the T-pose again" in verdict) == (word != "good")
