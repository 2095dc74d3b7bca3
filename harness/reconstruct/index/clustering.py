"""Clustering of vectors by k-means."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from harness.core.arrays import Ints, Singles

_ROUNDS, _TRAINING_PER_CELL = 6, 39
"""Iterations, and training vectors for each centroid at most."""


def cluster_vectors(vectors: Singles, cells: int, rng: np.random.Generator) -> Ints:
    """(N,) cell of each of N vectors (N, D), for `cells` centroids of k-means; a cell may stay empty."""
    count = len(vectors)
    sample = np.sort(rng.choice(count, min(count, _TRAINING_PER_CELL * cells), replace=False))
    vectors = np.ascontiguousarray(vectors, np.float32)
    with single_threaded_faiss() as faiss:
        flat = faiss.IndexFlatL2(vectors.shape[1])
        clustering = faiss.Clustering(vectors.shape[1], cells)
        clustering.seed, clustering.niter = 1, _ROUNDS
        clustering.min_points_per_centroid, clustering.max_points_per_centroid = 1, _TRAINING_PER_CELL
        clustering.train(vectors[sample], flat)
        out: Ints = flat.search(vectors, 1)[1][:, 0].astype(np.int64)
    return out


@contextmanager
def single_threaded_faiss() -> Iterator[Any]:
    """The faiss module, imported at its first use, with one thread so that equal input gives equal cells.

    Vectors are compared with centroids in blocks of 256, for which a megabyte of memory suffices.
    """
    import faiss

    threads, block_size = faiss.omp_get_max_threads(), faiss.cvar.distance_compute_blas_query_bs
    faiss.omp_set_num_threads(1)
    faiss.cvar.distance_compute_blas_query_bs = 256
    try:
        yield faiss
    finally:
        faiss.omp_set_num_threads(threads)
        faiss.cvar.distance_compute_blas_query_bs = block_size
