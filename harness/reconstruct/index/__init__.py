"""Nearest-neighbour search among many vectors: one protocol, several implementations."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.reconstruct.index.exact import FlatIndex
    from harness.reconstruct.index.inverted_file import cells_for, probes_for
    from harness.reconstruct.index.protocol import ArrayVectors, Lookup, Vectors
    from harness.reconstruct.index.selection import AUTO_INDEX, FLAT_MAX_VECTORS, INDEXES, best_index, make_index
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "AUTO_INDEX",
    "FLAT_MAX_VECTORS",
    "INDEXES",
    "ArrayVectors",
    "FlatIndex",
    "Lookup",
    "Vectors",
    "best_index",
    "cells_for",
    "make_index",
    "probes_for",
]
