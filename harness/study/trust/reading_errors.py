"""Errors of a tracker's readings on a known motion, their energy distance, and the health of the stream.

An error is a reading minus what a tracker without errors would report at the sampling time of the take. Errors of the
clock are part of it: they displace a reading along the path. The median over a recording is subtracted, because mounts
and room are calibrated anew on each side.

The energy distance of two distributions is 2 E|X - Y| - E|X - X'| - E|Y - Y'|. It is zero only where they are equal
(Szekely & Rizzo 2013). Successive errors of a tracker are correlated. A test that permutes single samples would find a
difference in them that is not there. So blocks of several correlation times change sides as a whole. Distances within
one block are left out, which makes the estimate unbiased for independent blocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, find_runs
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.experiment import ObservedTake
from harness.results.findings import StreamHealth
from harness.simulate import Trajectory
from harness.stream import StationCounts

FEATURES = {"position error": "m", "orientation error": "rad"}
"""Error -> its unit; each is a vector in the tracker's axes."""
CORRELATION_TIMES = 5.0
"""Length of a block in correlation times."""
PERMUTATIONS = 999
MOST_ROWS = 1500
"""Most samples of a side whose distances are computed; they are spread evenly over all of them."""
MIN_BLOCKS = 4
"""Least number of blocks of a side: fewer have too few permutations for a small p."""


def reading_errors(take: ObservedTake) -> dict[str, list[Floats]]:
    """`FEATURES` -> errors (N, S, 3) of each loop at its instants, one after another; NaN where there is no reading."""
    motion = Trajectory(take.clip.body, take.motion).station_motion(take.calibration, take.sample_s)
    tracker_from_world = rotations.inverse(take.calibration.world_from_tracker)
    position_m = rotations.rotate(tracker_from_world, motion.position_m - take.calibration.tracker_origin_m)
    tracker_from_station = rotations.multiply(tracker_from_world, motion.world_from_station)
    errors: dict[str, list[Floats]] = {name: [] for name in FEATURES}
    for loop in take.loops:
        read = [take.frames[row] for row in loop.rows]
        turn = rotations.multiply(
            np.array([frame.tracker_from_station for frame in read]),
            rotations.inverse(tracker_from_station[loop.index]),
        )
        found = {
            "position error": np.array([frame.position_m for frame in read]) - position_m[loop.index],
            "orientation error": rotations.log(turn),
        }
        usable = ~np.array([frame.suspect for frame in read])
        for name, values in found.items():
            series = np.full((len(loop.expected), *values.shape[1:]), np.nan)
            series[loop.index - loop.expected.start] = np.where(usable[:, :, None], values, np.nan)
            errors[name].append(_without_median(series))
    return errors


def _without_median(series: Floats) -> Floats:
    """A series (N, S, 3) minus its median; a station without any reading stays NaN."""
    some = np.isfinite(series).any(axis=0)
    middle = np.full(series.shape[1:], np.nan)
    middle[some] = np.nanmedian(series[:, some], axis=0)
    out: Floats = series - middle
    return out


@dataclass
class HealthCounts:
    """Counts of one station's stream that add up over recordings."""

    frames: int = 0
    lost: int = 0
    suspect: int = 0
    gaps: int = 0
    duration_s: float = 0.0
    quality: float = 0.0
    """Sum over the frames with a usable position."""

    def add(self, other: "HealthCounts") -> "HealthCounts":
        """The counts of both."""
        return HealthCounts(*(mine + its for mine, its in zip(vars(self).values(), vars(other).values(), strict=True)))

    def as_health(self) -> StreamHealth:
        """Rates and shares; a stream without frames is lost for all of its time."""
        seen, minutes = self.frames - self.lost, self.duration_s / 60.0
        rate_hz = self.frames / self.duration_s if self.duration_s else 0.0
        return StreamHealth(
            rate_hz,
            self.lost / self.frames if self.frames else 1.0,
            self.gaps / minutes if minutes else 0.0,
            self.lost / rate_hz / self.gaps if self.gaps and rate_hz else None,
            self.quality / seen if seen else 0.0,
            self.suspect / self.frames if self.frames else 0.0,
        )


def count_health(take: ObservedTake) -> list[HealthCounts]:
    """Counts of each station over the frames between the first and the last one of each loop.

    A frame that did not arrive at all counts as lost for every station, so that the device's silence is not overlooked.
    """
    stations = len(take.calibration.stations)
    total = [HealthCounts() for _ in range(stations)]
    for loop in take.loops:
        read, count = [take.frames[row] for row in loop.rows], len(loop.expected)
        received_s = read[-1].received_s - read[0].received_s
        duration_s = received_s * count / (count - 1) if count > 1 else 1.0 / take.rate_hz
        valid = np.zeros((count, stations), dtype=bool)
        valid[loop.index - loop.expected.start] = [frame.position_valid for frame in read]
        counts = StationCounts(stations)
        for frame in read:
            counts.add(frame)
        quality = counts.quality.tolist()
        for k in range(stations):
            gaps, lost = len(find_runs(~valid[:, k])), count - int(counts.positions[k])
            total[k] = total[k].add(HealthCounts(count, lost, int(counts.suspect[k]), gaps, duration_s, quality[k]))
    return total


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
