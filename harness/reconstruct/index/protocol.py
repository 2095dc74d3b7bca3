"""Protocols of nearest-neighbour search: the vectors, the lookup, and its answer."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

import numpy as np

from harness.core.arrays import Bools, Ints, Singles

CHUNK = 1024
"""Number of vectors gathered at a time while an index is built."""


class Vectors(Protocol):
    """N vectors of D numbers, computed on demand (`Windows`, `StationFeatures`) or in memory (`ArrayVectors`)."""

    def __len__(self) -> int: ...

    @property
    def size(self) -> int:
        """D, the length of a vector."""
        ...

    @property
    def consecutive(self) -> Bools:
        """(N,) whether the next row is the next frame in time."""
        ...

    def gather(self, rows: Ints | slice) -> Singles:
        """The vectors (K, D) of these rows."""
        ...


class Neighbours(NamedTuple):
    """The K nearest vectors, nearest first."""

    rows: Ints
    """(K,) row of each."""
    squared: Singles
    """(K,) squared distances from the query."""
    offsets: Singles
    """(K, d) the vectors minus the query, along axes that the index chooses."""


class Lookup(Protocol):
    """A search for the nearest of N vectors."""

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """Rows (count,) of the nearest vectors to a query (D,), and their squared Euclidean distances (count,).

        Nearest first, and at equal distances the lower row first. There are fewer than `count` when N is smaller.
        """
        ...


class Index(Lookup, Protocol):
    """A search structure over N vectors: deterministic and shared by sessions."""

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """The nearest vectors as `nearest` finds them, and their offsets from the query."""
        ...

    def begin_search(self) -> "Index":
        """The index for one session. Only a search that follows its last answer has a state."""
        ...


class StatelessIndex(ABC):
    """Base of an `Index` whose answers do not depend on earlier queries."""

    @abstractmethod
    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """See `Index`."""

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """See `Lookup`."""
        rows, squared, _ = self.nearest_with_offsets(query, count)
        return rows, squared

    def begin_search(self) -> Self:
        """The index itself."""
        return self


@dataclass(frozen=True, eq=False)
class ArrayVectors:
    """`Vectors` in memory."""

    values: Singles
    """(N, D) the vectors."""

    @property
    def consecutive(self) -> Bools:
        """Rows are one take."""
        return np.arange(1, len(self) + 1) < len(self)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def size(self) -> int:
        return int(self.values.shape[1])

    def gather(self, rows: Ints | slice) -> Singles:
        return self.values[rows]
