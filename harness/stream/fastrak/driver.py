"""A real FASTRAK as a `TrackerStream`."""

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import ClassVar

from harness.errors import BadInput
from harness.stream.fastrak.items import FASTRAK_ITEMS, FASTRAK_LIST
from harness.stream.polhemus.codec import commands
from harness.stream.polhemus.codec.commands import station_command
from harness.stream.polhemus.codec.items import MOST_DEVICE_HZ, DeviceFamily
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.records import RecordFormat
from harness.stream.polhemus.codec.replies import GeometryReply, OutputList, StationStates, StatusRecord
from harness.stream.polhemus.driver.config import LineConfig, join_commas
from harness.stream.polhemus.driver.connection import DeviceConnection
from harness.stream.polhemus.driver.line_tracker import LineTracker
from harness.stream.polhemus.driver.rate import (
    check_requested_rate,
    measure_rate_hz,
    rates_agree,
    too_few_records_error,
)
from harness.stream.polhemus.driver.transport import LineLost

ALL_STATES = station_command("l", "1")
"""Query of the states of all stations: the reply for station 1 tells those of 2, 3 and 4 too."""


@dataclass(frozen=True)
class FastrakConfig(LineConfig):
    """The requested configuration of a FASTRAK. Raises BadInput where it is contradictory."""

    items: tuple[int, ...] = FASTRAK_LIST
    binary: bool = True
    """Whether records are binary; False is ASCII, whose positions have a step of 0.01 units."""
    family: ClassVar[DeviceFamily] = "fastrak"

    def __post_init__(self) -> None:
        if unknown := tuple(code for code in self.items if code not in FASTRAK_ITEMS):
            raise BadInput(
                f"Output item {join_commas(unknown)} of a FASTRAK is not known.",
                f"It has {join_commas(tuple(sorted(FASTRAK_ITEMS)))}; the default list is {join_commas(FASTRAK_LIST)}.",
            )
        super().__post_init__()

    @property
    def settings(self) -> RecordFormat:
        """Number format that the device will be configured for."""
        return RecordFormat(self.metres_per_unit, binary=self.binary)


