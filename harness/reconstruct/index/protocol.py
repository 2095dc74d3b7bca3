"""What an index searches, and what it answers."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

from harness.core.arrays import Ints, Singles

CHUNK = 1024
"""Vectors gathered at a time while an index is made."""


class Vectors(Protocol):
    """N vectors of D numbers, made on demand (`Windows`, `StationFeatures`) or in memory (`ArrayVectors`)."""

    def __len__(self) -> int: ...

    @property
    def size(self) -> int:
        """D."""
        ...

    def gather(self, rows: Ints | slice) -> Singles:
        """(K, D) of some rows."""
        ...


class Neighbours(NamedTuple):
    """K vectors, nearest first."""

    rows: Ints
    """(K,)"""
    squared: Singles
    """(K,) distances from the query."""
    offsets: Singles
    """(K, d) the vectors minus the query, along axes of the index's choice."""


class Lookup(Protocol):
    """Something that finds the nearest of N vectors."""

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """Rows (count,) of the nearest vectors to a query (D,), and their squared Euclidean distances (count,).

        Nearest first, of equals that were found the lower row first. There are fewer when N is smaller.
        """
        ...


class Index(Lookup, Protocol):
    """A search among N vectors: immutable, deterministic, shared by sessions."""

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """The same, and how the vectors differ from the query."""
        ...


@dataclass(frozen=True, eq=False)
class ArrayVectors:
    """`Vectors` that are all in memory."""

    values: Singles
    """(N, D)"""

    def __len__(self) -> int:
        return len(self.values)

    @property
    def size(self) -> int:
        return int(self.values.shape[1])

    def gather(self, rows: Ints | slice) -> Singles:
        return self.values[rows]
