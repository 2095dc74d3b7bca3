"""A real FASTRAK as a `TrackerStream`."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

from harness.core.network import FASTRAK_PREFIX
from harness.errors import BadInput
from harness.stream.fastrak.items import FASTRAK_ITEMS, FASTRAK_LIST
from harness.stream.line_events import LineEvent, LineObserver
from harness.stream.polhemus.codec import commands
from harness.stream.polhemus.codec.commands import station_command
from harness.stream.polhemus.codec.items import MOST_DEVICE_HZ, DeviceFamily
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.records import RecordFormat
from harness.stream.polhemus.codec.replies import OutputList, StationStates, StatusRecord
from harness.stream.polhemus.driver.config import DriverTiming, LineConfig, join_commas
from harness.stream.polhemus.driver.connection import DeviceConnection, Host
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

    def __init__(
        self,
        port: str,
        config: FastrakConfig | None = None,
        *,
        observer: LineObserver | None = None,
        on_event: Callable[[LineEvent], None] = lambda event: None,
        timing: DriverTiming | None = None,
        host: Host | None = None,
    ) -> None:
        """Open and set up the tracker at `fastrak:/dev/ttyUSB0`; the prefix may be left out here.

        `observer` receives all bytes and events, `on_event` the events only. Both are called in the thread that
        iterates.
        """
        self._lists: dict[str, tuple[int, ...]] = {}
        name = FASTRAK_PREFIX + port.removeprefix(FASTRAK_PREFIX)
        super().__init__(name, config, observer=observer, on_event=on_event, timing=timing, host=host)

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
        """Read the lists of the stations, which a session changes. Old firmware may not tell them."""
        for station in self._stations.characters:
            reply = self._line.ask(station_command("O", station), OutputList, self._timing.answer_s)
            if reply is not None and reply.station == station:
                self._lists[station] = reply.items

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
            line.send(commands.BINARY if self._status.binary else commands.ASCII)
            # A port that is closed may drop bytes that have not left it, so wait until the device has answered.
            line.ask(commands.STATUS, StatusRecord, self._timing.answer_s)
