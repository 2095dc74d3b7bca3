"""A real IS-900 as a `TrackerStream`: set up, streaming, watched over, brought back when it was gone."""

import contextlib
import threading
from collections import deque
from collections.abc import Callable, Iterator
from types import TracebackType

from harness.errors import BadInput
from harness.stream.codec import commands
from harness.stream.codec.continuous_reader import ContinuousFrameReader
from harness.stream.codec.reader import WireFormat
from harness.stream.codec.replies import OutputList, StatusRecord
from harness.stream.driver.config import DriverConfig, DriverTiming
from harness.stream.driver.configurator import DeviceConfigurator
from harness.stream.driver.connection import DeviceConnection, DriverClosed
from harness.stream.driver.detection import DetectedDevice, NoAnswer, candidate_baud_rates, detect_device, query_status
from harness.stream.driver.host import Host
from harness.stream.driver.stations import StationSelection, restore_stations, select_stations
from harness.stream.driver.transport import LineLost
from harness.stream.driver.watchdog import Diagnosis, Watchdog, diagnose_reply
from harness.stream.frame import TrackerFrame
from harness.stream.line_events import LineEvent, LineEventKind, LineObserver, NullLineObserver

_RATE_WINDOW_FRAMES = 50
"""Frames that the present rate is counted over."""


