"""Nearest-neighbour search among many vectors: one protocol, several implementations."""

from harness.reconstruct.index.exact import FlatIndex, KDTree, nearest_exact, nearest_partial
from harness.reconstruct.index.inverted_file import InvertedFile
from harness.reconstruct.index.neighbour_graph import NeighbourGraph
from harness.reconstruct.index.protocol import ArrayVectors, Index, Lookup, Neighbours, Vectors
from harness.reconstruct.index.selection import INDEXES, make_index

__all__ = [
    "INDEXES",
    "ArrayVectors",
    "FlatIndex",
    "Index",
    "InvertedFile",
    "KDTree",
    "Lookup",
    "NeighbourGraph",
    "Neighbours",
    "Vectors",
    "make_index",
    "nearest_exact",
    "nearest_partial",
]
