"""Which index serves a set best: as measured by `harness bench index`."""

from collections.abc import Callable

from harness.errors import UnknownName
from harness.reconstruct.index.flat import FlatIndex
from harness.reconstruct.index.inverted_file import InvertedFile
from harness.reconstruct.index.kd_tree import KDTree
from harness.reconstruct.index.protocol import Index, Vectors

INDEXES: dict[str, Callable[[Vectors, int], Index]] = {
    "flat": lambda vectors, wanted: FlatIndex(vectors),
    "kd_tree": lambda vectors, wanted: KDTree(vectors),
    "inverted_file": lambda vectors, wanted: InvertedFile(vectors, wanted),
}
AUTO = "auto"
FLAT_MAX_VECTORS, KD_TREE_MAX_DIMENSIONS, KD_TREE_MAX_NEIGHBOURS = 3000, 20, 16
"""Up to so many vectors all are looked at; those of up to so many numbers go into a kd-tree when no more than so many
neighbours are wanted: in more dimensions, and asked for hundreds, a tree looks at nearly all."""


def make_index(kind: str, vectors: Vectors, wanted: int = KD_TREE_MAX_NEIGHBOURS) -> Index:
    """The named index of these vectors, for queries of so many neighbours; "auto" is the quickest that misses next to
    nothing. UnknownName."""
    if kind == AUTO:
        return make_index(best_index(len(vectors), vectors.size, wanted), vectors, wanted)
    if kind not in INDEXES:
        raise UnknownName("index", kind, (AUTO, *INDEXES))
    return INDEXES[kind](vectors, wanted)


def best_index(count: int, size: int, wanted: int) -> str:
    """The kind for so many vectors of so many numbers."""
    if count <= FLAT_MAX_VECTORS:
        return "flat"
    return "kd_tree" if size <= KD_TREE_MAX_DIMENSIONS and wanted <= KD_TREE_MAX_NEIGHBOURS else "inverted_file"
