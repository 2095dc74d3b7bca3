"""Recording of a device that another program uses: its bytes pass through in both directions.

The program configures the device. The recorder only asks, and nothing else: before the program starts the stream, it
asks for the format of the records, so that the recording can be replayed. The answers to its own questions are recorded
but not passed on.
"""

import select
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from harness.core.interrupts import defer_interrupts
from harness.errors import BadFile, BadInput
from harness.stream.line_events import LineEvent, LineEventKind
from harness.stream.polhemus.codec.commands import FACTORY_DEFAULTS, POLL, RESTART, STATUS, STOP, STREAM, CommandReader
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.driver.config import DriverTiming, LineConfig
from harness.stream.polhemus.driver.connection import (
    DeviceConnection,
    Host,
    NoAnswer,
    describe_device,
    detect_device,
)
from harness.stream.polhemus.driver.exchange import read_wire_format
from harness.stream.polhemus.driver.transport import LineLost, SelectTransport
from harness.stream.polhemus.emulator.pty_port import ClientPty, check_link_is_free
from harness.stream.recording.blocks import RECEIVED, SENT
from harness.stream.recording.recorder import PROGRESS_INTERVAL_S
from harness.stream.recording.recording_writer import RecordingWriter

SERVE_TIMING = DriverTiming(answer_s=0.3, quiet_s=0.05)
"""Shorter waits than the driver's: the program waits meanwhile [choice]."""
_IDLE_S, _BUSY_S = 0.05, 0.005
"""Longest wait for bytes, and the one while bytes wait for the program [s]."""
_NEUTRAL = (STREAM, STOP, POLL, STATUS)
"""Commands that change no format."""
_ENDING = (STOP, RESTART, FACTORY_DEFAULTS)
"""Commands after which the device does not stream."""
_RETRY_S = 0.25
"""Interval between two attempts to open a lost line [s]."""


def serve_line(
    port: str,
    link: Path,
    config: LineConfig,
    writer: RecordingWriter,
    *,
    seconds: float | None = None,
    log: Callable[[str], None] = lambda line: None,
    progress: Callable[[str], None] = lambda line: None,
    host: Host | None = None,
) -> dict[str, int]:
    """Pass bytes between a device and a pty at `link`, and record them, until Ctrl-C or for `seconds` [s].

    The device is stopped first. Of `config`, baud rate, rate and stations count. Returns the numbers of bytes that the
    program did not read (`unread`) and of bytes that found no device (`undelivered`). Raises BadInput without a device.
    """
    server = _LineServer(port, link, config, writer, log, host or Host())
    try:
        with suppress(KeyboardInterrupt):
            server.run(server.open(), seconds, progress)
    finally:
        progress("")
        server.close()
    return server.counts


