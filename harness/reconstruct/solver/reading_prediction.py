"""Readings have their own time: stations that a frame does not report are predicted from their last readings.

On a slow line a frame carries one or two stations, and each station reports every 100 to 300 ms. The last readings of
all stations together tell where a silent one is now, and how sure that is.

With x_s(t) the place of station s now, its reading of age a is y = x_s(t) + D_s(a) + n. The increments D have the
second moments of the examples (`features.station_increments`), linear in age between whole periods, and n is noise.
With V = Cov(D + n) over the kept readings and A the matrix that says which reading is of which station, the best linear
unbiased prediction (generalised least squares; Aitken 1935; in geostatistics: kriging) is

    x = (A^T V^-1 A)^-1 A^T V^-1 y,    Cov(x) = (A^T V^-1 A)^-1.

V depends on ages alone, so all axes of a kind share it. Orientations are rotation vectors from the newest one of their
station. A fresh reading stays as it is; predictions carry their variance into the solver and the features. A position
that the outlier gate leaves out is not predicted: it contradicts the history that would predict it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.calibration import Calibration
from harness.core.compiled import compiled, specialise
from harness.core.compiled_rotations import as_tuple, quaternion_product, rotation_vector
from harness.reconstruct.solver.matrix_algebra import invert_positive_definite
from harness.reconstruct.solver.residuals import Residuals
from harness.stream import TrackerFrame

OLDEST_AGE, NEWEST_AGE = 24, 8
"""Ages of increments are whole periods from -`NEWEST_AGE` to `OLDEST_AGE`: of a slow round, a part is read after the
frame's instant."""
AGES = NEWEST_AGE + 1 + OLDEST_AGE
MAX_OFFSET_S = 0.04
"""A reading that is farther from the frame's instant is one of those that predict [s]."""
READINGS = 3
"""Number of readings of a station that are kept. Two and four predict as well [choice]."""
OLDEST_S = 0.6
"""A reading that is older predicts nothing [s]."""
_NOISE_M, _NOISE_RAD = 0.002, float(np.deg2rad(0.4))
"""Standard deviations of a reading's noise [m], [rad] [choice]."""
_WIDENING = 2.0
"""Factor on the variance of a prediction: performers move unlike the examples (docs/notes/constants.toml)."""
_SPEED_M_S, _TURN_RAD_S, _MEMORY_S = 1.0, 3.0, 0.2
"""RMS velocity of a station along an axis, and the time in which it is forgotten, where no example tells [choice]."""
_UNLEARNT_PERIOD_S = 0.025


class IncrementMoments(NamedTuple):
    """Second moments of the increments of S stations."""

    table: Floats
    """(4, S, A, S, A) of a horizontal and of the vertical axis [m^2], and the same of rotation vectors [rad^2]."""
    period_s: float
    """Time between two ages [s]."""


LearnMoments = Callable[[Calibration], IncrementMoments]
"""Gives the moments for the stations of a calibration."""


class ReadingHistory(NamedTuple):
    """The last readings of S stations, the newest first; positions and orientations have times of their own."""

    position_s: Floats
    """(S, K) device times [s]; -inf for none."""
    position_m: Floats
    """(S, K, 3) in the world [m]."""
    turn_s: Floats
    """(S, K) device times [s]; -inf for none."""
    turn: Floats
    """(S, K, 4) orientations of the bones that carry the stations."""


def unlearnt_moments(stations: int) -> IncrementMoments:
    """Moments without examples: stations move independently, with a velocity that forgets itself exponentially.

    The position of such a station is an integrated Ornstein-Uhlenbeck process (Uhlenbeck and Ornstein 1930).
    """
    age_s: Floats = _UNLEARNT_PERIOD_S * np.arange(-NEWEST_AGE, OLDEST_AGE + 1, dtype=float)
    covariance = _spread_after(age_s[:, None]) + _spread_after(age_s) - _spread_after(age_s[:, None] - age_s)
    table = np.zeros((4, stations, AGES, stations, AGES))
    for channel, speed in enumerate((_SPEED_M_S, _SPEED_M_S, _TURN_RAD_S, _TURN_RAD_S)):
        for station in range(stations):
            table[channel, station, :, station] = speed**2 * covariance
    return IncrementMoments(table, _UNLEARNT_PERIOD_S)


