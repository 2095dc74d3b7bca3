"""Maps from predictors to features, with all readings and with some, and the tables of both experts."""

import numpy as np
import pytest

from harness.core.arrays import Bools, Floats
from harness.reconstruct.features import local_experts
from harness.reconstruct.features.local_experts import LocalExperts
from harness.reconstruct.features.reduced_rank_regression import ReducedRankRegression
from harness.reconstruct.methods.expert_map import ExpertMap
from harness.reconstruct.solver.ground_frame import ground_from_qpos, posture_from_qpos, qpos_from_postures
from tests.reconstruct.conftest import Scene

ALL: Bools = np.ones(12, bool)
EXACT: Floats = np.zeros(12)
"""Variance of predicted rows: none is predicted."""


@pytest.fixture(scope="module")
def experts(walk: Scene) -> LocalExperts:
    fitted = ExpertMap().fit(walk.body, walk.examples, np.random.default_rng(0))
    regression, _ = fitted._trained(walk.calibration)
    return LocalExperts(regression)


def training_data(regression: ReducedRankRegression, rows: int = 300) -> tuple[Floats, Floats]:
    """Predictors (K, P) and postures (K, 52) of the first windows."""
    pairs = list(regression.training_data(regression.windows, np.arange(rows)))
    return np.concatenate([x for x, _ in pairs]), np.concatenate([y for _, y in pairs])


def without(*lost: int) -> Bools:
    out = ALL.copy()
    out[list(lost)] = False
    return out


def test_with_all_readings_features_are_the_directions_of_the_regression(experts: LocalExperts) -> None:
    regression = experts.regression
    predictors, _ = training_data(regression)
    to_z = experts.feature_map(ALL, True)
    wanted = (predictors - regression.mean) @ regression.directions(np.ones(regression.size, bool))
    np.testing.assert_allclose(predictors @ to_z.matrix - to_z.origin, wanted, atol=1e-9)
    assert to_z.matrix.shape == (regression.size, regression.options.directions)


def test_the_tables_hold_the_moments_of_all_windows(experts: LocalExperts) -> None:
    """Their pooled means and second moments are those of features and postures."""
    regression = experts.regression
    predictors, postures = training_data(regression, len(regression.windows))
    to_z = experts.feature_map(ALL, True)
    z = predictors @ to_z.matrix - to_z.origin
    u = predictors[:, : len(experts.history_axes)] @ experts.history_axes - experts.history_origin
    for table, features in ((experts.table, z), (experts.history_table, u)):
        pairs, share = np.concatenate([features, postures], axis=1), table.examples / len(postures)
        assert table.examples.sum() == len(postures)
        assert table.features == features.shape[1]
        np.testing.assert_allclose(share @ table.mean, pairs.mean(axis=0), atol=1e-5)
        lower = np.tril_indices(pairs.shape[1])
        between = sum(n * np.outer(m, m) for n, m in zip(table.examples, table.mean.astype(float), strict=True))
        second = table.scatter.sum(axis=0, dtype=float) + between[lower]
        np.testing.assert_allclose(second / len(postures), (pairs.T @ pairs)[lower] / len(postures), atol=1e-4)


def test_axes_of_the_history_are_its_leading_principal_ones(experts: LocalExperts) -> None:
    regression, axes = experts.regression, experts.history_axes
    length = regression.windows.size
    np.testing.assert_allclose(axes.T @ axes, np.eye(axes.shape[1]), atol=1e-9)
    scatter = regression.scatter[:length, :length]
    variance = np.diag(axes.T @ scatter @ axes)
    np.testing.assert_allclose(variance, np.linalg.eigvalsh(scatter)[::-1][: len(variance)], atol=1e-9)
    predictors, _ = training_data(regression, len(regression.windows))
    np.testing.assert_allclose((predictors[:, :length] @ axes).mean(axis=0), experts.history_origin, atol=1e-6)


@pytest.mark.parametrize("measured", [without(0), without(0, 6), without(*range(6, 12)), without(4, 10)])
@pytest.mark.parametrize("history", [True, False])
def test_missing_predictors_are_replaced_by_their_regression(
    experts: LocalExperts, measured: Bools, history: bool
) -> None:
    regression = experts.regression
    known = regression.columns(measured, history)
    predictors, _ = training_data(regression)
    scatter = regression.scatter[np.ix_(known, known)] + regression.ridge * np.eye(known.sum())
    completed = predictors - regression.mean
    completed[:, ~known] = completed[:, known] @ np.linalg.solve(scatter, regression.scatter[np.ix_(known, ~known)])
    whole, part = experts.feature_map(ALL, True), experts.feature_map(measured, history)
    wanted = (completed + regression.mean) @ whole.matrix - whole.origin
    np.testing.assert_allclose(predictors @ part.matrix - part.origin, wanted, atol=1e-6)
    assert not part.matrix[~known].any()


