"""Nearest neighbours of a partly unknown query: a lost station, a velocity across a gap, positions only.

No index can search some columns only, and a separate index for every set of lost stations would take seconds to build.
So the caller fills the unknown columns from its last estimate. The index proposes several times as many vectors as are
needed, and of those the nearest in the known columns are returned. The filled values decide which vectors are proposed,
never which are chosen. A column may also have a reduced weight, by the quality of its station.

At the start of a session, and after a gap, there is no estimate to fill in from. Then all vectors are compared.
"""

import numpy as np

from harness.core.arrays import Ints, Singles
from harness.reconstruct.index.protocol import CHUNK, Lookup, Vectors

CANDIDATE_FACTOR = 8
"""Vectors proposed for each neighbour that is wanted."""


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
