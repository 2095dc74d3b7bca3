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
from harness.reconstruct.index.principal_axes import PrincipalAxes, chunks
from harness.reconstruct.index.protocol import CHUNK, Neighbours, Vectors

Codes = NDArray[np.int16]
Places = NDArray[np.int32]
PROBES, PROBES_PER_ROOT = 4.0, 0.4
"""Cells looked into: so many, and for each square root of the number of neighbours that are wanted so many more."""
VARIANCE_SHARE = 0.9995
"""Share of the variance that the axes keep."""
_MIN_CANDIDATES_PER_NEIGHBOUR = 3.0
"""Vectors looked into for each neighbour that is wanted, at least."""
_VECTORS_PER_CELL, _CLUSTERING_ROUNDS = 39, 6
"""Of the clustering: vectors that each centroid is found from, and rounds."""
_MAX_CODE, _MAX_QUERY = 32_000, 1e9
"""Steps to the farthest number from the middle; and of queries, whose squares must not overflow."""
_ROW_BITS = 32
_ROW_MASK = (1 << _ROW_BITS) - 1
"""Candidates are sorted as whole numbers: the bits of a distance, which rise with it, then those of the row."""


class InvertedFile:
    """An `Index`; squared distances are those along the axes that were kept, in whole steps."""

    def __init__(self, vectors: Vectors, wanted: int = 100) -> None:
        """For queries of so many neighbours."""
        count = len(vectors)
        rng = generator(0, "inverted file", count)
        self._principal = PrincipalAxes(vectors, rng, VARIANCE_SHARE)
        width, cells = self._principal.width, cells_for(count)
        sample = np.sort(rng.choice(count, min(count, _VECTORS_PER_CELL * cells), replace=False))
        seen = np.empty((len(sample), width), np.float32)
        for rows in chunks(np.arange(len(sample))):
            seen[rows] = self._principal.project(vectors.gather(sample[rows]))
        with _faiss() as faiss:
            flat = faiss.IndexFlatL2(width)
            clustering = faiss.Clustering(width, cells)
            clustering.seed, clustering.niter = 1, _CLUSTERING_ROUNDS
            clustering.min_points_per_centroid, clustering.max_points_per_centroid = 1, _VECTORS_PER_CELL
            clustering.train(seen, flat)
            cell_of = np.empty(count, np.int32)
            farthest = 0.0
            for start in range(0, count, CHUNK):
                seen = self._principal.project(vectors.gather(slice(start, start + CHUNK)))
                cell_of[start : start + CHUNK] = flat.search(seen, 1)[1][:, 0]
                farthest = max(farthest, float(np.abs(seen).max()))
            centroids = flat.reconstruct_n(0, cells)
        self._probes = min(probes_for(wanted, count), cells)
        self._rows: Places = np.argsort(cell_of, kind="stable").astype(np.int32)
        """(N,) cell after cell."""
        self._starts: Ints = np.searchsorted(cell_of[self._rows], np.arange(cells + 1))
        """(C + 1,) where each cell begins among them."""
        self._step = np.float32(max(farthest, 1e-6) / _MAX_CODE)
        self._centroids: Singles = np.ascontiguousarray(centroids.T / self._step)
        """(d, C) in steps."""
        self._codes: Codes = np.empty(count * width, np.int16)
        """(N d,) cell after cell (d, n): one number of all vectors of a cell lies together."""
        self._cell_of = cell_of
        """(N,) of each row."""
        self._where = where = np.empty(count, np.int32)
        """(N,) of each row among `_rows`."""
        where[self._rows] = np.arange(count, dtype=np.int32)
        for start in range(0, count, CHUNK):
            some = slice(start, start + CHUNK)
            seen = np.rint(self._principal.project(vectors.gather(some)) / self._step)
            _store_codes(seen.astype(np.int16), where[some], cell_of[some], self._starts, self._codes)

    def __len__(self) -> int:
        return len(self._rows)

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """As `Index`; most of the nearest, not always all."""
        rows, squared, _ = self._searched(query, count)
        return rows, squared

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """As `Index`, along the axes that were kept."""
        rows, squared, asked = self._searched(query, count)
        away = _gather_offsets(self._codes, self._starts, self._cell_of, self._where, rows, asked, self._step)
        return Neighbours(rows, squared, away)

    def _searched(self, query: Singles, count: int) -> tuple[Ints, Singles, Singles]:
        """Rows (K,), squared distances (K,), and the query in steps (d,)."""
        count, probes = min(count, len(self)), self._probes
        asked = self._principal.project(np.asarray(query, np.float32)) / self._step
        if np.isnan(asked).any():
            raise ArithmeticError(
                "a query for neighbours holds something that is not a number: is a reading not finite?"
            )
        np.clip(asked, -_MAX_QUERY, _MAX_QUERY, out=asked)
        found = _scan_cells(self._centroids, self._starts, self._codes, self._rows, asked, probes)
        while len(found) < count:  # the cells looked into hold fewer
            probes = min(4 * probes, len(self._starts) - 1)
            found = _scan_cells(self._centroids, self._starts, self._codes, self._rows, asked, probes)
        found.partition(count - 1)
        best = np.sort(found[:count])
        squared = (best >> _ROW_BITS).astype(np.int32).view(np.float32)
        return best & _ROW_MASK, squared * self._step**2, asked


