"""Search when part of the query is not known: a silent station, a velocity across a gap, positions only.

No index can be asked for some columns only, and one for every set of silent stations would cost seconds as each falls
silent. So the caller fills the unknown columns with what its last estimate says; the index proposes several times as
many vectors as are asked for; and of those the nearest in the known columns are answered. What was filled in decides
who is proposed, never who is chosen. Columns may also weigh less, by the quality of their station.
"""

import numpy as np

from harness.core.arrays import Ints, Singles
from harness.reconstruct.index.protocol import Index, Vectors

CANDIDATE_FACTOR = 8
"""Vectors proposed for each that is asked for."""


def nearest_partial(
    index: Index, vectors: Vectors, query: Singles, weight: Singles, count: int, wider: int = CANDIDATE_FACTOR
) -> tuple[Ints, Singles]:
    """Of the vectors proposed for a filled query (D,), the nearest with squares times `weight` (D,), 0 where unknown.

    Returns as `Index.nearest` does, the squared distances weighted.
    """
    proposed, _ = index.nearest(query, wider * count)
    away = vectors.gather(proposed) - np.asarray(query, np.float32)
    away *= np.sqrt(weight, dtype=np.float32)
    squared = np.vecdot(away, away)
    order = np.lexsort((proposed, squared))[:count]
    return proposed[order], squared[order]
