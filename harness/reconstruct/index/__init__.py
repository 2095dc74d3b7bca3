"""Nearest neighbours among many vectors: one protocol, several ways."""

from harness.reconstruct.index.flat import Flat
from harness.reconstruct.index.inverted_file import InvertedFile
from harness.reconstruct.index.protocol import Index, Table, Vectors

__all__ = ["Flat", "Index", "InvertedFile", "Table", "Vectors"]
