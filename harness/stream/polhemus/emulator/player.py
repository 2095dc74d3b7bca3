"""Playing of samples: which reading is taken when, and its record with prediction, enhancement and geometry."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from harness.core.arrays import Floats
from harness.stream.polhemus.codec.records import RecordFormat, RecordValues, encode_records, to_bytes
from harness.stream.polhemus.codec.samples import MAX_RANGES, DeviceSamples
from harness.stream.polhemus.emulator.config import CONTROL_PATTERNS, EmulatorConfig
from harness.stream.polhemus.emulator.settings import (
    DeviceSettings,
    StationSettings,
    apply_station_settings,
    into_hemisphere,
)

_SAME_TIME_S = 1e-9
"""Times closer than this count as equal [s]."""


class SamplePlayer:
    """Plays samples in a loop.

    Rounds are counted from the beginning of the motion through all loops; rows are stations.
    """

    def __init__(self, samples: DeviceSamples, now_s: float) -> None:
        self.samples = samples
        self._taken_s: list[list[float]] = samples.taken_s.tolist()
        self._loop_s, self._device_loop_s = samples.loop_s, samples.device_loop_s
        self._pace = self._device_loop_s / self._loop_s
        self.begin(now_s)

    def begin(self, now_s: float) -> None:
        """Start the motion at the first instant, with the clock of that instant."""
        self._began_s, self._zero_s = now_s, 0.0

    def zero(self, now_s: float) -> None:
        """Set the clock to 0 now; the motion continues."""
        self._zero_s = 0.0
        self._zero_s = self.clock_s(now_s)

    @property
    def epoch(self) -> tuple[float, float]:
        """A value that changes whenever the meaning of stamps changes."""
        return self._began_s, self._zero_s

    def clock_s(self, now_s: float) -> float:
        """Return the device's clock at `now_s` [s]."""
        first_s = float(self.samples.device_s[0, 0]) - self._pace * self._taken_s[0][0]
        return first_s + self._pace * (now_s - self._began_s) - self._zero_s

    def time_s(self, number: int, row: int) -> float:
        """Return when a reading is taken, on the clock of the caller [s]."""
        loop, k = divmod(number, len(self._taken_s))
        return self._began_s + loop * self._loop_s + self._taken_s[k][row]

    def first_from(self, now_s: float) -> int:
        """Return the number of the first whole round from `now_s` on."""
        number = max(int((now_s - self._began_s) * self.samples.rate_hz) - 1, 0)
        while self.time_s(number, 0) < now_s - _SAME_TIME_S:
            number += 1
        return number

    def latest(self, now_s: float, row: int) -> int:
        """Return the round of the latest reading of a station; round 0 before the first reading."""
        number = int((now_s - self._began_s) * self.samples.rate_hz) + 1
        while number > 0 and self.time_s(number, row) > now_s + _SAME_TIME_S:
            number -= 1
        return max(number, 0)

    def stamps_s(self, number: int) -> Floats:
        """Return the device's clock (S,) at the readings of a round [s]."""
        loop, k = divmod(number, len(self._taken_s))
        out: Floats = self.samples.device_s[k] + loop * self._device_loop_s - self._zero_s
        return np.maximum(out, 0.0)

    def instant_of(self, number: int) -> int:
        """Return the index of the instant that a round plays."""
        return number % len(self._taken_s)


