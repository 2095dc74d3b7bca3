"""Timing of a device and its line: rate, lost and repeated records, and the device's clock against the host's.

The host may read a byte late, never early. The clock ratio therefore comes from the least difference of the two clocks
in each of many stretches of time, by the slope of Theil and Sen, which ignores stretches in which every record came
late.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.number_format import Interval
from harness.core.seeds import generator
from harness.stream.recording import CaptureBlock, StationReadings

TIMING_KEYS = (
    "timing.rate_hz",
    "timing.jitter_s",
    "timing.delay_s",
    "timing.lost_share",
    "timing.duplicate_share",
    "timing.stamp_resolution_s",
    "timing.clock_age_s",
    "components.clock.drift_ppm",
)
"""Names of the measured numbers.

Jitter is the standard deviation of a station's period by the device's clock. Delay is the mean time by which records
arrive later than the earliest one of the same second. Clock age is the reading of the device's clock when it was set
up, which should be zero.
"""
_BIN_S = 1.0
_MOST_BINS = 120
_FEWEST_BINS = 8
_LAST_STAMPS = 500
"""Stamps of each station at the end of a capture whose resolution is measured."""
_AGE_TOLERANCE_S = 0.5
"""Half width of the interval of the clock's age [s]: the set-up of a device takes that long [choice]."""
_DRAWS = 300
_LEAST_BLOCK = 4


@dataclass
class _StationCounts:
    records: int = 0
    duplicates: int = 0
    lost: int = 0
    steps: int = 0
    """Periods between the records that were compared."""
    elapsed_s: float = 0.0
    """Sum of the times between them, by the device's clock [s]."""
    squares_s2: float = 0.0
    """Sum of the squared deviations of single periods from the nominal one [s^2]."""
    deviations_s: float = 0.0
    singles: int = 0
    last: StationReadings | None = None
    """The last record, to compare the next block with it."""


@dataclass(frozen=True)
class TimingMeasurement:
    """Numbers by `TIMING_KEYS`, of all stations together and of each."""

    all_stations: Mapping[str, Interval]
    by_station: Mapping[str, Mapping[str, Interval]]
    expected_resolution_s: float
    """Resolution of stamps in the wire format at the length of the capture, had the clock been zero at set-up [s]."""


