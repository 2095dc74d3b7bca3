"""Stations at rest: their readings on the uniform grid of their samples, as differences from the resting pose."""

from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.core.runs import find_runs
from harness.stream.recording.station_readings import StationReadings

MIN_REST_S = 5.0
"""Shortest rest that is used [s]."""
_WINDOW_S = 1.0
_STILL_M, _STILL_RAD = 0.02, float(np.deg2rad(1.5))
"""Largest median distance from the median within a window: far above noise and drift at rest [choice]."""
_STEP_M, _STEP_RAD = 0.07, float(np.deg2rad(3.0))
"""Largest step of the median from one window to the next: two opposite excursions of 3 cm are nearer [choice]."""


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

    Windows of one second are at rest if the median distance from their median pose is small, and so is the step from
    the window before. Echoes, gaps and excursions of up to 3 cm do not end a rest. A window without valid readings, in
    which the station is lost, does not end it either, but a rest neither begins nor ends with one.
    """
    size = max(round(_WINDOW_S * rate_hz), 4)
    count = len(readings) // size
    if count == 0:
        return np.zeros((0, 2), dtype=np.int64)
    rows = slice(0, count * size)
    place = readings.position_m[rows].reshape(count, size, 3)
    turn = readings.tracker_from_station[rows].reshape(count, size, 4)
    seen = (np.isfinite(place[..., 0]) & np.isfinite(turn[..., 0])).sum(axis=1) >= size // 4
    still, last_m, last_turn = np.zeros(count, bool), None, None
    for i in np.flatnonzero(seen).tolist():
        middle_m = np.nanmedian(place[i], axis=0)
        middle_turn = _mean_orientation(turn[i])
        near = np.nanmedian(np.linalg.norm(place[i] - middle_m, axis=1)) < _STILL_M
        near &= np.nanmedian(rotations.angle_between_rad(turn[i], middle_turn)) < _STILL_RAD
        if last_m is not None and last_turn is not None and still[:i][seen[:i]][-1:].any():
            near &= np.linalg.norm(middle_m - last_m) < _STEP_M
            near &= rotations.angle_between_rad(middle_turn, last_turn) < _STEP_RAD
        still[i], last_m, last_turn = near, middle_m, middle_turn
    still |= ~seen
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

    A sample's place is its device time times the rate, rounded, so that a sample that never came leaves a place empty.
    Of records with one stamp the first is taken. Records without a stamp are left out.
    """
    rows = np.arange(*rest)
    rows = rows[np.isfinite(readings.measured_s[rows])]
    begin_s = float(readings.measured_s[rows[0]])
    place = np.round((readings.measured_s[rows] - begin_s) * rate_hz).astype(np.int64)
    _, first = np.unique(place, return_index=True)
    rows, place = rows[first], place[first]
    count = int(place[-1]) + 1
    turn = readings.tracker_from_station[rows]
    valid = np.zeros(count, bool)
    sound = ~readings.suspect[rows] & np.isfinite(readings.position_m[rows, 0]) & np.isfinite(turn[:, 0])
    valid[place] = sound
    position_m, rotation_rad = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
    position_m[place[sound]] = readings.position_m[rows[sound]]
    position_m -= np.nanmedian(position_m, axis=0)
    from_middle = rotations.multiply(turn[sound], rotations.inverse(_mean_orientation(turn[sound])))
    rotation_rad[place[sound]] = rotations.log(from_middle)
    quality = np.full(count, np.nan)
    quality[place] = readings.quality[rows]
    return StaticSeries(
        station, rate_hz, begin_s, float(readings.received_s[rows[0]]), position_m, rotation_rad, quality, valid
    )


def _mean_orientation(quaternions: Floats) -> Floats:
    """The mean (4,) of orientations (N, 4), rows of NaN left out (Markley et al. 2007, J. Guid. Control Dyn. 30)."""
    sound = quaternions[np.isfinite(quaternions[:, 0])]
    _, vectors = np.linalg.eigh(sound.T @ sound)
    out: Floats = vectors[:, -1]
    return out