class RoundEncoder:
    """Encodes the records of one round of stations at a time, once."""

    def __init__(self, player: SamplePlayer, config: EmulatorConfig) -> None:
        self.player, self._pattern, self._stylus_bytes = player, CONTROL_PATTERNS[config.controls], config.stylus_bytes
        self._has_hemispheres = config.fastrak
        self.station_characters = config.station_characters(len(player.samples.stations))
        """Characters of the stations that are plugged in."""
        self._lost: frozenset[str] = frozenset()
        self._cache: tuple[int, DeviceSettings, tuple[float, float], dict[str, bytes]] | None = None
        """Round number, settings and epoch of the latest encoding, and its records by station."""

    def set_lost_stations(self, stations: Iterable[str]) -> None:
        """Lose exactly these stations from now on, in addition to what the samples say."""
        self._lost, self._cache = frozenset(stations), None

    def _is_lost(self, station: str, settings: DeviceSettings) -> bool:
        """Whether a station is lost, as all are without a constellation."""
        return station in self._lost or not settings.emitters

    def quality(self, now_s: float, station: str, settings: DeviceSettings) -> float:
        """Return the quality of the station's latest reading, 0 to 1."""
        row = self.station_characters.index(station)
        instant = self.player.instant_of(self.player.latest(now_s, row))
        return (
            0.0
            if self._is_lost(station, settings)
            else float(np.clip(self.player.samples.quality[instant, row], 0.0, 1.0))
        )

    def orientation(self, now_s: float, station: str, settings: DeviceSettings) -> Floats:
        """Return the quaternion (4,) of the station's latest reading, before its geometry is applied."""
        row = self.station_characters.index(station)
        out: Floats = self._poses(self.player.instant_of(self.player.latest(now_s, row)), settings)[1][row]
        return out

    def ranges(self, now_s: float, station: str, settings: DeviceSettings) -> tuple[int, int]:
        """Return how many ranges the station received and rejected at its latest reading; none when it is lost here.

        Samples without a filter give as many as the quality suggests, and none is ever rejected.
        """
        filtered, row = self.player.samples.filter, self.station_characters.index(station)
        if filtered is None:
            return int(np.ceil(MAX_RANGES * self.quality(now_s, station, settings))), 0
        if self._is_lost(station, settings):
            return 0, 0
        instant = self.player.instant_of(self.player.latest(now_s, row))
        return int(filtered.ranges_received[instant, row]), int(filtered.ranges_rejected[instant, row])

    def records(self, number: int, settings: DeviceSettings) -> dict[str, bytes]:
        """Return the records of a round by station."""
        cached, epoch = self._cache, self.player.epoch
        if cached is None or cached[0] != number or cached[1] is not settings or cached[2] != epoch:
            self._cache = cached = number, settings, epoch, self._encode(number, settings)
        return cached[3]

    def values(self, number: int, settings: DeviceSettings) -> RecordValues:
        """Return what the stations that are plugged in report in a round, with the geometry of these settings."""
        samples, instant, stamps_s = self.player.samples, self.player.instant_of(number), self.player.stamps_s(number)
        position_m, orientation = self._poses(instant, settings)
        quality = samples.quality[instant].copy()
        # Each station is a second ahead of the one before, so that a client that mixes them up shows it.
        buttons, joystick = self._pattern(number / samples.rate_hz + np.arange(len(samples.stations), dtype=float))
        for row, (name, station) in enumerate(zip(self.station_characters, self._stations(settings), strict=True)):
            if self._has_hemispheres:
                position_m[row] = into_hemisphere(position_m[row], station)
            if not station.plain:
                position_m[row], orientation[row] = apply_station_settings(position_m[row], orientation[row], station)
            if self._is_lost(name, settings):
                quality[row] = 0.0
        return RecordValues(stamps_s, position_m, orientation, quality, buttons, joystick)

    def _poses(self, instant: int, settings: DeviceSettings) -> tuple[Floats, Floats]:
        """Return new positions (S, 3) and quaternions (S, 4) with prediction and enhancement, but without geometry."""
        samples = self.player.samples
        position_m, orientation = samples.position_m[instant], samples.tracker_from_station[instant]
        if samples.filter is None:
            return position_m.copy(), orientation.copy()
        stations = self._stations(settings)
        prediction_ms = np.array([station.prediction_ms for station in stations])
        enhancement = np.array([station.enhancement for station in stations])
        return samples.filter.report_poses(position_m, orientation, prediction_ms, enhancement, instant)

    def _stations(self, settings: DeviceSettings) -> list[StationSettings]:
        """Return the settings of the stations that are plugged in."""
        return [settings.station(name) for name in self.station_characters]

    def _encode(self, number: int, settings: DeviceSettings) -> dict[str, bytes]:
        values = self.values(number, settings)
        rows_of: dict[tuple[int, ...], list[int]] = {}
        for row, station in enumerate(self._stations(settings)):
            rows_of.setdefault(station.items, []).append(row)
        out, number_format = {}, replace(record_format(settings), stylus_bytes=self._stylus_bytes)
        for items, rows in rows_of.items():
            part = values.rows(rows)
            characters = np.array([ord(self.station_characters[row]) for row in rows], np.uint8)
            table = encode_records(items, characters, part, number_format)
            for index, row in enumerate(rows):
                out[self.station_characters[row]] = to_bytes(items, table[index : index + 1], number_format)
        return out


def record_format(settings: DeviceSettings) -> RecordFormat:
    """Return the format in which a device with these settings writes records."""
    return RecordFormat(
        metres_per_unit=settings.record_unit_m,
        seconds_per_tick=1e-6 if settings.microseconds else 1e-3,
        binary=settings.binary,
    )
