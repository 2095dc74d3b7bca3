"""Tabulated moments against weighted moments of the examples, and the conditional Gaussian against numpy."""

from itertools import pairwise

import numpy as np
import pytest

from harness.core.arrays import Floats, Ints, Singles
from harness.core.seeds import generator
from harness.reconstruct.features import moment_table
from harness.reconstruct.features.moment_table import LocalGaussian, condition, local_gaussian, tabulate_moments
from harness.reconstruct.index.decomposition import cluster_vectors

F, Y = 4, 3
SLOPE: Floats = np.array([[1.0, -0.5, 0.2], [0.3, 0.8, 0.0], [0.0, 0.4, -1.0], [0.6, 0.0, 0.5]])
"""(F, Y) targets of the planted system per feature."""
RESIDUAL: Floats = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, -0.02], [0.0, -0.02, 0.06]])
"""(Y, Y) covariance of the planted residuals."""


def examples(count: int, seed: int = 1) -> tuple[Singles, Singles]:
    """Features (N, F) and targets (N, Y) of a linear system with Gaussian residuals."""
    rng = generator(seed, "examples")
    features = rng.normal(size=(count, F)) * [2.0, 1.0, 0.7, 0.4] + [1.0, -3.0, 0.5, 2.0]
    targets = features @ SLOPE + [0.5, 0.0, -1.0] + rng.multivariate_normal(np.zeros(Y), RESIDUAL, count)
    return features.astype(np.float32), targets.astype(np.float32)


def symmetric(lower: Floats) -> Floats:
    out: Floats = np.tril(lower) + np.tril(lower, -1).T
    return out


def weighted_moments(pairs: Floats, weight: Floats) -> tuple[Floats, Floats]:
    share = weight / weight.sum()
    mean = share @ pairs
    return mean, ((pairs - mean) * share[:, None]).T @ (pairs - mean)


def by_definition(
    features: Singles, targets: Singles, cell: Ints, query: Floats, neighbours: int, width: float
) -> tuple[Floats, Floats]:
    """Mean and covariance from the examples themselves, whose weights are those of their cells."""
    pairs = np.concatenate([features, targets], axis=1, dtype=float)
    names = np.unique(cell)
    away = np.sum((pairs[:, :F] - query) ** 2, axis=1)
    distance = np.array([away[cell == c].mean() for c in names])
    order = np.argsort(distance, kind="stable")
    held = np.cumsum([(cell == c).sum() for c in names[order]])
    used = order[: 1 + int(np.argmax(held >= neighbours))] if held[-1] >= neighbours else order
    half = distance[order[np.argmax(held >= neighbours / 2)]] if held[-1] >= neighbours / 2 else distance[used[-1]]
    weight = np.zeros(len(pairs))
    for k in used:
        weight[cell == names[k]] = np.exp(-(distance[k] - distance.min()) / (2.0 * width * half))
    return weighted_moments(pairs, weight)


def agrees(local: LocalGaussian, wanted: tuple[Floats, Floats]) -> None:
    np.testing.assert_allclose(local.mean, wanted[0], atol=1e-5)
    np.testing.assert_allclose(symmetric(local.covariance), wanted[1], atol=2e-5)


def test_one_cell_holds_the_moments_of_all_examples() -> None:
    features, targets = examples(50)
    table, query = tabulate_moments(features, targets), np.array([0.0, -2.0, 1.0, 2.0])
    assert len(table.examples) == 1
    assert table.features == F
    agrees(local_gaussian(table, query, 10, 1.0), by_definition(features, targets, np.zeros(50, int), query, 10, 1.0))


