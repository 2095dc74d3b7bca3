"""The leading principal axes of many vectors, along which a few numbers hold most of a distance."""

from collections.abc import Iterator

import numpy as np

from harness.core.arrays import Floats, Ints, Singles
from harness.reconstruct.index.protocol import CHUNK, Vectors

_SAMPLE = 20_000
"""Vectors from which the axes are estimated."""
_AXES_MULTIPLE = 8
"""The number of axes is a multiple of this, for the sake of vector instructions."""


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
