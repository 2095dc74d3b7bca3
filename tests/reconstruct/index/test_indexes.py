"""Every index finds what looking at every vector finds, the approximate ones nearly always."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.core.arrays import Ints, Singles
from harness.core.seeds import generator
from harness.core.workers import run_in_workers
from harness.errors import UnknownName
from harness.reconstruct.index.exact import FlatIndex, KDTree, nearest_partial
from harness.reconstruct.index.inverted_file import InvertedFile
from harness.reconstruct.index.neighbour_graph import NeighbourGraph
from harness.reconstruct.index.protocol import ArrayVectors, Index, Vectors
from harness.reconstruct.index.selection import make_index

EXACT: dict[str, Callable[[Vectors], Index]] = {"flat": FlatIndex, "kd_tree": KDTree}
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
    index = EXACT[name](ArrayVectors(values))
    for row in rng.integers(0, 3000, 20):
        query = values[row] + rng.normal(0.0, 0.5, 20).astype(np.float32)
        rows, squared = index.nearest(query, 25)
        wanted, distances = truth(values, query, 25)
        np.testing.assert_array_equal(rows, wanted)
        np.testing.assert_allclose(squared, distances, rtol=1e-4)


@pytest.mark.parametrize("name", ALL)
def test_most_of_the_nearest_are_found_in_order(name: str, rng: np.random.Generator) -> None:
    values = paths(8000, 30)
    index, found, spread = ALL[name](ArrayVectors(values)), [], float(np.sum(np.var(values, axis=0)))
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
    rows, squared = ALL[name](ArrayVectors(values)).nearest(values[90], 6)
    assert rows[:3].tolist() == [90, 91, 92]
    np.testing.assert_array_equal(squared[:3], squared[0])


@pytest.mark.parametrize("name", ALL)
def test_a_small_set_is_answered_whole(name: str) -> None:
    values = paths(7, 5)
    rows, squared = ALL[name](ArrayVectors(values)).nearest(values[3], 20)
    assert sorted(rows.tolist()) == list(range(7))
    assert rows[0] == 3
    assert len(squared) == 7


@pytest.mark.parametrize("name", ALL)
def test_the_same_vectors_give_the_same_answers(name: str) -> None:
    values = paths(5000, 16)
    one, other = (ALL[name](ArrayVectors(values)) for _ in range(2))
    for query in values[::500] + np.float32(0.01):
        for mine, theirs in zip(one.nearest(query, 30), other.nearest(query, 30), strict=True):
            np.testing.assert_array_equal(mine, theirs)


def answers(index: Index, queries: Singles) -> list[tuple[Ints, Singles]]:
    return [index.nearest(query, 300) for query in queries]


def test_indexes_travel_to_another_process() -> None:
    values = paths(1000, 16)
    tasks = [(make(ArrayVectors(values)), values[::250] + np.float32(0.01)) for make in ALL.values()]
    for which, done in run_in_workers(answers, tasks, 1):
        for here, there in zip(answers(*tasks[which]), done.result(), strict=True):
            for mine, theirs in zip(here, there, strict=True):
                np.testing.assert_array_equal(mine, theirs)


def test_nothing_is_far_away_in_a_set_that_never_varies() -> None:
    values = np.full((500, 9), 3.0, np.float32)
    rows, _ = FlatIndex(ArrayVectors(values)).nearest(values[0], 4)
    assert rows.tolist() == [0, 1, 2, 3]
    for make in ALL.values():
        np.testing.assert_allclose(make(ArrayVectors(values)).nearest(values[0], 4)[1], 0.0, atol=1e-6)


def test_odd_queries_are_answered_or_refused() -> None:
    same = InvertedFile(ArrayVectors(np.full((4000, 12), 3.0, np.float32)))
    rows, squared = same.nearest(np.full(12, 3.001, np.float32), 8)
    assert len(set(rows.tolist())) == 8
    assert np.all(np.isfinite(squared))
    index = InvertedFile(ArrayVectors(paths(4000, 12)))
    rows, squared = index.nearest(np.full(12, 1e20, np.float32), 8)
    assert len(set(rows.tolist())) == 8
    assert np.all(np.isfinite(squared))
    with pytest.raises(ArithmeticError, match="not a number"):
        index.nearest(np.full(12, np.nan, np.float32), 8)


def test_unknown_columns_decide_nothing(rng: np.random.Generator) -> None:
    values = paths(3000, 12)
    table, known = ArrayVectors(values), np.array([1.0] * 8 + [0.0] * 4, np.float32)
    for row in (10, 1500, 2990):
        query = values[row] + rng.normal(0.0, 0.1, 12).astype(np.float32)
        query[8:] += rng.normal(0.0, 0.5, 4).astype(np.float32)
        rows, squared = nearest_partial(FlatIndex(table), table, query, known, 10)
        wanted, distances = truth(values[:, :8], query[:8], 10)
        assert len(set(rows.tolist()) & set(wanted.tolist())) >= 8
        assert rows[0] == wanted[0]
        np.testing.assert_allclose(squared[0], distances[0], rtol=1e-4)
        np.testing.assert_allclose(squared, np.sum((values[rows, :8] - query[:8]) ** 2, axis=1), rtol=1e-5)


def test_weighing_every_column_alike_is_plain_search() -> None:
    values = paths(2000, 12)
    index, table = FlatIndex(ArrayVectors(values)), ArrayVectors(values)
    query = values[700] + np.float32(0.02)
    weighed = nearest_partial(index, table, query, np.ones(12, np.float32), 9)
    np.testing.assert_array_equal(weighed[0], index.nearest(query, 9)[0])


def test_the_index_is_chosen_by_size_or_by_name() -> None:
    assert isinstance(make_index("auto", ArrayVectors(paths(500, 107))), FlatIndex)
    assert isinstance(make_index("auto", ArrayVectors(paths(4000, 12))), KDTree)
    assert isinstance(make_index("auto", ArrayVectors(paths(4000, 107))), InvertedFile)
    assert isinstance(make_index("auto", ArrayVectors(paths(4000, 60)), 800), InvertedFile)
    assert isinstance(make_index("flat", ArrayVectors(paths(4000, 107))), FlatIndex)
    assert isinstance(make_index("graph", ArrayVectors(paths(500, 12))), NeighbourGraph)
    with pytest.raises(UnknownName, match="Did you mean 'kd_tree'"):
        make_index("kdtree", ArrayVectors(paths(10, 3)))


def test_a_graph_follows_and_asks_for_everything_when_it_must() -> None:
    values = paths(3000, 12)
    graph = NeighbourGraph(ArrayVectors(values), FlatIndex(ArrayVectors(values)))
    assert graph.links.min() >= 0
    assert graph.links.max() < 3000
    session, found = graph.begin_search(), []
    for row in range(1200, 1300):
        rows, squared = session.nearest(values[row] + np.float32(0.01), 20)
        assert np.all(np.diff(squared) >= 0.0)
        found.append(len(set(rows.tolist()) & set(truth(values, values[row], 20)[0].tolist())) / 20)
    assert np.mean(found) > 0.8
    rows, _ = graph.begin_search().nearest(values[2500], 20)  # a new session knows nothing of the last one
    assert rows[0] == 2500
    fresh, again = graph.begin_search(), graph.begin_search()
    for row in (5, 6, 7):
        np.testing.assert_array_equal(fresh.nearest(values[row], 9)[0], again.nearest(values[row], 9)[0])


@pytest.mark.parametrize("name", [*ALL, "graph"])
def test_offsets_are_the_vectors_minus_the_query(name: str) -> None:
    """Along other axes perhaps: inner products of any two are the same."""
    values = paths(4000, 12)
    index = make_index(name, ArrayVectors(values), 60)
    query = values[700] + np.float32(0.3)
    rows, squared, offsets = index.nearest_with_offsets(query, 60)
    np.testing.assert_array_equal(rows, index.nearest(query, 60)[0])
    expected, spread = values[rows].astype(float) - query, float(np.sum(np.var(values, axis=0)))
    np.testing.assert_allclose(offsets @ offsets.T, expected @ expected.T, rtol=0.01, atol=2e-3 * spread)
    np.testing.assert_allclose(squared, np.vecdot(offsets, offsets), rtol=1e-3, atol=1e-6 * spread)


def test_a_search_widens_until_it_has_enough(rng: np.random.Generator) -> None:
    values = paths(4000, 12)
    index = InvertedFile(ArrayVectors(values), 10)
    rows, squared = index.nearest(values[100], 3500)
    assert len(set(rows.tolist())) == 3500
    assert rows[0] == 100
    assert np.all(np.diff(squared) >= 0.0)