def cells_for(count: int) -> int:
    """Cells for so many vectors."""
    return max(1, min(round(2.0 * math.sqrt(count)), count // _VECTORS_PER_CELL))


def probes_for(wanted: int, count: int) -> int:
    """Cells to look into for so many neighbours among so many vectors.

    A recall of 0.96 and more at 66,000 and at 1,000,000 frames: `harness bench index`, `harness bench methods --large`.
    """
    enough = _MIN_CANDIDATES_PER_NEIGHBOUR * wanted * cells_for(count) / max(count, 1)
    return math.ceil(max(PROBES + PROBES_PER_ROOT * math.sqrt(wanted), enough))


@compiled
def _store_codes(seen: Codes, where: Places, cell_of: Places, starts: Ints, codes: Codes) -> None:
    """Put vectors (M, d) where they belong among the codes."""
    width = seen.shape[1]
    for k in range(len(seen)):
        first, last = starts[cell_of[k]], starts[cell_of[k] + 1]
        begin = first * width + where[k] - first
        for i in range(width):
            codes[begin + i * (last - first)] = seen[k, i]


@compiled
def _scan_cells(centroids: Singles, starts: Ints, codes: Codes, rows: Places, asked: Singles, probes: int) -> Ints:
    """(M,) squared distances and rows of all vectors in the nearest cells, as whole numbers."""
    width, cells = centroids.shape
    far = np.zeros(cells, np.float32)
    for i in range(width):
        here, value = centroids[i], asked[i]
        for c in range(cells):
            far[c] += (here[c] - value) * (here[c] - value)
    nearest, total, most = np.empty(probes, np.int64), 0, 0
    for p in range(probes):
        best = 0
        for c in range(1, cells):
            if far[c] < far[best]:
                best = c
        nearest[p], far[best] = best, np.inf
        total, most = total + starts[best + 1] - starts[best], max(most, starts[best + 1] - starts[best])
    out, squared, done = np.empty(total, np.int64), np.empty(most, np.float32), 0
    bits = squared.view(np.int32)
    for cell in nearest:
        first, count = starts[cell], starts[cell + 1] - starts[cell]
        squared[:count] = 0.0
        for i in range(width):
            begin, value = first * width + i * count, asked[i]
            here = codes[begin : begin + count]
            for j in range(count):
                away = np.float32(here[j]) - value
                squared[j] += away * away
        for j in range(count):
            out[done + j] = (np.int64(bits[j]) << _ROW_BITS) | np.int64(rows[first + j])
        done += count
    return out


@compiled
def _gather_offsets(
    codes: Codes, starts: Ints, cell_of: Places, where: Places, rows: Ints, asked: Singles, step: np.float32
) -> Singles:
    """(K, d) the vectors of some rows, minus the query in steps (d,)."""
    width = len(asked)
    out = np.empty((len(rows), width), np.float32)
    for k in range(len(rows)):
        cell = cell_of[rows[k]]
        first, last = starts[cell], starts[cell + 1]
        begin = first * width + where[rows[k]] - first
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
