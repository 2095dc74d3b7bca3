"""Approximate search for large sets: an inverted file over the leading principal axes, in 16 bits.

Vectors are assigned to cells around centroids of k-means; a query scans only the cells nearest to it. The
cost of a query is the memory that it reads, and human poses hardly vary along most axes. So vectors are rotated onto
their principal axes, truncated to the leading ones, and stored as 16-bit multiples of one small step: a third of the
memory. Unlike a neighbour graph, an inverted file does not depend on the order in which frames were added
(docs/notes/traps.md). Cells are scanned by a compiled loop of this module. The heap in which faiss keeps the best
takes longer than all distances when hundreds of neighbours are wanted (`harness bench index` measures both).

Memory layout. `_rows` lists the vectors cell after cell; cell c occupies places `_starts[c]` to `_starts[c + 1]`.
Within a cell of n vectors the codes are stored by axis: n numbers for the first axis, then n for the second, and so
on. So the scan adds up one axis for all vectors of a cell in a contiguous loop, which the compiler vectorises. A second
copy of the codes by row would save 20 us of 800 neighbours' offsets, for a fifth of the memory of the poses.
"""

import math

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Ints, Singles
from harness.core.compiled import compiled
from harness.core.seeds import generator
from harness.reconstruct.index.decomposition import (
    VECTORS_PER_CELL,
    PrincipalAxes,
    chunks,
    draw_sample,
    find_centroids,
    nearest_centroids,
)
from harness.reconstruct.index.protocol import CHUNK, Neighbours, StatelessIndex, Vectors

Codes = NDArray[np.int16]
Places = NDArray[np.int32]
PROBES, PROBES_PER_ROOT = 4.0, 0.4
"""Number of cells to scan: the first, plus the second times the square root of the number of wanted neighbours."""
VARIANCE_SHARE = 0.9995
"""Share of the variance that the axes hold."""
_MIN_CANDIDATES_PER_NEIGHBOUR = 3.0
"""Vectors to scan for each wanted neighbour, at least."""
_MAX_CODE, _MAX_QUERY = 32_000, 1e9
"""Largest code, in steps; largest number of a query in steps, whose square must not overflow."""
_ROW_BITS = 32
_ROW_MASK = (1 << _ROW_BITS) - 1
"""Candidates are sorted as 64-bit integers: the squared distance in the high bits, the row in the low ones. The bits of
a float32 that is not negative, read as an integer, have the order of the float. So one integer sort orders by
distance, then by row."""


