"""Gaps and echoes of readings at rest: a lost station and the coasting before it, bursts of displaced readings."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, find_runs, freeze
from harness.measure.static_series import StaticSeries

GRAVITY_M_S2 = 9.81
_FULL_QUALITY = 0.999
_LEAST_COAST = 5
"""Samples of falling quality that show how fast it falls."""
_BEFORE = 8
"""Samples before a coasting that show where the station was."""


@dataclass(frozen=True, eq=False)
class Gaps:
    """G gaps of one station, in their order."""

    begin: Ints
    """(G,) first lost sample of each gap."""
    end: Ints
    """(G,) first sample after it."""
    whole: Bools
    """(G,) whether the gap begins and ends within the series."""
    coast_s: Floats
    """(G,) time in which quality falls from 1 to 0 before the gap, from the slope of its fall [s]; NaN if unknown."""
    coasting: Bools
    """(N,) samples whose quality has fallen before a gap."""
    lost: Bools
    """(N,) samples of the gaps."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, begin=("G",))
        count = len(self.begin)
        freeze(self, np.int64, end=(count,))
        freeze(self, coast_s=(count,))
        freeze(self, np.bool_, whole=(count,), coasting=("N",))
        freeze(self, np.bool_, lost=(len(self.coasting),))


def find_gaps_at_rest(series: StaticSeries) -> Gaps:
    """Find the gaps of a station at rest, and how its quality falls before each."""
    count = len(series)
    lost = series.quality == 0.0
    coasting = np.zeros(count, bool)
    rows = find_runs(lost)
    coast_s = np.full(len(rows), np.nan)
    for number, (first, _) in enumerate(rows.tolist()):
        begin = first
        while begin > 0 and series.quality[begin - 1] < _FULL_QUALITY and not lost[begin - 1]:
            begin -= 1
        coasting[begin:first] = True
        if first - begin >= _LEAST_COAST:
            coast_s[number] = _fall_s(series.quality[begin:first], series.rate_hz)
    whole = (rows[:, 0] > 0) & (rows[:, 1] < count) if len(rows) else np.zeros(0, bool)
    return Gaps(rows[:, 0], rows[:, 1], whole, coast_s, coasting, lost)


def leaked_tilt_rad(
    series: StaticSeries, ends: Ints, coast_s: float, left_out: Bools, noise: tuple[float, float, float]
) -> tuple[Floats, float]:
    """Tilt errors (K, 2) that explain the horizontal displacement before the samples `ends`, and their noise [rad].

    While a station coasts, a tilt error leaks gravity into the horizontal: the position moves by 0.5 g sin(tilt) t^2
    (docs/is900.md 13.4). Each tilt is found by generalised least squares with white noise and a Gauss-Markov process.
    `noise` is the white noise [m], the drift [m] and its correlation time [s]. The noise that is returned is the
    standard deviation of an axis. Coastings with samples in `left_out` are skipped.
    """
    white_m, drift_m, correlation_s = noise
    size = round(coast_s * series.rate_hz)
    time_s = (np.arange(size) + 0.5) / series.rate_hz  # sight is lost between two samples
    growth = 0.5 * GRAVITY_M_S2 * time_s**2
    apart_s = np.abs(time_s[:, None] - time_s)
    covariance = drift_m**2 * np.exp(-apart_s / correlation_s) + white_m**2 * np.eye(size)
    before = np.arange(1, _BEFORE + 1) / series.rate_hz
    reach = np.exp(-(time_s[:, None] - time_s[0] + before) / correlation_s)
    own = drift_m**2 * np.exp(-np.abs(before[:, None] - before) / correlation_s) + white_m**2 * np.eye(_BEFORE)
    whole = np.block([[own, drift_m**2 * reach.T], [drift_m**2 * reach, covariance]])
    design = np.stack([np.ones(_BEFORE + size), np.concatenate([np.zeros(_BEFORE), growth])], axis=1)
    weights = np.linalg.solve(whole, design)
    information = np.linalg.inv(design.T @ weights)
    fit = information @ weights.T
    tilts = []
    for end in ends.tolist():
        rows = np.concatenate([end - size - 1 - np.arange(_BEFORE), np.arange(end - size, end)])
        if rows.min() >= 0 and series.valid[rows].all() and not left_out[rows].any():
            tilts.append(fit[1] @ series.position_m[rows, :2])
    return np.array(tilts).reshape(-1, 2), float(np.sqrt(information[1, 1]))


