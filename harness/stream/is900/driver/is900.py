"""A real IS-900 as a `TrackerStream`: configured, streaming, watched, and reconnected when it was gone."""

import contextlib
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace

from harness.errors import BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.is900.codec import commands
from harness.stream.is900.codec.capacity import emitter_reach_m
from harness.stream.is900.codec.commands import station_command
from harness.stream.is900.codec.items import STANDARD_LIST, position_range_m
from harness.stream.is900.codec.reader import WireFormat
from harness.stream.is900.codec.replies import Emitter, OutputList, StatusRecord
from harness.stream.is900.driver.broadcast import Is900Broadcast
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.configurator import DeviceConfigurator
from harness.stream.is900.driver.connection import (
    DetectedDevice,
    DeviceConnection,
    NoAnswer,
    candidate_baud_rates,
    detect_device,
    query_status,
)
from harness.stream.is900.driver.session_settings import SessionSettings, read_settings, restore_settings, set_defaults
from harness.stream.is900.driver.stations import StationSelection, restore_stations, select_stations
from harness.stream.is900.driver.tracker import Tracker
from harness.stream.is900.driver.transport import UDP_SCHEME, LineLost
from harness.stream.is900.driver.watchdog import Diagnosis, Watchdog, diagnose_reply
from harness.stream.line_events import LineEvent, LineEventKind, LineObserver
from harness.stream.tracker import DriverClosed

MAX_EMITTERS = 200
"""More emitters than any constellation has."""


