"""Energy distance between two samples of correlated vectors, with a permutation test of whole blocks.

The energy distance of two distributions is 2 E|X - Y| - E|X - X'| - E|Y - Y'|. It is zero only where they are equal
(Szekely & Rizzo 2013). Successive errors of a tracker are correlated. A test that permutes single samples would find a
difference in them that is not there. So blocks of several correlation times change sides as a whole. Distances within
one block are left out, which makes the estimate unbiased for independent blocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.seeds import generator
from harness.errors import BadInput

CORRELATION_TIMES = 5.0
"""Length of a block in correlation times."""
PERMUTATIONS = 999
MOST_ROWS = 1500
"""Most samples of a side whose distances are computed; they are spread evenly over all of them."""
MIN_BLOCKS = 4
"""Least number of blocks of a side: fewer have too few permutations for a small p."""


@dataclass(frozen=True)
class EnergyDistance:
    """Energy distance of two samples and its test."""

    distance: float
    """Unbiased estimate, in the unit of the samples."""
    split_half: float
    """95th percentile of the distance between random halves of the first sample's blocks, in the unit."""
    p: float
    """p of the permutation test."""
    blocks: tuple[int, int]
    """Number of blocks of each side."""


def correlation_samples(series: Sequence[Floats]) -> float:
    """Integrated correlation time of vector series (N, D), in samples; 1 where samples are independent.

    It is 1 plus twice the sum of the autocorrelation over the lags: so many samples count as one. The sum is over pairs
    of lags as long as that of a pair is positive (Geyer 1992, "initial positive sequence"), up to half of the longest
    series. A slow part of small variance is thus not missed. Rows with a NaN are left out. The mean over all series is
    subtracted. BadInput without any variance.
    """
    rows = np.concatenate(series) if series else np.zeros((0, 1))
    seen = rows[np.isfinite(rows).all(axis=1)]
    if len(seen) < 2 or not seen.var(axis=0).sum() > 0.0:
        raise BadInput("Series without any variance.", "Use a longer recording with noise.")
    length = max(map(len, series))
    total, pairs = np.zeros(length), np.zeros(length)
    for each in series:
        known: Bools = np.asarray(np.isfinite(each).all(axis=1))
        centred: Floats = np.where(known[:, None], each - seen.mean(axis=0), 0.0)
        for axis in range(each.shape[1]):
            total[: len(each)] += _lagged_sums(centred[:, axis])
        pairs[: len(each)] += _lagged_sums(known.astype(np.float64))
    count = (length // 2 + 1) // 2 * 2
    correlation = total[:count] / np.maximum(pairs[:count], 0.5) * (pairs[0] / total[0])
    sums = correlation[::2] + correlation[1::2]
    ends: Ints = np.flatnonzero(np.asarray(sums) <= 0.0)
    positive = sums[: ends[0]] if len(ends) else sums
    return max(2.0 * float(positive.sum()) - 1.0, 1.0)


def _lagged_sums(values: Floats) -> Floats:
    """Sums (N,) of products of values (N,) that lie 0, 1, ... N - 1 samples apart."""
    spectrum = np.fft.rfft(values, 2 * len(values))
    out: Floats = np.fft.irfft(np.abs(spectrum) ** 2, 2 * len(values))[: len(values)]
    return out


def label_blocks(series: Sequence[Floats], length: int) -> list[Ints]:
    """Number of the block of each row (N,) of each series, counted over all series.

    A series is cut into blocks of equal size, of `length` samples or more; a shorter series is one block.
    """
    if length < 1:
        raise BadInput(f"Blocks of {length} samples.", "Use at least one.")
    labels, before = [], 0
    for each in series:
        blocks = max(len(each) // length, 1)
        labels.append(before + np.arange(len(each), dtype=np.int64) * blocks // max(len(each), 1))
        before += blocks
    return labels


def compare_errors(
    device: Sequence[Floats],
    simulated: Sequence[Floats],
    length: int,
    *,
    seed: int = 0,
    permutations: int = PERMUTATIONS,
) -> EnergyDistance:
    """Energy distance of the series (N, D) of two sides, tested by permuting blocks of `length` samples.

    Rows with a NaN are left out. BadInput with fewer than `MIN_BLOCKS` blocks on a side.
    """
    sides = [_thin_rows(side, label_blocks(side, length)) for side in (device, simulated)]
    counts = [len(np.unique(labels)) for _, labels in sides]
    if min(counts) < MIN_BLOCKS:
        raise BadInput(
            f"{min(counts)} blocks of {length} samples on one side, of at least {MIN_BLOCKS}.", "Record more motion."
        )
    rows = np.concatenate([rows for rows, _ in sides])
    labels = np.concatenate([sides[0][1], sides[0][1].max() + 1 + sides[1][1]])
    sums, sizes = _block_sums(rows, labels)
    first = np.arange(len(sizes)) < counts[0]
    rng = generator(seed, "energy distance")
    distance = float(_distances(sums, sizes, first[None, :])[0])
    drawn = _distances(sums, sizes, rng.permuted(np.tile(first, (permutations, 1)), axis=1))
    p = (1 + int(np.count_nonzero(drawn >= distance))) / (1 + permutations)
    half = np.arange(counts[0]) < counts[0] // 2
    split = rng.permuted(np.tile(half, (permutations, 1)), axis=1)
    halves = _distances(sums[np.ix_(first, first)], sizes[first], split)
    return EnergyDistance(distance, float(np.quantile(halves, 0.95)), p, (counts[0], counts[1]))


def _thin_rows(series: Sequence[Floats], labels: Sequence[Ints]) -> tuple[Floats, Ints]:
    """The rows (M, D) without NaN and their blocks (M,), at most `MOST_ROWS`, spread evenly."""
    rows, blocks = np.concatenate(series), np.concatenate(labels)
    finite = np.flatnonzero(np.isfinite(rows).all(axis=1))
    if len(finite) > MOST_ROWS:
        finite = finite[(np.arange(MOST_ROWS) * len(finite)) // MOST_ROWS]
    return rows[finite], blocks[finite]


def _block_sums(rows: Floats, labels: Ints) -> tuple[Floats, Floats]:
    """Sums (B, B) of the distances between the rows of two blocks, and the sizes (B,) of the blocks."""
    from scipy.spatial.distance import cdist  # takes a while to load

    _, blocks = np.unique(labels, return_inverse=True)
    starts = np.flatnonzero(np.diff(blocks, prepend=-1))
    ends = np.append(starts[1:], len(rows))
    sums = np.array(
        [
            np.add.reduceat(cdist(rows[start:end], rows).sum(axis=0), starts)
            for start, end in zip(starts, ends, strict=True)
        ]
    )
    return sums, (ends - starts).astype(np.float64)


def _distances(sums: Floats, sizes: Floats, first: Bools) -> Floats:
    """Energy distances (P,) between the blocks (P, B) of the first side and all others; none within a block count."""
    a, b = first.astype(np.float64), (~first).astype(np.float64)
    out: Floats = 2.0 * np.einsum("pi,pi->p", a @ sums, b) / ((a @ sizes) * (b @ sizes))
    for side in (a, b):
        pairs = (side @ sizes) ** 2 - side @ sizes**2
        out -= (np.einsum("pi,pi->p", side @ sums, side) - side @ np.diag(sums)) / pairs
    return out
