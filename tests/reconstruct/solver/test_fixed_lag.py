"""Fixed-lag smoothing of planted motions: what the filter leaves alone, what it damps, and which frame it answers."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Origin, Status, session_lag
from harness.core.humanoid24 import pack
from harness.experiment.methods import run_method
from harness.reconstruct.solver.fixed_lag import FixedLagFilter, FixedLagSession

FIVE = (1.0, 4.0, 6.0, 4.0, 1.0)
FRAMES = 40


def planted(noise: Floats | float = 0.0) -> Floats:
    """(40, 55) steady motion: the root moves and turns about a fixed axis, hinges turn at constant rates past pi."""
    n = np.arange(FRAMES)[:, None]
    turn = rotations.exp((3.0 + 0.05 * n) * np.array([[0.6, 0.0, 0.8]]))
    angles_rad = np.linspace(-3.1, 3.1, 48) + 0.04 * n + noise
    wrapped = rotations.wrap_angle(angles_rad)
    return pack(np.concatenate([0.02 * n, 0.0 * n, 0.9 + 0.0 * n], axis=1), turn, wrapped)


class Replayed:
    """A session that answers with given poses, `lag` frames late."""

    def __init__(self, qpos: Floats, lag: int = 0, sigma_rad: Floats | None = None) -> None:
        self.qpos, self.lag, self.sigma_rad, self.steps = qpos, lag, sigma_rad, 0

    def step(self, frame: Any) -> Estimate:
        lag = min(self.steps, self.lag)
        at = self.steps - lag
        self.steps += 1
        status, origin = (Status.HELD, Origin.BRIDGED) if at == 20 else (Status.SOLVED, Origin.MODEL)
        sigma_rad = None if self.sigma_rad is None else self.sigma_rad[at]
        return Estimate(self.qpos[at], status, origin, sigma_rad, lag)


def run(qpos: Floats, weights: Sequence[float], lag: int = 0, sigma_rad: Floats | None = None) -> list[Estimate]:
    session, frame = FixedLagSession(Replayed(qpos, lag, sigma_rad), weights), Any
    return [session.step(frame) for _ in qpos]  # type: ignore[arg-type]  # the session looks at no frame


@pytest.mark.parametrize("weights", [(1.0,), (0.15, 0.7, 0.15), FIVE])
@pytest.mark.parametrize("inner_lag", [0, 1, 2])
def test_steady_motion_is_left_alone_at_the_frame_that_is_answered(weights: Sequence[float], inner_lag: int) -> None:
    truth, half = planted(), len(weights) // 2
    estimates = run(truth, weights, inner_lag)
    assert session_lag([e.lag for e in estimates]) == inner_lag + half
    for n, estimate in enumerate(estimates):
        at = max(n - inner_lag - half, 0)
        assert estimate.lag == n - at
        np.testing.assert_allclose(estimate.qpos[:3], truth[at, :3], atol=1e-9)
        assert rotations.angle_between_rad(estimate.qpos[3:7], truth[at, 3:7]) < 1e-7
        assert np.linalg.norm(estimate.qpos[3:7]) == pytest.approx(1.0, abs=1e-12)
        np.testing.assert_allclose(rotations.wrap_angle(estimate.qpos[7:] - truth[at, 7:]), 0.0, atol=1e-9)


def test_an_impulse_comes_out_with_the_weights(rng: np.random.Generator) -> None:
    qpos = np.tile(planted()[0], (FRAMES, 1))
    kick = rng.normal(size=48) * 0.1
    qpos[20, 7:] += kick
    qpos[20, :3] += [0.1, -0.2, 0.3]
    qpos[20, 3:7] = rotations.multiply(qpos[20, 3:7], rotations.exp(np.array([0.1, 0.0, 0.0])))
    answered = run(qpos, FIVE)[2:]
    for n, weight in zip(range(18, 23), np.array(FIVE) / 16.0, strict=True):
        np.testing.assert_allclose(answered[n].qpos[7:], qpos[0, 7:] + weight * kick, atol=1e-12)
        np.testing.assert_allclose(answered[n].qpos[:3], qpos[0, :3] + weight * np.array([0.1, -0.2, 0.3]), atol=1e-12)
        turned = rotations.angle_between_rad(answered[n].qpos[3:7], qpos[0, 3:7])
        assert turned == pytest.approx(0.1 * weight, abs=1e-9)
    np.testing.assert_array_equal(answered[17].qpos[7:], qpos[0, 7:])


def test_noise_is_reduced_by_the_root_of_the_squared_weights(rng: np.random.Generator) -> None:
    truth, noise = planted(), rng.normal(size=(FRAMES, 48)) * 0.01
    answered = np.array([e.qpos for e in run(planted(noise), (1.0, 2.0, 1.0))[1:]])
    error = rotations.wrap_angle(answered[1:, 7:] - truth[1 : FRAMES - 1, 7:])
    assert np.sqrt(np.mean(error**2)) == pytest.approx(0.01 * np.sqrt(6.0 / 16.0), rel=0.05)


def test_the_first_frames_have_narrower_windows() -> None:
    qpos = np.tile(planted()[0], (FRAMES, 1))
    qpos[:, 7] = np.arange(FRAMES) ** 2 * 0.001
    answered = [e.qpos[7] for e in run(qpos, FIVE)[2:]]
    assert answered[0] == qpos[0, 7]
    assert answered[1] == pytest.approx((4.0 * 0.0 + 6.0 * 0.001 + 4.0 * 0.004) / 14.0)
    assert answered[2] == pytest.approx((0.0 + 4.0 * 0.001 + 6.0 * 0.004 + 4.0 * 0.009 + 0.016) / 16.0)


def test_status_origin_and_standard_deviation_are_those_of_the_frame_that_is_answered() -> None:
    sigma_rad = 0.1 + 0.001 * np.arange(FRAMES)[:, None] ** 2 * np.ones(48)
    estimates = run(planted(), (1.0, 2.0, 1.0), 1, sigma_rad)
    held = [n - e.lag for n, e in enumerate(estimates) if e.status is Status.HELD]
    assert held == [20]
    assert [n - e.lag for n, e in enumerate(estimates) if e.origin is Origin.BRIDGED] == [20]
    found = estimates[12].angle_sigma_rad
    assert found is not None
    np.testing.assert_allclose(found, 0.25 * sigma_rad[9] + 0.5 * sigma_rad[10] + 0.25 * sigma_rad[11])
    assert run(planted(), (1.0, 2.0, 1.0))[12].angle_sigma_rad is None


def test_a_run_accepts_the_session() -> None:
    truth = planted()
    reconstructor: Any = SimpleNamespace(begin=lambda calibration: FixedLagSession(Replayed(truth, 1), FIVE))
    shown: Any = range(FRAMES)
    answers, lag = run_method(reconstructor, reconstructor, shown).by_frame()
    assert (lag, len(answers.qpos)) == (3, FRAMES - 3)
    np.testing.assert_allclose(answers.qpos[:, :3], truth[: FRAMES - 3, :3], atol=1e-9)


@pytest.mark.parametrize(
    "weights", [(), (0.5, 0.5), (0.2, 0.6, 0.3), (-0.1, 1.2, -0.1), (1.0, 0.0, 1.0), (np.nan,), (0.0,)]
)
def test_other_weights_are_refused(weights: Sequence[float]) -> None:
    with pytest.raises(ValueError, match="weights"):
        FixedLagFilter(weights)


@pytest.mark.parametrize("lags", [(1,), (0, 0, 2), (0, 1, 0), (0, 0, 1)])
def test_a_session_whose_lag_changes_is_refused(lags: Sequence[int]) -> None:
    smoother, pose = FixedLagFilter(), planted()[0]
    for lag in lags[:-1]:
        smoother.smooth(Estimate(pose, Status.SOLVED, lag=lag))
    with pytest.raises(ValueError, match="answers frame"):
        smoother.smooth(Estimate(pose, Status.SOLVED, lag=lags[-1]))