class TimingAccumulator:
    """Collects the timing of a capture, block by block."""

    def __init__(self, rate_hz: float) -> None:
        """`rate_hz` is the nominal rate of each station [Hz]."""
        self._rate_hz = rate_hz
        self._counts: dict[str, _StationCounts] = {}
        self._clocks: dict[int, dict[int, tuple[float, float]]] = {}
        """Session of the line -> second -> least difference of host and device clock, and device time [s]."""
        self._delays_s: list[float] = []
        """Mean delay of each second of each station [s]."""
        self._tails_s: dict[str, Floats] = {}
        """The latest stamps of each station [s]."""
        self._seconds_per_tick = 1e-3
        self._age_s, self._longest_s = math.nan, 0.0
        self._session = -1

    def add(self, block: CaptureBlock) -> None:
        """Add the readings of a block; blocks come in the order of the capture."""
        if block.session != self._session:
            self._session = block.session
            for counts in self._counts.values():
                counts.last = None
        self._seconds_per_tick = block.wire.settings.seconds_per_tick
        for station, readings in block.stations.items():
            self._add_station(station, readings)
            self._add_clocks(block, station, readings)

    def measure(self) -> TimingMeasurement:
        """The numbers of everything that was added."""
        clock, span_s = self._clock_drift_ppm()
        resolution_s = self._resolution_s()
        together = _merge(self._counts)
        all_stations = {
            **self._numbers(together, resolution_s),
            "timing.delay_s": _mean(np.array(self._delays_s)),
            "timing.stamp_resolution_s": _exact(resolution_s, sum(map(len, self._tails_s.values()))),
            "timing.clock_age_s": Interval.missing("No record has a stamp.")
            if math.isnan(self._age_s)
            else Interval(self._age_s, self._age_s - _AGE_TOLERANCE_S, self._age_s + _AGE_TOLERANCE_S, 1),
            "components.clock.drift_ppm": clock,
        }
        by_station = {name: self._numbers(counts, resolution_s) for name, counts in self._counts.items()}
        ticks = max(self._longest_s, span_s, 1.0) / self._seconds_per_tick
        expected_s = float(np.spacing(np.float32(ticks))) * self._seconds_per_tick
        return TimingMeasurement(all_stations, by_station, expected_s)

    def _add_station(self, station: str, readings: StationReadings) -> None:
        counts = self._counts.setdefault(station, _StationCounts())
        if not len(readings):
            return
        joined = readings if counts.last is None else StationReadings.join([counts.last, readings])
        repeated = _repeats(joined)
        counts.records += len(readings)
        counts.duplicates += int(repeated.sum())
        times_s = joined.measured_s[~repeated & np.isfinite(joined.measured_s)]
        step_s = np.diff(times_s)
        periods = np.round(step_s * self._rate_hz)
        ahead = periods >= 1.0
        counts.lost += int(np.sum(periods[ahead] - 1.0))
        counts.steps += int(periods[ahead].sum())
        counts.elapsed_s += float(step_s[ahead].sum())
        single = step_s[periods == 1.0] - 1.0 / self._rate_hz
        counts.squares_s2 += float(np.sum(single**2))
        counts.deviations_s += float(single.sum())
        counts.singles += len(single)
        counts.last = readings.select(slice(-1, None))

    def _add_clocks(self, block: CaptureBlock, station: str, readings: StationReadings) -> None:
        known = np.isfinite(readings.measured_s)
        if not known.any():
            return
        device_s, host_s = readings.measured_s[known], readings.received_s[known]
        difference_s = host_s - device_s
        clocks = self._clocks.setdefault(block.session, {})
        second = (device_s // _BIN_S).astype(np.int64)
        order = np.lexsort((difference_s, second))
        _, first = np.unique(second[order], return_index=True)
        for row in order[first].tolist():
            least, number = (float(difference_s[row]), float(device_s[row])), int(second[row])
            clocks[number] = min(least, clocks.get(number, (math.inf, 0.0)))
        _, group = np.unique(second, return_inverse=True)
        late_s = np.bincount(group, difference_s - difference_s[order[first]][group]) / np.bincount(group)
        self._delays_s += late_s.tolist()
        stamps_s = readings.stamp_s[np.isfinite(readings.stamp_s)]
        self._tails_s[station] = np.concatenate([self._tails_s.get(station, stamps_s[:0]), stamps_s])[-_LAST_STAMPS:]
        if math.isnan(self._age_s):
            self._age_s = float(readings.stamp_s[known][0] - (host_s[0] - block.configured_s))
        self._longest_s = max(self._longest_s, float(host_s[-1] - block.configured_s))

    def _numbers(self, counts: _StationCounts, resolution_s: float) -> dict[str, Interval]:
        if not counts.steps:
            reason = "No two records have a stamp."
            return dict.fromkeys(TIMING_KEYS[:2] + TIMING_KEYS[3:5], Interval.missing(reason))
        rate_hz = counts.steps / counts.elapsed_s
        half_hz = rate_hz * resolution_s / counts.elapsed_s
        mean_s = counts.deviations_s / max(counts.singles, 1)
        jitter_s = math.sqrt(max(counts.squares_s2 / max(counts.singles, 1) - mean_s**2, 0.0))
        spread = jitter_s / math.sqrt(2.0 * max(counts.singles, 1))
        return {
            "timing.rate_hz": Interval(rate_hz, rate_hz - half_hz, rate_hz + half_hz, counts.steps),
            "timing.jitter_s": Interval.normal(jitter_s, spread, counts.singles, least=0.0),
            "timing.lost_share": count_share(counts.lost, counts.steps),
            "timing.duplicate_share": count_share(counts.duplicates, counts.records),
        }

    def _clock_drift_ppm(self) -> tuple[Interval, float]:
        """Rate error of the device's clock [1e-6] from the longest session, and the length of it [s]."""
        clocks = max(self._clocks.values(), key=len, default={})
        points = np.array(list(clocks.values())).reshape(-1, 2)
        if len(points) < _FEWEST_BINS:
            return Interval.missing(f"The clock needs {_FEWEST_BINS} s of records with stamps."), 0.0
        points = points[np.argsort(points[:, 1])]
        size = -(-len(points) // _MOST_BINS)
        least = np.array([part[np.argmin(part[:, 0])] for part in np.split(points, range(size, len(points), size))])
        span_s = float(least[-1, 1] - least[0, 1])
        slope, low, high = robust_slope(least[:, 1], least[:, 0])
        margin = self._resolution_s() / span_s  # rounding of the stamps is no independent noise
        drift, fast, slow = (float(1e6 * (1.0 / (1.0 + one) - 1.0)) for one in (slope, low - margin, high + margin))
        return Interval(drift, slow, fast, len(least)), span_s

    def _resolution_s(self) -> float:
        """The largest power of two of the stamp's unit that divides every stamp of the capture's end [s]."""
        tails_s = np.concatenate([np.zeros(0), *self._tails_s.values()])
        ticks = (tails_s / self._seconds_per_tick).astype(np.float32).astype(float)
        ticks = ticks[ticks > 0.0]
        if not len(ticks):
            return math.nan
        exponent = 10
        while exponent > -24 and np.any(np.mod(ticks, 2.0**exponent)):
            exponent -= 1
        return float(2.0**exponent * self._seconds_per_tick)


def count_share(count: int, total: int) -> Interval:
    """Share of independent events among all, with the exact interval of Clopper and Pearson 1934."""
    from scipy import special

    if not total:
        return Interval.missing("There is no record.")
    low = float(special.betaincinv(count, total - count + 1, 0.025)) if count else 0.0
    high = float(special.betaincinv(count + 1, total - count, 0.975)) if count < total else 1.0
    return Interval(count / total, low, high, count)


def _repeats(readings: StationReadings) -> Bools:
    """(N,) whether a record has the stamp and the content of the station's record before it."""
    out = np.zeros(len(readings), bool)
    if len(readings) > 1:
        same = readings.stamp_s[1:] == readings.stamp_s[:-1]
        for name in ("position_m", "tracker_from_station", "quality"):
            column = getattr(readings, name).reshape(len(readings), -1)
            equal = (column[1:] == column[:-1]) | (np.isnan(column[1:]) & np.isnan(column[:-1]))
            same &= equal.all(axis=1)
        out[1:] = same
    return out


def _merge(counts: Mapping[str, _StationCounts]) -> _StationCounts:
    total = _StationCounts()
    for one in counts.values():
        for name in ("records", "duplicates", "lost", "steps", "elapsed_s", "squares_s2", "deviations_s", "singles"):
            setattr(total, name, getattr(total, name) + getattr(one, name))
    return total


def _mean(values: Floats) -> Interval:
    if len(values) < 2:
        return Interval.missing("No record has a stamp.")
    return Interval.normal(float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values))), len(values), 0.0)


