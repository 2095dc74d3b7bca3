"""Configuration of the device: send the commands, then query whether it obeys.

No setter is acknowledged (docs/is900.md 1).
"""

import re
from dataclasses import replace

from harness.errors import BadInput
from harness.stream.is900.driver.config import QUALITY_ITEMS, DriverConfig
from harness.stream.polhemus.codec import commands
from harness.stream.polhemus.codec.capacity import check_capacity, required_bit_rate
from harness.stream.polhemus.codec.commands import station_command
from harness.stream.polhemus.codec.items import SINCE_FIRMWARE, missing_items
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.replies import OutputList, StatusRecord, SystemRecord, TrackingStatus
from harness.stream.polhemus.driver.connection import DeviceConnection
from harness.stream.polhemus.driver.rate import (
    check_requested_rate,
    measure_rate_hz,
    rates_agree,
    too_few_records_error,
)
from harness.stream.polhemus.driver.stations import StationSelection

SATURATED_SHARE = 0.95
"""A line that carries this share of its capacity may have dropped records [choice]."""


def select_items(port: str, status: StatusRecord, config: DriverConfig) -> tuple[int, ...]:
    """Return the output list, without quality items where `MP` reports quality.

    Raises BadInput when the firmware is too old for an item.
    """
    if config.quality == "mp":
        return tuple(code for code in config.items if code not in QUALITY_ITEMS)
    match = re.match(r"\d+\.\d+", status.firmware)
    version = float(match[0]) if match else float("inf")  # unknown: the device itself accepts or refuses the list
    for code in missing_items(config.items, version):
        raise BadInput(
            f"Port {port}: firmware {status.firmware} has no item {code} (quality), "
            f"which needs {SINCE_FIRMWARE[code]} or newer.",
            "Use quality 'mp' (--quality mp), which queries the device once a second, or install newer firmware.",
        )
    return config.items


