"""Temporal alignment: the readings of all stations at one instant, the mean of their sampling times.

A tracker samples its stations in turn, at 40 Hz up to 16 ms apart (`TrackerFrame.measured_s`). A hand at 3 m/s is then
2.5 cm from where it was when the head was sampled. Each reading is moved to the frame's instant t from its own time
t_1, by the station's last readings p_1, p_0, p_-1:

- Position: between readings, t < t_1, the parabola through the last three. Beyond the last one the mean velocity of
  the last two steps, p_1 + (t - t_1) (p_1 - p_-1) / (t_1 - t_-1). The parabola, or the last step alone, would be as
  accurate there and adds jitter (docs/notes/tuning.md).
- Orientation: the last rotation vector, in proportion to the time.

The outlier gate comes first. It compares readings as measured, each with the body's position at the time of the
reading. What it lets through is aligned. A loss, an outlier, a suspect record or a gap clears the history of the
station, and its next readings stay as they are. Known slots of the stations keep the instant in place while one of them
is silent. Readings of one time stay the same to the bit.
"""

from typing import NamedTuple

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, immutable
from harness.core.compiled import compiled, specialise
from harness.core.compiled_rotations import as_tuple, quaternion_product, rotation_vector
from harness.reconstruct.solver.residuals import Residuals
from harness.stream import TrackerFrame

MAX_STEP_S = 0.04
"""Longest time between two readings of a station that still describe one motion [s]."""
MAX_BEND_M = 0.06
"""Largest second difference of three positions that counts as motion [m]: 96 m/s^2 at 40 Hz. Echoes are larger."""
MAX_TURN_RAD = 0.6
"""Largest rotation between two readings that counts as motion [rad]: 24 rad/s at 40 Hz."""
_MIN_OFFSET_S = 1e-6
"""A reading that is nearer to the instant stays as it is: the mean of equal times has a rounding error [s]."""


class AlignmentHistory(NamedTuple):
    """The last readings of S stations, as measured."""

    last_s: Floats
    """(S,) time of the last record [s]."""
    before_s: Floats
    """(S,) time of the record before it [s]."""
    last_m: Floats
    """(S, 3) last position [m]."""
    before_m: Floats
    """(S, 3) the position before it [m]."""
    positions: Ints
    """(S,) number of positions in a row up to the last record."""
    last_turn: Floats
    """(S, 4) last orientation."""
    orientations: Ints
    """(S,) number of orientations in a row up to the last record."""


class TemporalAlignment:
    """Moves the readings of S stations to one instant per frame, for one session."""

    def __init__(self, stations: int) -> None:
        self._history = AlignmentHistory(
            last_s=np.full(stations, np.nan),
            before_s=np.full(stations, np.nan),
            last_m=np.zeros((stations, 3)),
            before_m=np.zeros((stations, 3)),
            positions=np.zeros(stations, np.int64),
            last_turn=np.tile(rotations.IDENTITY, (stations, 1)),
            orientations=np.zeros(stations, np.int64),
        )
        record = immutable(np.zeros(stations)), immutable(np.zeros(stations), bool)
        readings = np.zeros(2 * stations, bool), np.zeros((stations, 3)), np.zeros((stations, 4))
        self._align = specialise(align_readings, *record, np.zeros(stations), *readings, self._history)

    def align(self, frame: TrackerFrame, residuals: Residuals, offset_s: Floats) -> None:
        """Move the readings of a frame to one instant; `offset_s` (S,) are their times from it (`measure_offsets`)."""
        self._align(
            *(frame.measured_s, frame.suspect, offset_s),
            *(residuals.measured, residuals.target_m, residuals.world_from_target),
            self._history,
        )


