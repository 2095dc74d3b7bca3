"""The cost and its slopes against differences, and the Lorentzian against its formula."""

from dataclasses import replace

import numpy as np
import pytest

from harness.errors import ShapeError
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolver, Prior, Stopping
from harness.reconstruct.solver.normal_equations import add_curvature, normal_rows
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.testing.frames import drop_stations
from tests.reconstruct.conftest import Scene, normal_equations_of


def noisy(walk: Scene, rng: np.random.Generator, loss: Loss, off_m: float) -> tuple[Residuals, np.ndarray]:
    """Residuals that have read a frame, and a pose some way off it."""
    residuals = Residuals(walk.body, walk.calibration, loss)
    frame = walk.frames[30]
    residuals.read(replace(frame, position_m=frame.position_m + rng.normal(0.0, off_m, frame.position_m.shape)))
    qpos = np.array(walk.take.qpos[30])
    qpos[7:] += rng.normal(0.0, 0.05, 48)
    return residuals, qpos


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("off_m", [0.003, 0.2])
def test_descent_is_the_slope_of_the_cost(walk: Scene, rng: np.random.Generator, robust: bool, off_m: float) -> None:
    residuals, qpos = noisy(walk, rng, Loss(robust=robust), off_m)
    residuals.evaluate(qpos)
    _, descent = normal_equations_of(residuals)
    h, slopes = 1e-6, np.zeros(54)
    for k, step in enumerate(h * np.eye(54)):
        ahead, behind = (residuals.evaluate(residuals.kinematics.integrate(qpos, s)) for s in (step, -step))
        slopes[k] = (ahead - behind) / (2.0 * h)
    np.testing.assert_allclose(-descent, slopes, atol=1e-6 * np.max(np.abs(descent)))


def test_slopes_of_every_residual_against_differences(walk: Scene) -> None:
    """Where measured and modelled agree, the errors' slopes are exactly minus the Jacobian."""
    loss = Loss(position_sigma_m=1.0, orientation_sigma_rad=1.0, robust=False)
    residuals, here = Residuals(walk.body, walk.calibration, loss), walk.take.qpos[30]
    residuals.read(walk.frames[30])
    residuals.evaluate(here)
    hessian, _ = normal_equations_of(residuals)

    def errors(step: np.ndarray) -> np.ndarray:
        residuals.evaluate(residuals.kinematics.integrate(here, step))
        return residuals.error.reshape(-1).copy()

    h = 1e-6
    slopes = np.array([(errors(step) - errors(-step)) / (2.0 * h) for step in h * np.eye(54)]).T
    np.testing.assert_allclose(hessian, slopes.T @ slopes, atol=1e-6)


def test_curvature_completes_the_hessian(walk: Scene, rng: np.random.Generator) -> None:
    residuals, qpos = noisy(walk, rng, Loss(robust=False), 0.02)
    residuals.evaluate(qpos)
    gauss_newton, _ = normal_equations_of(residuals)
    rows, full = np.empty(residuals.tree.ancestors.shape), np.zeros((54, 54))
    normal_rows(residuals.tree, residuals.state, rows, np.empty(54))
    add_curvature(residuals.tree, residuals.state, rows)
    for i, ancestors in enumerate(residuals.tree.ancestors):
        known = ancestors[: residuals.tree.depth[i] + 1]
        full[i, known] = full[known, i] = rows[i, : len(known)]
    h, columns = 1e-5, []
    for step in h * np.eye(54):
        slopes = []
        for s in (step, -step):
            residuals.evaluate(residuals.kinematics.integrate(qpos, s))
            slopes.append(-normal_equations_of(residuals)[1])
        columns.append((slopes[0] - slopes[1]) / (2.0 * h))
    true = np.array(columns)[6:, 6:]
    true = 0.5 * (true + true.T)
    missing = np.max(np.abs(true - gauss_newton[6:, 6:]))
    assert np.max(np.abs(true - full[6:, 6:])) < 0.05 * missing


