"""Inverse kinematics on known motion."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.body import retarget_to_common_body, retarget_to_own_body
from harness.core.estimate import Status
from harness.errors import BadInput
from harness.mocap import MotionLibrary
from harness.reconstruct.methods.clean_up import CleanUp
from harness.reconstruct.methods.ik import GAUSSIAN, MEAN, PREVIOUS, Ik
from harness.reconstruct.methods.mean_pose import MeanPose
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.residuals import Loss
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations, exact_calibration, exact_frames
from tests.reconstruct.conftest import Scene, moved

LEFT_WRIST, TORSO = 0, 4


def shifted(frame: TrackerFrame, station: int, by_m: float) -> TrackerFrame:
    position_m = np.array(frame.position_m)
    position_m[station, 1] += by_m
    return replace(frame, position_m=position_m)


@pytest.mark.parametrize("method", [Ik(), GAUSSIAN, PREVIOUS, MEAN])
@pytest.mark.parametrize("motion", ["walk", "boxing"])
def test_six_clean_trackers_are_met_from_the_first_frame(
    motion: str, method: Ik, request: pytest.FixtureRequest
) -> None:
    scene: Scene = request.getfixturevalue(motion)
    estimates = scene.run(method)
    position_m, orientation_rad = scene.residuals(estimates, scene.frames)
    assert np.max(position_m) < (1e-3 if motion == "walk" else 2e-3)
    assert np.max(orientation_rad) < np.deg2rad(0.5)
    assert np.max(scene.off_m(estimates, scene.take.qpos)) < 0.03
    assert np.max(HingeLimits(scene.body).excess_rad(np.array([e.qpos[7:] for e in estimates]))) < 1e-9


def test_examples_help_where_trackers_are_silent(walk: Scene) -> None:
    """The prior about the mean posture beats that about the last estimate; scaled by spread it beats both."""
    previous, mean, both = (np.mean(walk.off_m(walk.run(m), walk.take.qpos)) for m in (PREVIOUS, MEAN, Ik()))
    assert both < mean < previous


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, 180.0])
def test_starts_anywhere_and_facing_anywhere(boxing: Scene, yaw_deg: float) -> None:
    qpos = moved(boxing.take.qpos[:10], np.deg2rad(yaw_deg), (1.0, -1.0, 0.0))
    estimates = boxing.run(Ik(), exact_frames(boxing.body, boxing.calibration, qpos))
    assert np.max(boxing.off_m(estimates, qpos)) < 0.02


@pytest.mark.parametrize("method", [Ik(), GAUSSIAN])
@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, 180.0])
def test_finds_a_performer_who_was_moved(walk: Scene, method: Ik, yaw_deg: float) -> None:
    qpos = np.concatenate([walk.take.qpos[:40], moved(walk.take.qpos[40:80], np.deg2rad(yaw_deg), (1.0, 0.0, 0.0))])
    off_m = walk.off_m(walk.run(method, exact_frames(walk.body, walk.calibration, qpos)), qpos)
    assert np.max(off_m[:40]) < 0.02
    assert np.max(off_m[55:]) < 0.03  # within 0.4 s
    assert off_m[-1] < 0.02


@pytest.mark.parametrize("station", range(6))
def test_one_outlier_of_30_cm_moves_the_pose_little(walk: Scene, station: int) -> None:
    hit = [shifted(f, station, 0.3) if i == 60 else f for i, f in enumerate(walk.frames)]
    for method, least_m, most_m in ((Ik(), 0.0, 0.01), (GAUSSIAN, 0.03, 0.3)):
        plain = np.array([e.qpos for e in walk.run(method)])
        off_m = walk.off_m(walk.run(method, hit), plain)
        assert least_m <= off_m[60] < most_m
        assert np.max(off_m[:60]) == 0.0


def test_a_burst_is_bridged(walk: Scene) -> None:
    burst = [shifted(f, LEFT_WRIST, 0.3) if 40 <= i < 48 else f for i, f in enumerate(walk.frames)]
    off_m = walk.off_m(walk.run(Ik(), burst), walk.take.qpos)
    assert np.max(off_m) < 0.05
    assert np.max(off_m[52:]) < 0.03


@pytest.mark.parametrize("silent", [[LEFT_WRIST], [TORSO], [2, 3], [0, 1, 5]])
def test_lost_stations_are_left_out_and_taken_up_again(walk: Scene, silent: list[int]) -> None:
    frames = [drop_stations(f, silent) if 40 <= i < 80 else f for i, f in enumerate(walk.frames)]
    estimates = walk.run(Ik(), frames)
    off_m = walk.off_m(estimates, walk.take.qpos)
    assert {e.status for e in estimates} == {Status.SOLVED}
    assert np.max(off_m[40:80]) < 0.2
    assert np.max(off_m[90:]) < 0.03


def test_status_follows_what_reports_or_is_surely_predicted(walk: Scene) -> None:
    two_left, nothing = [0, 1, 2, 3], range(6)
    frames = [
        drop_stations(f, two_left) if 20 <= i < 60 else drop_stations(f, nothing) if 60 <= i < 90 else f
        for i, f in enumerate(walk.frames)
    ]
    estimates = walk.run(Ik(), frames)
    status = [e.status for e in estimates]
    sure = status.index(Status.HELD)  # until then a third station is predicted within 0.15 m
    assert 25 <= sure <= 40
    assert set(status[:sure]) == {Status.SOLVED}
    assert set(status[sure : sure + 20]) == {Status.HELD}  # up to 0.5 s after the last solved frame
    assert set(status[sure + 20 : 90]) == {Status.LOST}
    assert set(status[90:]) == {Status.SOLVED}
    np.testing.assert_array_equal(estimates[60].qpos, estimates[89].qpos)
    assert not np.array_equal(estimates[30].qpos, estimates[50].qpos)  # two stations still lead the pose
    assert np.max(walk.off_m(estimates, walk.take.qpos)[90:]) < 0.03


def test_before_anything_reports_the_t_pose_is_held(walk: Scene) -> None:
    frames = [drop_stations(f, range(6)) if i < 30 else f for i, f in enumerate(walk.frames[:40])]
    estimates = walk.run(Ik(), frames)
    assert [estimates[i].status for i in (0, 20, 29, 30)] == [Status.HELD, Status.HELD, Status.LOST, Status.SOLVED]
    assert np.max(walk.off_m(estimates, walk.take.qpos[:40])[30:]) < 0.02


def test_one_tracker_is_a_legal_run(walk: Scene) -> None:
    calibration = exact_calibration(walk.body, ["pelvis"])
    frames = exact_frames(walk.body, calibration, walk.take.qpos)
    session = PREVIOUS.fit(walk.body, [], np.random.default_rng(0)).begin(calibration)
    estimates = [session.step(frame) for frame in frames]
    assert {e.status for e in estimates} == {Status.SOLVED}
    root_m = np.array([e.qpos[:3] for e in estimates])
    assert np.max(np.abs(root_m - walk.take.qpos[:, :3])) < 0.01


@pytest.mark.parametrize("kind", ["pos", "ori"])
def test_either_kind_of_reading_is_met_alone(walk: Scene, kind: str) -> None:
    frames = walk.only(kind)
    estimates = walk.run(Ik(), frames)
    position_m, orientation_rad = walk.residuals(estimates, frames)
    assert np.max(position_m) < 1e-3
    assert np.max(orientation_rad) < np.deg2rad(0.5)


def test_passes_the_pole_of_a_shoulder(walk: Scene) -> None:
    """The middle angle of three goes from 60 to 120 deg and back: within limits only in the equivalent form."""
    names = [walk.body.model.joint(1 + d).name for d in range(48)]
    qpos = np.tile(walk.take.qpos[0], (81, 1))
    qpos[:, 7 + names.index("rhumerus.ry")] = np.deg2rad(90.0 - 30.0 * np.cos(np.linspace(0.0, 2.0 * np.pi, 81)))
    qpos[:, 7 + names.index("rhumerus.rx")] = 0.3
    qpos[:, 7 + names.index("rhumerus.rz")] = 0.2
    frames = exact_frames(walk.body, walk.calibration, qpos)
    estimates = walk.run(Ik(), frames)
    position_m, orientation_rad = walk.residuals(estimates, frames)
    assert np.max(position_m) < 5e-3
    assert np.max(orientation_rad) < np.deg2rad(2.0)


def test_clean_up_meets_the_trackers_and_keeps_the_pose_near(walk: Scene) -> None:
    plain, cleaned = (walk.run(m) for m in (MeanPose(), CleanUp(MeanPose())))
    before_m, _ = walk.residuals(plain, walk.frames)
    after_m, _ = walk.residuals(cleaned, walk.frames)
    assert np.max(after_m) < 2.0 * Loss().position_sigma_m < 0.02 < np.max(before_m)
    assert np.mean(walk.off_m(cleaned, walk.take.qpos)) < 0.5 * np.mean(walk.off_m(plain, walk.take.qpos))
    assert CleanUp(MeanPose()).name == "mean_pose+ik"
    assert CleanUp(MeanPose()).needs_examples


def test_a_mean_needs_examples(walk: Scene) -> None:
    with pytest.raises(BadInput, match="examples"):
        Ik().fit(walk.body, [], np.random.default_rng(0))


@pytest.mark.parametrize("clip", ["13_17", "16_15", "02_04", "49_02"])
def test_real_motion_is_followed_throughout(mocap: Path, clip: str) -> None:
    library = MotionLibrary(mocap, rate_hz=120.0)
    body, take = retarget_to_own_body(library.load(clip))
    other, _ = retarget_to_common_body(library.load("16_27"), body.skeleton)
    calibration = exact_calibration(body)
    scene = Scene(body, calibration, take, exact_frames(body, calibration, take.qpos[:900:3]), [other])
    estimates = scene.run(Ik())
    position_m, _ = scene.residuals(estimates, scene.frames)
    assert np.mean(position_m) < 5e-4
    assert np.max(position_m) < 0.01
    assert np.max(scene.off_m(estimates, take.qpos[:900:3])) < 0.06
