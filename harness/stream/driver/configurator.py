"""The set-up: tell the device how to report, ask it whether it does. No setter is acknowledged (docs/is900.md 1)."""

import re
from dataclasses import replace

from harness.errors import BadInput
from harness.stream.codec import commands
from harness.stream.codec.items import SINCE_FIRMWARE
from harness.stream.codec.reader import WireFormat
from harness.stream.codec.replies import OutputList, StatusRecord, SystemRecord, TrackingStatus
from harness.stream.driver.capacity import check_capacity, required_bit_rate
from harness.stream.driver.config import QUALITY_ITEMS, DriverConfig
from harness.stream.driver.connection import DeviceConnection
from harness.stream.driver.rate_measurement import measure_rate_hz
from harness.stream.driver.stations import StationSelection

SATURATED_SHARE = 0.95
"""A line that carries this share of what it can may have left records out [choice]."""
RATE_TOLERANCE = 0.1
"""Rates that differ by less than this share are one; `MP` rounds to whole numbers."""


def select_items(port: str, status: StatusRecord, wanted: DriverConfig) -> tuple[int, ...]:
    """The output list: without quality where `MP` is to tell it; BadInput when the firmware is too old for it."""
    if wanted.quality == "mp":
        return tuple(code for code in wanted.items if code not in QUALITY_ITEMS)
    found = re.match(r"\d+\.\d+", status.firmware)
    version = float(found[0]) if found else float("inf")  # then the device itself says whether it takes the list
    for code in wanted.items:
        if version < SINCE_FIRMWARE.get(code, 0.0):
            raise BadInput(
                f"Port {port}: firmware {status.firmware} does not know item {code} (quality), "
                f"which came with {SINCE_FIRMWARE[code]}.",
                "Take quality 'mp' (--quality mp), which asks the device once a second instead, or newer firmware.",
            )
    return wanted.items


