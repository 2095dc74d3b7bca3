"""The posterior against numpy, and scales of noise and prior that are estimated from planted residuals."""

import math
from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.reconstruct.solver import self_calibration
from harness.reconstruct.solver.ground_frame import HINGES, ground_from_qpos, posture_from_qpos, qpos_from_posture
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import Stopping
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.self_calibration import (
    LossScale,
    Posterior,
    SelfCalibration,
    Trust,
    median_distance,
    posterior,
)
from harness.reconstruct.solver.subspace import SubspaceSolver
from harness.reconstruct.solver.subspace_minimiser import Subspace
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations
from tests.reconstruct.conftest import Scene

SQUARES = Loss(robust=False)


def subspace(mean: Floats, covariance: Floats) -> Subspace:
    size = len(mean)
    curvature = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    return Subspace(mean, np.zeros((0, size)), curvature, np.zeros(size), np.zeros(size))


def noisy(frame: TrackerFrame, position_m: float, orientation_rad: float, rng: np.random.Generator) -> TrackerFrame:
    shape = frame.position_m.shape
    turned = rotations.multiply(rotations.exp(orientation_rad * rng.normal(size=shape)), frame.tracker_from_station)
    return replace(
        frame, position_m=frame.position_m + position_m * rng.normal(size=shape), tracker_from_station=turned
    )


def masked(scene: Scene, index: int, kinds: str) -> TrackerFrame:
    return scene.only(kinds)[index]


def errors_of(residuals: Residuals, z: Floats, sigma: tuple[float, float]) -> Floats:
    """(6 S,) whitened errors of positions, then of orientations; 0 where not measured."""
    residuals.evaluate(qpos_from_posture(z[3:], z[:3]))
    count = len(residuals.bones)
    out: Floats = residuals.error / np.repeat(sigma, count)[:, None] * residuals.measured[:, None]
    return out.ravel()


