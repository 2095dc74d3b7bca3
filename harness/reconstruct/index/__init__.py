"""Nearest neighbours among many vectors: one protocol, several ways."""

from harness.reconstruct.index.flat import Flat
from harness.reconstruct.index.inverted_file import InvertedFile
from harness.reconstruct.index.kd_tree import KDTree
from harness.reconstruct.index.neighbour_graph import Graph
from harness.reconstruct.index.partial_search import nearest_known
from harness.reconstruct.index.protocol import Found, Index, Lookup, Table, Vectors
from harness.reconstruct.index.selection import INDEXES, choose

__all__ = [
    "INDEXES",
    "Flat",
    "Found",
    "Graph",
    "Index",
    "InvertedFile",
    "KDTree",
    "Lookup",
    "Table",
    "Vectors",
    "choose",
    "nearest_known",
]
