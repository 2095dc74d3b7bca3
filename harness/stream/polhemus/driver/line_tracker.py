"""A device on a line as a `TrackerStream`: configured, streaming, watched, and reconnected when it was gone."""

import contextlib
import threading
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace

from harness.errors import BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec import commands
from harness.stream.polhemus.codec.commands import station_command
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.replies import OutputList, StatusRecord
from harness.stream.polhemus.driver.connection import (
    DetectedDevice,
    DeviceConnection,
    NoAnswer,
    describe_device,
    detect_device,
    query_status,
)
from harness.stream.polhemus.driver.stations import StationSelection, query_active, restore_stations, select_stations
from harness.stream.polhemus.driver.tracker import Tracker
from harness.stream.polhemus.driver.transport import LineLost
from harness.stream.polhemus.driver.watchdog import Diagnosis, Watchdog, diagnose_reply
from harness.stream.tracker import DriverClosed


class LineTracker(Tracker):
    """Driver of a device on a line: opens the port, detects the device and configures it; streams while it is iterated.

    It has no thread: frames are read in the thread that iterates. `close` may be called from any thread. Use it as a
    context manager, so that Ctrl-C leaves the device silent. Raises BadInput when the first configuration fails. Later
    trouble is reported as events, and the driver reconnects by itself.
    """

    _states_query = commands.STATION_STATES
    """Query of the stations that are on."""
    _active_stations = staticmethod(query_active)
    """Returns the stations that are on."""

    def _open(self) -> None:
        """Open and configure the device."""
        port = self.port
        self._watchdog = Watchdog(self._timing)
        self._line_lock, self._closed = threading.RLock(), False
        detected = detect_device(port, self.config, self._connect, self._timing.answer_s)
        self._line, self._baud, self._status = detected.line, detected.baud, detected.status
        self._stations = StationSelection("", (), "")
        try:
            self._stations = select_stations(
                port, self._line, self.config.stations, self.config.characters, self._active_stations
            )
            if self._stations.others:
                restore_stations(port, self._line, self._stations, self._active_stations)
            self._read_settings()
            self._wire = self._configure(self._status, previous_hz=None)
            self._check_set_up()
        except LineLost as lost:
            self.close()
            raise NoAnswer(f"Port {port}: {lost.why} during configuration.", "Check the cable and try again.") from lost
        except BaseException:
            self.close()
            raise

    def _read_settings(self) -> None:
        """Read what other programs left in the device, before the first configuration."""

    def _check_set_up(self) -> None:
        """Report what a person should know of the device as it is set up for the first time."""

    @abstractmethod
    def _configure(self, status: StatusRecord, previous_hz: float | None) -> WireFormat:
        """Configure the device. `previous_hz` is the rate of an earlier configuration [Hz]; None the first time."""

    @abstractmethod
    def _put_back(self, line: DeviceConnection) -> None:
        """Give a device that was stopped the settings that it had, as far as the line still works."""

    def _prepare_stream(self) -> None:
        """Prepare the device just before it streams."""

    def _send_periodic_commands(self, now_s: float) -> None:
        """Send the commands that are due while the device streams."""

    @property
    def baud(self) -> int | None:
        """Baud rate of the serial port [bit/s]; None over TCP."""
        return self._baud

    @property
    def identification(self) -> str:
        """Name and firmware of the device."""
        return describe_device(self._status, self.config.family)

    @property
    def station_list(self) -> str:
        """Characters of the device's stations, with their names: `1 torso, 3 head`; and the active ones not read."""
        others = self._stations.others
        return super().station_list + (f"; not read: {', '.join(others)}" if others else "")

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
        """Stop the device and give it the settings and stations that it had."""
        with contextlib.suppress(LineLost):
            line.stop()
        self._put_back(line)

    def _restore_stations(self, line: DeviceConnection) -> None:
        """Switch on the stations that were switched off, and the other way round."""
        for station in self._stations.others + self._stations.woken:
            line.send(station_command("l", station, [station in self._stations.others]))

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
            self._line.send(self._states_query)
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

    def _start(self) -> None:
        """Send `C`."""
        self._prepare_stream()
        now_s = self._host.monotonic_s()
        self._observer.on_configured(self._wire)
        self._frames.extend(self._reader.begin_session(self._wire, now_s))
        self._watchdog.start(self._wire, now_s)
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
        config = replace(self.config, baud=self._baud)
        detected = detect_device(self.port, config, self._connect, self._timing.answer_s)
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
        if missing := restore_stations(self.port, self._line, self._stations, self._active_stations):
            for diagnosis in self._watchdog.report_missing(missing):
                self._handle(diagnosis)

    def _pause(self) -> None:
        """Wait before the next attempt, in short steps, so that closing is prompt."""
        until_s = self._host.monotonic_s() + self._timing.retry_s
        while (left_s := until_s - self._host.monotonic_s()) > 0.0:
            if self._closing.is_set():
                raise DriverClosed
            self._host.sleep(min(left_s, self._timing.poll_s))