class _LineServer:
    """The line to the device, the pty of the program, and what is known of the format of the records."""

    def __init__(
        self,
        port: str,
        link: Path,
        config: LineConfig,
        writer: RecordingWriter,
        log: Callable[[str], None],
        host: Host,
    ) -> None:
        self._port, self._link, self._config = port, link, config
        self._writer, self._log, self._host = writer, log, host
        self._line: DeviceConnection | None = None
        self._transport: SelectTransport | None = None
        self._pty: ClientPty | None = None
        self._baud: int | None = None
        self._commands = CommandReader()
        self._format_known = self._streaming = self._asking = False
        self._undelivered = 0
        self._lost_s = self._tried_s = 0.0

    def open(self) -> ClientPty:
        """Find the device, and open the pty. Raises BadInput."""
        check_link_is_free(self._link)
        detected = detect_device(self._port, self._config, self._connect, DriverTiming().answer_s)
        self._use(detected.line)
        self._baud = detected.baud
        with defer_interrupts():
            self._pty = pty = ClientPty(self._link, detected.baud)
        name = describe_device(detected.status, self._config.family)
        self._log(f"{name} at {self._port} is recorded; another program may use it at {self._link}")
        self._log("Ctrl-C ends the recording")
        return pty

    @property
    def counts(self) -> dict[str, int]:
        return {"unread": self._pty.unread if self._pty else 0, "undelivered": self._undelivered}

    def run(self, pty: ClientPty, seconds: float | None, progress: Callable[[str], None]) -> None:
        """Pass bytes on for `seconds` [s], or without end."""
        began_s = shown_s = time.monotonic()
        waiting = False
        while seconds is None or time.monotonic() - began_s < seconds:
            ready = self._wait(pty, _BUSY_S if waiting else _IDLE_S)
            try:
                if self._line is not None and self._transport is not None:
                    if not ready or self._transport.descriptor in ready:
                        self._line.receive(0.0)
                    self._follow_baud(self._transport, pty.baud())
                if pty.master in ready:
                    self._take_commands(pty.read())
            except LineLost as lost:
                self._end_line(lost)
            if self._line is None:
                self._reopen()
            waiting = pty.flush()
            if (now_s := time.monotonic()) - shown_s >= PROGRESS_INTERVAL_S:
                shown_s = now_s
                progress(self._progress_text())

    def close(self) -> None:
        """Remove the link, and stop a device that streams: nobody hears it any more."""
        if self._pty is not None:
            self._pty.close()
        if self._line is not None:
            self._asking = True
            with suppress(LineLost):
                if self._streaming:
                    self._line.stop()
            self._line.transport.close()

    def _wait(self, pty: ClientPty, timeout_s: float) -> set[int]:
        """Wait for bytes from the device or the program, and return the descriptors that have some."""
        poll = select.poll()
        poll.register(pty.master, select.POLLIN)
        if self._transport is not None:
            poll.register(self._transport.descriptor, select.POLLIN)
        return {descriptor for descriptor, _ in poll.poll(1e3 * timeout_s)}

    def _take_commands(self, data: bytes) -> None:
        """Send what the program wrote. Before it starts the stream, ask for the format."""
        begin = 0
        for end in range(1, len(data) + 1):
            for command in self._commands.feed(data[end - 1 : end]):
                if command.line in (STREAM, POLL) and not self._format_known and not self._streaming:
                    self._send(data[begin : end - 1])
                    begin = end - 1
                    self._announce_format()
                self._streaming = command.line == STREAM or (self._streaming and command.line not in _ENDING)
                self._format_known = self._format_known and command.line in _NEUTRAL
        self._send(data[begin:])

    def _send(self, data: bytes) -> None:
        if self._line is None:
            self._undelivered += len(data)
        elif data:
            self._writer.keep()
            self._line.send(data)

    def _announce_format(self) -> None:
        """Write the format of the records that follow, so that `harness replay` decodes them."""
        if self._line is None:
            return
        self._line.wait_for_silence()  # answers to earlier commands of the program still pass
        self._asking = True
        try:
            self._writer.on_configured(
                self._named(read_wire_format(self._line, self._config.rate_hz, self._config.family))
            )
            self._format_known = True
        except (BadInput, BadFile) as error:
            self._log(f"{error} Every byte is recorded, but no frames can be replayed.")
        finally:
            self._asking = False

    def _named(self, wire: WireFormat) -> WireFormat:
        """The format with the station names that the user gave."""
        names = self._config.stations
        if names is None:
            return wire
        if len(names) != len(wire.stations):
            active = wire.characters.decode()
            raise BadInput(f"--stations names {len(names)} stations; stations {active} are active.", "")
        return replace(wire, stations=names)

    def _pass_on(self, data: bytes, now_s: float) -> None:
        if not self._asking and self._pty is not None:
            self._pty.write(data)

    def _use(self, line: DeviceConnection) -> None:
        line.on_data, self._line = self._pass_on, line

    def _follow_baud(self, transport: SelectTransport, baud: int | None) -> None:
        """Set the baud rate that the program has set."""
        if self._baud is not None and baud is not None and baud != self._baud:
            self._baud = baud
            transport.set_baud(baud)
            self._log(f"the program has set {baud} baud")

    def _end_line(self, lost: LineLost) -> None:
        if self._line is not None:
            self._line.transport.close()
        self._line = self._transport = None
        self._lost_s = time.monotonic()
        self._streaming = self._format_known = False
        self._report("unplugged", lost.why)

    def _reopen(self) -> None:
        """Try to open the line again. The program configures the device again, if it was reset."""
        if time.monotonic() - self._tried_s < _RETRY_S:
            return
        self._tried_s = time.monotonic()
        try:
            self._use(self._connect(self._baud))
        except NoAnswer:
            return
        self._report("connected", f"the line is back after {time.monotonic() - self._lost_s:.1f} s")

    def _connect(self, baud: int | None) -> DeviceConnection:
        try:
            transport = self._host.open(self._port, baud or 115200)
        except BadInput as error:
            raise NoAnswer(error.what, error.advice) from error
        if not isinstance(transport, SelectTransport):
            transport.close()
            raise BadInput(f"--serve with {self._port}.", "It needs pseudo terminals: use Linux or macOS.")
        self._transport = transport
        return DeviceConnection(transport, self._host, self._writer, SERVE_TIMING)

    def _report(self, kind: LineEventKind, text: str) -> None:
        self._writer.on_event(LineEvent(kind, self._host.monotonic_s(), self._host.wall_s(), text))
        self._log(text)

    def _progress_text(self) -> str:
        counts, unread = self._writer.counts, self.counts["unread"]
        text = f"{1e-3 * counts[RECEIVED]:.0f} kB from the device, {counts[SENT]} bytes to it"
        if self._line is None:
            return f"no line for {time.monotonic() - self._lost_s:.0f} s; {text}"
        return f"{text}, {unread} bytes not read by a program" if unread else text
