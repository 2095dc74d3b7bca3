"""Approximate search for large sets: an inverted file over the leading principal axes, in 16 bits.

Vectors fall into cells around centroids, which faiss finds; a query looks only into the cells nearest to it. What a
query costs is the memory that it reads, and human poses hardly vary along most axes, so vectors are first rotated onto
their principal axes, cut off where next to nothing is left, and kept as whole multiples of one small step: a third of
the memory. Unlike a graph of neighbours an inverted file does not care in which order frames were added
(docs/methods.md E, traps). Cells are looked into by a loop of our own: faiss keeps a heap of the best, which for
hundreds of neighbours takes longer than all distances (`harness bench index` has both).
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Ints, Singles
from harness.core.compiled import compiled
from harness.core.seeds import generator
from harness.reconstruct.index.principal import Principal, chunks
from harness.reconstruct.index.protocol import CHUNK, Found, Vectors

Codes = NDArray[np.int16]
Places = NDArray[np.int32]
PROBES = 10
"""Cells looked into: a recall of 0.97 and more at 66,000 and at 1,000,000 frames (`harness bench index`)."""
KEPT = 0.9995
"""Share of the variance that the axes keep."""
_ENOUGH = 3.0
"""Vectors looked into for each neighbour that is wanted, at least: a recall of 0.98 for 800 of 66,000."""
_PER_CELL, _ROUNDS = 39, 6
"""Of the clustering: vectors that each centroid is found from, and rounds."""
_FEW = 32
"""Neighbours that are picked out one by one; more are parted from the rest at once."""
_MOST = 32_000
"""Steps to the farthest number from the middle."""


class InvertedFile:
    """An `Index`; squared distances are those along the axes that were kept, in whole steps."""

    def __init__(self, vectors: Vectors, probes: int = PROBES) -> None:
        count = len(vectors)
        rng = generator(0, "inverted file", count)
        self._principal = Principal(vectors, rng, KEPT)
        width, cells = self._principal.width, cells_for(count)
        sample = np.sort(rng.choice(count, min(count, _PER_CELL * cells), replace=False))
        seen = np.empty((len(sample), width), np.float32)
        for rows in chunks(np.arange(len(sample))):
            seen[rows] = self._principal.seen(vectors.gather(sample[rows]))
        with _faiss() as faiss:
            flat = faiss.IndexFlatL2(width)
            clustering = faiss.Clustering(width, cells)
            clustering.seed, clustering.niter = 1, _ROUNDS
            clustering.min_points_per_centroid, clustering.max_points_per_centroid = 1, _PER_CELL
            clustering.train(seen, flat)
            cell_of = np.empty(count, np.int32)
            farthest = 0.0
            for start in range(0, count, CHUNK):
                seen = self._principal.seen(vectors.gather(slice(start, start + CHUNK)))
                cell_of[start : start + CHUNK] = flat.search(seen, 1)[1][:, 0]
                farthest = max(farthest, float(np.abs(seen).max()))
            centroids = flat.reconstruct_n(0, cells)
        self._probes = min(probes, cells)
        self._rows: Places = np.argsort(cell_of, kind="stable").astype(np.int32)
        """(N,) cell after cell."""
        self._starts: Ints = np.searchsorted(cell_of[self._rows], np.arange(cells + 1))
        """(C + 1,) where each cell begins among them."""
        self._step = np.float32(max(farthest, 1e-30) / _MOST)
        self._centroids: Singles = np.ascontiguousarray(centroids.T / self._step)
        """(d, C) in steps."""
        self._codes: Codes = np.empty(count * width, np.int16)
        """(N d,) cell after cell (d, n): one number of all vectors of a cell lies together."""
        where = np.empty(count, np.int32)
        where[self._rows] = np.arange(count, dtype=np.int32)
        for start in range(0, count, CHUNK):
            some = slice(start, start + CHUNK)
            seen = np.rint(self._principal.seen(vectors.gather(some)) / self._step)
            _store(seen.astype(np.int16), where[some], cell_of[some], self._starts, self._codes)

    def __len__(self) -> int:
        return len(self._rows)

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """As `Index`; most of the nearest, not always all."""
        rows, squared, _, _ = self._searched(query, count)
        return rows, squared

    def around(self, query: Singles, count: int) -> Found:
        """As `Index`, along the axes that were kept."""
        rows, squared, asked, at = self._searched(query, count)
        return Found(rows, squared, _differences(self._codes, self._starts, at, asked, self._step))

    def _searched(self, query: Singles, count: int) -> tuple[Ints, Singles, Singles, Ints]:
        """Rows (K,), squared distances (K,), the query in steps (d,), and where the vectors are kept (2, K)."""
        count, probes = min(count, len(self)), self._probes
        asked = self._principal.seen(np.asarray(query, np.float32)) / self._step
        squared, at = _looked_into(self._centroids, self._starts, self._codes, asked, probes)
        while len(squared) < count:  # the cells looked into hold fewer
            probes = min(4 * probes, len(self._starts) - 1)
            squared, at = _looked_into(self._centroids, self._starts, self._codes, asked, probes)
        if count <= _FEW:
            best = _smallest(squared, count)
        else:
            best = squared.argpartition(count - 1)[:count]
            best = best[squared[best].argsort()]
        near, rows = squared[best], self._rows[at[0, best]].astype(np.int64)
        if not np.all(near[1:] > near[:-1]):
            order = np.lexsort((rows, near))
            best, near, rows = best[order], near[order], rows[order]
        return rows, near * self._step**2, asked, at[:, best]


def cells_for(count: int) -> int:
    """Cells for so many vectors."""
    return max(1, min(round(2.0 * math.sqrt(count)), count // _PER_CELL))


def probes_for(wanted: int, count: int) -> int:
    """Cells to look into for so many neighbours among so many vectors."""
    return max(PROBES, math.ceil(_ENOUGH * wanted * cells_for(count) / max(count, 1)))


@compiled
def _store(seen: Codes, where: Places, cell_of: Places, starts: Ints, codes: Codes) -> None:
    """Put vectors (M, d) where they belong among the codes."""
    width = seen.shape[1]
    for k in range(len(seen)):
        first, last = starts[cell_of[k]], starts[cell_of[k] + 1]
        begin = first * width + where[k] - first
        for i in range(width):
            codes[begin + i * (last - first)] = seen[k, i]


@compiled
def _looked_into(centroids: Singles, starts: Ints, codes: Codes, asked: Singles, probes: int) -> tuple[Singles, Ints]:
    """Squared distances (M,) of all vectors in the nearest cells, and where each is kept and in which cell (2, M)."""
    width, cells = centroids.shape
    far = np.zeros(cells, np.float32)
    for i in range(width):
        here, value = centroids[i], asked[i]
        for c in range(cells):
            far[c] += (here[c] - value) * (here[c] - value)
    nearest, total = np.empty(probes, np.int64), 0
    for p in range(probes):
        best = 0
        for c in range(1, cells):
            if far[c] < far[best]:
                best = c
        nearest[p], far[best] = best, np.inf
        total += starts[best + 1] - starts[best]
    squared, at, done = np.zeros(total, np.float32), np.empty((2, total), np.int64), 0
    for cell in nearest:
        first, count = starts[cell], starts[cell + 1] - starts[cell]
        some = squared[done : done + count]
        for i in range(width):
            begin, value = first * width + i * count, asked[i]
            here = codes[begin : begin + count]
            for j in range(count):
                away = np.float32(here[j]) - value
                some[j] += away * away
        for j in range(count):
            at[0, done + j], at[1, done + j] = first + j, cell
        done += count
    return squared, at


@compiled
def _smallest(values: Singles, count: int) -> Ints:
    """Where the smallest of many values are, rising."""
    out, done = np.empty(count, np.int64), 0
    for i in range(len(values)):
        if done < count or values[i] < values[out[done - 1]]:
            done = min(done + 1, count)
            k = done - 1
            while k > 0 and values[out[k - 1]] > values[i]:
                out[k] = out[k - 1]
                k -= 1
            out[k] = i
    return out


@compiled
def _differences(codes: Codes, starts: Ints, at: Ints, asked: Singles, step: np.float32) -> Singles:
    """(K, d) the vectors kept at (2, K), minus the query in steps (d,)."""
    width = len(asked)
    out = np.empty((at.shape[1], width), np.float32)
    for k in range(at.shape[1]):
        first, last = starts[at[1, k]], starts[at[1, k] + 1]
        begin = first * width + at[0, k] - first
        for i in range(width):
            out[k, i] = (codes[begin + i * (last - first)] - asked[i]) * step
    return out


@contextmanager
def _faiss() -> Iterator[Any]:
    """faiss, imported when it is first needed, with one thread: so that equal input gives equal cells.

    Vectors are compared with centroids few at a time, for which a megabyte is enough.
    """
    import faiss

    threads, at_once = faiss.omp_get_max_threads(), faiss.cvar.distance_compute_blas_query_bs
    faiss.omp_set_num_threads(1)
    faiss.cvar.distance_compute_blas_query_bs = 256
    try:
        yield faiss
    finally:
        faiss.omp_set_num_threads(threads)
        faiss.cvar.distance_compute_blas_query_bs = at_once
