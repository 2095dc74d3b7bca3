"""Stations at rest: their readings on the uniform grid of their samples, as differences from the resting pose."""

from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, find_runs, freeze
from harness.core.motion import count_steps
from harness.stream.recording import StationReadings

MIN_REST_S = 5.0
"""Shortest rest that is used [s]."""
_WINDOW_S = 1.0
_NEIGHBOURS = 2
"""Windows on either side whose medians must agree with that of a window at rest."""
_STILL_M, _STILL_RAD = 0.02, float(np.deg2rad(1.5))
"""Largest median distance from the median within a window: far above noise and drift at rest [choice]."""
_RANGE_M, _RANGE_RAD = 0.07, float(np.deg2rad(4.0))
"""Largest distance between the medians of near windows: two opposite excursions of 3 cm are nearer [choice]."""


@dataclass(frozen=True, eq=False)
class StaticSeries:
    """N samples of one station at rest; the time between two samples is the period of the station."""

    station: str
    rate_hz: float
    begin_s: float
    """Device time of the first sample [s]."""
    received_s: float
    """Host time of the first sample [s]."""
    position_m: Floats
    """(N, 3) position minus its median, in the tracker's axes [m]; NaN where not valid."""
    rotation_rad: Floats
    """(N, 3) rotation vector from the mean orientation, in the tracker's axes [rad]: z is yaw; NaN where not valid."""
    quality: Floats
    """(N,) tracking quality; NaN where no record came."""
    valid: Bools
    """(N,) whether a sound record with quality above 0 came."""

    def __post_init__(self) -> None:
        freeze(self, position_m=("N", 3))
        count = len(self.position_m)
        freeze(self, rotation_rad=(count, 3), quality=(count,))
        freeze(self, np.bool_, valid=(count,))

    def __len__(self) -> int:
        return len(self.position_m)

    @property
    def duration_s(self) -> float:
        """Length of the rest [s]."""
        return len(self) / self.rate_hz


def find_rest(readings: StationReadings, rate_hz: float) -> Ints:
    """Rows (K, 2), first and end, of the stretches of at least `MIN_REST_S` in which the station rests.

    Their ends are left out, so that a rest between motions has to last 10 s to be found at any rate.
    Windows of one second are at rest if the median distance from their median pose is small, and if the medians of
    five consecutive windows are near each other. So motion of 2 cm/s or 1 deg/s is found. Echoes, gaps, excursions of
    up to 3 cm and a disagreement for one or two windows do not end a rest. A window without valid readings, in which
    the station is lost, does not end it either, but a rest neither begins nor ends with one.
    """
    size = max(round(_WINDOW_S * rate_hz), 4)
    count = len(readings) // size
    if count == 0:
        return np.zeros((0, 2), dtype=np.int64)
    rows = slice(0, count * size)
    place = readings.position_m[rows].reshape(count, size, 3)
    turn = readings.tracker_from_station[rows].reshape(count, size, 4)
    seen = (np.isfinite(place[..., 0]) & np.isfinite(turn[..., 0])).sum(axis=1) >= size // 4
    still, middle_m, middle_turn = np.zeros(count, bool), np.full((count, 3), np.nan), np.full((count, 4), np.nan)
    for i in np.flatnonzero(seen).tolist():
        middle_m[i], middle_turn[i] = np.nanmedian(place[i], axis=0), rotations.mean_rotation(turn[i])
        still[i] = np.nanmedian(np.linalg.norm(place[i] - middle_m[i], axis=1)) < _STILL_M
        still[i] &= np.nanmedian(rotations.angle_between_rad(turn[i], middle_turn[i])) < _STILL_RAD
    still |= ~seen
    still &= _agrees_nearby(middle_m, middle_turn)
    for first, end in find_runs(~still).tolist():
        if first > 0 and end < count and end - first <= _NEIGHBOURS:
            still[first:end] = True
    rests = []
    for first, end in find_runs(still).tolist():
        inside = np.flatnonzero(seen[first:end]) + first
        if len(inside) and (inside[-1] + 1 - inside[0]) * size >= MIN_REST_S * rate_hz:
            begin = inside[0] + (inside[0] > 0)  # motion may begin or end within a window
            stop = inside[-1] + 1 - (inside[-1] + 1 < count)
            rests.append((begin * size, len(readings) if stop == count else stop * size))
    return np.array(rests, dtype=np.int64).reshape(-1, 2)


