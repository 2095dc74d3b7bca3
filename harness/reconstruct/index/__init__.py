"""Nearest neighbours among many vectors: one protocol, several ways."""

from harness.reconstruct.index.flat import Flat
from harness.reconstruct.index.protocol import Index, Vectors

__all__ = ["Flat", "Index", "Vectors"]
