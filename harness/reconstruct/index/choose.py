"""Which index serves a set best: as measured by `harness bench index`."""

from collections.abc import Callable

from harness.errors import UnknownName
from harness.reconstruct.index.flat import Flat
from harness.reconstruct.index.inverted_file import InvertedFile
from harness.reconstruct.index.kd_tree import KDTree
from harness.reconstruct.index.protocol import Index, Vectors

INDEXES: dict[str, Callable[[Vectors], Index]] = {"flat": Flat, "kd_tree": KDTree, "inverted_file": InvertedFile}
AUTO = "auto"
FEW, MANY, LOW = 3000, 30_000, 64
"""Up to so many vectors all are looked at; up to so many of up to so many numbers go into a kd-tree."""


def choose(kind: str, vectors: Vectors) -> Index:
    """The named index of these vectors; "auto" is the quickest that misses next to nothing. UnknownName."""
    if kind == AUTO:
        return choose(best_for(len(vectors), vectors.size), vectors)
    if kind not in INDEXES:
        raise UnknownName("index", kind, (AUTO, *INDEXES))
    return INDEXES[kind](vectors)


def best_for(count: int, size: int) -> str:
    """The kind for so many vectors of so many numbers."""
    if count <= FEW:
        return "flat"
    return "kd_tree" if size <= LOW and count <= MANY else "inverted_file"
