"""Records of single stations, put together into frames.

Stations are read one after another, so a frame closes when the station number does not increase, when the last
station has come, or when 1.5 periods have passed since its first record. A station without a record is an invalid
row. The wire has no checksum: rows whose time runs backwards or whose numbers cannot be are marked suspect.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats, Ints
from harness.errors import BadInput
from harness.stream.clock import DeviceClock
from harness.stream.frame import TrackerFrame
from harness.stream.records import STATIONS

FARTHEST_M = 30.0
"""No IS-900 hall is larger; a position beyond it is damage."""
NORM_SLACK = 0.02
"""How far the norm of a quaternion may be from 1."""


class FrameAssembler:
    """For stations that are numbered from 1 in the given order; `unit_m` is the device's unit of length [m]."""

    def __init__(self, stations: Sequence[str], period_s: float, unit_m: float = 0.01) -> None:
        if not 0 < len(stations) <= len(STATIONS):
            raise BadInput(f"{len(stations)} stations.", f"An IS-900 has 1 to {len(STATIONS)}.")
        self.stations = tuple(stations)
        self._patience_s, self._unit_m = 1.5 * period_s, unit_m
        self._clock = DeviceClock()
        self._open: list[TrackerFrame] = []
        self._records: NDArray[np.void] | None = None
        self._station: Ints = np.empty(0, dtype=np.int64)
        self._received_s: Floats = np.empty(0)
        self._device_s: Floats = np.empty(0)
        self._latest_s = np.full(len(stations), -np.inf)
        self.unknown = 0
        """Records of stations that were not configured; left out of every frame."""

    def push(self, records: NDArray[np.void], received_s: Floats) -> list[TrackerFrame]:
        """The frames that N further records complete; `received_s` (N,) host time of each [s]."""
        number = _numbers(records["station"])
        known = number < len(self.stations)
        self.unknown += int(np.count_nonzero(~known))
        records, number, received_s = records[known], number[known], received_s[known]
        device_s = self._clock.unwrapped_s(records["time"])
        if self._records is not None:
            records = np.concatenate([self._records, records])
            number = np.concatenate([self._station, number])
            received_s = np.concatenate([self._received_s, received_s])
            device_s = np.concatenate([self._device_s, device_s])
        starts = self._starts(number, received_s)
        whole = len(number) > 0 and number[-1] == len(self.stations) - 1
        last = len(number) if whole or not len(starts) else int(starts[-1])
        frames = self._frames(records[:last], number[:last], received_s[:last], device_s[:last], starts)
        self._records, self._station = records[last:], number[last:]
        self._received_s, self._device_s = received_s[last:], device_s[last:]
        return frames

    def flush(self) -> list[TrackerFrame]:
        """The frame that is still open, at the end of a stream."""
        if self._records is None or not len(self._records):
            return []
        starts = np.zeros(1, dtype=np.int64)
        frames = self._frames(self._records, self._station, self._received_s, self._device_s, starts)
        self._records = None
        return frames

    def _starts(self, number: Ints, received_s: Floats) -> Ints:
        """Where frames begin among records."""
        starts: list[int] = []
        fresh = np.concatenate([[True], number[1:] <= number[:-1]]) if len(number) else np.empty(0, bool)
        candidates = np.flatnonzero(fresh)
        late = np.flatnonzero(received_s - _first_of(received_s, fresh) > self._patience_s) if len(number) else []
        if not len(late):
            return candidates
        first = -np.inf
        for k in range(len(number)):
            if fresh[k] or received_s[k] - first > self._patience_s:
                starts.append(k)
                first = received_s[k]
        return np.array(starts, dtype=np.int64)

    def _frames(
        self, records: NDArray[np.void], number: Ints, received_s: Floats, device_s: Floats, starts: Ints
    ) -> list[TrackerFrame]:
        if not len(records):
            return []
        starts = starts[starts < len(records)]
        frame = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(records))))
        shape = (len(starts), len(self.stations))
        position, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
        time, quality = np.full(shape, np.nan), np.zeros(shape)
        position[frame, number] = self._unit_m * records["position"].astype(float)
        quaternion[frame, number] = records["quaternion"]
        time[frame, number] = device_s
        quality[frame, number] = records["quality"] / 255.0
        came = ~np.isnan(time)
        suspect = came & self._runs_back(time)
        norm = np.linalg.norm(quaternion, axis=2)
        with np.errstate(invalid="ignore"):
            placed = (np.abs(position) < FARTHEST_M).all(axis=2)
            turned = np.abs(norm - 1.0) < NORM_SLACK
        suspect |= came & ~(placed & turned)
        valid = came & (quality > 0.0)
        position_valid, orientation_valid = valid & placed, valid & turned
        position[~position_valid] = np.nan
        quaternion[~orientation_valid] = np.nan
        with np.errstate(invalid="ignore"):
            quaternion /= norm[..., None]
        ended_s = received_s[np.append(starts[1:], len(records)) - 1]
        return [
            TrackerFrame(*row)
            for row in zip(
                ended_s.tolist(),
                time,
                position,
                quaternion,
                position_valid,
                orientation_valid,
                quality,
                suspect,
                strict=True,
            )
        ]

    def _runs_back(self, time_s: Floats) -> NDArray[np.bool_]:
        """(F, S) where a station's stamp is not later than every one that it gave before."""
        with np.errstate(invalid="ignore"):
            filled = np.where(np.isnan(time_s), -np.inf, time_s)
            before = np.maximum.accumulate(np.vstack([self._latest_s, filled]), axis=0)
            self._latest_s = before[-1]
            back: NDArray[np.bool_] = time_s <= before[:-1]
        return back


def _numbers(characters: NDArray[np.bytes_]) -> Ints:
    """(N,) 0 for station '1', ..., 11 for 'C'."""
    table = np.full(256, len(STATIONS), dtype=np.int64)
    table[np.frombuffer(STATIONS, np.uint8)] = np.arange(len(STATIONS))
    return (
        table[characters.view(np.uint8)]
        if characters.flags.c_contiguous
        else table[np.ascontiguousarray(characters).view(np.uint8)]
    )


def _first_of(values: Floats, fresh: NDArray[np.bool_]) -> Floats:
    """(N,) the value at the latest fresh place."""
    places = np.maximum.accumulate(np.where(fresh, np.arange(len(values)), 0))
    return values[places]
