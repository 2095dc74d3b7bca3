"""The leading principal axes of many vectors: where most of a distance lies, in few numbers."""

from collections.abc import Iterator

import numpy as np

from harness.core.arrays import Floats, Ints, Singles
from harness.reconstruct.index.protocol import CHUNK, Vectors

_SAMPLE = 20_000
_AXES_MULTIPLE = 8
"""Processors are quickest when the number of axes is a multiple of it."""


class PrincipalAxes:
    """Turns vectors about their mean onto orthonormal axes, strongest first; distances never grow."""

    def __init__(self, vectors: Vectors, rng: np.random.Generator, kept: float) -> None:
        """With as many axes as keep this share of a sample's variance (all for 1), filled up to a multiple of 8."""
        count, size = len(vectors), vectors.size
        rows = np.sort(rng.choice(count, min(count, _SAMPLE), replace=False))
        total: Floats = np.zeros(size)
        products: Floats = np.zeros((size, size))
        for some in chunks(rows):
            values: Floats = vectors.gather(some).astype(float)
            total += values.sum(axis=0)
            products += values.T @ values
        middle = total / len(rows)
        variance, axes = np.linalg.eigh(products / len(rows) - np.outer(middle, middle))
        share = np.cumsum(variance[::-1]) / max(float(variance.sum()), 1e-30)
        needed = size if kept >= 1.0 else min(int(np.searchsorted(share, kept)) + 1, size)
        self.width = _AXES_MULTIPLE * -(-needed // _AXES_MULTIPLE)
        """d, the number of axes."""
        self._middle: Singles = middle.astype(np.float32)
        self._axes: Singles = np.zeros((size, self.width), np.float32)
        strongest = axes[:, ::-1][:, : self.width]
        self._axes[:, : strongest.shape[1]] = strongest

    def project(self, vectors: Singles) -> Singles:
        """(..., d) of vectors (..., D)."""
        out: Singles = np.matmul(vectors - self._middle, self._axes, dtype=np.float32)
        return out


def chunks(rows: Ints) -> Iterator[Ints]:
    """The rows, so many at a time that their vectors need little room."""
    for start in range(0, len(rows), CHUNK):
        yield rows[start : start + CHUNK]
