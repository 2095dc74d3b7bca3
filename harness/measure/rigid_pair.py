"""Errors in motion of two stations on one rigid bar, without any reference.

The vector from one station to the other is constant in the frame of the bar. What it changes by is the error of both
stations. A position that is measured at another moment than the orientation shows as an error along the relative
velocity of the two stations: (p_b - p_a) = R r + ahead d/dt (R r), with the bar's rotation R and vector r.

A bar whose length was measured also shows the bias of the length over the volume (ASTM E3064). The bar need not rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import special

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.number_format import NORMAL_QUANTILE, Interval
from harness.errors import BadInput
from harness.measure.uncertainty import BudgetComponent, UncertaintyBudget

SPEED_EDGES_M_S = (0.0, 0.05, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Edges of the classes of speed [m/s]; the first class is rest [choice]."""
_MAX_STEP_S = 0.1
"""Longest time between two readings that are interpolated [s]."""
_BLOCK_S = 5.0
"""Length of the blocks whose sums give the intervals [s]: five correlation times of the drift."""
_MIN_BLOCKS = 6
_PLACES = 4
"""Classes of place."""
_OUTLIER = 5.0
"""Errors beyond this many median absolute values are left out: echoes and excursions."""
_MIN_TURN_SPEED_M_S = 0.05
"""Least RMS of the stations' relative speed that shows a difference of their times [m/s]."""


@dataclass(frozen=True)
class SpeedClass:
    """Errors of the bar's vector in one class of speed."""

    from_m_s: float
    to_m_s: float
    rms_m: Interval
    """RMS of the error, of both stations together [m]."""


@dataclass(frozen=True)
class PlaceClass:
    """Length of the bar in one class of distance from the tracker's origin."""

    from_m: float
    to_m: float
    length_m: Interval
    """Mean length [m]."""
    spread_m: float
    """Standard deviation of the length [m]."""


@dataclass(frozen=True)
class RigidPair:
    """What two stations on one bar show."""

    stations: tuple[str, str]
    length_m: Interval
    """Distance of the two stations [m]."""
    rotation_rad: Interval
    """RMS of the difference of the two orientations from its mean [rad]."""
    ahead_s: Interval
    """Time by which positions run ahead of orientations [s]: `components.speed.ahead_s` of a scenario."""
    speeds: tuple[SpeedClass, ...]
    """Classes of speed in which the pair was measured."""
    places: tuple[PlaceClass, ...]
    """Classes of place, of as many readings each."""
    budget: UncertaintyBudget
    """Uncertainty of the length of a single reading [m]."""


