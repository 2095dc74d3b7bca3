"""Approximate search for large sets: an inverted file (faiss), over the leading principal axes in half precision.

Vectors fall into cells around centroids; a query looks only into the cells nearest to it. What a query costs is the
memory it reads, and human poses hardly vary along most axes, so vectors are first rotated onto their principal axes,
cut off where next to nothing is left, and kept in 16 bits: a third of the memory. Unlike a graph of neighbours an
inverted file does not care in which order frames were added (docs/methods.md E, traps).
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from harness.core.arrays import Ints, Singles
from harness.core.seeds import generator
from harness.reconstruct.index.principal import Principal, chunks
from harness.reconstruct.index.protocol import CHUNK, Vectors

PROBES = 10
"""Cells looked into: a recall of 0.97 and more at 66,000 and at 1,000,000 frames (`harness bench index`)."""
KEPT = 0.9995
"""Share of the variance that the axes keep."""
_ENOUGH = 2.0
"""Vectors looked into for each neighbour that is wanted, at least: a recall of 0.97 for 800 of 66,000."""
_PER_CELL, _ROUNDS = 39, 6
"""Of the clustering: vectors that each centroid is found from, and rounds."""


class InvertedFile:
    """An `Index`; squared distances are those along the axes that were kept, to half precision."""

    def __init__(self, vectors: Vectors, probes: int = PROBES) -> None:
        count = len(vectors)
        rng = generator(0, "inverted file", count)
        self._principal = Principal(vectors, rng, KEPT)
        width = self._principal.width
        cells = cells_for(count)
        sample = np.sort(rng.choice(count, min(count, _PER_CELL * cells), replace=False))
        with _one_thread() as faiss:
            centroids = faiss.IndexFlatL2(width)
            half = faiss.ScalarQuantizer.QT_fp16
            self._file: Any = faiss.IndexIVFScalarQuantizer(centroids, width, cells, half, faiss.METRIC_L2, False)
            self._file.cp.seed, self._file.cp.niter = 1, _ROUNDS
            self._file.cp.min_points_per_centroid = 1
            self._file.cp.max_points_per_centroid = _PER_CELL
            self._file.train(np.concatenate([self._principal.seen(vectors.gather(rows)) for rows in chunks(sample)]))
            for start in range(0, count, CHUNK):
                self._file.add(self._principal.seen(vectors.gather(slice(start, start + CHUNK))))
            self._file.nprobe = min(probes, cells)

    def __len__(self) -> int:
        return int(self._file.ntotal)

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """As `Index`; most of the nearest, not always all."""
        count = min(count, len(self))
        asked = self._principal.seen(np.asarray(query, np.float32)[None])
        squared, rows = self._file.search(asked, count)
        if rows[0, -1] < 0:  # the cells looked into hold fewer: look into all
            with _one_thread() as faiss:
                every = faiss.SearchParametersIVF(nprobe=self._file.nlist)
            squared, rows = self._file.search(asked, count, params=every)
        if np.all(squared[0, 1:] > squared[0, :-1]):
            return rows[0], squared[0]
        order: Ints = np.lexsort((rows[0], squared[0]))
        return rows[0, order], squared[0, order]


def cells_for(count: int) -> int:
    """Cells for so many vectors."""
    return max(1, min(round(2.0 * math.sqrt(count)), count // _PER_CELL))


def probes_for(wanted: int, count: int) -> int:
    """Cells to look into for so many neighbours among so many vectors."""
    return max(PROBES, math.ceil(_ENOUGH * wanted * cells_for(count) / max(count, 1)))


@contextmanager
def _one_thread() -> Iterator[Any]:
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
