"""The weighted regression of Liu et al. 2011, eq. 2 to 8, against planted systems and against other formulations."""

import numpy as np
import pytest

from harness.core.arrays import Floats, Singles
from harness.reconstruct.methods.local_dynamic_model import forecast, neighbour_weights


def examples(rng: np.random.Generator, count: int, rank: int, size: int = 20) -> tuple[Floats, Floats]:
    """Windows minus query (K, N) in a subspace of some rank, and weights of sum 1."""
    away = rng.normal(size=(count, rank)) @ rng.normal(size=(rank, size)) + rng.normal(size=rank) @ np.ones(
        (rank, size)
    )
    return away, neighbour_weights(np.sort(rng.uniform(0.0, 2.0, count)), 0.7)


@pytest.mark.parametrize(
    ("kept", "off", "count", "rank"),
    [(1.0 - 1e-13, 1e-9, 60, 5), (1.0 - 1e-13, 1e-9, 60, 20), (1.0 - 1e-13, 1e-9, 15, 4), (1.0, 1e-7, 15, 4)],
)
def test_a_planted_linear_system_is_recovered(
    rng: np.random.Generator, kept: float, off: float, count: int, rank: int
) -> None:
    """Without a ridge, factorising the singular X X^T needs a tiny one."""
    away, weight = examples(rng, count, rank)
    slope, level = rng.normal(size=(away.shape[1], 7)), rng.normal(size=7)
    found = forecast(away, away @ slope + level, weight, kept, 0.0)
    np.testing.assert_allclose(found.mean, level + _unreachable(away, weight) @ slope, atol=off)
    assert np.max(found.covariance) < off**2


def test_a_planted_linear_system_is_recovered_from_many_examples(rng: np.random.Generator) -> None:
    """More examples than columns: the normal equations, with a tiny ridge."""
    away = rng.normal(size=(400, 12))
    weight = neighbour_weights(np.sort(rng.uniform(0.0, 2.0, 400)), 0.7)
    slope, level = rng.normal(size=(12, 7)), rng.normal(size=7)
    found = forecast(away, away @ slope + level, weight, 1.0, 0.0)
    np.testing.assert_allclose(found.mean, level, atol=1e-8)
    assert np.max(found.covariance) < 1e-7


@pytest.mark.parametrize("ridge", [1e-6, 1e-3, 0.1])
def test_many_examples_and_few_are_solved_alike(rng: np.random.Generator, ridge: float) -> None:
    """Normal equations and K x K space agree: appended zero columns change only the formulation."""
    away, after = rng.normal(size=(100, 12)), rng.normal(size=(100, 6))
    weight = neighbour_weights(np.sort(rng.uniform(0.0, 2.0, 100)), 0.7)
    primal = forecast(away, after, weight, 1.0, ridge)
    dual = forecast(np.concatenate([away, np.zeros((100, 90))], axis=1), after, weight, 1.0, ridge)
    np.testing.assert_allclose(primal.mean, dual.mean, atol=1e-9)
    np.testing.assert_allclose(primal.covariance, dual.covariance, rtol=1e-6, atol=1e-12)


def _unreachable(away: Floats, weight: Floats) -> Floats:
    """A part of the query (the origin) lies outside the examples' plane: the regression ignores it."""
    middle = weight @ away
    _, spread, axes = np.linalg.svd(away - middle)
    axes = axes[: np.count_nonzero(spread > 1e-9 * spread[0])]
    out: Floats = middle - axes.T @ (axes @ middle)
    return out


