"""The neighbour graph of Chai and Hodgins 2005 (docs/papers.md C2): a search that follows its last answer in time.

A query hardly differs from that of the frame before. So candidates are the last neighbours, their successors in time,
and the vectors that are linked to those. Every few frames, or when candidates are too few, all vectors are searched
again. Two vectors may be linked when their mean absolute difference does not exceed 3 deg, or the largest difference of
consecutive frames. Each is linked to the nearest few of these, which another index finds.
"""

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Ints, Singles
from harness.core.seeds import generator
from harness.reconstruct.index.decomposition import PrincipalAxes
from harness.reconstruct.index.protocol import CHUNK, Index, Neighbours, Vectors

Links = NDArray[np.int32]
LINKS_PER_VECTOR, FULL_SEARCH_PERIOD, LINK_DISTANCE = 8, 10, float(np.deg2rad(3.0))
"""Links of each vector; frames from one full search to the next; C2's epsilon [rad, m]."""
_TEMPORAL_EXCLUSION = 4
"""Vectors this near in time are not linked: following the answer through time reaches them."""
_VARIANCE_SHARE = 0.9995
"""Share of the variance that the axes for ranking hold."""


class NeighbourGraph:
    """An `Index`: the links between vectors. `begin_search` starts a search that follows its answers in time.

    Without a session, every search is a full one.
    """

    def __init__(self, vectors: Vectors, index: Index) -> None:
        """`index` finds links and makes full searches."""
        count, consecutive = len(vectors), vectors.consecutive
        self.vectors, self.index, self.consecutive = vectors, index, consecutive
        self._principal = PrincipalAxes(vectors, generator(0, "graph", count), _VARIANCE_SHARE)
        self._projected = np.empty((count, self._principal.width), np.float16)
        step = 0.0
        for start in range(0, count, CHUNK):
            values = vectors.gather(slice(start, start + CHUNK))
            self._projected[start : start + CHUNK] = self._principal.project(values)
            steps = np.abs(np.diff(values, axis=0)).mean(axis=1)[consecutive[start : start + len(values) - 1]]
            step = max(step, float(steps.max(initial=0.0)))
        self.links: Links = self._link(vectors, max(step, LINK_DISTANCE))
        """(N, 8) the rows that each is linked to, filled up with the row itself."""

    def __len__(self) -> int:
        return len(self._projected)

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """See `Lookup`."""
        return self.index.nearest(query, count)

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """See `Index`."""
        return self.begin_search().nearest_with_offsets(query, count)

    def _link(self, vectors: Vectors, max_difference: float) -> Links:
        links = np.repeat(np.arange(len(vectors), dtype=np.int32)[:, None], LINKS_PER_VECTOR, axis=1)
        for row in range(len(vectors)):
            vector = vectors.gather(np.array([row]))[0]
            near, _ = self.index.nearest(vector, LINKS_PER_VECTOR + 2 * _TEMPORAL_EXCLUSION + 1)
            near = near[np.abs(near - row) > _TEMPORAL_EXCLUSION][:LINKS_PER_VECTOR]
            near = near[np.abs(vectors.gather(near) - vector).mean(axis=1) <= max_difference]
            links[row, : len(near)] = near
        return links

    def begin_search(self) -> "GraphSearch":
        """A search for one session."""
        return GraphSearch(self)

    def nearest_of(self, rows: Ints, query: Singles, count: int) -> tuple[Ints, Singles]:
        """The nearest of these rows, by distance along the leading principal axes."""
        offsets = self._projected[rows].astype(np.float32)
        offsets -= self._principal.project(np.asarray(query, np.float32))
        squared = np.vecdot(offsets, offsets)
        if len(rows) > count:
            best = np.argpartition(squared, count - 1)[:count]
            rows, squared = rows[best], squared[best]
        order = np.lexsort((rows, squared))
        return rows[order], squared[order]


class GraphSearch:
    """The search of one session: an `Index` whose answers depend on earlier queries."""

    def __init__(self, graph: NeighbourGraph) -> None:
        self._graph, self._rows, self._age = graph, np.zeros(0, np.int64), FULL_SEARCH_PERIOD

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """See `Lookup`; finds most of the nearest, as long as queries change little from one to the next."""
        graph, self._age = self._graph, self._age + 1
        if self._age < FULL_SEARCH_PERIOD:
            ahead = self._rows + graph.consecutive[self._rows]
            near = np.unique(np.concatenate([self._rows, ahead, graph.links[ahead].reshape(-1)]))
            if len(near) >= count:
                rows, squared = graph.nearest_of(near, query, count)
                self._rows = rows
                return rows, squared
        self._age = 0
        self._rows, squared = graph.index.nearest(query, count)
        return self._rows, squared

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """See `Index`."""
        rows, squared = self.nearest(query, count)
        return Neighbours(rows, squared, self._graph.vectors.gather(rows) - np.asarray(query, np.float32))

    def begin_search(self) -> "GraphSearch":
        """A search for another session."""
        return self._graph.begin_search()