def measure_rigid_pair(
    stations: tuple[str, str],
    time_s: tuple[Floats, Floats],
    position_m: tuple[Floats, Floats],
    tracker_from_station: tuple[Floats, Floats],
    stated_m: tuple[float, float] | None = None,
) -> RigidPair:
    """Measure two stations on one bar from their valid readings: times (N,), positions (N, 3), quaternions (N, 4).

    `stated_m` is the length of the bar that somebody measured, and its standard uncertainty. The second station is
    interpolated at the times of the first. BadInput with fewer than `_MIN_BLOCKS` blocks of
    common readings.
    """
    rows, b_m, b_turn = _at_times_of_first(time_s, position_m[1], tracker_from_station[1])
    now_s, a_m, a_turn = time_s[0][rows], position_m[0][rows], tracker_from_station[0][rows]
    block = ((now_s - now_s[0]) // _BLOCK_S).astype(np.int64) if len(now_s) else np.zeros(0, dtype=np.int64)
    if len(np.unique(block)) < _MIN_BLOCKS:
        found = f"{stations[0]} and {stations[1]} have {len(np.unique(block)) * _BLOCK_S:g} s of common readings."
        raise BadInput(found, f"Move the bar for {_MIN_BLOCKS * _BLOCK_S:g} s or more, in sight of the emitters.")
    vector_m = rotations.rotate(rotations.inverse(a_turn), b_m - a_m)  # in the frame of the first station
    lever_m = np.median(vector_m, axis=0)
    turned = rotations.multiply(rotations.inverse(a_turn), b_turn)
    mean_turn = rotations.mean_rotation(turned)
    twist_rad = rotations.log(rotations.multiply(rotations.inverse(mean_turn), turned))
    relative_m_s = _derivative(now_s, rotations.rotate(a_turn, lever_m))
    speed_m_s = np.linalg.norm(_derivative(now_s, 0.5 * (a_m + b_m)), axis=1)
    error_m = (b_m - a_m) - rotations.rotate(a_turn, lever_m)
    size_m = np.linalg.norm(error_m, axis=1)
    kept = np.isfinite(relative_m_s).all(axis=1) & np.isfinite(speed_m_s)
    kept &= size_m < _OUTLIER * np.median(size_m[kept]) if kept.any() else False
    if not kept.any():
        found = f"{stations[0]} and {stations[1]} have no three readings within {2.0 * _MAX_STEP_S:g} s."
        raise BadInput(found, "Record the bar at a higher rate.")
    length_m, away_m = np.linalg.norm(vector_m[kept], axis=1), np.linalg.norm(0.5 * (a_m + b_m)[kept], axis=1)
    length = _mean(length_m, block[kept])
    places = _places(length_m, away_m, block[kept])
    columns = error_m[kept], relative_m_s[kept], twist_rad[kept], speed_m_s[kept], block[kept]
    return RigidPair(
        stations,
        length,
        _rms(np.linalg.norm(columns[2], axis=1), columns[4]),
        _ahead(columns[0], columns[1], columns[4]),
        tuple(
            SpeedClass(low, high, _rms(size_m[kept][inside], block[kept][inside]))
            for low, high in pairwise(SPEED_EDGES_M_S)
            if len(np.unique(block[kept][inside := (columns[3] >= low) & (columns[3] < high)])) >= _MIN_BLOCKS
        ),
        places,
        _budget(length_m, length, places, block[kept], stated_m),
    )


def _places(length_m: Floats, away_m: Floats, block: Ints) -> tuple[PlaceClass, ...]:
    """Quarters of the readings by their distance from the tracker's origin; one class for a bar in one place."""
    edges = np.unique(np.quantile(away_m, np.linspace(0.0, 1.0, _PLACES + 1)))
    out = []
    for low, high in pairwise(edges.tolist()):
        inside = (away_m >= low) & (away_m <= high)
        if len(np.unique(block[inside])) > 1:
            out.append(PlaceClass(low, high, _mean(length_m[inside], block[inside]), float(np.std(length_m[inside]))))
    return tuple(out)


def _budget(
    length_m: Floats, length: Interval, places: Sequence[PlaceClass], block: Ints, stated_m: tuple[float, float] | None
) -> UncertaintyBudget:
    """Repeatability at one place, change over the volume, and the stated length with its uncertainty."""
    components = []
    if places:
        within = float(np.sqrt(np.mean([one.spread_m**2 for one in places])))
        components.append(BudgetComponent("repeatability", within, "A", float(len(np.unique(block)) - 1)))
    if len(places) > 1:
        over = float(np.std([one.length_m.value for one in places], ddof=1))
        components.append(BudgetComponent("change over the volume", over, "A", float(len(places) - 1)))
    bias = Interval.missing("Nobody stated the length of the bar: --length MM,MM.")
    if stated_m is not None:
        components.append(BudgetComponent("stated length", stated_m[1], "B"))
        half = float(np.hypot(0.5 * (length.high - length.low), NORMAL_QUANTILE * stated_m[1]))
        value = length.value - stated_m[0]
        bias = Interval(value, value - half, value + half, length.count)
    return UncertaintyBudget("length of the bar", "m", tuple(components), bias)


def _at_times_of_first(time_s: tuple[Floats, Floats], b_m: Floats, b_turn: Floats) -> tuple[Ints, Floats, Floats]:
    """Rows of the first station between two near readings of the second, whose pose is interpolated there.

    Positions follow a cubic through the nearest four readings (Catmull-Rom); orientations a great arc.
    """
    a_s, b_s = time_s
    after = np.clip(np.searchsorted(b_s, a_s, side="right"), 2, max(len(b_s) - 2, 2))
    if len(b_s) < 4 or not len(a_s):
        return np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 4))
    quartet_s = b_s[after[:, None] + np.arange(-2, 2)]
    near = (np.diff(quartet_s, axis=1) < _MAX_STEP_S).all(axis=1)
    rows = np.flatnonzero(near & (a_s >= quartet_s[:, 1]) & (a_s <= quartet_s[:, 2]))
    before, now_s = after[rows] - 1, a_s[rows]
    share = ((now_s - b_s[before]) / (b_s[before + 1] - b_s[before]))[:, None]
    between = rotations.log(rotations.multiply(rotations.inverse(b_turn[before]), b_turn[before + 1]))
    turn = rotations.multiply(b_turn[before], rotations.exp(share * between))
    place = np.zeros((len(rows), 3))
    for offset in range(-1, 3):  # Lagrange's polynomial through four readings, which need not be evenly spaced
        weight = np.ones(len(rows))
        for other in range(-1, 3):
            if other != offset:
                weight *= (now_s - b_s[before + other]) / (b_s[before + offset] - b_s[before + other])
        place += weight[:, None] * b_m[before + offset]
    return rows, place, turn


def _derivative(time_s: Floats, values: Floats) -> Floats:
    """Central differences (N, 3) of values over their neighbours; NaN at the ends and across gaps."""
    out: Floats = np.full(values.shape, np.nan)
    step_s = time_s[2:] - time_s[:-2]
    near = step_s < 2.0 * _MAX_STEP_S
    out[1:-1][near] = ((values[2:] - values[:-2])[near].T / step_s[near]).T
    return out


def _ahead(error_m: Floats, velocity_m_s: Floats, block: Ints) -> Interval:
    """Regression of the errors (N, 3) on the relative velocities (N, 3)."""
    power = np.sum(velocity_m_s**2, axis=1)
    if np.sqrt(power.mean()) < _MIN_TURN_SPEED_M_S:
        return Interval.missing("The bar hardly turned: turn it about several axes.")
    return _block_ratio(np.sum(velocity_m_s * error_m, axis=1), power, block)


def _mean(values: Floats, block: Ints) -> Interval:
    return _block_ratio(values, np.ones(len(values)), block)


def _rms(values: Floats, block: Ints) -> Interval:
    squared = _block_ratio(values**2, np.ones(len(values)), block)
    low, middle, high = np.sqrt(np.maximum([squared.low, squared.value, squared.high], 0.0)).tolist()
    return Interval(middle, low, high, squared.count)


def _block_ratio(numerator: Floats, denominator: Floats, block: Ints) -> Interval:
    """The ratio of two sums over (N,) values, with the standard deviation that the blocks' sums show (delta method).

    Values of one block may depend on each other.
    """
    _, row = np.unique(block, return_inverse=True)
    above, below = np.bincount(row, numerator), np.bincount(row, denominator)
    ratio = float(above.sum() / below.sum())
    count = len(above)
    deviation = np.sqrt(count / (count - 1) * np.sum((above - ratio * below) ** 2)) / below.sum()
    half = float(special.stdtrit(count - 1, 0.975) * deviation)
    return Interval(ratio, ratio - half, ratio + half, count)
