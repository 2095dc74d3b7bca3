"""An emulated FASTRAK with its line (docs/device.md, FASTRAK)."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.stream.fastrak.items import FASTRAK_ITEMS, FASTRAK_LIST
from harness.stream.polhemus.codec.items import FAMILY_STATIONS, MOST_DEVICE_HZ
from harness.stream.polhemus.codec.replies import ParsedReply, StatusRecord
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.emulator.argument import OUT_OF_RANGE, UNKNOWN_COMMAND, CommandArgument, CommandError
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.device import IMMEDIATE_COMMANDS, CommandDevice, CommandTable, boresight_station
from harness.stream.polhemus.emulator.device_state import DeviceState
from harness.stream.polhemus.emulator.emulator import LineEmulator
from harness.stream.polhemus.emulator.setting_commands import (
    STATION_QUERIES,
    STATION_RESETS,
    STATION_SETTERS,
    geometry_query,
    no_change,
    with_station,
)
from harness.stream.polhemus.emulator.settings import DeviceSettings


@dataclass(frozen=True)
class FastrakEmulatorConfig(EmulatorConfig):
    """Properties of the emulated device and line. Raises BadInput for impossible ones."""

    firmware: str = "3.02"
    identification: str = "OutputCompensat CPG2030-003-10"
    """Text of the status record: the default of the command `X` in the manual."""
    tagged: bool = False
    """Whether the status record has the tag `F3` and the map of the receivers, as the manual of 2012 says; VR Juggler
    refuses it."""
    hemisphere: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Hemisphere vector of each station after power-on. Zero follows the station to every side, as after `H1,0,0,0`; a
    real device has 1, 0, 0."""
    known_items: ClassVar[frozenset[int]] = FASTRAK_ITEMS
    usual_items: ClassVar[tuple[int, ...]] = FASTRAK_LIST
    known_stations: ClassVar[str] = FAMILY_STATIONS["fastrak"].decode()
    fastrak: ClassVar[bool] = True


def _ignore(device: DeviceState, now_s: float) -> None:
    """Compensation (`D`, `d`) changes no pose here: the samples have none."""


_WITHOUT_EFFECT = ("Q", "r")
"""Limits of angles, mounting of the transmitter: taken, not stored, so that they cannot be read."""


def _set_increment(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    (distance,) = argument.numbers(1)
    if distance < 0.0:
        raise CommandError(OUT_OF_RANGE, 2)
    return with_station(settings, argument, increment_m=settings.command_unit_m * distance)


def _refuse_query(settings: DeviceSettings, argument: CommandArgument) -> Iterable[ParsedReply]:
    raise CommandError(UNKNOWN_COMMAND)


class FastrakDevice(CommandDevice):
    """A FASTRAK that plays samples and executes commands. The same bytes at the same times give the same answers."""

    config_type = FastrakEmulatorConfig
    commands: ClassVar[CommandTable] = CommandTable(
        actions={"B": lambda device, argument, now_s: boresight_station(device, argument, now_s, True)},
        setters={**STATION_SETTERS, "I": _set_increment, **dict.fromkeys(_WITHOUT_EFFECT, no_change)},
        set_only={**STATION_RESETS, "e": no_change, "y": no_change},
        queries={
            **STATION_QUERIES,
            "I": geometry_query("I", lambda station, unit_m: [station.increment_m / unit_m]),
            **dict.fromkeys(_WITHOUT_EFFECT, _refuse_query),
        },
        immediate={**IMMEDIATE_COMMANDS, "D": _ignore, "d": _ignore},
    )

    def start_streaming(self, now_s: float) -> None:
        """Send records from the next whole round on; the first one of each station whatever its increment."""
        self._sent_m: dict[int, Floats] = {}
        super().start_streaming(now_s)

    def _is_due(self, number: int, row: int) -> bool:
        """Whether the station has moved by its increment along an axis since its last record."""
        station = self.settings.station(self.rounds.station_characters[row])
        if not station.increment_m:
            return True
        position_m = self.rounds.values(number, self.settings).position_m[row]
        if row in self._sent_m and np.abs(position_m - self._sent_m[row]).max() < station.increment_m:
            return False
        self._sent_m[row] = position_m
        return True

    def status_record(self) -> StatusRecord:
        """Return the reply to `S`, with the map of the receivers that are plugged in where it is tagged."""
        status = replace(super().status_record(), blank=False)
        if not (isinstance(self.config, FastrakEmulatorConfig) and self.config.tagged):
            return status
        plugged = sum(1 << self.config.known_stations.index(name) for name in self.rounds.station_characters)
        return replace(status, tag=f"F3{plugged:X}")


class FastrakEmulator(LineEmulator):
    """A FASTRAK and the line as a host sees them. Calls must have increasing times."""

    device_type: ClassVar[type[CommandDevice]] = FastrakDevice

    def __init__(self, samples: DeviceSamples, config: FastrakEmulatorConfig | None = None, now_s: float = 0.0) -> None:
        """Switch the device on. Raises BadInput for samples that no FASTRAK can have, UnknownName for a fault's
        station that is not in them.
        """
        limit_hz = MOST_DEVICE_HZ["fastrak"] / len(samples.stations)
        if samples.rate_hz > 1.001 * limit_hz:
            raise BadInput(
                f"A FASTRAK with {len(samples.stations)} stations at {samples.rate_hz:g} Hz.",
                f"It sends {MOST_DEVICE_HZ['fastrak']:g} records per second in total: give at most {limit_hz:g} Hz.",
            )
        super().__init__(samples, config, now_s)
