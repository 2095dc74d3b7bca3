"""The baselines: mean pose and best match."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.humanoid24 import unpack
from harness.core.motion import BodyMotion
from harness.reconstruct.features.posture_statistics import mean_posture
from harness.reconstruct.methods.best_match import BestMatch
from harness.reconstruct.methods.mean_pose import MeanPose
from harness.testing.frames import drop_stations, exact_frames
from tests.reconstruct.conftest import Scene, moved


def test_the_mean_pose_never_changes_but_follows(walk: Scene) -> None:
    qpos = np.array([e.qpos for e in walk.run(MeanPose())])
    mean = mean_posture(walk.body, walk.examples)
    np.testing.assert_allclose(qpos[:, 7:], np.tile(mean[7:], (len(qpos), 1)), atol=1e-12)
    np.testing.assert_allclose(
        np.diff(qpos[[0, -1], :2], axis=0), np.diff(walk.take.qpos[[0, -1], :2], axis=0), atol=0.1
    )
    assert np.max(rotations.angle_between_rad(qpos[:, 3:7], walk.take.qpos[:, 3:7])) < np.deg2rad(30.0)


def test_the_mean_is_that_of_the_angles(walk: Scene) -> None:
    _, _, mean = unpack(mean_posture(walk.body, [walk.take]))
    _, _, angles = unpack(walk.take.qpos)
    assert np.max(np.abs(mean - angles.mean(axis=0))) < np.deg2rad(3.0)


@pytest.mark.parametrize("yaw_deg", [0.0, 120.0])
def test_finds_the_very_example_wherever_it_is_performed(walk: Scene, yaw_deg: float) -> None:
    qpos = moved(walk.take.qpos, np.deg2rad(yaw_deg), (3.0, -2.0, 0.0))
    estimates = walk.run(BestMatch(), exact_frames(walk.body, walk.calibration, qpos), [walk.take])
    assert np.max(walk.off_m(estimates, qpos)[2:]) < 1e-3


def test_finds_it_with_half_of_the_stations_lost(walk: Scene) -> None:
    frames = [drop_stations(f, [0, 2, 5]) for f in walk.frames]
    assert np.max(walk.off_m(walk.run(BestMatch(), frames, [walk.take]), walk.take.qpos)[2:]) < 1e-3


@pytest.mark.parametrize("kind", ["pos", "ori"])
def test_finds_it_from_one_kind_of_reading(walk: Scene, kind: str) -> None:
    frames = walk.only(kind)
    found = np.array([e.qpos for e in walk.run(BestMatch(), frames, [walk.take])])
    assert np.max(np.abs(found[2:, 7:] - walk.take.qpos[2:, 7:])) < 1e-6


def test_takes_the_nearer_of_two_examples(walk: Scene, boxing: Scene) -> None:
    other = BodyMotion("b", "b", "b", "boxing", 40.0, boxing.take.qpos)
    session = BestMatch().fit(walk.body, [other, walk.take], np.random.default_rng(0)).begin(walk.calibration)
    found = np.array([session.step(f).qpos[7:] for f in walk.frames])
    assert np.max(np.abs(found[2:] - walk.take.qpos[2:, 7:])) < 1e-6


def test_the_best_match_heeds_a_station_the_less_the_poorer_its_quality(boxing: Scene) -> None:
    """A hand 40 cm off leads to other examples; at a hundredth of the quality to the right ones again."""
    shift = np.zeros((6, 3))
    shift[0] = [0.25, 0.25, 0.25]
    said = np.ones(6)
    said[0] = 0.01
    wrong = [replace(frame, position_m=frame.position_m + shift) for frame in boxing.frames[:1]]
    doubted = [replace(frame, quality=said) for frame in wrong]
    off_m = [
        boxing.off_m(boxing.run(BestMatch(), frames, [boxing.take]), boxing.take.qpos[:1])[0]
        for frames in (wrong, doubted)
    ]
    assert off_m[1] < 2e-3 < 0.02 < off_m[0]