class DeviceConfigurator:
    """Sets up one device, once. `boresight` is for the first time: later, nobody stands in the pose of reference."""

    def __init__(
        self, port: str, baud: int | None, line: DeviceConnection, status: StatusRecord, wanted: DriverConfig
    ) -> None:
        self._port, self._baud, self._line, self._wanted = port, baud, line, wanted
        self._items = select_items(port, status, wanted)

    def configure(self, stations: StationSelection, boresight: bool, known_hz: float | None = None) -> WireFormat:
        """Tell and ask; BadInput when the device does not do as it is told, or the line is too slow for it.

        `known_hz` is the rate that an earlier set-up found; without it the device is believed what it says of its rate
        only where its records say the same.
        """
        told_hz = known_hz or self._told_rate_hz()
        if sure_hz := known_hz or self._wanted.rate_hz:
            self._check_capacity(len(stations.names), sure_hz)
        wire = WireFormat(
            stations.names, told_hz or 1.0, self._items, self._wanted.settings, stations.characters.encode()
        )
        self._line.errors.clear()
        self._tell(wire)
        if amiss := self._differences(wire):
            self._tell(wire)
            amiss = self._differences(wire)
        if amiss:
            raise BadInput(f"Port {self._port}: the device does not do as it is told: {amiss}.", self._advice())
        self._place(wire, boresight)
        if known_hz is None:
            wire = replace(wire, rate_hz=self._rate_hz(wire, told_hz))
            self._check_capacity(len(stations.names), wire.rate_hz)
        return wire

    def _told_rate_hz(self) -> float:
        """As the device says; 0 when it does not."""
        tracking = self._line.ask(commands.TRACKING, TrackingStatus, self._line.timing.answer_s)
        return tracking.rate_hz if tracking is not None else 0.0

    def _rate_hz(self, wire: WireFormat, told_hz: float) -> float:
        """As asked for, as told, or as measured, where the records do not say otherwise; BadInput.

        Records that fill the line say nothing against a higher rate: the others have found no room.
        """
        asked_hz, measured_hz = self._wanted.rate_hz, measure_rate_hz(self._line, wire)
        own_hz = measured_hz or told_hz
        if asked_hz and own_hz and not _rates_agree(asked_hz, own_hz):
            raise BadInput(
                f"Port {self._port}: a rate of {asked_hz:g} Hz is asked for, the device runs at {own_hz:.4g} Hz.",
                "Leave the rate out, or set the device's own.",
            )
        for rate_hz in (asked_hz, told_hz):
            if rate_hz and (measured_hz is None or _rates_agree(rate_hz, measured_hz)):
                return rate_hz
        if measured_hz is not None and told_hz > measured_hz and self._filled(len(wire.stations), measured_hz):
            return told_hz
        if measured_hz is None:
            raise BadInput(
                f"Port {self._port}: the device does not tell its rate, and sent next to no records of station "
                f"{chr(wire.characters[0])} in {self._line.timing.measure_s:g} s.",
                "See that this station is plugged in, or give the rate.",
            )
        return measured_hz

    def _check_capacity(self, stations: int, rate_hz: float) -> None:
        """BadInput when the line cannot carry it."""
        check_capacity(self._port, self._baud, stations, self._items, rate_hz, self._asked_hz)

    def _filled(self, stations: int, rate_hz: float) -> bool:
        """Whether the line has next to no room left at this rate."""
        return (
            self._baud is not None
            and required_bit_rate(stations, self._items, rate_hz, self._asked_hz) >= SATURATED_SHARE * self._baud
        )

    @property
    def _asked_hz(self) -> float:
        """How often `MP` is asked for."""
        return 1.0 / self._line.timing.tracking_s if self._wanted.quality == "mp" else 0.0

    def _tell(self, wire: WireFormat) -> None:
        wanted = self._wanted
        self._line.send(commands.BINARY)
        self._line.send(commands.CENTIMETRES if wanted.centimetres else commands.INCHES)
        self._line.send(commands.MILLISECONDS if wanted.milliseconds else commands.MICROSECONDS)
        for station in wire.characters.decode():
            self._line.send(commands.set_output_list(station, wire.items))
            # the answer paces us: the device's own buffer is small (error -5, docs/is900.md 6.4)
            self._line.ask(commands.query_output_list(station), OutputList, self._line.timing.answer_s)

    def _differences(self, wire: WireFormat) -> str:
        """What the device has otherwise than it was told; empty when all is well."""
        line, answer_s = self._line, self._line.timing.answer_s
        status = line.ask(commands.STATUS, StatusRecord, answer_s)
        if status is None:
            return "no answer to S"
        system = line.ask(commands.SYSTEM, SystemRecord, answer_s)
        found = [
            "it reports in ASCII" if not status.binary else "",
            "it goes on sending" if status.continuous else "",
            f"it reports in {'centimetres' if status.centimetres else 'inches'}"
            if status.centimetres != self._wanted.centimetres
            else "",
            f"its clock counts {'micro' if system.microseconds else 'milli'}seconds"
            if system is not None and system.microseconds == self._wanted.milliseconds
            else "",
        ]
        for station in wire.characters.decode():
            answer = line.ask(commands.query_output_list(station), OutputList, answer_s)
            if answer is None:
                found.append(f"no answer to O{station}")
            elif answer.station != station or answer.items != wire.items:
                found.append(f"the list of station {answer.station} is {','.join(map(str, answer.items))}")
        return ", ".join(filter(None, found))

    def _place(self, wire: WireFormat, boresight: bool) -> None:
        """The frames that stations report in; BadInput when the device refuses them."""
        self._line.errors.clear()
        for station, name in zip(wire.characters.decode(), wire.stations, strict=True):
            if (frame := self._wanted.alignment_of(name)) is not None:
                self._line.send(commands.undo_alignment(station))
                self._line.send(commands.alignment(station, *([100.0 * value for value in point] for point in frame)))
            if boresight:
                self._line.send(commands.boresight(station))
        if boresight or self._wanted.alignment is not None:
            self._line.ask(commands.STATUS, StatusRecord, self._line.timing.answer_s)  # errors come before its answer
        if self._line.errors:
            raise BadInput(f"Port {self._port}: the device refuses its frame.", self._advice())

    def _advice(self) -> str:
        said = "; ".join(f"{error.command}: error {error.code}" for error in self._line.errors[-3:])
        return f"It said: {said}." if said else "Switch it off and on, and see that no other program talks to it."


def _rates_agree(one_hz: float, other_hz: float) -> bool:
    return abs(one_hz - other_hz) <= RATE_TOLERANCE * other_hz