class Is900(Tracker):
    """Driver of a real IS-900: opens the port, detects the device and configures it; streams while it is iterated.

    It has no thread: frames are read in the thread that iterates. `close` may be called from any thread. Use it as a
    context manager, so that Ctrl-C leaves the device silent. Raises BadInput when the first configuration fails. Later
    trouble is reported as events, and the driver reconnects by itself.
    """

    def _open(self) -> None:
        """Open and configure the device."""
        port = self.port
        self._watchdog = Watchdog(self._timing)
        self._line_lock, self._closed = threading.RLock(), False
        self._tracked_s = self._zeroed_s = self._last_byte_s
        detected = detect_device(port, candidate_baud_rates(port, self.config), self._connect, self._timing.answer_s)
        self._line, self._baud, self._status = detected.line, detected.baud, detected.status
        self._stations = StationSelection("", (), "")
        self._found: SessionSettings | None = None
        try:
            self._stations = select_stations(port, self._line, self.config.stations, self.config.characters)
            if self._stations.others:
                restore_stations(port, self._line, self._stations)
            self._found = read_settings(self._line, self._stations.characters, self._status)
            self._report_settings(self._found)
            self._wire = self._configure(self._status, previous_hz=None)
            self._report_room(self._wire)
        except LineLost as lost:
            self.close()
            raise NoAnswer(f"Port {port}: {lost.why} during configuration.", "Check the cable and try again.") from lost
        except BaseException:
            self.close()
            raise

    @property
    def baud(self) -> int | None:
        """Baud rate of the serial port [bit/s]; None over TCP."""
        return self._baud

    @property
    def firmware(self) -> str:
        """Firmware version that the device reports."""
        return self._status.firmware

    @property
    def identification(self) -> str:
        """Name that the device reports."""
        return self._status.identification

    @property
    def station_list(self) -> str:
        """Characters of the device's stations, with their names: `1 torso, 3 head`; and the active ones not read."""
        others = self._stations.others
        return super().station_list + (f"; not read: {', '.join(others)}" if others else "")

    @property
    def setup_note(self) -> str:
        """What a person at the device should know of its set-up, in one line."""
        if self.config.keep_settings:
            return "settings of other programs are kept: see the events"
        note = f"boresight of station {', '.join(self._stations.characters)} undone: it cannot be read or put back"
        unreadable = self._found.unreadable if self._found else ()
        return note + (f"; nor can {', '.join(unreadable)}, now at their defaults" if unreadable else "")

    def close(self) -> None:
        """Stop the device, put its settings back and end every iteration.

        May be called from any thread, and more than once. It returns when the device has its settings.
        """
        self._closing.set()
        with self._line_lock:
            if self._closed:
                return
            self._closed, line = True, self._line
            line.closing = lambda: False
            try:
                try:
                    self._leave(line)
                except KeyboardInterrupt:  # an impatient person: the device gets its settings back all the same
                    self._leave(line)
                    raise
            finally:
                line.transport.close()

    def _leave(self, line: DeviceConnection) -> None:
        """Stop the device and give it the settings and stations that it had, as far as the line still works."""
        found, config = self._found, self.config
        keep, aligned = config.keep_settings, config.alignment is not None
        is_back = False
        with contextlib.suppress(LineLost):
            line.stop()
            is_back = found is not None and restore_settings(line, found, keep, aligned, config.boresight)
            for station in self._stations.others + self._stations.woken:
                line.send(station_command("l", station, [station in self._stations.others]))
            # A port that is closed may drop bytes that have not left it, so wait until the device has answered.
            is_back = is_back and line.ask(commands.STATUS, StatusRecord, self._timing.answer_s) is not None
        if found is not None and (text := found.describe()) and not keep:
            self._report("settings", f"{'put back' if is_back else 'not put back, the device is gone'}: {text}")

    def _report_room(self, wire: WireFormat) -> None:
        """Report emitters whose stations are farther away than the list can carry."""
        range_m = position_range_m(wire.items)
        if range_m is None:
            return
        replies = self._line.collect(commands.EMITTERS, MAX_EMITTERS)
        reach_m = emitter_reach_m(reply for reply in replies if isinstance(reply, Emitter))
        if reach_m >= range_m:
            items = ",".join(map(str, STANDARD_LIST))
            text = f"emitters are up to {reach_m:.2f} m from the tracker's origin, the list carries {range_m:g} m"
            self._report("out of range", f"{text}: use a list with item 2, as {items}")

    def _report_settings(self, found: SessionSettings) -> None:
        """Report what other programs left in the device."""
        if text := found.describe():
            kept = "kept, as asked" if self.config.keep_settings else "at defaults for this session, then put back"
            self._report("settings", f"settings of another program: {text}; {kept}")

    def _step(self) -> None:
        """Wait once for bytes and process them."""
        with self._line_lock:
            try:
                if not self._streaming:
                    self._start()
                received, now_s = self._receive()
                self._send_periodic_commands(now_s)
                if (reader := self._reader.reader) is not None:
                    for diagnosis in self._watchdog.check(now_s, received, reader):
                        self._handle(diagnosis)
                        if diagnosis.action in ("configure", "reopen"):
                            break
            except LineLost as lost:
                self._handle_lost_line(lost)

    def _send_periodic_commands(self, now_s: float) -> None:
        """Send `MP` and `MZ` when they are due."""
        if self.config.quality == "mp" and now_s - self._tracked_s >= self._timing.tracking_s:
            self._tracked_s = now_s
            self._line.send(commands.TRACKING)
        if 21 in self._wire.items and now_s - self._zeroed_s >= self._timing.rezero_s:
            self._zeroed_s = now_s
            self._watchdog.expect_clock_reset()
            self._line.send(commands.ZERO_CLOCK)

    def _handle(self, diagnosis: Diagnosis) -> None:
        """Report a diagnosis and carry out its recovery action."""
        text = diagnosis.text
        if station := diagnosis.unexpected:
            text += "; it is switched off until the session ends, since it would load the line"
            others = "".join(sorted({*self._stations.others, station}))
            self._stations = replace(self._stations, others=others)
            self._line.send(station_command("l", station, [False]))
        if diagnosis.kind is not None:
            self._report(diagnosis.kind, text)
        if diagnosis.action == "ask":
            self._line.send(commands.STATUS)
            self._line.send(commands.STATION_STATES)
            for station in self._stations.characters:
                self._line.send(station_command("O", station))
        elif diagnosis.action != "none" and self._streaming:
            self._reconnect(reopen=diagnosis.action == "reopen")

    def _handle_lost_line(self, lost: LineLost) -> None:
        """Report that the line is gone, and reconnect."""
        if self._closing.is_set():
            raise DriverClosed from lost
        self._handle(self._watchdog.report("unplugged", lost.why, self._host.monotonic_s()))
        self._reconnect(reopen=True)

    def _report(self, kind: LineEventKind, text: str) -> None:
        """Send an event to the observer and the callback."""
        if kind == "reset" and self.config.boresight:
            text += "; boresight is lost and not repeated, since nobody may stand in the reference pose now"
        super()._report(kind, text)

    def _connect(self, baud: int | None) -> DeviceConnection:
        try:
            transport = self._host.open(self.port, baud or 115200)
        except BadInput as error:
            raise NoAnswer(error.what, error.advice) from error
        return self._connect_line(transport, self._observer)

    def _add_frames(self, frames: Sequence[TrackerFrame], now_s: float) -> None:
        super()._add_frames(frames, now_s)
        for diagnosis in self._watchdog.add_frames(frames, now_s):
            self._handle(diagnosis)

    def _configure(self, status: StatusRecord, previous_hz: float | None) -> WireFormat:
        """Configure the device. Boresight is set only the first time, when no rate is known yet."""
        first = previous_hz is None
        if not self.config.keep_settings:
            characters = self._stations.characters
            found = self._found if first and self._found else read_settings(self._line, characters, status)
            set_defaults(self.port, self._line, found, undo_boresight=first or not self.config.boresight)
        configurator = DeviceConfigurator(self.port, self._baud, self._line, status, self.config)
        return configurator.configure(self._stations, self.config.boresight and first, previous_hz)

    def _start(self) -> None:
        """Set the device's clock to zero, then send `C`: records between the two would carry the old clock."""
        self._line.send(commands.ZERO_CLOCK)
        now_s = self._host.monotonic_s()
        self._observer.on_configured(self._wire)
        self._frames.extend(self._reader.begin_session(self._wire, now_s))
        self._watchdog.start(self._wire, now_s)
        self._zeroed_s = self._tracked_s = now_s
        self._streaming = True
        self._line.send(commands.STREAM)

    def _reconnect(self, reopen: bool) -> None:
        """Try again and again until the device streams."""
        self._streaming = False
        self._watchdog.pause()
        while True:
            try:
                status = None if reopen else query_status(self._line, self._timing.answer_s)
                if status is None:
                    status = self._reopen().status
                self._diagnose(status)
                self._restore()
                self._wire = self._configure(status, self._wire.rate_hz)
                self._start()
                self._reconnects += 1
                return
            except (NoAnswer, LineLost):
                if self._closing.is_set():
                    raise DriverClosed from None
            except BadInput as error:
                self._handle(self._watchdog.report("refused", str(error), self._host.monotonic_s()))
            reopen = True
            self._pause()

    def _reopen(self) -> DetectedDevice:
        self._line.transport.close()
        detected = detect_device(self.port, (self._baud,), self._connect, self._timing.answer_s)
        self._line, self._status = detected.line, detected.status
        return detected

    def _diagnose(self, status: StatusRecord) -> None:
        """Report which part of its configuration the device has lost."""
        now_s, line = self._host.monotonic_s(), self._line
        kind, text = diagnose_reply(self._wire, status, streaming=False)
        if kind is not None:
            self._handle(self._watchdog.report(kind, text, now_s))
            return
        for station in self._stations.characters:
            answer = line.ask(station_command("O", station), OutputList, self._timing.answer_s)
            if answer is not None:
                kind, text = diagnose_reply(self._wire, answer)
                if kind is not None:
                    self._handle(self._watchdog.report(kind, text, now_s))

    def _restore(self) -> None:
        if missing := restore_stations(self.port, self._line, self._stations):
            for diagnosis in self._watchdog.report_missing(missing):
                self._handle(diagnosis)

    def _pause(self) -> None:
        """Wait before the next attempt, in short steps, so that closing is prompt."""
        until_s = self._host.monotonic_s() + self._timing.retry_s
        while (left_s := until_s - self._host.monotonic_s()) > 0.0:
            if self._closing.is_set():
                raise DriverClosed
            self._host.sleep(min(left_s, self._timing.poll_s))


def open_tracker(
    port: str,
    config: DriverConfig | None = None,
    *,
    observer: LineObserver | None = None,
    on_event: Callable[[LineEvent], None] = lambda event: None,
) -> Tracker:
    """Open and set up a tracker: a serial line or TCP, or a broadcast at `udp://host:port`. Raises BadInput."""
    kind = Is900Broadcast if port.startswith(UDP_SCHEME) else Is900
    return kind(port, config, observer=observer, on_event=on_event)