class Fastrak(LineTracker):
    """Driver of a real FASTRAK: opens the port, detects the device and configures it; streams while it is iterated.

    Records have no time stamps: `measured_s` is NaN, and the host's clock gives the time of a frame. It has no thread.
    `close` may be called from any thread. Use it as a context manager, so that Ctrl-C leaves the device silent.
    Raises BadInput when the first configuration fails. Later trouble is reported as events, and the driver reconnects.
    """

    config: FastrakConfig
    _config_type = FastrakConfig
    _states_query = ALL_STATES
    _lists: Mapping[str, tuple[int, ...]] = MappingProxyType({})
    """Output list of each station that told it, before the session."""
    _increments: Mapping[str, tuple[float, ...]] = MappingProxyType({})
    """Increment of each station that has one, before the session, in the device's unit."""

    @property
    def setup_note(self) -> str:
        """What a person at the device should know of its set-up, in one line."""
        return "alignment, boresight, tip offset, hemisphere and filters are as other programs left them"

    def _active_stations(self, port: str, line: DeviceConnection, fallback: str) -> str:
        """Return the stations that are on; `fallback` where the device does not tell."""
        states = line.ask(ALL_STATES, StationStates, line.timing.answer_s)
        if states is None and not fallback:
            raise BadInput(f"Port {port}: the device does not tell its stations (l1).", "Name them: --stations a,b.")
        return fallback if states is None else "".join(states.stations)

    def _read_settings(self) -> None:
        """Read the lists and increments of the stations, which a session changes. Old firmware may not tell them."""
        stations = self._stations.characters
        queries = b"".join(station_command(letter, station) for station in stations for letter in "OI")
        replies = self._line.collect(queries, 2 * len(stations))
        self._lists = {reply.station: reply.items for reply in replies if isinstance(reply, OutputList)}
        told = [reply for reply in replies if isinstance(reply, GeometryReply) and reply.letter == "I"]
        self._increments = {reply.station: reply.values for reply in told if any(reply.values)}
        if self._increments:
            text = f"station {', '.join(self._increments)} had an increment, which holds records back"
            self._report("settings", f"{text}: 0 for this session, then put back")

    def _configure(self, status: StatusRecord, previous_hz: float | None) -> WireFormat:
        stations, line = self._stations, self._line
        nominal_hz = MOST_DEVICE_HZ["fastrak"] / len(stations.names)
        wire = WireFormat(
            stations.names,
            previous_hz or nominal_hz,
            self.config.items,
            self.config.settings,
            stations.characters.encode(),
            zeroed=False,
            family="fastrak",
        )
        line.errors.clear()
        for _ in range(2):  # a byte of a command may have been damaged
            self._send_settings(wire)
            differences = self._differences(wire)
            if not differences:
                break
        else:
            errors = "; ".join(f"{error.command}: error {error.code}" for error in line.errors[-3:])
            advice = f"The device reported: {errors}." if errors else "Switch it off and on."
            raise BadInput(f"Port {self.port}: the device does not obey its commands: {differences}.", advice)
        return wire if previous_hz else replace(wire, rate_hz=self._find_rate_hz(wire))

    def _find_rate_hz(self, wire: WireFormat) -> float:
        """Return the rate of the device for its number of stations, or the measured one where that differs [Hz]."""
        measured_hz = measure_rate_hz(self._line, wire)
        check_requested_rate(self.port, self.config.rate_hz, measured_hz)
        if measured_hz is None:
            if self.config.rate_hz is None:
                raise too_few_records_error(self.port, self._line, wire)
            return self.config.rate_hz
        known = (rate_hz for rate_hz in (self.config.rate_hz, wire.rate_hz) if rate_hz)
        return next((rate_hz for rate_hz in known if rates_agree(rate_hz, measured_hz)), measured_hz)

    def _send_settings(self, wire: WireFormat) -> None:
        line = self._line
        line.send(commands.BINARY if self.config.binary else commands.ASCII)
        line.send(commands.CENTIMETRES if self.config.centimetres else commands.INCHES)
        for station in wire.characters.decode():
            line.send(station_command("O", station, wire.items))
        for station in self._increments:
            line.send(station_command("I", station, (0,)))

    def _differences(self, wire: WireFormat) -> str:
        """Describe where the device differs from the configuration; empty when it agrees."""
        line, answer_s = self._line, self._timing.answer_s
        status = line.ask(commands.STATUS, StatusRecord, answer_s)
        if status is None:
            return "no answer to S"
        texts = [
            f"it reports in {'binary' if status.binary else 'ASCII'}" if status.binary != self.config.binary else "",
            f"it reports in {'centimetres' if status.centimetres else 'inches'}"
            if status.centimetres != self.config.centimetres
            else "",
            "it does not stop streaming" if status.continuous else "",
        ]
        for station in self._lists:  # those that are told
            reply = line.ask(station_command("O", station), OutputList, answer_s)
            if reply is None or reply.items != wire.items:
                found = "not told" if reply is None else join_commas(reply.items)
                texts.append(f"the list of station {station} is {found}")
        return ", ".join(filter(None, texts))

    def _put_back(self, line: DeviceConnection) -> None:
        with contextlib.suppress(LineLost):
            for station, items in self._lists.items():
                line.send(station_command("O", station, items))
            self._restore_stations(line)
            line.send(commands.CENTIMETRES if self._status.centimetres else commands.INCHES)
            for station, distance in self._increments.items():
                line.send(station_command("I", station, distance, 2))
            line.send(commands.BINARY if self._status.binary else commands.ASCII)
            # A port that is closed may drop bytes that have not left it, so wait until the device has answered.
            line.ask(commands.STATUS, StatusRecord, self._timing.answer_s)
