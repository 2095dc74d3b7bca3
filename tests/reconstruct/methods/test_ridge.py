"""Ridge regression: a linear map, invariant to the performer's place, with maps of its own for each set of readings."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.reconstruct.methods.mean_pose import MeanPose
from harness.reconstruct.methods.ridge import Ridge, ridge_regression
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations, exact_frames
from tests.reconstruct.conftest import Scene, moved


def hinge_error_deg(scene: Scene, method: Ridge | MeanPose, frames: list[TrackerFrame]) -> float:
    """Mean absolute hinge error [deg]."""
    qpos = np.array([estimate.qpos for estimate in scene.run(method, frames)])
    return float(np.rad2deg(np.abs(rotations.wrap_angle(qpos - scene.take.qpos)[:, 7:])).mean())


def test_a_planted_map_comes_back_and_noise_shrinks_it() -> None:
    rng = np.random.default_rng(1)
    x, weights = rng.standard_normal((400, 3)) + 1j * rng.standard_normal((400, 3)), np.array([1.0, 2j, -0.5])
    np.testing.assert_allclose(ridge_regression(x, x @ weights, 1e-9), weights, atol=1e-9)
    assert np.linalg.norm(ridge_regression(x, x @ weights, 2.0)) < 0.5 * np.linalg.norm(weights)


@pytest.mark.parametrize("readings", ["pos+ori", "pos", "ori", "without the head", "without the anchor"])
def test_it_beats_the_mean_pose_with_any_readings(walk: Scene, readings: str) -> None:
    silent = {"without the head": [5], "without the anchor": [4]}.get(readings)
    frames = walk.only(readings) if silent is None else [drop_stations(frame, silent) for frame in walk.frames]
    assert hinge_error_deg(walk, Ridge(), frames) < 0.75 * hinge_error_deg(walk, MeanPose(), frames)


@pytest.mark.parametrize("readings", ["pos", "ori"])
def test_the_posture_depends_neither_on_place_nor_on_heading(walk: Scene, readings: str) -> None:
    away = exact_frames(walk.body, walk.calibration, moved(walk.take.qpos, 2.4, (3.0, -2.0, 0.0)))
    masked = Scene(walk.body, walk.calibration, walk.take, away, walk.examples).only(readings)
    here, there = (np.array([e.qpos for e in walk.run(Ridge(), f)]) for f in (walk.only(readings), masked))
    np.testing.assert_allclose(there[:, 7:], here[:, 7:], atol=2e-3)  # frames are rounded to single precision


def test_a_reading_that_is_far_off_leaves_the_hinges_within_the_examples_range(walk: Scene) -> None:
    off_m = np.zeros((6, 3))
    off_m[0] = 50.0
    far = [replace(frame, position_m=frame.position_m + off_m) for frame in walk.frames]
    found = np.array([estimate.qpos[7:] for estimate in walk.run(Ridge(), far)])
    learnt = np.concatenate([take.qpos[:, 7:] for take in walk.examples])
    assert (found >= learnt.min(axis=0) - 1e-6).all()
    assert (found <= learnt.max(axis=0) + 1e-6).all()
