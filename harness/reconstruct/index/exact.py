"""Exact search: a comparison with every vector, a kd-tree, and searches of a partly unknown query.

The flat index is for small sets, and the reference for all others. The kd-tree of Kim et al. 2012 (docs/papers.md B3)
is for few dimensions.

A query is partly unknown with a lost station, a velocity across a gap, or positions only. No index can search some
columns only, and a separate index for every set of lost stations would take seconds to build. So the caller fills the
unknown columns from its last estimate. The index proposes several times as many vectors as are needed, and of those the
nearest in the known columns are returned. The filled values decide which vectors are proposed, never which are chosen.
A column may also have a reduced weight, by the quality of its station. At the start of a session, and after a gap, no
estimate is there to fill in from. Then all vectors are compared.
"""

import numpy as np
from scipy.spatial import cKDTree

from harness.core.arrays import Floats, Ints, Singles
from harness.core.seeds import generator
from harness.reconstruct.index.decomposition import PrincipalAxes
from harness.reconstruct.index.protocol import CHUNK, Lookup, Neighbours, StatelessIndex, Vectors

_ROUNDING = 1e-6
"""Rounding error of the first pass, relative to the largest of its terms."""
_EXTRA_CANDIDATES = 4
"""Candidates beyond the answer, for rounding may have swapped some near the last place."""
CANDIDATE_FACTOR = 8
"""Vectors proposed for each neighbour that is wanted."""


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


class KDTree(StatelessIndex):
    """An exact `Index`. It keeps the source of the vectors, and ranks the candidates by exact distances.

    The tree is that of scipy, in double precision: for large sets an inverted file needs a sixth of its memory.
    """

    def __init__(self, vectors: Vectors) -> None:
        count = len(vectors)
        self._vectors, self._principal = (
            vectors,
            PrincipalAxes(vectors, generator(0, "kd-tree", count), variance_share=1.0),
        )
        projected: Floats = np.empty((count, self._principal.width))
        for start in range(0, count, CHUNK):
            projected[start : start + CHUNK] = self._principal.project(vectors.gather(slice(start, start + CHUNK)))
        self._tree = cKDTree(projected, balanced_tree=False)

    def __len__(self) -> int:
        return len(self._vectors)

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """See `Index`."""
        query = np.asarray(query, np.float32)
        count = min(count, len(self))
        _, candidates = self._tree.query(self._principal.project(query), min(count + _EXTRA_CANDIDATES, len(self)))
        rows: Ints = np.asarray(candidates, np.int64).reshape(-1)
        return rank_neighbours(rows, self._vectors.gather(rows) - query, count)


def nearest_partial(
    index: Lookup, vectors: Vectors, query: Singles, weight: Singles, count: int, wider: int = CANDIDATE_FACTOR
) -> tuple[Ints, Singles]:
    """The `count` nearest vectors by squared differences times `weight` (D,), which is 0 where the query is unknown.

    `query` (D,) has all columns filled; the index proposes `wider` times as many vectors. Returns rows and weighted
    squared distances, as `Lookup.nearest`.
    """
    proposed, _ = index.nearest(query, wider * count)
    offsets = vectors.gather(proposed) - np.asarray(query, np.float32)
    offsets *= np.sqrt(weight, dtype=np.float32)
    squared = np.vecdot(offsets, offsets)
    order = np.lexsort((proposed, squared))[:count]
    return proposed[order], squared[order]


def nearest_exact(vectors: Vectors, query: Singles, weight: Singles, count: int) -> tuple[Ints, Singles]:
    """`nearest_partial` without an index: all vectors are compared in the known columns.

    It takes milliseconds for 66,000 vectors.
    """
    root, squared = np.sqrt(weight, dtype=np.float32), np.empty(len(vectors), np.float32)
    for start in range(0, len(vectors), CHUNK):
        offsets = vectors.gather(slice(start, start + CHUNK)) - np.asarray(query, np.float32)
        offsets *= root
        squared[start : start + CHUNK] = np.vecdot(offsets, offsets)
    order = np.lexsort((np.arange(len(squared)), squared))[:count]
    return order, squared[order]
