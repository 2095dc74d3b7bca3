"""What an index knows of many vectors: their leading principal axes, and cells of k-means (Lloyd 1982).

Along the leading axes a few numbers hold most of a distance.
"""

from collections.abc import Iterator

import numpy as np

from harness.core.arrays import Floats, Ints, Singles
from harness.reconstruct.index.protocol import CHUNK, Vectors

_SAMPLE = 20_000
"""Vectors from which the axes are estimated."""
_AXES_MULTIPLE = 8
"""The number of axes is a multiple of this, for the sake of vector instructions."""
VECTORS_PER_CELL = 39
"""Vectors from which a centroid is computed, on average and at most."""
_ROUNDS, _BLOCK = 6, 256
"""Iterations, and vectors that are compared with all centroids at a time: a megabyte or two of memory."""


class PrincipalAxes:
    """Projection of vectors, relative to their mean, onto orthonormal axes, strongest first; distances never grow."""

    def __init__(self, vectors: Vectors, rng: np.random.Generator, variance_share: float) -> None:
        """As many axes as hold this share of a sample's variance (all for 1), rounded up to a multiple of 8."""
        count, size = len(vectors), vectors.size
        rows = np.sort(rng.choice(count, min(count, _SAMPLE), replace=False))
        total: Floats = np.zeros(size)
        products: Floats = np.zeros((size, size))
        for some in chunks(rows):
            values: Floats = vectors.gather(some).astype(float)
            total += values.sum(axis=0)
            products += values.T @ values
        mean = total / len(rows)
        variance, axes = np.linalg.eigh(products / len(rows) - np.outer(mean, mean))
        share = np.cumsum(variance[::-1]) / max(float(variance.sum()), 1e-30)
        needed = size if variance_share >= 1.0 else min(int(np.searchsorted(share, variance_share)) + 1, size)
        self.width = _AXES_MULTIPLE * -(-needed // _AXES_MULTIPLE)
        """d, the number of axes."""
        self._mean: Singles = mean.astype(np.float32)
        self._axes: Singles = np.zeros((size, self.width), np.float32)
        strongest = axes[:, ::-1][:, : self.width]
        self._axes[:, : strongest.shape[1]] = strongest

    def project(self, vectors: Singles) -> Singles:
        """Coordinates (..., d) of vectors (..., D) along the axes."""
        out: Singles = np.matmul(vectors - self._mean, self._axes, dtype=np.float32)
        return out


def chunks(rows: Ints) -> Iterator[Ints]:
    """The rows in pieces of `CHUNK`, so that their vectors need little memory."""
    for start in range(0, len(rows), CHUNK):
        yield rows[start : start + CHUNK]


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
