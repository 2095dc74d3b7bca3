"""Every index finds what looking at every vector finds, the approximate ones nearly always."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.core.arrays import Ints, Singles
from harness.core.seeds import generator
from harness.reconstruct.index import Flat, Index, InvertedFile, Table, Vectors

EXACT: dict[str, Callable[[Vectors], Index]] = {"flat": Flat}
ALL = EXACT | {"inverted_file": InvertedFile}


def paths(count: int, size: int, seed: int = 1) -> Singles:
    """Smooth curves far from the origin, with as little along most axes as poses have."""
    rng = generator(seed, "paths")
    walk = np.cumsum(rng.normal(size=(count, size)), axis=0) * 0.7 ** np.arange(size)
    return (walk + 100.0).astype(np.float32)


def truth(values: Singles, query: Singles, count: int) -> tuple[Ints, Singles]:
    away = values.astype(float) - query
    squared = np.sum(away**2, axis=1)
    order = np.lexsort((np.arange(len(values)), squared))[:count]
    return order, squared[order].astype(np.float32)


@pytest.mark.parametrize("name", EXACT)
def test_an_exact_index_finds_the_nearest(name: str, rng: np.random.Generator) -> None:
    values = paths(3000, 20)
    index = EXACT[name](Table(values))
    for row in rng.integers(0, 3000, 20):
        query = values[row] + rng.normal(0.0, 0.5, 20).astype(np.float32)
        rows, squared = index.nearest(query, 25)
        wanted, distances = truth(values, query, 25)
        np.testing.assert_array_equal(rows, wanted)
        np.testing.assert_allclose(squared, distances, rtol=1e-4)


@pytest.mark.parametrize("name", ALL)
def test_most_of_the_nearest_are_found_in_order(name: str, rng: np.random.Generator) -> None:
    values = paths(20_000, 30)
    index, found, spread = ALL[name](Table(values)), [], float(np.sum(np.var(values, axis=0)))
    for row in rng.integers(0, len(values), 50):
        query = values[row] + rng.normal(0.0, 0.05, 30).astype(np.float32)
        rows, squared = index.nearest(query, 50)
        assert len(rows) == len(set(rows.tolist())) == 50
        assert np.all(np.diff(squared) >= 0.0)
        found.append(len(set(rows.tolist()) & set(truth(values, query, 50)[0].tolist())) / 50)
        np.testing.assert_allclose(squared, np.sum((values[rows] - query) ** 2, axis=1), rtol=0.01, atol=2e-3 * spread)
    assert np.mean(found) >= 0.95


@pytest.mark.parametrize("name", ALL)
def test_of_equals_the_lower_row_comes_first(name: str) -> None:
    values = np.repeat(paths(60, 12), 3, axis=0)
    rows, squared = ALL[name](Table(values)).nearest(values[90], 6)
    assert rows[:3].tolist() == [90, 91, 92]
    np.testing.assert_array_equal(squared[:3], squared[0])


@pytest.mark.parametrize("name", ALL)
def test_a_small_set_is_answered_whole(name: str) -> None:
    values = paths(7, 5)
    rows, squared = ALL[name](Table(values)).nearest(values[3], 20)
    assert sorted(rows.tolist()) == list(range(7))
    assert rows[0] == 3
    assert len(squared) == 7


@pytest.mark.parametrize("name", ALL)
def test_the_same_vectors_give_the_same_answers(name: str) -> None:
    values = paths(5000, 16)
    one, other = (ALL[name](Table(values)) for _ in range(2))
    for query in values[::500] + np.float32(0.01):
        for mine, theirs in zip(one.nearest(query, 30), other.nearest(query, 30), strict=True):
            np.testing.assert_array_equal(mine, theirs)


def test_nothing_is_far_away_in_a_set_that_never_varies() -> None:
    values = np.full((500, 9), 3.0, np.float32)
    for name, make in EXACT.items():
        rows, squared = make(Table(values)).nearest(values[0], 4)
        assert rows.tolist() == [0, 1, 2, 3], name
        np.testing.assert_allclose(squared, 0.0, atol=1e-6)
