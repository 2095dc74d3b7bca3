"""Clusters by k-means: every vector is in the cell of its nearest centroid, and equal seeds give equal cells."""

import numpy as np
import pytest

from harness.core.arrays import Ints, Singles
from harness.core.seeds import generator
from harness.reconstruct.index.decomposition import cluster_vectors, find_centroids, nearest_centroids


def blobs(count: int = 600, size: int = 5) -> tuple[Singles, Ints]:
    """Vectors in three groups, 10 apart with a standard deviation of 1, and their groups."""
    rng = generator(1, "blobs")
    group = rng.integers(0, 3, count)
    return (10.0 * np.eye(3, size)[group] + rng.normal(size=(count, size))).astype(np.float32), group


def test_groups_come_back() -> None:
    vectors, group = blobs()
    cell = cluster_vectors(vectors, 3, generator(1, "cells"))
    assert cell.shape == (600,)
    assert cell.dtype == np.int64
    pairs = set(zip(cell.tolist(), group.tolist(), strict=True))
    assert len(pairs) == 3, "every cell is one group"


def test_nearly_every_vector_is_nearest_to_the_mean_of_its_own_cell() -> None:
    """Centroids are the means of the cells of the round before, so a few vectors at a border may differ."""
    vectors, _ = blobs(2000)
    cell = cluster_vectors(vectors, 12, generator(1, "cells"))
    assert set(cell) == set(range(12))
    means = np.array([vectors[cell == c].mean(axis=0) for c in range(12)])
    nearest = np.linalg.norm(vectors[:, None] - means, axis=2).argmin(axis=1)
    assert (nearest == cell).mean() > 0.9


def test_the_same_seed_gives_the_same_cells() -> None:
    vectors, _ = blobs(2000)
    one, two, other = (cluster_vectors(vectors, 12, generator(seed, "cells")) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, two)
    assert (one != other).any(), "the sample is drawn"


@pytest.mark.parametrize("count", [4, 5, 40])
def test_as_many_cells_as_vectors_leave_each_alone(count: int) -> None:
    vectors, _ = blobs(count)
    assert len(set(cluster_vectors(vectors, count, generator(1, "cells")))) == count


def test_a_centroid_to_which_none_is_nearest_stays() -> None:
    vectors = np.full((30, 4), 3.0, np.float32)
    centroids = find_centroids(vectors, 5, generator(1, "start"))
    np.testing.assert_array_equal(centroids[1:], vectors[1:5])
    np.testing.assert_allclose(centroids[0], vectors[0], rtol=1e-6)


def test_a_block_that_is_not_full_is_assigned_as_well() -> None:
    vectors, _ = blobs(513)
    centroids = vectors[[3, 400, 512]]
    exact = ((vectors[:, None].astype(float) - centroids) ** 2).sum(axis=2).argmin(axis=1)
    np.testing.assert_array_equal(nearest_centroids(vectors, centroids), exact)
