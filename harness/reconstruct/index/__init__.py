"""Nearest-neighbour search among many vectors: one protocol, several implementations."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.reconstruct.index.exact import FlatIndex as FlatIndex
    from harness.reconstruct.index.inverted_file import cells_for as cells_for
    from harness.reconstruct.index.inverted_file import probes_for as probes_for
    from harness.reconstruct.index.protocol import ArrayVectors as ArrayVectors
    from harness.reconstruct.index.protocol import Lookup as Lookup
    from harness.reconstruct.index.protocol import Vectors as Vectors
    from harness.reconstruct.index.selection import AUTO_INDEX as AUTO_INDEX
    from harness.reconstruct.index.selection import FLAT_MAX_VECTORS as FLAT_MAX_VECTORS
    from harness.reconstruct.index.selection import INDEXES as INDEXES
    from harness.reconstruct.index.selection import best_index as best_index
    from harness.reconstruct.index.selection import make_index as make_index
else:
    __getattr__, __dir__ = lazy_names(__name__)
