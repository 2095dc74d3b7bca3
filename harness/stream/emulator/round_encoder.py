"""Readings as the records of a device with these settings: geometry applied, numbers written as it was told."""

from collections.abc import Iterable

import numpy as np

from harness.core.arrays import Floats
from harness.stream.codec import ascii_records
from harness.stream.codec.records import RecordFormat, RecordValues, encode_records
from harness.stream.emulator import geometry
from harness.stream.emulator.player import SamplePlayer
from harness.stream.emulator.settings import STATION_NAMES, DeviceSettings

_INCH_M, _CENTIMETRE_M = 0.0254, 0.01


class RoundEncoder:
    """The records of one round of stations at a time, written once."""

    def __init__(self, player: SamplePlayer) -> None:
        self.player = player
        self._lost: frozenset[str] = frozenset()
        self._written: tuple[int, DeviceSettings, tuple[float, float], dict[str, bytes]] | None = None
        """Number of the round, settings and epoch it was written with, and the records by station."""

    @property
    def plugged(self) -> str:
        """Characters of the stations that are there."""
        return STATION_NAMES[: len(self.player.samples.stations)]

    def set_lost_stations(self, stations: Iterable[str]) -> None:
        """From now on these are out of sight, and no others (but where the samples say so)."""
        self._lost, self._written = frozenset(stations), None

    def quality(self, now_s: float, station: str) -> float:
        """Of the last reading, 0 to 1."""
        row = STATION_NAMES.index(station)
        k = self.player.row_of(self.player.latest(now_s, row))
        return 0.0 if station in self._lost else float(np.clip(self.player.samples.quality[k, row], 0.0, 1.0))

    def turn(self, now_s: float, station: str) -> Floats:
        """(4,) orientation of the last reading, as it was taken."""
        row = STATION_NAMES.index(station)
        out: Floats = self.player.samples.tracker_from_station[self.player.row_of(self.player.latest(now_s, row)), row]
        return out

    def records(self, number: int, settings: DeviceSettings) -> dict[str, bytes]:
        """Of a round, by station."""
        known, epoch = self._written, self.player.epoch
        if known is None or known[0] != number or known[1] is not settings or known[2] != epoch:
            self._written = known = number, settings, epoch, self._write(number, settings)
        return known[3]

    def _write(self, number: int, settings: DeviceSettings) -> dict[str, bytes]:
        samples, k, stamps_s = self.player.samples, self.player.row_of(number), self.player.stamps_s(number)
        position_m, turn = samples.position_m[k].copy(), samples.tracker_from_station[k].copy()
        quality = samples.quality[k].copy()
        rows_of: dict[tuple[int, ...], list[int]] = {}
        for row, (name, station) in enumerate(zip(self.plugged, settings.stations, strict=False)):
            if not station.plain:
                position_m[row], turn[row] = geometry.apply_station_settings(position_m[row], turn[row], station)
            if name in self._lost:
                quality[row] = 0.0
            rows_of.setdefault(station.items, []).append(row)
        out = {}
        for items, rows in rows_of.items():
            said = RecordValues(stamps_s[rows], position_m[rows], turn[rows], quality[rows])
            table = encode_records(
                items, np.array([ord(STATION_NAMES[row]) for row in rows], np.uint8), said, record_format(settings)
            )
            for place, row in enumerate(rows):
                one = table[place : place + 1]
                out[STATION_NAMES[row]] = one.tobytes() if settings.binary else ascii_records.format_records(items, one)
        return out


def record_format(settings: DeviceSettings) -> RecordFormat:
    """How a decoder has to read what a device with these settings writes."""
    return RecordFormat(
        metres_per_unit=_CENTIMETRE_M if settings.centimetres else _INCH_M,
        seconds_per_tick=1e-6 if settings.microseconds else 1e-3,
        binary=settings.binary,
    )
