"""Bursts of displaced readings at rest: reflections of the ultrasound (`components.echo`)."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, find_runs, freeze
from harness.measure.static_series import StaticSeries

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