def _exact(value: float, count: int) -> Interval:
    return Interval.missing("No record has a stamp.") if math.isnan(value) else Interval(value, value, value, count)


def robust_slope(at: Floats, values: Floats) -> tuple[float, float, float]:
    """Slope of values (N,) over rising places (N,), and the ends of its 95 % interval.

    The slope is the median over all pairs (Theil and Sen). Its interval is the wider one of two. One is Sen's, for
    independent errors. The other comes from residuals drawn in blocks, for errors that are correlated over several
    values (Kunsch 1989, Ann. Stat. 17), widened for the few blocks.
    """
    from scipy import special, stats

    slope, _, low, high = (float(one) for one in stats.theilslopes(values, at, 0.95))
    count = len(values)
    length = max(round(2.0 * math.sqrt(count)), _LEAST_BLOCK)
    blocks = count / length
    if blocks < 2.0:
        return slope, low, high
    first, second = np.triu_indices(count, 1)
    apart = at[second] - at[first]
    residual = values - slope * at
    rng = generator(0, "slope")
    begins = rng.integers(0, count - length + 1, size=(_DRAWS, math.ceil(blocks)))
    drawn = residual[(begins[:, :, None] + np.arange(length)).reshape(_DRAWS, -1)[:, :count]]
    slopes = np.array([np.median((one[second] - one[first]) / apart) for one in drawn])
    scatter = float(np.std(slopes)) * math.sqrt(blocks / (blocks - 1.0))
    half = scatter * float(special.stdtrit(max(blocks - 2.0, 1.0), 0.975))
    return slope, min(low, slope - half), max(high, slope + half)
