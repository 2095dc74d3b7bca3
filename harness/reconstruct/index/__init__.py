"""Nearest neighbours among many vectors: one protocol, several ways."""

from harness.reconstruct.index.choose import INDEXES, choose
from harness.reconstruct.index.flat import Flat
from harness.reconstruct.index.graph import Graph
from harness.reconstruct.index.inverted_file import InvertedFile
from harness.reconstruct.index.kd_tree import KDTree
from harness.reconstruct.index.masked import nearest_known
from harness.reconstruct.index.protocol import Found, Index, Lookup, Table, Vectors

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