class InvertedFile(StatelessIndex):
    """An approximate `Index`; distances are those along the leading axes, between quantised vectors and the query."""

    def __init__(self, vectors: Vectors, wanted: int = 100) -> None:
        """Build the index for queries of `wanted` neighbours."""
        count = len(vectors)
        rng = generator(0, "inverted file", count)
        self._principal = PrincipalAxes(vectors, rng, VARIANCE_SHARE)
        width, cells = self._principal.width, cells_for(count)
        sample = draw_sample(count, cells, rng)
        projected = np.empty((len(sample), width), np.float32)
        for rows in chunks(np.arange(len(sample))):
            projected[rows] = self._principal.project(vectors.gather(sample[rows]))
        centroids = find_centroids(projected, cells, rng)
        cell_of = np.empty(count, np.int32)
        farthest = 0.0
        for start in range(0, count, CHUNK):
            projected = self._principal.project(vectors.gather(slice(start, start + CHUNK)))
            cell_of[start : start + CHUNK] = nearest_centroids(projected, centroids)
            farthest = max(farthest, float(np.abs(projected).max()))
        self._probes = min(probes_for(wanted, count), cells)
        self._rows: Places = np.argsort(cell_of, kind="stable").astype(np.int32)
        """(N,) rows of the vectors, cell after cell."""
        self._starts: Ints = np.searchsorted(cell_of[self._rows], np.arange(cells + 1))
        """(C + 1,) first place of each cell; the next entry ends it."""
        self._step = np.float32(max(farthest, 1e-6) / _MAX_CODE)
        self._centroids: Singles = np.ascontiguousarray(centroids.T / self._step)
        """(d, C) centroids in steps."""
        self._codes: Codes = np.empty(count * width, np.int16)
        """(N d,) codes, cell after cell, each (d, n)."""
        self._cell_of = cell_of
        """(N,) cell of each row."""
        self._place = place = np.empty(count, np.int32)
        """(N,) place of each row in `_rows`."""
        place[self._rows] = np.arange(count, dtype=np.int32)
        for start in range(0, count, CHUNK):
            some = slice(start, start + CHUNK)
            codes = np.rint(self._principal.project(vectors.gather(some)) / self._step).astype(np.int16)
            _store_codes(codes, place[some], cell_of[some], self._starts, self._codes)

    def __len__(self) -> int:
        return len(self._rows)

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """See `Lookup`; finds most of the nearest, not always all."""
        best, _ = self._search(query, count)
        return _unpack(best, self._step)

    def nearest_with_offsets(self, query: Singles, count: int) -> Neighbours:
        """See `Index`; offsets are along the leading principal axes."""
        best, target = self._search(query, count)
        rows, squared = _unpack(best, self._step)
        offsets = _gather_offsets(self._codes, self._starts, self._cell_of, self._place, rows, target, self._step)
        return Neighbours(rows, squared, offsets)

    def _search(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        """The nearest (K,) as integers of squared distance and row, in order, and the query in steps (d,)."""
        count, probes = min(count, len(self)), self._probes
        target = self._principal.project(np.asarray(query, np.float32)) / self._step
        candidates = _scan_cells(self._centroids, self._starts, self._codes, self._rows, target, probes)
        while len(candidates) < count:  # the scanned cells hold too few
            if np.isnan(target).any():
                raise ArithmeticError(
                    "A query for neighbours contains a value that is not a number: is a reading not finite?"
                )
            probes = min(4 * probes, len(self._starts) - 1)
            candidates = _scan_cells(self._centroids, self._starts, self._codes, self._rows, target, probes)
        candidates.partition(count - 1)
        best = candidates[:count]
        best.sort()
        return best, target


def cells_for(count: int) -> int:
    """Number of cells for `count` vectors."""
    return max(1, min(round(2.0 * math.sqrt(count)), count // VECTORS_PER_CELL))


def probes_for(wanted: int, count: int) -> int:
    """Number of cells to scan for `wanted` neighbours among `count` vectors.

    Recall is 0.96 or more at 66,000 and at 1,000,000 frames: `harness bench index`, `harness bench methods --large`.
    """
    enough = _MIN_CANDIDATES_PER_NEIGHBOUR * wanted * cells_for(count) / max(count, 1)
    return math.ceil(max(PROBES + PROBES_PER_ROOT * math.sqrt(wanted), enough))


@compiled
def _store_codes(values: Codes, place: Places, cell_of: Places, starts: Ints, codes: Codes) -> None:
    """Write the codes (M, d) of vectors to their places in `codes`, where they are `last - first` numbers apart."""
    width = values.shape[1]
    for k in range(len(values)):
        first, last = starts[cell_of[k]], starts[cell_of[k] + 1]
        begin = first * width + place[k] - first
        for i in range(width):
            codes[begin + i * (last - first)] = values[k, i]


@compiled
def _scan_cells(centroids: Singles, starts: Ints, codes: Codes, rows: Places, target: Singles, probes: int) -> Ints:
    """(M,) integers of squared distance and row, for all vectors of the `probes` cells nearest to `target` (d,).

    The target is clipped. None are near a target with a value that is not a number.
    """
    width, cells = centroids.shape
    for i in range(width):
        if np.isnan(target[i]):
            return np.empty(0, np.int64)
        target[i] = min(max(target[i], np.float32(-_MAX_QUERY)), np.float32(_MAX_QUERY))
    # 1. Squared distances to all centroids, axis by axis, so that the inner loop runs over contiguous numbers.
    far = np.zeros(cells, np.float32)
    for i in range(width):
        coordinate, value = centroids[i], target[i]
        for c in range(cells):
            far[c] += (coordinate[c] - value) * (coordinate[c] - value)
    # 2. The nearest cells, by insertion into a short list, since only few are needed.
    nearest, distance = np.empty(probes, np.int64), np.full(probes, np.inf, np.float32)
    for c in range(cells):
        if far[c] < distance[-1]:
            p = probes - 1
            while p > 0 and distance[p - 1] > far[c]:
                nearest[p], distance[p] = nearest[p - 1], distance[p - 1]
                p -= 1
            nearest[p], distance[p] = c, far[c]
    total, most = 0, 0
    for cell in nearest:
        total, most = total + starts[cell + 1] - starts[cell], max(most, starts[cell + 1] - starts[cell])
    # 3. Squared distances to their vectors. `bits` is the same memory as `squared`, read as integers.
    out, squared, done = np.empty(total, np.int64), np.empty(most, np.float32), 0
    bits = squared.view(np.int32)
    for cell in nearest:
        first, count = starts[cell], starts[cell + 1] - starts[cell]
        squared[:count] = 0.0
        for i in range(width):
            begin, value = first * width + i * count, target[i]
            coordinates = codes[begin : begin + count]
            for j in range(count):
                offset = np.float32(coordinates[j]) - value
                squared[j] += offset * offset
        for j in range(count):
            out[done + j] = (np.int64(bits[j]) << _ROW_BITS) | np.int64(rows[first + j])
        done += count
    return out


@compiled
def _unpack(packed: Ints, step: np.float32) -> tuple[Ints, Singles]:
    """Rows (K,) and squared distances (K,) of integers of both."""
    rows, bits = np.empty(len(packed), np.int64), np.empty(len(packed), np.int32)
    for k in range(len(packed)):
        rows[k], bits[k] = packed[k] & _ROW_MASK, packed[k] >> _ROW_BITS
    return rows, bits.view(np.float32) * (step * step)


@compiled
def _gather_offsets(
    codes: Codes, starts: Ints, cell_of: Places, place: Places, rows: Ints, target: Singles, step: np.float32
) -> Singles:
    """(K, d) the vectors of these rows minus the query, which is given in steps (d,)."""
    width = len(target)
    out = np.empty((len(rows), width), np.float32)
    for k in range(len(rows)):
        values, cell = out[k], cell_of[rows[k]]
        first, stride = starts[cell], starts[cell + 1] - starts[cell]
        at = first * width + place[rows[k]] - first
        for i in range(width):
            values[i] = codes[at]
            at += stride
        for i in range(width):
            values[i] = (values[i] - target[i]) * step
    return out
