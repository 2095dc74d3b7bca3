"""The neighbour graph of Chai and Hodgins 2005 (docs/methods.md C2): search by following the last answer through time.

A query hardly differs from the one a frame ago, so its neighbours are sought among the last ones, the moments after
them, and what is joined to those; now and then, and when too few are left, everything is searched again. Joined are
moments whose vectors differ, per number, by no more than a step from one frame to the next can be, or 3 deg; of those
the nearest few are kept, found by another index, never by the order of frames.
"""

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Bools, Ints, Singles
from harness.core.seeds import generator
from harness.reconstruct.index.principal_axes import PrincipalAxes
from harness.reconstruct.index.protocol import CHUNK, Index, Vectors

Links = NDArray[np.int32]
LINKS_PER_VECTOR, FULL_SEARCH_PERIOD, LINK_DISTANCE = 8, 10, float(np.deg2rad(3.0))
"""Moments that each is joined to; frames from one full search to the next; C2's epsilon [rad, m]."""
_TEMPORAL_EXCLUSION = 4
"""Moments so near in time are reached by following, not by links."""
_VARIANCE_SHARE = 0.9995


class NeighbourGraph:
    """Immutable; `follow` begins a search that remembers its last answer."""

    def __init__(self, vectors: Vectors, follows: Bools, index: Index) -> None:
        """`follows` (N,): whether the next row is the moment after this one; `index` makes links and full searches."""
        count = len(vectors)
        self.index, self.follows = index, follows
        self._principal = PrincipalAxes(vectors, generator(0, "graph", count), _VARIANCE_SHARE)
        self._seen = np.empty((count, self._principal.width), np.float16)
        step = 0.0
        for start in range(0, count, CHUNK):
            values = vectors.gather(slice(start, start + CHUNK))
            self._seen[start : start + CHUNK] = self._principal.project(values)
            steps = np.abs(np.diff(values, axis=0)).mean(axis=1)[follows[start : start + len(values) - 1]]
            step = max(step, float(steps.max(initial=0.0)))
        self.links: Links = self._joined(vectors, max(step, LINK_DISTANCE))
        """(N, 8) rows that each is joined to, or itself where there are fewer."""

    def _joined(self, vectors: Vectors, reach: float) -> Links:
        links = np.repeat(np.arange(len(vectors), dtype=np.int32)[:, None], LINKS_PER_VECTOR, axis=1)
        for row in range(len(vectors)):
            here = vectors.gather(np.array([row]))[0]
            near, _ = self.index.nearest(here, LINKS_PER_VECTOR + 2 * _TEMPORAL_EXCLUSION + 1)
            near = near[np.abs(near - row) > _TEMPORAL_EXCLUSION][:LINKS_PER_VECTOR]
            near = near[np.abs(vectors.gather(near) - here).mean(axis=1) <= reach]
            links[row, : len(near)] = near
        return links

    def begin_search(self) -> "GraphSearch":
        return GraphSearch(self)

    def among(self, rows: Ints, query: Singles, count: int) -> tuple[Ints, Singles]:
        """The nearest of some rows, in the leading principal axes."""
        away = self._seen[rows].astype(np.float32)
        away -= self._principal.project(np.asarray(query, np.float32))
        squared = np.vecdot(away, away)
        if len(rows) > count:
            some = np.argpartition(squared, count - 1)[:count]
            rows, squared = rows[some], squared[some]
        order = np.lexsort((rows, squared))
        return rows[order], squared[order]


class GraphSearch:
    """One session's search: a `Lookup` whose answers depend on the queries before."""

    def __init__(self, graph: NeighbourGraph) -> None:
        self._graph, self._rows, self._age = graph, np.zeros(0, np.int64), FULL_SEARCH_PERIOD

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """As `Index`; most of the nearest, as long as queries follow each other."""
        graph, self._age = self._graph, self._age + 1
        if self._age < FULL_SEARCH_PERIOD:
            ahead = self._rows + graph.follows[self._rows]
            near = np.unique(np.concatenate([self._rows, ahead, graph.links[ahead].reshape(-1)]))
            if len(near) >= count:
                rows, squared = graph.among(near, query, count)
                self._rows = rows
                return rows, squared
        self._age = 0
        self._rows, squared = graph.index.nearest(query, count)
        return self._rows, squared