def static_series(readings: StationReadings, rest: tuple[int, int], rate_hz: float, station: str) -> StaticSeries:
    """The readings from row `rest[0]` to before `rest[1]` on the grid of the station's samples.

    A sample that never came leaves a place empty. The grid follows the stamps where their rate is not quite `rate_hz`.
    Of records with one stamp the first is taken. Records without a stamp, and those whose stamp runs backwards or
    beyond the last sound one, are left out. If none has a stamp, the places are those in order of arrival.
    """
    rows = np.arange(*rest)
    stamped = np.isfinite(readings.measured_s[rows])
    if stamped.any():
        rows = rows[stamped]
        place = _places(readings.measured_s[rows], readings.suspect[rows], rate_hz)
        begin_s = float(readings.measured_s[rows[place >= 0][0]])
    else:
        place, begin_s = np.arange(len(rows)), float(readings.received_s[rows[0]])
    rows, place = rows[place >= 0], place[place >= 0]
    place, first = np.unique(place, return_index=True)
    rows = rows[first]
    count_steps(float(place[-1]) / rate_hz, 1.0 / rate_hz, f"Stamps of {station}")
    count = int(place[-1]) + 1
    turn = readings.tracker_from_station[rows]
    valid = np.zeros(count, bool)
    sound = ~readings.suspect[rows] & np.isfinite(readings.position_m[rows, 0]) & np.isfinite(turn[:, 0])
    valid[place] = sound
    position_m, rotation_rad = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
    position_m[place[sound]] = readings.position_m[rows[sound]]
    position_m -= np.nanmedian(position_m, axis=0)
    from_middle = rotations.multiply(turn[sound], rotations.inverse(rotations.mean_rotation(turn[sound])))
    rotation_rad[place[sound]] = rotations.log(from_middle)
    quality = np.full(count, np.nan)
    quality[place] = readings.quality[rows]
    return StaticSeries(
        station, rate_hz, begin_s, float(readings.received_s[rows[0]]), position_m, rotation_rad, quality, valid
    )


def _agrees_nearby(middle_m: Floats, middle_turn: Floats) -> Bools:
    """(K,) whether all windows within `_NEIGHBOURS` of each are near each other; NaN is near to everything."""
    count = len(middle_m)
    out = np.ones(count, bool)
    for rows in range(1, 2 * _NEIGHBOURS + 1):
        apart = np.linalg.norm(middle_m[rows:] - middle_m[:-rows], axis=1) > _RANGE_M
        apart |= rotations.angle_between_rad(middle_turn[rows:], middle_turn[:-rows]) > _RANGE_RAD
        for i in np.flatnonzero(apart).tolist():  # the windows that have both of the pair among their neighbours
            out[max(i + rows - _NEIGHBOURS, 0) : i + _NEIGHBOURS + 1] = False
    return out


def _places(measured_s: Floats, suspect: Bools, rate_hz: float) -> Ints:
    """Place (N,) of each record on the grid of its stamps, from 0; -1 for a record that has none.

    Steps between records that are not suspect give their places, a regression on the stamps the rate, and this the
    places of all, without the rounding of single steps.
    """
    sound = ~suspect if not suspect.all() else np.ones(len(suspect), bool)
    level_s = np.maximum.accumulate(np.where(sound, measured_s, -np.inf))
    sound &= measured_s >= level_s
    times_s = measured_s[sound]
    place = np.concatenate([[0.0], np.cumsum(np.rint(np.diff(times_s) * rate_hz))])
    period_s, phase_s = 1.0 / rate_hz, float(times_s[0])
    if place[-1] > 0.0:
        centred = place - place.mean()
        period_s = float(centred @ times_s) / float(centred @ centred)
        phase_s = float(np.median(times_s - place * period_s))
    first, last = np.rint((times_s[[0, -1]] - phase_s) / period_s).tolist()
    place = np.rint((measured_s - phase_s) / period_s) - first
    known = (measured_s >= level_s) & (place >= 0.0) & (place <= last - first)
    return np.where(known, place, -1.0).astype(np.int64)
