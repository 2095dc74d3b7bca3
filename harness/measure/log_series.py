"""Poses at uneven times as readings at an even rate, for methods that need one, and what that left out.

Each place of the grid takes the nearest pose. Poses are not interpolated: a mean of two would have less noise.
"""

from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.motion import count_steps
from harness.measure.sampling import LOST_STEP, mean_period_s
from harness.stream import BodyPoses
from harness.stream.recording import StationReadings

PAUSE_S = 10.0
"""Time without poses that ends a part of a log [s]."""
_SLOWER = (1.0, 1.1, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0)
"""Periods that are tried, in mean periods."""
_MOST_HOLES = 0.02
"""Largest share of the steps between consecutive poses that may leave a place of the grid empty."""
NORMAL_MEDIAN = 0.6744897501960817
"""Median of the absolute value of a standard normal variable."""
_AROUND = (0, 1, 3, 4)
"""The neighbours of the middle one of five poses."""


@dataclass(frozen=True, eq=False)
class EvenSeries:
    """Poses of one body at an even rate, in parts between pauses."""

    rate_hz: float
    parts: tuple[StationReadings, ...]
    """A row for each place of the grid; NaN where no pose is near."""
    left_out: float
    """Share of the poses that no place took."""


def even_series(body: BodyPoses, kept: Bools) -> EvenSeries:
    """The poses of a mask (N,), at least two, at the highest rate at which hardly a place is empty."""
    time_s, place_m, turn = body.times_s[kept], body.positions_m[kept], body.quaternions[kept]
    step_s = np.diff(time_s)
    single = step_s < LOST_STEP * np.median(step_s)
    period_s = mean_period_s([time_s])
    for slower in _SLOWER:
        steps = np.diff(np.rint((time_s - time_s[0]) / (slower * period_s)))[single]
        if np.mean(steps > 1.0) <= _MOST_HOLES:
            break
    period_s *= slower
    edges = np.flatnonzero(step_s > PAUSE_S) + 1
    parts, taken = [], 0
    for rows in np.split(np.arange(len(time_s)), edges):
        part = _part(time_s[rows], place_m[rows], turn[rows], period_s, body.name)
        taken += int(np.isfinite(part.quality).sum())
        parts.append(part)
    return EvenSeries(1.0 / period_s, tuple(parts), 1.0 - taken / len(time_s))


def _part(time_s: Floats, place_m: Floats, turn: Floats, period_s: float, name: str) -> StationReadings:
    count = count_steps(float(time_s[-1] - time_s[0]), period_s, f"Times of {name}") + 2
    place = np.rint((time_s - time_s[0]) / period_s)
    apart = np.abs(time_s - time_s[0] - place * period_s)
    order = np.lexsort((apart, place))
    _, first = np.unique(place[order], return_index=True)
    rows = order[first]
    at = place[rows].astype(np.int64)
    count = min(count, int(at[-1]) + 1)
    positions, quaternions, quality = np.full((count, 3), np.nan), np.full((count, 4), np.nan), np.full(count, np.nan)
    positions[at], quaternions[at], quality[at] = place_m[rows], turn[rows], 1.0
    grid_s = time_s[0] + period_s * np.arange(count)
    return StationReadings(grid_s, grid_s, grid_s, positions, quaternions, quality, np.zeros(count, bool))


def neighbour_noise(body: BodyPoses, kept: Bools) -> tuple[float, float]:
    """Standard deviations of positions [m] and rotations [rad] on each axis from one pose to the next; NaN for few.

    The distance of each pose from the cubic through its four neighbours, at whatever times they are, relative to what
    independent noise would give, in the median. Motion that a cubic does not follow adds to it, so it is a bound.
    """
    time_s, place_m, turn = body.times_s[kept], body.positions_m[kept], body.quaternions[kept]
    if len(time_s) < 5:
        return np.nan, np.nan
    weights = np.ones((len(time_s) - 4, 4))
    around = np.stack([time_s[i : len(time_s) - 4 + i] for i in _AROUND], axis=1)
    middle_s = time_s[2:-2]
    for one in range(4):
        for other in range(4):
            if one != other:
                weights[:, one] *= (middle_s - around[:, other]) / (around[:, one] - around[:, other])
    near = around[:, 3] - around[:, 0] < 4.0 * LOST_STEP * np.median(np.diff(time_s))
    size = np.sqrt(1.0 + np.sum(weights**2, axis=1))[near]
    signed = rotations.continuous(turn)
    rest_m, rest = (
        values[2:-2] - np.einsum("nk,nka->na", weights, np.stack([values[i : len(values) - 4 + i] for i in _AROUND], 1))
        for values in (place_m, signed)
    )
    rest_rad = 2.0 * rotations.multiply(rotations.inverse(signed[2:-2]), rest)[:, 1:]
    place, angle = (
        float(np.median(np.abs(values[near] / size[:, None]))) / NORMAL_MEDIAN if near.any() else np.nan
        for values in (rest_m, rest_rad)
    )
    return place, angle