class Is900:
    """Opens the port, finds the device and sets it up at once; streams when it is iterated.

    It has no thread: frames are read in the one that iterates. `close` may be called from any; use it as a context
    manager, so that Ctrl-C leaves the device quiet. BadInput when the first set-up fails; later trouble is told as
    events, and the driver comes back by itself.
    """

    def __init__(
        self,
        port: str,
        wanted: DriverConfig | None = None,
        *,
        witness: LineObserver | None = None,
        on_event: Callable[[LineEvent], None] = lambda event: None,
        timing: DriverTiming | None = None,
        host: Host | None = None,
    ) -> None:
        """`witness` sees all bytes and events, `on_event` the events; both in the thread that iterates."""
        self.port, self.config = port, wanted or DriverConfig()
        self._timing, self._host = timing or DriverTiming(), host or Host()
        self._witness, self._on_event = witness or NullLineObserver(), on_event
        self._wall_ahead_s = self._host.wall_s() - self._host.monotonic_s()
        self._sessions, self._watchdog = ContinuousFrameReader(), Watchdog(self._timing)
        self._frames: deque[TrackerFrame] = deque()
        self._recent_s: deque[float] = deque(maxlen=_RATE_WINDOW_FRAMES)
        self._line_lock, self._closing = threading.RLock(), threading.Event()
        self._streaming = False
        self._heard_s = self._tracked_s = self._zeroed_s = self._host.monotonic_s()
        self._reconnects = 0
        found = detect_device(port, candidate_baud_rates(port, self.config), self._connect, self._timing.answer_s)
        self._line, self._baud, self._status = found.line, found.baud, found.status
        self._stations = StationSelection("", (), "")
        try:
            self._stations = select_stations(port, self._line, self.config.stations)
            if self._stations.others:
                restore_stations(port, self._line, self._stations)
            self._wire = self._set_up(self._status, known_hz=None)
        except LineLost as lost:
            self.close()
            raise NoAnswer(f"Port {port}: {lost.why}, during the set-up.", "See to the cable, and try again.") from lost
        except BaseException:
            self.close()
            raise

    @property
    def stations(self) -> tuple[str, ...]:
        """Names, in the order of the device's stations."""
        return self._stations.names

    @property
    def wire(self) -> WireFormat:
        """As it was set up last."""
        return self._wire

    @property
    def baud(self) -> int | None:
        """Of the serial port [bit/s]; None over TCP."""
        return self._baud

    @property
    def firmware(self) -> str:
        return self._status.firmware

    @property
    def identification(self) -> str:
        return self._status.identification

    @property
    def counts(self) -> dict[str, int]:
        """`sessions`, `reconnects`, `frames`, `records`, `garbage_bytes` and `clock_resets` so far."""
        return self._sessions.counts | {"reconnects": self._reconnects}

    def health(self) -> dict[str, float]:
        """The counts, the present rate of frames [Hz], and since when no byte came [s]."""
        recent_s = list(self._recent_s)
        span_s = recent_s[-1] - recent_s[0] if len(recent_s) > 1 else 0.0
        return {
            **self.counts,
            "rate_hz": (len(recent_s) - 1) / span_s if span_s > 0.0 else 0.0,
            "silent_s": self._host.monotonic_s() - self._heard_s,
        }

    def wall_s(self, received_s: float) -> float:
        """Seconds since 1970 at a moment of the host's monotonic clock."""
        return received_s + self._wall_ahead_s

    def __iter__(self) -> Iterator[TrackerFrame]:
        """Frames as they come, until the driver is closed; goes on where another iteration ended."""
        while not self._closing.is_set():
            if self._frames:
                yield self._frames.popleft()
                continue
            try:
                self._step()
            except DriverClosed:
                return
            except BaseException:
                self.close()
                raise

    def close(self) -> None:
        """Stop the device and end every iteration; from any thread, as often as one likes."""
        if self._closing.is_set():
            return
        self._closing.set()
        with self._line_lock:
            line = self._line
            line.closing = lambda: False
            try:
                with contextlib.suppress(LineLost):
                    line.stop()
                    for station in self._stations.others:
                        line.send(commands.switch_station(station, True))
            finally:
                line.transport.close()

    def __enter__(self) -> "Is900":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _step(self) -> None:
        """One wait for bytes, and what follows from them."""
        with self._line_lock:
            try:
                if not self._streaming:
                    self._start()
                came = self._line.receive(self._timing.poll_s)
                now_s = self._host.monotonic_s()
                if not came:  # for longer than USB adapters hold bytes back: no frame is torn that is only late
                    late = self._sessions.expire(now_s)
                    if late:
                        self._witness.on_received(b"", now_s, self._host.wall_s())
                    self._framed(late, now_s)
                self._keep_up(now_s)
                if (reader := self._sessions.reader) is not None:
                    for finding in self._watchdog.check(now_s, bool(came), reader):
                        self._act(finding)
                        if finding.action in ("set up", "reopen"):
                            break
            except LineLost as lost:
                self._lost(lost)

    def _keep_up(self, now_s: float) -> None:
        """What the device is told now and then."""
        if self.config.quality == "mp" and now_s - self._tracked_s >= self._timing.tracking_s:
            self._tracked_s = now_s
            self._line.send(commands.TRACKING)
        if 21 in self._wire.items and now_s - self._zeroed_s >= self._timing.rezero_s:
            self._zeroed_s = now_s
            self._watchdog.zeroed()
            self._line.send(commands.ZERO_CLOCK)

    def _act(self, finding: Diagnosis) -> None:
        if finding.kind is not None:
            self._tell(finding.kind, finding.text)
        if finding.action == "ask":
            self._line.send(commands.STATUS)
            for station in self._stations.characters:
                self._line.send(commands.query_output_list(station))
        elif finding.action != "none" and self._streaming:
            self._come_back(reopen=finding.action == "reopen")

    def _lost(self, lost: LineLost) -> None:
        if self._closing.is_set():
            raise DriverClosed from lost
        self._act(self._watchdog.tell("unplugged", lost.why, self._host.monotonic_s()))
        self._come_back(reopen=True)

    def _tell(self, kind: LineEventKind, text: str) -> None:
        if kind == "reset" and self.config.boresight:
            text += "; boresight is lost, and nobody may stand in the pose for it now"
        event = LineEvent(kind, self._host.monotonic_s(), self._host.wall_s(), text)
        self._witness.on_event(event)
        self._on_event(event)

    def _connect(self, baud: int | None) -> DeviceConnection:
        try:
            transport = self._host.open(self.port, baud or 115200)
        except BadInput as error:
            raise NoAnswer(error.what, error.advice) from error
        line = DeviceConnection(transport, self._host, self._witness, self._timing)
        line.closing, line.on_data = self._closing.is_set, self._received
        return line

    def _received(self, data: bytes, now_s: float) -> None:
        self._heard_s = now_s
        self._framed(self._sessions.feed(data, now_s), now_s)

    def _framed(self, frames: list[TrackerFrame], now_s: float) -> None:
        self._frames.extend(frames)
        self._recent_s.extend(frame.received_s for frame in frames)
        for finding in self._watchdog.framed(frames, now_s):
            self._act(finding)

    def _set_up(self, status: StatusRecord, known_hz: float | None) -> WireFormat:
        """Boresight is for the first time, when nothing is known."""
        set_up = DeviceConfigurator(self.port, self._baud, self._line, status, self.config)
        return set_up.configure(self._stations, self.config.boresight and known_hz is None, known_hz)

    def _start(self) -> None:
        """The device's clock to zero, then `C`: records that leave between the two would carry the old clock."""
        self._line.send(commands.ZERO_CLOCK)
        now_s = self._host.monotonic_s()
        self._witness.on_configured(self._wire)
        self._frames.extend(self._sessions.begin_session(self._wire, now_s))
        self._watchdog.start(self._wire, now_s)
        self._zeroed_s = self._tracked_s = now_s
        self._streaming = True
        self._line.send(commands.STREAM)

    def _come_back(self, reopen: bool) -> None:
        """Try until the device streams again."""
        self._streaming = False
        self._watchdog.pause()
        while True:
            try:
                status = None if reopen else query_status(self._line, self._timing.answer_s)
                if status is None:
                    status = self._reopened().status
                self._diagnose(status)
                self._restore()
                self._wire = self._set_up(status, self._wire.rate_hz)
                self._start()
                self._reconnects += 1
                return
            except (NoAnswer, LineLost):
                if self._closing.is_set():
                    raise DriverClosed from None
            except BadInput as error:
                self._act(self._watchdog.tell("refused", str(error), self._host.monotonic_s()))
            reopen = True
            self._pause()

    def _reopened(self) -> DetectedDevice:
        self._line.transport.close()
        found = detect_device(self.port, (self._baud,), self._connect, self._timing.answer_s)
        self._line, self._status = found.line, found.status
        return found

    def _diagnose(self, status: StatusRecord) -> None:
        """Tell what the device has forgotten."""
        now_s, line = self._host.monotonic_s(), self._line
        kind, text = diagnose_reply(self._wire, status, streaming=False)
        if kind is not None:
            self._act(self._watchdog.tell(kind, text, now_s))
            return
        for station in self._stations.characters:
            answer = line.ask(commands.query_output_list(station), OutputList, self._timing.answer_s)
            if answer is not None:
                kind, text = diagnose_reply(self._wire, answer)
                if kind is not None:
                    self._act(self._watchdog.tell(kind, text, now_s))

    def _restore(self) -> None:
        if missing := restore_stations(self.port, self._line, self._stations):
            now_s = self._host.monotonic_s()
            self._act(self._watchdog.tell("missing", f"station {', '.join(missing)} is not there", now_s))

    def _pause(self) -> None:
        """Wait before the next attempt, in short steps, so that closing is prompt."""
        until_s = self._host.monotonic_s() + self._timing.retry_s
        while (left_s := until_s - self._host.monotonic_s()) > 0.0:
            if self._closing.is_set():
                raise DriverClosed
            self._host.sleep(min(left_s, self._timing.poll_s))
