"""Exact search by looking at every vector: for small sets, and the judge of all others."""

import numpy as np

from harness.core.arrays import Ints, Singles
from harness.reconstruct.index.protocol import CHUNK, Neighbours, Vectors

_ROUNDING = 1e-6
"""Of the first pass, beside the largest of its terms."""


class FlatIndex:
    """An `Index`: |q - x|^2 = |q|^2 - 2 q x + |x|^2 for all x at once, then exactly for the few that are left.

    Vectors are kept about their mean, so that little is lost to rounding in the first pass.
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
        """As `Index`."""
        rows, squared, _ = self.nearest_with_offsets(query, count)
        return rows, squared

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """As `Index`."""
        asked = np.asarray(query, np.float32) - self._mean
        score = self._half_squares - self._values @ asked
        count = min(count, len(score))
        last = np.partition(score, count - 1)[count - 1]
        rounding = _ROUNDING * float(self._largest + asked @ asked)
        rows = np.flatnonzero(score <= last + rounding)
        return rank_neighbours(rows, self._values[rows] - asked, count)


def rank_neighbours(rows: Ints, away: Singles, count: int) -> Neighbours:
    """The nearest of candidates (M,) whose differences from the query are (M, D), nearest first."""
    squared = np.vecdot(away, away)
    order = np.lexsort((rows, squared))[:count]
    return Neighbours(rows[order], squared[order], away[order])