class DeviceConfigurator:
    """Configures one device.

    `boresight` belongs to the first configuration only: later nobody stands in the reference pose.
    """

    def __init__(
        self, port: str, baud: int | None, line: DeviceConnection, status: StatusRecord, config: DriverConfig
    ) -> None:
        self._port, self._baud, self._line, self._config = port, baud, line, config
        self._items = select_items(port, status, config)

    def configure(self, stations: StationSelection, boresight: bool, previous_hz: float | None = None) -> WireFormat:
        """Send the configuration and check it; return the resulting wire format.

        `previous_hz` is the rate that an earlier configuration determined [Hz]. Without it, the rate that the device
        reports is trusted only where its records agree. Raises BadInput when the device does not accept the
        configuration, or when the line is too slow for it.
        """
        reported_hz = previous_hz or self._query_rate_hz()
        if given_hz := previous_hz or self._config.rate_hz:
            self._check_capacity(len(stations.names), given_hz)
        wire = WireFormat(
            stations.names, reported_hz or 1.0, self._items, self._config.settings, stations.characters.encode()
        )
        self._line.errors.clear()
        self._send_settings(wire)
        if differences := self._differences(wire):
            self._send_settings(wire)
            differences = self._differences(wire)
        if differences:
            raise BadInput(f"Port {self._port}: the device does not obey its commands: {differences}.", self._advice())
        self._set_frames(wire, boresight)
        if previous_hz is None:
            wire = replace(wire, rate_hz=self._rate_hz(wire, reported_hz))
            self._check_capacity(len(stations.names), wire.rate_hz)
        return wire

    def _query_rate_hz(self) -> float:
        """Return the rate that the device reports [Hz]; 0 when it reports none."""
        tracking = self._line.ask(commands.TRACKING, TrackingStatus, self._line.timing.answer_s)
        return tracking.rate_hz if tracking is not None else 0.0

    def _rate_hz(self, wire: WireFormat, reported_hz: float) -> float:
        """Choose the requested, the reported or the measured rate [Hz]; raise BadInput when they contradict each other.

        Records that saturate the line are no evidence against a higher rate, because the missing ones found no room.
        """
        requested_hz, measured_hz = self._config.rate_hz, measure_rate_hz(self._line, wire)
        device_hz = measured_hz or reported_hz
        check_requested_rate(self._port, requested_hz, device_hz)
        for rate_hz in (requested_hz, reported_hz):
            if rate_hz and (measured_hz is None or rates_agree(rate_hz, measured_hz)):
                return rate_hz
        if measured_hz is None:
            raise too_few_records_error(self._port, self._line, wire)
        if reported_hz > measured_hz and self._is_saturated(len(wire.stations), measured_hz):
            return reported_hz
        return measured_hz

    def _check_capacity(self, stations: int, rate_hz: float) -> None:
        """Raise BadInput when the line cannot carry this many stations at this rate."""
        reach_m = self._config.reach_m
        check_capacity(self._port, self._baud, stations, self._items, rate_hz, self._poll_hz, reach_m)

    def _is_saturated(self, stations: int, rate_hz: float) -> bool:
        """Whether the line has almost no capacity left at this rate."""
        return (
            self._baud is not None
            and required_bit_rate(stations, self._items, rate_hz, self._poll_hz) >= SATURATED_SHARE * self._baud
        )

    @property
    def _poll_hz(self) -> float:
        """How often `MP` is sent [Hz]."""
        return 1.0 / self._line.timing.tracking_s if self._config.quality == "mp" else 0.0

    def _send_settings(self, wire: WireFormat) -> None:
        config = self._config
        self._line.send(commands.BINARY)
        self._line.send(commands.CENTIMETRES if config.centimetres else commands.INCHES)
        self._line.send(commands.MILLISECONDS if config.milliseconds else commands.MICROSECONDS)
        for station in wire.characters.decode():
            self._line.send(station_command("O", station, wire.items))
            # Wait for the reply, because the device's input buffer is small (error -5, docs/is900.md 6.4).
            self._line.ask(station_command("O", station), OutputList, self._line.timing.answer_s)

    def _differences(self, wire: WireFormat) -> str:
        """Describe where the device differs from the configuration; empty when it agrees."""
        line, answer_s = self._line, self._line.timing.answer_s
        status = line.ask(commands.STATUS, StatusRecord, answer_s)
        if status is None:
            return "no answer to S"
        system = line.ask(commands.SYSTEM, SystemRecord, answer_s)
        texts = [
            "it reports in ASCII" if not status.binary else "",
            "it does not stop streaming" if status.continuous else "",
            f"it reports in {'centimetres' if status.centimetres else 'inches'}"
            if status.centimetres != self._config.centimetres
            else "",
            f"its clock counts {'micro' if system.microseconds else 'milli'}seconds"
            if system is not None and system.microseconds == self._config.milliseconds
            else "",
        ]
        for station in wire.characters.decode():
            reply = line.ask(station_command("O", station), OutputList, answer_s)
            if reply is None:
                texts.append(f"no answer to O{station}")
            elif reply.station != station or reply.items != wire.items:
                texts.append(f"the list of station {reply.station} is {','.join(map(str, reply.items))}")
        return ", ".join(filter(None, texts))

    def _set_frames(self, wire: WireFormat, boresight: bool) -> None:
        """Set the frames that stations report in. Raises BadInput when the device refuses them."""
        self._line.errors.clear()
        for station, name in zip(wire.characters.decode(), wire.stations, strict=True):
            if (frame := self._config.alignment_of(name)) is not None:
                self._line.send(station_command("R", station))
                self._line.send(station_command("A", station, (100.0 * value for point in frame for value in point), 2))
            if boresight:
                self._line.send(station_command("B", station))
        if boresight or self._config.alignment is not None:
            self._line.ask(commands.STATUS, StatusRecord, self._line.timing.answer_s)  # error records come before it
        if self._line.errors:
            raise BadInput(f"Port {self._port}: the device refuses the alignment or boresight.", self._advice())

    def _advice(self) -> str:
        errors = "; ".join(f"{error.command}: error {error.code}" for error in self._line.errors[-3:])
        if errors:
            return f"The device reported: {errors}."
        return "Switch it off and on, and check that no other program uses it."
