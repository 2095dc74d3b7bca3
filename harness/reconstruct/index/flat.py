"""Exact search by comparison with every vector: for small sets, and the reference for all other indexes."""

import numpy as np

from harness.core.arrays import Ints, Singles
from harness.reconstruct.index.protocol import CHUNK, Neighbours, StatelessIndex, Vectors

_ROUNDING = 1e-6
"""Rounding error of the first pass, relative to the largest of its terms."""


class FlatIndex(StatelessIndex):
    """An `Index`: |q - x|^2 = |q|^2 - 2 q x + |x|^2 for all x at once, then exact distances for the few candidates.

    Vectors are stored relative to their mean, which keeps rounding in the first pass small.
    """

    def __init__(self, vectors: Vectors) -> None:
        count = len(vectors)
        self._values = np.empty((count, vectors.size), np.float32)
        for start in range(0, count, CHUNK):
            self._values[start : start + CHUNK] = vectors.gather(slice(start, start + CHUNK))
        self._mean = self._values.mean(axis=0, dtype=np.float64).astype(np.float32)
        self._values -= self._mean
        self._half_squares: Singles = 0.5 * np.vecdot(self._values, self._values)
        self._largest = float(self._half_squares.max(initial=0.0))

    def __len__(self) -> int:
        return len(self._values)

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """See `Lookup`."""
        rows, squared, _ = self.nearest_with_offsets(query, count)
        return rows, squared

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """See `Index`."""
        centred = np.asarray(query, np.float32) - self._mean
        score = self._half_squares - self._values @ centred
        count = min(count, len(score))
        last = np.partition(score, count - 1)[count - 1]
        rounding = _ROUNDING * float(self._largest + centred @ centred)
        rows = np.flatnonzero(score <= last + rounding)
        return rank_neighbours(rows, self._values[rows] - centred, count)


def rank_neighbours(rows: Ints, offsets: Singles, count: int) -> Neighbours:
    """The nearest of candidate rows (M,) with offsets (M, D) from the query, nearest first, then by row."""
    squared = np.vecdot(offsets, offsets)
    order = np.lexsort((rows, squared))[:count]
    return Neighbours(rows[order], squared[order], offsets[order])