@pytest.mark.parametrize("measured", [without(0), without(0, 6), without(*range(6, 12))])
def test_imputation_adds_the_covariance_of_what_the_regression_leaves(experts: LocalExperts, measured: Bools) -> None:
    """That of the imputed features over the examples, and that of known predictors that err as much as the ridge."""
    regression = experts.regression
    known, directions = regression.columns(measured), regression.directions(np.ones(regression.size, bool))
    predictors, _ = training_data(regression, len(regression.windows))
    whole, part = experts.feature_map(ALL, True), experts.feature_map(measured, True)
    away = predictors @ part.matrix - part.origin - (predictors @ whole.matrix - whole.origin)
    gain = part.matrix[known] - directions[known]
    added = part.fixed - experts._map(part.matrix).fixed
    assert np.linalg.eigvalsh(added).min() > -1e-9 * np.trace(added)
    wanted = away.T @ away / len(away) + regression.ridge * gain.T @ gain
    np.testing.assert_allclose(added, wanted, atol=1e-5 * np.trace(added))
    less, more = (entry.error_covariance(0.0, 0.0, EXACT) for entry in (whole, part))
    assert np.trace(more) > np.trace(less)


def test_fewer_readings_err_more(experts: LocalExperts) -> None:
    traces = [
        np.trace(experts.feature_map(measured, history).error_covariance(1e-3, 1e-3, EXACT))
        for measured, history in ((ALL, True), (without(0), True), (without(0, 6), True), (without(0, 6), False))
    ]
    assert traces == sorted(set(traces))


def test_errors_of_positions_and_of_past_poses_go_through_the_map(experts: LocalExperts, walk: Scene) -> None:
    """Each is the covariance of independent errors: the sum of squares of the features' derivatives."""
    regression, to_z = experts.regression, experts.feature_map(ALL, True)
    past = walk.take.qpos[[12, 11, 10]]
    ground, posture = ground_from_qpos(past), posture_from_qpos(past)
    length, step = regression.windows.size, 1e-3
    before = regression.windows.query(past).astype(float)
    slopes = []
    for k in range(52):
        if k == 3:
            continue  # the tilt has no component about the vertical
        shifted = posture.copy()
        shifted[:, k] += step
        after = regression.windows.query(qpos_from_postures(shifted, ground)).astype(float)
        slopes.append(regression.options.window_weight * (after - before) / step @ to_z.matrix[:length])
    slope = np.array(slopes)
    wanted = np.deg2rad(2.0) ** 2 * slope.T @ slope
    np.testing.assert_allclose(to_z.fixed, wanted, atol=0.02 * np.abs(wanted).max())
    readings = to_z.matrix[length:].reshape(6, 9, -1)
    places, axes = readings[:, :3].reshape(18, -1), readings[:, 3:].reshape(36, -1)
    np.testing.assert_allclose(to_z.position, places.T @ places)
    np.testing.assert_allclose(to_z.orientation, regression.options.lever_m**2 * axes.T @ axes)
    np.testing.assert_allclose(
        to_z.error_covariance(0.002, 0.05, EXACT), to_z.fixed + 4e-6 * to_z.position + 2.5e-3 * to_z.orientation
    )


def test_the_variance_of_a_predicted_reading_goes_through_its_rows_of_the_map(experts: LocalExperts) -> None:
    """Station 2 errs by 5 cm along every axis, and station 4 by 0.3 rad about every axis."""
    to_z = experts.feature_map(ALL, True)
    variance = EXACT.copy()
    variance[[2, 6 + 4]] = 0.05**2, 0.3**2
    rows = to_z.matrix[experts.regression.windows.size :].reshape(6, 9, -1)
    lever = experts.regression.options.lever_m
    wanted = 0.05**2 * rows[2, :3].T @ rows[2, :3] + (0.3 * lever) ** 2 * rows[4, 3:].T @ rows[4, 3:]
    added = to_z.error_covariance(0.0, 0.0, variance) - to_z.error_covariance(0.0, 0.0, EXACT)
    np.testing.assert_allclose(added, wanted, atol=1e-9 * np.trace(to_z.fixed))
    np.testing.assert_allclose(to_z.readings[:6].sum(axis=0), to_z.position)
    np.testing.assert_allclose(to_z.readings[6:].sum(axis=0), to_z.orientation)


def test_imputation_keeps_the_covariance_of_each_reading(experts: LocalExperts) -> None:
    part = experts.feature_map(without(3), True)
    np.testing.assert_allclose(part.readings[:6].sum(axis=0), part.position)
    assert not part.readings[3].any()
    assert part.readings[2].any()


def test_maps_are_made_once_and_few_are_kept(experts: LocalExperts, monkeypatch: pytest.MonkeyPatch) -> None:
    assert experts.feature_map(without(3), True) is experts.feature_map(without(3), True)
    assert experts.feature_map(without(3), False) is not experts.feature_map(without(3), True)
    monkeypatch.setattr(local_experts, "_CACHED_MAPS", 3)
    monkeypatch.setattr(experts, "_maps", {})
    kept = []
    for lost in range(5):
        experts.feature_map(without(lost), True)
        kept.append(len(experts._maps))
    assert kept == [1, 2, 3, 1, 2]