def _fall_s(quality: Floats, rate_hz: float) -> float:
    """Time of the fall of quality from 1 to 0 by its slope [s]; NaN if it does not fall."""
    inside = quality > 1.5 / 255.0  # the lowest value is a floor
    if inside.sum() < _LEAST_COAST:
        return np.nan
    slope = np.polyfit(np.flatnonzero(inside) / rate_hz, quality[inside], 1)[0]
    return float(-1.0 / slope) if slope < 0.0 else np.nan


MEDIAN_S = 0.7
"""Length of the running median [s]: a displacement that lasts longer than half of it is no echo."""
LEAST_ECHO_M = 0.025
"""Smallest displacement that counts as an echo [m]; an excursion of up to 3 cm with a ramp of 0.2 s stays below it."""
_LIMIT_DEVIATIONS = 8.0
_NEIGHBOURS = 4
"""Readings on each side of a burst whose mean is the undisturbed position."""


@dataclass(frozen=True, eq=False)
class EchoBursts:
    """B bursts of one station, in their order."""

    begin: Ints
    """(B,) first sample of each burst."""
    end: Ints
    """(B,) first sample after it."""
    size_m: Floats
    """(B,) distance from the undisturbed position [m]."""
    whole: Bools
    """(B,) whether there are sound readings on both sides, so that its length is known."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, begin=("B",))
        freeze(self, np.int64, end=(len(self.begin),))
        freeze(self, size_m=(len(self.begin),))
        freeze(self, np.bool_, whole=(len(self.begin),))

    def mask(self, samples: int) -> Bools:
        """(N,) samples that belong to a burst."""
        out = np.zeros(samples, bool)
        for begin, end in zip(self.begin.tolist(), self.end.tolist(), strict=True):
            out[begin:end] = True
        return out


def echo_limit_m(white_m: float, drift_m: float, correlation_s: float) -> float:
    """Smallest displacement that counts as an echo [m], for this noise on each axis."""
    spread_m = np.sqrt(white_m**2 + drift_m**2 * min(0.5 * MEDIAN_S / correlation_s, 1.0))
    return max(LEAST_ECHO_M, _LIMIT_DEVIATIONS * float(spread_m))


def find_echoes(series: StaticSeries, limit_m: float) -> EchoBursts:
    """Find runs of readings farther than `limit_m` from a running median; runs of several displacements are parted."""
    from scipy import ndimage

    window = 2 * round(0.5 * MEDIAN_S * series.rate_hz) + 1
    position_m = hold(series.position_m, series.valid)
    away = np.zeros(len(series), bool)
    for _ in range(2):  # the second median is of the readings that are no echoes
        used = series.valid & ~away
        middle_m = np.full_like(position_m, np.nan)
        columns = [ndimage.median_filter(axis, window, mode="mirror") for axis in series.position_m[used].T]
        middle_m[used] = np.stack(columns, axis=1)  # a value that is held in a gap does not count several times
        middle_m = hold(middle_m, used)
        away = series.valid & (np.linalg.norm(position_m - middle_m, axis=1) > limit_m)
        if away.sum() > 0.5 * series.valid.sum():
            break
    sound = series.valid & ~away
    bursts = []
    for first, end in find_runs(away).tolist():
        steps = np.linalg.norm(np.diff(position_m[first:end], axis=0), axis=1)
        cuts = [first, *(first + 1 + np.flatnonzero(steps > 0.6 * limit_m)).tolist(), end]
        around = np.concatenate([_near(sound, first, -1), _near(sound, end - 1, 1)])
        rest_m = position_m[around].mean(axis=0) if len(around) else middle_m[first]
        edges = [bool(first > 0 and sound[first - 1]), bool(end < len(sound) and sound[end])]
        for begin, stop in pairwise(cuts):
            size_m = float(np.linalg.norm(position_m[begin:stop].mean(axis=0) - rest_m))
            bursts.append((begin, stop, size_m, (begin > first or edges[0]) and (stop < end or edges[1])))
    table: Floats = np.array(bursts, dtype=np.float64).reshape(-1, 4)
    return EchoBursts(table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2], table[:, 3] > 0.0)


def hold(values: Floats, valid: Bools) -> Floats:
    """Values (N, A) with each row that is not valid replaced by the last valid one before it, or the first one."""
    row = np.maximum.accumulate(np.where(valid, np.arange(len(valid)), -1))
    first = int(np.argmax(valid))
    out: Floats = values[np.where(row < 0, first, row)]
    return out


def _near(sound: Bools, at: int, direction: int) -> Ints:
    """The nearest sound samples on one side of a sample, at most `_NEIGHBOURS`, within twice as many."""
    places = at + direction * np.arange(1, 2 * _NEIGHBOURS + 1)
    places = places[(places >= 0) & (places < len(sound))]
    out: Ints = places[sound[places]][:_NEIGHBOURS]
    return out