@pytest.mark.parametrize("neighbours", [2, 9, 40, 100])
@pytest.mark.parametrize("width", [0.1, 1.0])
def test_cells_of_one_example_give_the_weighted_moments_of_the_nearest(
    neighbours: int, width: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(moment_table, "EXAMPLES_PER_CELL", 1)
    features, targets = examples(100)
    table, query = tabulate_moments(features, targets), np.array([0.5, -2.0, 1.0, 2.0])
    assert len(table.examples) == 100
    assert not table.scatter.any()
    agrees(
        local_gaussian(table, query, neighbours, width),
        by_definition(features, targets, np.arange(100), query, neighbours, width),
    )


@pytest.mark.parametrize("neighbours", [60, 450, 1000, 5000])
@pytest.mark.parametrize("away", [0.0, 3.0, 200.0])
def test_cells_of_several_examples_give_each_its_cells_weight(neighbours: int, away: float) -> None:
    """Also for queries far from all examples, and for fewer examples than neighbours."""
    features, targets = examples(1000)
    cell = cluster_vectors(features, 20, generator(0, "moment table", 1000))
    table, query = tabulate_moments(features, targets), features[17] + away
    assert table.examples.sum() == 1000
    assert 15 <= len(table.examples) <= 20
    wanted = by_definition(features, targets, cell, query, neighbours, 0.3)
    found = local_gaussian(table, query.astype(float), neighbours, 0.3)
    np.testing.assert_allclose(found.mean, wanted[0], atol=1e-4)
    np.testing.assert_allclose(symmetric(found.covariance), wanted[1], atol=1e-3)


def test_the_number_of_cells_follows_the_number_of_examples_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(moment_table, "MAX_CELLS", 6)
    assert [len(tabulate_moments(*examples(count)).examples) for count in (1, 50, 51, 300, 900)] == [1, 1, 2, 6, 6]


def test_cells_that_stay_empty_are_left_out() -> None:
    features, targets = (np.repeat(values, 100, axis=0) for values in examples(2))
    table = tabulate_moments(features, targets)
    assert table.examples.sum() == 200
    assert table.examples.min() >= 1
    local = local_gaussian(table, features[0].astype(float), 1, 1.0)
    assert np.isfinite(local.mean).all()
    np.testing.assert_allclose(local.mean[F:], targets[0], atol=1e-5)


def test_the_same_examples_give_the_same_table_and_stay_as_they_are() -> None:
    features, targets = examples(400)
    before = features.tobytes(), targets.tobytes()
    one, two = tabulate_moments(features, targets), tabulate_moments(features, targets)
    for a, b in zip(one[1:], two[1:], strict=True):
        assert np.asarray(a).tobytes() == np.asarray(b).tobytes()
    assert (features.tobytes(), targets.tobytes()) == before


def test_a_query_leaves_the_table_as_it_is() -> None:
    table, query = tabulate_moments(*examples(400)), np.zeros(F)
    one, two = local_gaussian(table, query, 100, 0.3), local_gaussian(table, query, 100, 0.3)
    np.testing.assert_array_equal(np.tril(one.covariance), np.tril(two.covariance))
    assert one.mean.tobytes() == two.mean.tobytes()


def test_a_linear_gaussian_system_comes_back() -> None:
    features, targets = examples(20_000)
    query = np.array([2.0, -2.5, 0.0, 2.2])
    local = local_gaussian(tabulate_moments(features, targets), query, 4000, 1.0)
    mean, covariance = condition(local, query, np.zeros((F, F)), 0.0)
    np.testing.assert_allclose(mean, query @ SLOPE + [0.5, 0.0, -1.0], atol=0.03)
    np.testing.assert_allclose(covariance, RESIDUAL, atol=0.012)


def planted(rng: np.random.Generator, features: int = 6, targets: int = 5) -> tuple[LocalGaussian, Floats, Floats]:
    """A local Gaussian whose upper triangle is undefined, a query, and the covariance of its error."""
    size = features + targets
    root, noise_root = rng.normal(size=(size, 2 * size)), rng.normal(size=(features, features))
    covariance = root @ root.T / size
    local = LocalGaussian(rng.normal(size=size), np.where(np.tri(size) > 0.0, covariance, np.nan))
    return local, rng.normal(size=features), 0.3 * noise_root @ noise_root.T


@pytest.mark.parametrize("ridge", [0.0, 0.02])
@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("shape", [(1, 1), (6, 5), (3, 8)])
def test_conditioning_is_the_textbook_formula(
    shape: tuple[int, int], noisy: bool, ridge: float, rng: np.random.Generator
) -> None:
    local, query, noise = planted(rng, *shape)
    noise, count, whole = noise * noisy, shape[0], symmetric(local.covariance)
    of_features = whole[:count, :count] + noise + ridge * np.trace(whole[:count, :count]) * np.eye(count)
    gain = np.linalg.solve(of_features, whole[:count, count:]).T
    mean, covariance = condition(local, query, noise, ridge)
    np.testing.assert_allclose(mean, local.mean[count:] + gain @ (query - local.mean[:count]), atol=1e-6)
    np.testing.assert_allclose(covariance, whole[count:, count:] - gain @ whole[:count, count:], atol=1e-6)


def test_noise_shrinks_the_regression_towards_the_mean(rng: np.random.Generator) -> None:
    local, query, noise = planted(rng)
    whole, means, covariances = symmetric(local.covariance), [], []
    for factor in (0.0, 1.0, 1e9):
        mean, covariance = condition(local, query, factor * noise + 1e-9 * factor * np.eye(6), 0.0)
        means.append(mean - local.mean[6:])
        covariances.append(covariance)
    np.testing.assert_allclose(means[2], 0.0, atol=1e-6)
    np.testing.assert_allclose(covariances[2], whole[6:, 6:], atol=1e-6)
    for less, more in pairwise(covariances):
        assert np.linalg.eigvalsh(more - less).min() > -1e-9


def test_features_without_variance_condition_nothing() -> None:
    """As with a single example: the mean and the covariance of the targets are what they were."""
    local = LocalGaussian(np.arange(5.0), np.diag([0.0, 0.0, 1.0, 2.0, 3.0]))
    mean, covariance = condition(local, np.array([5.0, -5.0]), np.zeros((2, 2)), 0.1)
    np.testing.assert_allclose(mean, [2.0, 3.0, 4.0])
    np.testing.assert_allclose(covariance, np.diag([1.0, 2.0, 3.0]))