@pytest.mark.parametrize("kept", [0.5, 0.9, 1.0 - 1e-13])
def test_dual_equals_primal(rng: np.random.Generator, kept: float) -> None:
    """Eq. 7 as printed, with the eigenvectors of X^T W X."""
    away, weight = examples(rng, 50, 12)
    after = rng.normal(size=(50, 6))
    middle, after_middle = weight @ away, weight @ after
    x, y = away - middle, after - after_middle
    scatter = x.T @ (weight[:, None] * x)
    value, vector = np.linalg.eigh(scatter)
    value, vector = value[::-1], vector[:, ::-1]
    count = min(int(np.searchsorted(np.cumsum(value), kept * value.sum())) + 1, 12)
    value, vector = value[:count], vector[:, :count]
    beta = vector @ ((vector.T @ (x.T @ (weight[:, None] * y))) / value[:, None])
    found = forecast(away, after, weight, kept, 0.0)
    np.testing.assert_allclose(found.mean, after_middle - middle @ beta, atol=1e-8)
    np.testing.assert_allclose(found.covariance, (y - x @ beta).T @ (weight[:, None] * (y - x @ beta)), atol=1e-8)


@pytest.mark.parametrize("ridge", [1e-3, 0.1])
def test_a_ridge_is_that_of_the_primal(rng: np.random.Generator, ridge: float) -> None:
    away, weight = examples(rng, 40, 20)
    after = rng.normal(size=(40, 6))
    middle, after_middle = weight @ away, weight @ after
    x, y = away - middle, after - after_middle
    scatter = x.T @ (weight[:, None] * x)
    damped = scatter + ridge * np.trace(scatter) * np.eye(len(scatter))
    beta = np.linalg.solve(damped, x.T @ (weight[:, None] * y))
    for kept in (1.0, 1.0 - 1e-13):
        found = forecast(away, after, weight, kept, ridge)
        np.testing.assert_allclose(found.mean, after_middle - middle @ beta, atol=1e-9)
        np.testing.assert_allclose(found.covariance, (y - x @ beta).T @ (weight[:, None] * (y - x @ beta)), atol=1e-9)


def test_single_precision_is_good_enough(rng: np.random.Generator) -> None:
    away, weight = examples(rng, 100, 20)
    after = rng.normal(size=(100, 6))
    exact = forecast(away, after, weight, 1.0, 0.1)
    found = forecast(away.astype(np.float32), after.astype(np.float32), weight, 1.0, 0.1)
    np.testing.assert_allclose(found.mean, exact.mean, atol=1e-4)
    np.testing.assert_allclose(found.covariance, exact.covariance, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("spread", [1e-3, 0.01, 0.1])
def test_single_precision_is_good_enough_far_from_the_examples(rng: np.random.Generator, spread: float) -> None:
    """A distant query, as after a rotation of all readings: all neighbours are about equally far."""
    away, weight = examples(rng, 800, 40)
    far: Singles = (spread * away + rng.normal(0.0, 0.5, away.shape[1])).astype(np.float32)
    after: Singles = (far @ rng.normal(0.0, 0.1, (away.shape[1], 6)) + rng.normal(0.0, 0.1 * spread, (800, 6))).astype(
        np.float32
    )
    exact = forecast(far.astype(float), after.astype(float), weight, 1.0, 1e-3)
    found = forecast(far, after, weight, 1.0, 1e-3)
    np.testing.assert_allclose(found.mean, exact.mean, atol=2e-3)
    np.testing.assert_allclose(np.diagonal(found.covariance), np.diagonal(exact.covariance), rtol=0.05)


def test_examples_that_are_all_the_same_answer_what_they_are() -> None:
    for kept in (0.5, 1.0):
        found = forecast(np.ones((5, 3)), np.full((5, 2), 4.0), np.full(5, 0.2), kept, 0.1)
        np.testing.assert_allclose(found.mean, 4.0, atol=1e-9)
        np.testing.assert_allclose(found.covariance, 0.0, atol=1e-12)


def test_weights_are_equation_6_up_to_a_factor(rng: np.random.Generator) -> None:
    squared = np.sort(rng.uniform(3.0, 8.0, 20))
    printed = np.exp(-0.5 * squared / 2.0)
    np.testing.assert_allclose(neighbour_weights(squared, 2.0), printed / printed.sum(), rtol=1e-12)
    far = neighbour_weights(squared + 4000.0, 1.0)  # as printed every weight would be 0
    np.testing.assert_allclose(far.sum(), 1.0)