@compiled
def align_readings(
    measured_s: Floats,
    suspect: Bools,
    offset_s: Floats,
    measured: Bools,
    target_m: Floats,
    world_from_target: Floats,
    history: AlignmentHistory,
) -> None:
    """Move positions (S, 3) and orientations (S, 4), of which rows (2S,) are measured, to the instant, in place.

    `measured_s` (S,) are the times of the records, NaN where none arrived, and `offset_s` (S,) those from the instant.
    """
    count = len(measured_s)
    for s in range(count):
        now_s = measured_s[s]
        if suspect[s] or np.isnan(now_s):
            history.positions[s] = history.orientations[s] = 0
            continue
        if not 0.0 < now_s - history.last_s[s] <= MAX_STEP_S:
            history.positions[s] = history.orientations[s] = 0
        shift_s = -offset_s[s]
        moves = 0.0 < abs(shift_s) <= MAX_STEP_S
        if measured[s]:
            x, y, z = target_m[s, 0], target_m[s, 1], target_m[s, 2]
            if moves:
                _move_position(target_m[s], s, now_s, shift_s, history)
            history.before_m[s] = history.last_m[s]
            history.last_m[s, 0], history.last_m[s, 1], history.last_m[s, 2] = x, y, z
            history.positions[s] += 1
        else:
            history.positions[s] = 0
        if measured[count + s]:
            w, x, y, z = as_tuple(world_from_target[s])
            if moves:
                _move_orientation(world_from_target[s], s, now_s, shift_s, history)
            turn = history.last_turn[s]
            turn[0], turn[1], turn[2], turn[3] = w, x, y, z
            history.orientations[s] += 1
        else:
            history.orientations[s] = 0
        history.before_s[s], history.last_s[s] = history.last_s[s], now_s


@compiled
def measure_offsets(measured_s: Floats, suspect: Bools, slot_s: Floats, out: Floats) -> float:
    """Fill in the sampling times (S,) from the frame's instant [s]; 0 where no record arrived or it is suspect.

    The instant is the mean sampling time of the stations known so far. Their slots (S,) are updated. Returns the
    instant [s]; NaN when no usable record arrived.
    """
    start_s, records = 0.0, 0
    for s in range(len(measured_s)):
        if not suspect[s] and not np.isnan(measured_s[s] - slot_s[s]):
            start_s, records = start_s + measured_s[s] - slot_s[s], records + 1
    if records == 0:
        for s in range(len(measured_s)):
            if not suspect[s] and not np.isnan(measured_s[s]):
                start_s, records = start_s + measured_s[s], records + 1
    start_s /= records
    centre_s, known = 0.0, 0
    for s in range(len(measured_s)):
        if not suspect[s] and not np.isnan(measured_s[s]):
            slot_s[s] = measured_s[s] - start_s
        if not np.isnan(slot_s[s]):
            centre_s, known = centre_s + slot_s[s], known + 1
    instant_s = start_s + centre_s / known
    for s in range(len(measured_s)):
        offset_s = 0.0 if suspect[s] or np.isnan(measured_s[s]) else measured_s[s] - instant_s
        out[s] = offset_s if abs(offset_s) >= _MIN_OFFSET_S else 0.0
    return instant_s


@compiled
def _move_position(reading_m: Floats, s: int, now_s: float, shift_s: float, history: AlignmentHistory) -> None:
    """Move a position (3,) of station s by a time, where it makes one motion with the last two of the station."""
    if history.positions[s] < 2:
        return
    step_s, other_s = now_s - history.last_s[s], history.last_s[s] - history.before_s[s]
    last_m, before_m = history.last_m[s], history.before_m[s]
    bend_m = 0.0
    for i in range(3):
        bend_m += ((last_m[i] - before_m[i]) / other_s * step_s - (reading_m[i] - last_m[i])) ** 2
    if bend_m > MAX_BEND_M**2:
        return
    lever_s = shift_s + step_s if shift_s < 0.0 else -other_s  # a parabola, or the mean velocity of two steps
    for i in range(3):
        velocity = (reading_m[i] - last_m[i]) / step_s
        curvature = (velocity - (last_m[i] - before_m[i]) / other_s) / (step_s + other_s)
        reading_m[i] += shift_s * (velocity + lever_s * curvature)


@compiled
def _move_orientation(reading: Floats, s: int, now_s: float, shift_s: float, history: AlignmentHistory) -> None:
    """Turn an orientation (4,) of station s by a share of its rotation since the last one."""
    if history.orientations[s] < 1:
        return
    w, x, y, z = as_tuple(reading)
    last = history.last_turn[s]
    a, b, c = rotation_vector(quaternion_product((w, x, y, z), (last[0], -last[1], -last[2], -last[3])))
    angle_rad = np.sqrt(a * a + b * b + c * c)
    if angle_rad > MAX_TURN_RAD or angle_rad == 0.0:
        return
    half = 0.5 * (shift_s / (now_s - history.last_s[s])) * angle_rad
    sine = np.sin(half) / angle_rad
    moved = quaternion_product((np.cos(half), sine * a, sine * b, sine * c), (w, x, y, z))
    reading[0], reading[1], reading[2], reading[3] = moved