def _spread_after(age_s: Floats) -> Floats:
    """Half the variance of such an increment at a velocity of 1, by its age [s^2]."""
    share = np.abs(age_s) / _MEMORY_S
    out: Floats = _MEMORY_S**2 * (share - 1.0 + np.exp(-share))
    return out


class ReadingPrediction:
    """Predicts the silent stations of each frame, for one session."""

    def __init__(self, moments: IncrementMoments) -> None:
        stations = moments.table.shape[1]
        self._moments = moments
        self._history = ReadingHistory(
            np.full((stations, READINGS), -np.inf),
            np.zeros((stations, READINGS, 3)),
            np.full((stations, READINGS), -np.inf),
            np.tile(rotations.IDENTITY, (stations, READINGS, 1)),
        )
        rows = np.zeros(2 * stations, bool)
        arrays = np.zeros((stations, 3)), np.zeros((stations, 4)), self._history
        self._record = specialise(record_readings, np.zeros(stations), rows[:stations], rows, *arrays)
        self._predict = specialise(predict_readings, 0.0, moments, rows, np.zeros(2 * stations), *arrays)

    def record(self, residuals: Residuals, measured_s: Floats, suspect: Bools) -> None:
        """Take the readings of a frame at the device times (S,) of their records [s]; not those that are suspect."""
        arrays = residuals.target_m, residuals.world_from_target, self._history
        self._record(measured_s, suspect, residuals.measured, *arrays)

    def complete(self, residuals: Residuals, frame: TrackerFrame, instant_s: float, offset_s: Floats) -> None:
        """Add predictions at the frame's instant [s] for the readings that it lacks; not for those that were left out.

        `offset_s` (S,) are the times of its readings from the instant [s].
        """
        near = np.abs(offset_s) <= MAX_OFFSET_S
        known = np.concatenate([frame.position_valid & near, frame.orientation_valid & near])
        if known.all():
            return
        fresh, variance = known.copy(), np.zeros(len(known))
        self._predict(
            *(instant_s, self._moments, known, variance),
            *(residuals.target_m, residuals.world_from_target, self._history),
        )
        residuals.add_predictions(known & ~fresh, variance)


@compiled
def record_readings(
    measured_s: Floats, suspect: Bools, measured: Bools, position_m: Floats, turn: Floats, history: ReadingHistory
) -> None:
    """Take the measured positions (S, 3) and orientations (S, 4) of a frame as the newest, without suspect records."""
    count = len(measured_s)
    for s in range(count):
        if suspect[s] or np.isnan(measured_s[s]):
            continue
        if measured[s]:
            _put_first(history.position_s[s], history.position_m[s], measured_s[s], position_m[s])
        if measured[count + s]:
            _put_first(history.turn_s[s], history.turn[s], measured_s[s], turn[s])


@compiled
def _put_first(time_s: Floats, values: Floats, measured_s: float, value: Floats) -> None:
    """Take a reading as the newest of (K,) times and (K, D) values; one of a frame that is read again replaces it."""
    if measured_s > time_s[0]:
        time_s[1:] = time_s[:-1].copy()
        values[1:] = values[:-1].copy()
    time_s[0] = measured_s
    values[0] = value


@compiled
def predict_readings(
    instant_s: float,
    moments: IncrementMoments,
    known: Bools,
    variance: Floats,
    position_m: Floats,
    turn: Floats,
    history: ReadingHistory,
) -> None:
    """Fill in positions (S, 3) and orientations (S, 4) that are not known (2S,), with their variances (2S,), in place.

    A station without a reading of the last `OLDEST_S` stays unknown. The variance is the mean of the axes [m^2, rad^2].
    """
    count = len(position_m)
    values = np.zeros((count, READINGS, 3))
    if not known[:count].all():
        for s in range(count):
            for k in range(READINGS):
                values[s, k] = history.position_m[s, k] - history.position_m[s, 0]
        found, spread, has = _predict_axes(
            instant_s, moments.period_s, moments.table[:2], history.position_s, values, _NOISE_M
        )
        for s in range(count):
            if has[s] and not known[s]:
                position_m[s] = history.position_m[s, 0] + found[s]
                variance[s], known[s] = _WIDENING * spread[s], True
    if not known[count:].all():
        for s in range(count):
            newest = history.turn[s, 0]
            inverse = (newest[0], -newest[1], -newest[2], -newest[3])
            for k in range(READINGS):
                values[s, k] = rotation_vector(quaternion_product(as_tuple(history.turn[s, k]), inverse))
        found, spread, has = _predict_axes(
            instant_s, moments.period_s, moments.table[2:], history.turn_s, values, _NOISE_RAD
        )
        for s in range(count):
            if has[s] and not known[count + s]:
                turn[s] = _turned(history.turn[s, 0], found[s])
                variance[count + s], known[count + s] = _WIDENING * spread[s], True


