"""Configuration of the device: send the commands, then query whether it obeys.

No setter is acknowledged (docs/is900.md 1).
"""

import re
from dataclasses import replace

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.stream.is900.codec import commands
from harness.stream.is900.codec.capacity import check_capacity, required_bit_rate
from harness.stream.is900.codec.commands import STREAM, station_command
from harness.stream.is900.codec.decoder import Decoder, RecordRun
from harness.stream.is900.codec.items import SINCE_FIRMWARE, missing_items
from harness.stream.is900.codec.reader import WireFormat
from harness.stream.is900.codec.replies import OutputList, StatusRecord, SystemRecord, TrackingStatus
from harness.stream.is900.driver.config import QUALITY_ITEMS, DriverConfig
from harness.stream.is900.driver.connection import DeviceConnection
from harness.stream.is900.driver.stations import StationSelection

MIN_RECORDS = 3
"""Fewest records of a station that give a rate."""
PERIOD_QUANTILE = 0.1
"""Quantile of the stamp differences that is taken as the period at first. Many rounds may be missing, but some pairs
are adjacent [choice]."""
MAX_INTERVAL_S = 10.0
"""No two rounds are further apart [s] [choice]."""


def measure_rate_hz(line: DeviceConnection, wire: WireFormat) -> float | None:
    """Measure rounds per second from the device's stamps, or from the record count where there are none.

    Returns None for too few records. The device is configured for this format, and stopped before and after.
    """
    line.send(STREAM)
    data = line.listen(line.timing.measure_s)
    line.stop()
    runs = [event for event in _decoder(wire).feed(data) if isinstance(event, RecordRun)]
    tables = [run.table[run.table["station"] == wire.characters[0]] for run in runs]
    count = sum(map(len, tables))
    if count < MIN_RECORDS:
        return None
    table = np.concatenate(tables)
    if "time" in (table.dtype.names or ()):
        rate_hz = estimate_rate_hz(table["time"].astype(float) * wire.settings.seconds_per_tick)
        if rate_hz is not None:
            return rate_hz
    return count / line.timing.measure_s


def estimate_rate_hz(stamps_s: Floats) -> float | None:
    """Estimate rounds per second from the stamps (n,) [s] of one station; None for too few stamps.

    Stamps may have jitter, be damaged or be missing. A short difference is about one period. The number of periods in
    all differences is divided by their sum, in which the jitter of interior stamps cancels.
    """
    steps_s = np.diff(stamps_s)
    steps_s = steps_s[(steps_s > 0.0) & (steps_s < MAX_INTERVAL_S)]  # other differences involve a damaged stamp
    if len(steps_s) < MIN_RECORDS - 1:
        return None
    period_s = float(np.quantile(steps_s, PERIOD_QUANTILE))
    for _ in range(2):  # the first estimate is a short period
        period_s = float(np.median(steps_s / _count_periods(steps_s, period_s)))
    return float(_count_periods(steps_s, period_s).sum() / steps_s.sum())


def _count_periods(steps_s: Floats, period_s: float) -> Floats:
    return np.maximum(np.rint(steps_s / period_s), 1.0)


def _decoder(wire: WireFormat) -> Decoder:
    return Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings)


SATURATED_SHARE = 0.95
"""A line that carries this share of its capacity may have dropped records [choice]."""
RATE_TOLERANCE = 0.1
"""Rates that differ by less than this share count as equal. `MP` rounds to whole numbers."""


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
        if requested_hz and device_hz and not _rates_agree(requested_hz, device_hz):
            raise BadInput(
                f"Port {self._port}: a rate of {requested_hz:g} Hz is requested, "
                f"but the device runs at {device_hz:.4g} Hz.",
                "Omit the rate, or give that of the device.",
            )
        for rate_hz in (requested_hz, reported_hz):
            if rate_hz and (measured_hz is None or _rates_agree(rate_hz, measured_hz)):
                return rate_hz
        if measured_hz is None:
            raise BadInput(
                f"Port {self._port}: the device does not report its rate, and sent too few records of station "
                f"{chr(wire.characters[0])} in {self._line.timing.measure_s:g} s to measure it.",
                "Check that this station is plugged in, or give the rate.",
            )
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


def _rates_agree(first_hz: float, second_hz: float) -> bool:
    return abs(first_hz - second_hz) <= RATE_TOLERANCE * second_hz