@pytest.fixture(autouse=True)
def planted_constants(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rates and limits for these tests, whatever validation clips choose."""
    values = {"_NOISE_RATE": 0.1, "_INFLATION": 1.0, "_SCALE_S": 0.25, "_KIND_S": 1.0, "_FIRST_INFORMATION": 36.0}
    values |= {"_MIN_NOISE": 0.1, "_MAX_NOISE": 1.2, "_MIN_SCALE": 0.3, "_MAX_SCALE": 100.0, "_KNOWN": 0.8, "_NEW": 2.5}
    for name, value in values.items():
        monkeypatch.setattr(self_calibration, name, value)


@pytest.fixture
def spread() -> Floats:
    """(52, 52) covariance of a planted prior."""
    root = np.random.default_rng(5).normal(size=(52, 80))
    out: Floats = 0.01 * root @ root.T / 80.0 + 1e-4 * np.eye(52)
    return out


@pytest.mark.parametrize("kinds", ["pos+ori", "pos", "ori"])
def test_the_posterior_is_that_of_the_hessian_by_differences(
    walk: Scene, kinds: str, spread: Floats, rng: np.random.Generator
) -> None:
    loss, residuals = SQUARES, Residuals(walk.body, walk.calibration, SQUARES)
    residuals.read(masked(walk, 30, kinds))
    z = np.concatenate([ground_from_qpos(walk.take.qpos[30]), posture_from_qpos(walk.take.qpos[30])])
    z[7:] += 1e-3 * rng.normal(size=48)
    offset = 0.05 * rng.normal(size=52)
    prior = subspace(z[3:] - offset, spread)
    sigma, step = (loss.position_sigma_m, loss.orientation_sigma_rad), 1e-6
    slopes = [
        (errors_of(residuals, z + step * unit, sigma) - errors_of(residuals, z - step * unit, sigma)) / (2 * step)
        for unit in np.eye(55)
    ]
    whitened, slope = errors_of(residuals, z, sigma), np.array(slopes).T
    rows = 3 * len(residuals.bones)
    of_positions, of_orientations = (part.T @ part for part in (slope[:rows], slope[rows:]))
    of_prior = np.zeros((55, 55))
    of_prior[3:, 3:] = prior.curvature
    covariance = np.linalg.inv(of_positions + of_orientations + of_prior + 1e-6 * np.eye(55))
    other = z[3:] + 0.02 * rng.normal(size=52), np.asarray(np.linalg.inv(spread[::-1, ::-1]), dtype=np.float64)
    found = posterior(residuals.tree, residuals.targets, residuals.state, prior, other, z)
    np.testing.assert_allclose(found.variance, np.diag(covariance)[3:], rtol=2e-3)
    shares = [np.trace(covariance @ part) for part in (of_positions, of_orientations, of_prior)]
    expected = [
        (np.sum(part**2) + share) / rows if measured else 1.0
        for part, share, measured in (
            (whitened[:rows], shares[0], "pos" in kinds),
            (whitened[rows:], shares[1], "ori" in kinds),
        )
    ]
    assert found.position == pytest.approx(expected[0], rel=2e-3)
    assert found.orientation == pytest.approx(expected[1], rel=2e-3)
    away = z[3:] - other[0]
    assert found.distance == pytest.approx(away @ other[1] @ away)
    assert found.information == pytest.approx(52 - shares[2], abs=0.05)


def test_the_shares_of_the_posterior_are_as_many_as_the_unknowns(walk: Scene, spread: Floats) -> None:
    """At exact readings and at the prior's mean nothing but the shares remains."""
    residuals = Residuals(walk.body, walk.calibration, SQUARES)
    residuals.read(walk.frames[30])
    qpos = walk.take.qpos[30]
    residuals.evaluate(qpos)
    z = np.concatenate([ground_from_qpos(qpos), posture_from_qpos(qpos)])
    found = judge(residuals, subspace(z[3:], spread), z)
    assert 18 * found.position + 18 * found.orientation - found.information == pytest.approx(3.0, abs=1e-3)
    assert found.distance == 0.0
    assert min(found.position, found.orientation) > 0.0


def test_the_state_is_left_as_it_was(walk: Scene, spread: Floats) -> None:
    residuals = Residuals(walk.body, walk.calibration, SQUARES)
    residuals.read(walk.frames[30])
    residuals.evaluate(walk.take.qpos[31])
    z = np.concatenate([ground_from_qpos(walk.take.qpos[31]), posture_from_qpos(walk.take.qpos[31])])
    before = residuals.state.weight.copy(), residuals.state.error.copy()
    one, two = (judge(residuals, subspace(z[3:], spread), z) for _ in range(2))
    np.testing.assert_array_equal(residuals.state.weight, before[0])
    np.testing.assert_array_equal(residuals.state.error, before[1])
    assert one.variance.tobytes() == two.variance.tobytes()
    assert one[1:] == two[1:]


def test_an_outlier_counts_as_a_limited_square(walk: Scene, spread: Floats) -> None:
    residuals, found = Residuals(walk.body, walk.calibration, Loss()), []
    z = np.concatenate([ground_from_qpos(walk.take.qpos[30]), posture_from_qpos(walk.take.qpos[30])])
    for shift_m in (0.0, 0.5, 5.0):
        position_m = np.array(walk.frames[30].position_m)
        position_m[0, 0] += shift_m
        residuals.read(replace(walk.frames[30], position_m=position_m))
        residuals.evaluate(walk.take.qpos[30])
        found.append(judge(residuals, subspace(z[3:], spread), z))
    none, large, larger = found
    assert large.position == pytest.approx(larger.position, abs=0.05)
    assert large.position - none.position == pytest.approx(self_calibration._MAX_SQUARE / 18.0, abs=0.2)
    assert large.orientation == pytest.approx(none.orientation, abs=0.1)


def test_the_prior_is_judged_without_the_readings(walk: Scene, spread: Floats) -> None:
    """One more standard deviation along one direction adds one to the squared distance."""
    residuals = Residuals(walk.body, walk.calibration, SQUARES)
    residuals.read(walk.frames[30])
    residuals.evaluate(walk.take.qpos[30])
    z = np.concatenate([ground_from_qpos(walk.take.qpos[30]), posture_from_qpos(walk.take.qpos[30])])
    values, vectors = np.linalg.eigh(spread)
    found = [
        judge(residuals, subspace(z[3:] - far * math.sqrt(values[40]) * vectors[:, 40], spread), z)
        for far in (0.0, 1.0, 3.0)
    ]
    assert [f.distance for f in found] == pytest.approx([0.0, 1.0, 9.0], abs=1e-6)


def judge(residuals: Residuals, prior: Subspace, z: Floats) -> Posterior:
    """The posterior at z (55,), whose prior is that of the experts alone."""
    return posterior(residuals.tree, residuals.targets, residuals.state, prior, (prior.mean, prior.curvature), z)


def calibrate(
    scene: Scene,
    position_m: float,
    orientation_rad: float,
    spread_factor: float,
    outliers: float = 0.0,
    stations: int = 6,
) -> tuple[SelfCalibration, Trust]:
    """Scales and trust after 800 frames of readings with planted noise, and of priors whose means err as planted.

    The priors claim 0.01 for every number; under wider ones the scales converge more slowly. Of positions a share of
    `outliers` is off by 0.5 m.
    """
    rng, loss = np.random.default_rng(3), Loss()
    residuals, limits = Residuals(scene.body, scene.calibration, loss), HingeLimits(scene.body)
    solver, scales = SubspaceSolver(residuals, limits, Stopping()), SelfCalibration(0.003, math.radians(0.5))
    trust = Trust(40.0)
    for index in range(800):
        k = index % len(scene.frames)
        frame, qpos = noisy(scene.frames[k], position_m, orientation_rad, rng), scene.take.qpos[k]
        wild = 0.5 * (rng.random((6, 1)) < outliers) * np.array([1.0, 0.0, 0.0])
        residuals.set_sigma(scales.position_sigma_m, scales.orientation_sigma_rad)
        read = replace(frame, position_m=frame.position_m + wild)
        residuals.read(drop_stations(read, range(stations, 6)))
        true = posture_from_qpos(qpos)
        mean = true + 0.01 * spread_factor * rng.normal(size=52)
        mean[3] = 0.0
        mean[HINGES] = limits.clip(mean[HINGES])
        prior = subspace(mean, trust.inflation * 0.01**2 * np.eye(52))
        solution = solver.solve(prior, ground_from_qpos(qpos), mean)
        z = np.concatenate([ground_from_qpos(solution.qpos), posture_from_qpos(solution.qpos)])
        found = judge(residuals, prior, z)
        scales.update(found)
        trust.update(found)
    return scales, trust


@pytest.mark.parametrize("position_mm", [1.0, 3.0])
@pytest.mark.parametrize("orientation_deg", [0.1, 0.4])
def test_the_noise_of_the_readings_is_found(walk: Scene, position_mm: float, orientation_deg: float) -> None:
    scales, _ = calibrate(walk, 1e-3 * position_mm, math.radians(orientation_deg), 1.0)
    assert 1e3 * scales.position_sigma_m == pytest.approx(position_mm, rel=0.3)
    assert math.degrees(scales.orientation_sigma_rad) == pytest.approx(orientation_deg, rel=0.3)


@pytest.mark.parametrize("stations", [6, 3])
def test_the_inflation_is_three_times_the_planted_ratio_of_variances(
    walk: Scene, stations: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An inflated prior does not hide the ratio, nor do fewer readings."""
    monkeypatch.setattr(self_calibration, "_INFLATION", 3.0)
    for factor in (0.7, 1.0, 2.0, 3.0):
        _, trust = calibrate(walk, 1e-3, math.radians(0.1), factor, stations=stations)
        assert trust.inflation / 3.0 == pytest.approx(factor**2, rel=0.4)
        assert (trust.newness == 0.0) == (factor < 0.9) or factor == 1.0
        assert (trust.newness == 1.0) == (factor > 1.5)


def test_outliers_do_not_blow_up_the_noise(walk: Scene) -> None:
    scales, _ = calibrate(walk, 1e-3, math.radians(0.1), 1.0, outliers=0.02)
    assert 0.7e-3 < scales.position_sigma_m < 2.5e-3
    assert math.degrees(scales.orientation_sigma_rad) < 0.2


def found(
    position: float = 1.0, orientation: float = 1.0, distance: float = 0.0, information: float = 0.0
) -> Posterior:
    return Posterior(np.zeros(52), position, orientation, distance, information)


def test_scales_start_and_stay_where_residuals_are_as_large_as_they_should_be() -> None:
    scales = SelfCalibration(0.003, 0.01)
    for _ in range(3):
        scales.update(found())
    assert (scales.position_sigma_m, scales.orientation_sigma_rad) == pytest.approx((0.003, 0.01))


def test_every_scale_follows_its_own_ratio() -> None:
    for ratios, moved in (
        (found(position=0.5), (True, False)),
        (found(orientation=0.5), (False, True)),
        (found(distance=18.0), (False, False)),
    ):
        scales = SelfCalibration(0.003, 0.01)
        scales.update(ratios)
        now = scales.position_sigma_m / 0.003, scales.orientation_sigma_rad / 0.01
        assert tuple(abs(share - 1.0) > 1e-6 for share in now) == moved
        assert all(0.8 < share < 1.3 for share in now), "slowly"


def test_a_frame_moves_a_deviation_by_a_power_of_its_ratio() -> None:
    scales = SelfCalibration(0.003, 0.01)
    for expected in (0.9, 0.81):
        scales.update(found(position=0.9**10))
        assert scales.position_sigma_m == pytest.approx(0.003 * expected)


@pytest.mark.parametrize("ratio", [0.0, -1.0, 1e-9, 1e9])
def test_scales_keep_their_limits(ratio: float) -> None:
    scales = SelfCalibration(0.003, 0.01)
    for _ in range(200):
        scales.update(found(ratio, ratio))
    share = 1.2 if ratio > 1.0 else 0.1
    assert scales.position_sigma_m == pytest.approx(share * 0.003)
    assert scales.orientation_sigma_rad == pytest.approx(share * 0.01)


def test_trust_starts_and_stays_where_the_distance_is_the_information() -> None:
    trust = Trust(40.0)
    for information in (36.0, 10.0, 1.0, 0.0):
        trust.update(found(distance=information / trust.inflation, information=information))
        assert trust.inflation == pytest.approx(1.0)
        assert trust.newness == pytest.approx(math.log(1.25) / math.log(3.125))


@pytest.mark.parametrize("rate_hz", [40.0, 200.0])
def test_the_inflation_follows_in_a_quarter_of_a_second_and_the_newness_in_a_second(rate_hz: float) -> None:
    """Means of distance and information, each about the planted ratio of 9 after many time constants."""
    trust, inflations, newness = Trust(rate_hz), [], []
    for _ in range(round(2.0 * rate_hz)):
        trust.update(found(distance=9.0 * 36.0 / trust.inflation, information=36.0))
        inflations.append(trust.inflation)
        newness.append(trust.newness)
    at = [round(seconds * rate_hz) - 1 for seconds in (0.25, 1.0)]
    assert inflations[at[0]] == pytest.approx(1.0 + 8.0 * (1.0 - math.exp(-1.0)), rel=0.03)
    assert inflations[-1] == pytest.approx(9.0, rel=0.01)
    at_tenth = 1.0 + 8.0 * (1.0 - math.exp(-0.1))
    tenth = newness[round(0.1 * rate_hz) - 1]
    assert tenth == pytest.approx(math.log(at_tenth / 0.8) / math.log(3.125), rel=0.03)
    assert newness[-1] == 1.0


@pytest.mark.parametrize(("ratio", "limit", "newness"), [(1e-9, 0.3, 0.0), (1e9, 100.0, 1.0)])
def test_trust_keeps_its_limits(ratio: float, limit: float, newness: float) -> None:
    trust = Trust(40.0)
    for _ in range(600):
        trust.update(found(distance=ratio, information=1.0))
    assert trust.inflation == pytest.approx(limit)
    assert trust.newness == newness
    trust.update(found(distance=1.0, information=-1.0))
    assert math.isfinite(trust.inflation)


@pytest.fixture(autouse=True)
def planted_loss_constants(monkeypatch: pytest.MonkeyPatch) -> None:
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