@compiled
def _predict_axes(
    instant_s: float, period_s: float, table: Floats, time_s: Floats, values: Floats, noise: float
) -> tuple[Floats, Floats, Bools]:
    """Predicted values (S, 3), their variances (S,), and which stations (S,) have any, from readings (S, K, 3).

    `table` (2, S, A, S, A) has the moments of the horizontal axes and of the vertical one.
    """
    count = len(time_s)
    station, age = np.empty(count * READINGS, np.int64), np.empty(count * READINGS)
    picked = np.empty(count * READINGS, np.int64)
    order, stations, total = np.full(count, -1), 0, 0
    for s in range(count):
        for k in range(READINGS):
            since_s = instant_s - time_s[s, k]
            if not abs(since_s) <= OLDEST_S:  # a device that restarts has readings of the future
                break
            if order[s] < 0:
                order[s], stations = stations, stations + 1
            station[total], picked[total] = s, k
            age[total] = min(max(since_s / period_s + NEWEST_AGE, 0.0), AGES - 1.0)
            total += 1
    out, variance, has = np.zeros((count, 3)), np.zeros(count), order >= 0
    for axis in range(2):
        weight = _inverse_covariance(table[axis], station[:total], age[:total], noise)
        first, last = (0, 2) if axis == 0 else (2, 3)
        information, pull = np.zeros((stations, stations)), np.zeros((stations, 3))
        for i in range(total):
            a = order[station[i]]
            for j in range(total):
                information[a, order[station[j]]] += weight[i, j]
                for c in range(first, last):
                    pull[a, c] += weight[i, j] * values[station[j], picked[j], c]
        covariance = invert_positive_definite(information)
        for s in range(count):
            if order[s] >= 0:
                a = order[s]
                variance[s] += (last - first) / 3.0 * max(covariance[a, a] - noise**2, 0.0)
                for b in range(stations):
                    for c in range(first, last):
                        out[s, c] += covariance[a, b] * pull[b, c]
    return out, variance, has


@compiled
def _inverse_covariance(table: Floats, station: Ints, age: Floats, noise: float) -> Floats:
    """The inverse (N, N) of the covariance of readings, by their stations (N,) and ages (N,) in the table."""
    total = len(station)
    covariance = np.empty((total, total))
    for i in range(total):
        low_i = min(int(age[i]), AGES - 2)
        share_i = age[i] - low_i
        for j in range(i + 1):
            low_j = min(int(age[j]), AGES - 2)
            share_j = age[j] - low_j
            of = table[station[i], :, station[j]]
            near = (1.0 - share_j) * of[low_i, low_j] + share_j * of[low_i, low_j + 1]
            far = (1.0 - share_j) * of[low_i + 1, low_j] + share_j * of[low_i + 1, low_j + 1]
            covariance[i, j] = covariance[j, i] = (1.0 - share_i) * near + share_i * far
        covariance[i, i] += noise**2
    return invert_positive_definite(covariance)


@compiled
def _turned(orientation: Floats, turn_rad: Floats) -> Floats:
    """An orientation (4,) after a rotation vector (3,) about the world's axes."""
    angle = np.sqrt(turn_rad[0] ** 2 + turn_rad[1] ** 2 + turn_rad[2] ** 2)
    share = np.sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    q = (np.cos(0.5 * angle), share * turn_rad[0], share * turn_rad[1], share * turn_rad[2])
    w, x, y, z = quaternion_product(q, as_tuple(orientation))
    return np.array([w, x, y, z])
