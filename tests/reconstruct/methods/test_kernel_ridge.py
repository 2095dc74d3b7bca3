"""Kernel ridge regression: a smooth map, invariant to the performer's place, robust to silent stations."""

import numpy as np
import pytest

from harness.core.humanoid24 import unpack
from harness.reconstruct.methods.kernel_ridge import KernelRidge
from harness.testing.frames import drop_stations, exact_frames
from tests.reconstruct.conftest import Scene, moved

EXACT = KernelRidge(ridge=1e-6, position_noise_m=0.0, orientation_noise_rad=0.0)


def angle_error_deg(scene: Scene, qpos: np.ndarray) -> np.ndarray:
    """(T,) mean absolute hinge error [deg]."""
    off = unpack(qpos)[2] - unpack(scene.take.qpos)[2]
    return np.asarray(np.rad2deg(np.abs((off + np.pi) % (2.0 * np.pi) - np.pi)).mean(axis=1))


@pytest.mark.parametrize("yaw_deg", [0.0, 135.0])
def test_a_take_that_was_learnt_comes_back_wherever_it_is_performed(walk: Scene, yaw_deg: float) -> None:
    qpos = moved(walk.take.qpos, np.deg2rad(yaw_deg), (3.0, -2.0, 0.0))
    estimates = walk.run(EXACT, exact_frames(walk.body, walk.calibration, qpos), [walk.take])
    assert angle_error_deg(walk, np.array([e.qpos for e in estimates])).max() < 0.3
    assert walk.off_m(estimates, qpos).max() < 0.03  # the posture is stood by a rigid fit


def test_a_silent_station_takes_its_value_at_the_last_estimate(walk: Scene) -> None:
    frames = [drop_stations(f, [0]) if k > 10 else f for k, f in enumerate(walk.frames)]
    error_deg = angle_error_deg(walk, np.array([e.qpos for e in walk.run(KernelRidge(), frames)]))
    mean_deg = np.rad2deg(np.abs(unpack(walk.take.qpos)[2] - unpack(walk.take.qpos)[2].mean(axis=0))).mean()
    assert error_deg[-20:].mean() < 0.8 * mean_deg


def test_a_take_that_was_learnt_comes_back_by_positions_alone(walk: Scene) -> None:
    """What a session never measures takes no part: its values at the last estimate would feed errors back."""
    estimates = walk.run(EXACT, walk.only("pos"), [walk.take])
    assert angle_error_deg(walk, np.array([e.qpos for e in estimates])).max() < 0.5


def test_thinning_is_a_matter_of_the_generator_alone(walk: Scene) -> None:
    few = KernelRidge(most_frames=40)
    one, two = (few.fit(walk.body, [walk.take], np.random.default_rng(3)).frames for _ in range(2))
    np.testing.assert_array_equal(one, two)
    assert len(one) == 40
    assert (np.diff(one) > 0).all()
