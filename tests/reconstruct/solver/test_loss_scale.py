"""The Lorentzian's scale for positions, from planted residuals."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.reconstruct.solver import self_calibration
from harness.reconstruct.solver.ground_frame import ground_from_qpos, posture_from_qpos
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import Stopping
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.self_calibration import LossScale, median_distance
from harness.reconstruct.solver.subspace import SubspaceSolver
from harness.reconstruct.solver.subspace_minimiser import Subspace
from tests.reconstruct.conftest import Scene


@pytest.fixture(autouse=True)
def planted_constants(monkeypatch: pytest.MonkeyPatch) -> None:
    """Constants for these tests, whatever validation clips choose."""
    for name, value in {"_MULTIPLE": 6.0, "_MIN_SCALE_M": 0.005, "_MEAN_S": 0.5}.items():
        monkeypatch.setattr(self_calibration, name, value)


def residuals_at(scene: Scene, offset_m: Floats) -> Residuals:
    """Residuals of the true pose for positions that are off by these distances (S,) along x; NaN: not measured."""
    residuals, frame = Residuals(scene.body, scene.calibration, Loss()), scene.frames[30]
    away = np.nan_to_num(offset_m)[:, None] * np.array([1.0, 0.0, 0.0])
    residuals.read(replace(frame, position_m=frame.position_m + away, position_valid=~np.isnan(offset_m)))
    residuals.evaluate(scene.take.qpos[30])
    return residuals


def scale_after(scene: Scene, offset_m: Floats, frames: int) -> float:
    residuals, scale = residuals_at(scene, offset_m), LossScale(0.03, 40.0)
    for _ in range(frames):
        scale.update(residuals.targets, residuals.state)
    return scale.position_m


@pytest.mark.parametrize(
    ("offset_m", "median_m"),
    [
        ([0.001, 0.002, 0.003, 0.005, 0.006, 0.007], 0.004),
        ([0.007, np.nan, 0.001, 0.004, 0.5, 0.002], 0.004),
        ([np.nan, np.nan, 0.003, np.nan, np.nan, np.nan], 0.003),
        ([np.nan] * 6, -1.0),
    ],
)
def test_the_median_is_of_measured_positions(walk: Scene, offset_m: list[float], median_m: float) -> None:
    residuals = residuals_at(walk, np.array(offset_m))
    assert median_distance(residuals.targets, residuals.state) == pytest.approx(median_m, abs=2e-6)


def test_the_scale_starts_at_its_upper_limit_and_falls_slowly(walk: Scene) -> None:
    assert LossScale(0.03, 40.0).position_m == pytest.approx(0.03)
    assert scale_after(walk, np.full(6, 0.002), 1) == pytest.approx(6.0 * (0.005 - 0.05 * 0.003), rel=1e-3)
    assert scale_after(walk, np.full(6, 0.002), 400) == pytest.approx(0.012, rel=1e-3)


@pytest.mark.parametrize("rate_hz", [30.0, 40.0, 60.0, 120.0])
def test_the_mean_takes_half_a_second_at_every_rate(walk: Scene, rate_hz: float) -> None:
    """At 120 Hz it took a sixth of that: a weight was given to each frame."""
    residuals, scale = residuals_at(walk, np.full(6, 0.002)), LossScale(0.03, rate_hz)
    for _ in range(round(0.5 * rate_hz)):
        scale.update(residuals.targets, residuals.state)
    left = (scale.position_m / 6.0 - 0.002) / (0.005 - 0.002)
    assert left == pytest.approx(np.exp(-1.0), abs=0.015)


def test_the_weight_at_40_hz_is_that_of_published_figures() -> None:
    assert LossScale(0.03, 40.0)._weight == 0.05


@pytest.mark.parametrize(("offset_m", "scale_m"), [(0.0, 0.005), (0.01, 0.03), (5.0, 0.03)])
def test_the_scale_keeps_its_limits(walk: Scene, offset_m: float, scale_m: float) -> None:
    assert scale_after(walk, np.full(6, offset_m), 400) == pytest.approx(scale_m)


def test_two_stations_that_are_off_do_not_widen_it(walk: Scene) -> None:
    assert scale_after(walk, np.array([0.03, 0.03, 0.0, 0.0, 0.0, 0.0]), 400) == pytest.approx(0.005)


def test_it_narrows_again_soon_after_large_residuals(walk: Scene) -> None:
    scale = LossScale(0.03, 40.0)
    for offset_m in (5.0, 0.0):
        residuals = residuals_at(walk, np.full(6, offset_m))
        for _ in range(100):
            scale.update(residuals.targets, residuals.state)
    assert scale.position_m == pytest.approx(0.005)


def test_a_frame_without_positions_changes_nothing(walk: Scene) -> None:
    assert scale_after(walk, np.full(6, np.nan), 400) == pytest.approx(0.03)


def test_a_narrow_scale_resists_an_excursion(walk: Scene) -> None:
    """A hand that reads 25 mm too far hardly moves the pose, and exact readings are followed as before."""
    residuals, qpos = Residuals(walk.body, walk.calibration, Loss()), walk.take.qpos[30]
    solver = SubspaceSolver(residuals, HingeLimits(walk.body), Stopping())
    size, true = 52, posture_from_qpos(qpos)
    prior = Subspace(true, np.zeros((0, size)), np.eye(size) / 0.01**2, np.zeros(size), np.zeros(size))
    moved_m = {}
    for scale_m in (0.03, 0.005):
        for offset_m in (0.0, 0.025):
            position_m = np.array(walk.frames[30].position_m)
            position_m[0, 0] += offset_m
            residuals.set_position_scale(scale_m)
            residuals.read(replace(walk.frames[30], position_m=position_m))
            solution = solver.solve(prior, ground_from_qpos(qpos), true)
            residuals.read(walk.frames[30])
            residuals.evaluate(solution.qpos)
            moved_m[scale_m, offset_m] = float(residuals.distance[0])
    assert max(moved_m[0.03, 0.0], moved_m[0.005, 0.0]) < 1e-5
    assert moved_m[0.005, 0.025] < 0.5 * moved_m[0.03, 0.025]


def test_widening_is_of_the_scales_of_the_loss_and_one_restores_those_that_are_set(walk: Scene) -> None:
    residuals = Residuals(walk.body, walk.calibration, Loss())
    residuals.set_position_scale(0.005)
    residuals.read(walk.frames[30])
    for factor, position_m in ((10.0, 0.3), (1.0, 0.005)):
        residuals.widen(factor)
        expected = np.repeat([position_m, factor * np.radians(8.0)], 6)
        np.testing.assert_allclose(np.sqrt(residuals.targets.twice_scale_squared / 2.0), expected)
