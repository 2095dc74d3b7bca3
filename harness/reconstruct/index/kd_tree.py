"""Exact search in few dimensions: the kd-tree of Kim et al. 2012 (docs/papers.md B3).

Vectors are rotated onto all of their principal axes first, which changes no distance. A tree that splits along the axis
of the widest spread then visits half as many vectors.
"""

import numpy as np
from scipy.spatial import cKDTree

from harness.core.arrays import Floats, Ints, Singles
from harness.core.seeds import generator
from harness.reconstruct.index.flat import rank_neighbours
from harness.reconstruct.index.principal_axes import PrincipalAxes
from harness.reconstruct.index.protocol import CHUNK, Neighbours, StatelessIndex, Vectors

_EXTRA_CANDIDATES = 4
"""Candidates beyond the answer, for rounding may have swapped some near the last place."""


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

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """See `Lookup`."""
        rows, squared, _ = self.nearest_with_offsets(query, count)
        return rows, squared

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """See `Index`."""
        query = np.asarray(query, np.float32)
        count = min(count, len(self))
        _, candidates = self._tree.query(self._principal.project(query), min(count + _EXTRA_CANDIDATES, len(self)))
        rows: Ints = np.asarray(candidates, np.int64).reshape(-1)
        return rank_neighbours(rows, self._vectors.gather(rows) - query, count)