def test_one_lorentzian_for_each_tracker_and_kind(walk: Scene) -> None:
    loss = Loss()
    residuals = Residuals(walk.body, walk.calibration, loss)
    frame = walk.frames[0]
    shift = np.zeros((6, 3))
    shift[2] = [0.03, 0.04, 0.12]  # 13 cm
    residuals.read(replace(frame, position_m=frame.position_m + shift))
    expected = (loss.position_scale_m / loss.position_sigma_m) ** 2 * np.log1p(0.13**2 / (2 * loss.position_scale_m**2))
    assert residuals.evaluate(walk.take.qpos[0]) == pytest.approx(expected, rel=1e-6)
    residuals.widen(1000.0)
    assert residuals.evaluate(walk.take.qpos[0]) == pytest.approx(0.5 * (0.13 / 0.003) ** 2, rel=1e-3)


def test_rows_that_were_not_measured_count_nothing(walk: Scene) -> None:
    residuals = Residuals(walk.body, walk.calibration, Loss())
    residuals.read(drop_stations(walk.frames[0], [1, 3]))
    assert not residuals.measured[[1, 3, 7, 9]].any()
    assert residuals.evaluate(walk.take.qpos[0]) == pytest.approx(0.0, abs=1e-9)
    residuals.read(walk.frames[0])
    elsewhere = np.array(walk.take.qpos[0])
    elsewhere[0] += 1.0
    whole = residuals.evaluate(elsewhere)
    residuals.leave_out(np.arange(12) < 6)
    assert residuals.evaluate(elsewhere) == pytest.approx(0.0, abs=1e-9)
    assert whole > 100.0


def test_a_station_of_low_quality_pulls_less(walk: Scene) -> None:
    """One head 10 cm off: the solved head comes the nearer the better its quality, as 1 / sd^2 should."""
    loss, frame, truth = Loss(robust=False, position_sigma_m=0.05), walk.frames[0], walk.take.qpos[0]
    limits = HingeLimits(walk.body)
    shift, pulled_m = np.zeros((6, 3)), []
    shift[5] = [0.0, 0.1, 0.0]
    for quality in (1.0, 0.1):
        residuals = Residuals(walk.body, walk.calibration, loss)
        said = np.ones(6)
        said[5] = quality
        residuals.read(replace(frame, position_m=frame.position_m + shift, quality=said))
        assert residuals.confidence == pytest.approx(np.tile(said, 2))
        assert residuals.evaluate(truth) == pytest.approx(quality * 0.5 * (0.1 / 0.05) ** 2, rel=1e-6)
        qpos = IKSolver(residuals, limits, Stopping()).solve(truth, Prior(truth, np.full(54, 30.0))).qpos
        residuals.evaluate(truth)
        at_m = residuals.station_m[5].copy()
        residuals.evaluate(qpos)
        pulled_m.append(float(np.linalg.norm(residuals.station_m[5] - at_m)))
    assert pulled_m[1] < 0.5 * pulled_m[0]
    assert pulled_m[0] > 0.01


def test_quality_and_suspicion_may_be_ignored_or_taken_in_earnest(walk: Scene) -> None:
    doubted = replace(walk.frames[0], quality=np.full(6, 0.5), suspect=np.arange(6) == 2)
    for loss, expected in (
        (Loss(), [0.5, 0.5, 0.05, 0.5, 0.5, 0.5]),
        (Loss(quality=False), [1.0, 1.0, 0.1, 1.0, 1.0, 1.0]),
        (Loss(suspect_weight=0.0), [0.5, 0.5, 0.0, 0.5, 0.5, 0.5]),
        (Loss(quality=False, suspect_weight=1.0), [1.0] * 6),
    ):
        residuals = Residuals(walk.body, walk.calibration, loss)
        residuals.read(doubted)
        assert residuals.confidence == pytest.approx(np.tile(expected, 2))
        residuals.leave_out(np.arange(12) == 0)
        assert residuals.confidence == pytest.approx([0.0, *expected[1:], *expected])
        residuals.read(walk.frames[0])
        assert residuals.confidence == pytest.approx(np.ones(12))


@pytest.mark.parametrize("stations", [3, 7])
def test_a_frame_of_other_stations_is_refused(walk: Scene, stations: int) -> None:
    residuals = Residuals(walk.body, walk.calibration, Loss())
    kept = np.arange(stations) % len(walk.calibration.stations)
    frame = walk.frames[0]
    fields = (
        "measured_s",
        "position_m",
        "tracker_from_station",
        "position_valid",
        "orientation_valid",
        "quality",
        "suspect",
    )
    other = replace(frame, **{name: getattr(frame, name)[kept] for name in fields})
    with pytest.raises(ShapeError, match="as calibrated"):
        residuals.read(other)
