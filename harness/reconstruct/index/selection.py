"""Choice of the fastest index for a set of vectors, as measured by `harness bench index`."""

from collections.abc import Callable

from harness.errors import UnknownName
from harness.reconstruct.index.exact import FlatIndex, KDTree
from harness.reconstruct.index.inverted_file import InvertedFile
from harness.reconstruct.index.neighbour_graph import NeighbourGraph
from harness.reconstruct.index.protocol import Index, Vectors

INDEXES: dict[str, Callable[[Vectors, int], Index]] = {
    "flat": lambda vectors, wanted: FlatIndex(vectors),
    "kd_tree": lambda vectors, wanted: KDTree(vectors),
    "inverted_file": lambda vectors, wanted: InvertedFile(vectors, wanted),
    "graph": lambda vectors, wanted: NeighbourGraph(vectors, _fastest(vectors, wanted)),
}
AUTO_INDEX = "auto"
FLAT_MAX_VECTORS, KD_TREE_MAX_DIMENSIONS, KD_TREE_MAX_NEIGHBOURS = 3000, 20, 16
"""Limits of the choice: the flat index up to the first number of vectors; the kd-tree up to this many dimensions and
wanted neighbours. In more dimensions, or for hundreds of neighbours, a tree visits nearly all vectors."""


def make_index(kind: str, vectors: Vectors, wanted: int = KD_TREE_MAX_NEIGHBOURS) -> Index:
    """An index of these vectors for queries of `wanted` neighbours; UnknownName.

    "auto" takes the fastest whose recall is near 1 (`best_index`).
    """
    if kind == AUTO_INDEX:
        return _fastest(vectors, wanted)
    if kind not in INDEXES:
        raise UnknownName("index", kind, (AUTO_INDEX, *INDEXES))
    return INDEXES[kind](vectors, wanted)


def _fastest(vectors: Vectors, wanted: int) -> Index:
    return INDEXES[best_index(len(vectors), vectors.size, wanted)](vectors, wanted)


def best_index(count: int, size: int, wanted: int) -> str:
    """The kind of index for `count` vectors of `size` numbers and queries of `wanted` neighbours."""
    if count <= FLAT_MAX_VECTORS:
        return "flat"
    return "kd_tree" if size <= KD_TREE_MAX_DIMENSIONS and wanted <= KD_TREE_MAX_NEIGHBOURS else "inverted_file"
