"""Clustering of vectors by k-means: Lloyd's algorithm (1982)."""

import numpy as np

from harness.core.arrays import Ints, Singles

VECTORS_PER_CELL = 39
"""Vectors from which a centroid is computed, on average and at most."""
_ROUNDS, _BLOCK = 6, 256
"""Iterations, and vectors that are compared with all centroids at a time: a megabyte or two of memory."""


def cluster_vectors(vectors: Singles, cells: int, rng: np.random.Generator) -> Ints:
    """(N,) cell of each of N vectors (N, D), for `cells` centroids of k-means; a cell may stay empty."""
    vectors = np.ascontiguousarray(vectors, np.float32)
    return nearest_centroids(vectors, find_centroids(vectors[draw_sample(len(vectors), cells, rng)], cells, rng))


def draw_sample(count: int, cells: int, rng: np.random.Generator) -> Ints:
    """Rows, in order, of the vectors that are enough to find the centroids; all rows where there are few."""
    return np.sort(rng.choice(count, min(count, VECTORS_PER_CELL * cells), replace=False))


def find_centroids(vectors: Singles, cells: int, rng: np.random.Generator) -> Singles:
    """(C, D) centroids of N >= C vectors (N, D); equal vectors give equal centroids.

    They start at C of the vectors, drawn at random. A centroid to which no vector is nearest stays in its place.
    """
    centroids = vectors[rng.choice(len(vectors), cells, replace=False)]
    for _ in range(_ROUNDS):
        cell = nearest_centroids(vectors, centroids)
        ends = np.cumsum(np.bincount(cell, minlength=cells))
        for centroid, members in zip(centroids, np.split(vectors[np.argsort(cell, kind="stable")], ends), strict=False):
            if len(members):
                centroid[:] = members.mean(axis=0)
    return centroids


def nearest_centroids(vectors: Singles, centroids: Singles) -> Ints:
    """(N,) row of the nearest of C centroids (C, D) for each of N vectors (N, D)."""
    doubled, squared = np.ascontiguousarray(-2.0 * centroids.T), np.einsum("ij,ij->i", centroids, centroids)
    distance = np.empty((_BLOCK, len(centroids)), np.float32)
    out = np.empty(len(vectors), np.int64)
    for start in range(0, len(vectors), _BLOCK):
        block = vectors[start : start + _BLOCK]
        part = np.matmul(block, doubled, out=distance[: len(block)])
        part += squared  # the squared distance without the square of the vector, which is the same for all centroids
        part.argmin(axis=1, out=out[start : start + _BLOCK])
    return out
