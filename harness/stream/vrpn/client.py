"""A tracker that a VRPN server reports, as a `TrackerStream`."""

import threading
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from harness.core.arrays import Floats
from harness.errors import BadInput, shorten
from harness.stream.frame import TrackerFrame
from harness.stream.line_events import EventObserver, LineEvent, LineEventKind, PoseObserver, TrackedBodies
from harness.stream.tracker import DriverClosed, OpenTracker
from harness.stream.vrpn.connection import ConnectionLost, ServerConnection, TrackerAddress
from harness.stream.vrpn.messages import MalformedMessage, PoseReport
from harness.stream.vrpn.report_frames import ReportFrames

_FEWEST_REPORTS = 10
"""Fewest reports of one sensor from which the rate is measured."""
_MOST_SENSORS = 1000
"""Most sensors that are read at once, and that are told of."""


@dataclass(frozen=True)
class VrpnConfig:
    """What is read of a tracker of a VRPN server. Raises BadInput for names that are no names of those sensors."""

    stations: tuple[str, ...] | None = None
    """Station names, in the order of the sensors' numbers. None takes all sensors, named by their numbers."""
    sensors: tuple[int, ...] | None = None
    """Sensors that these names belong to, ascending. None takes the first ones that report."""
    rate_hz: float | None = None
    """Reports per second of each sensor, for a tracker that reports too rarely to measure it."""

    def __post_init__(self) -> None:
        names, sensors = self.stations or (), self.sensors
        if len(set(names)) < len(names):
            raise BadInput(f"Stations {', '.join(names)}: a name occurs twice.", "Give each its own name.")
        if sensors is not None and (len(sensors) != len(names) or tuple(sorted(set(sensors))) != sensors):
            raise BadInput(f"{len(names)} stations with the sensors {sensors}.", "Give each station its own sensor.")


@dataclass(frozen=True)
class VrpnTiming:
    """Time constants of the client [s]."""

    connect_s: float = 1.0
    """Longest wait for the connection."""
    silent_s: float = 2.0
    """Time without a report after which the server is pinged, and without any byte after which it is given up."""
    measure_s: float = 1.0
    """Time for which reports are gathered to find the sensors and their rate."""
    longest_measure_s: float = 5.0
    """Longest such time, for sensors that report rarely."""
    retry_s: float = 0.25
    """Interval between two attempts to reconnect."""
    poll_s: float = 0.05
    """Longest single wait, so that closing is prompt."""


PoseCallback = Callable[[PoseReport, float], None]
"""Receives every report of the tracker in sequence, with its time of reception on the host's monotonic clock [s]."""


class VrpnTracker(OpenTracker):
    """Client of one tracker of a VRPN server. It finds sensors and rate when it is opened, and reconnects by itself.

    `measured_s` counts from the first report, by the server's clock, exact to 1 us. Raises BadInput when there is no
    such server or tracker, or when it does not report.
    """

    def __init__(
        self,
        port: str,
        config: VrpnConfig | None = None,
        *,
        observer: EventObserver | None = None,
        on_event: Callable[[LineEvent], None] = lambda event: None,
        on_report: PoseCallback = lambda report, now_s: None,
        timing: VrpnTiming | None = None,
    ) -> None:
        """Open the tracker. `observer` receives the events, and the frames too if it is a `PoseObserver`."""
        super().__init__(port, observer=observer, on_event=on_event)
        self._pose_observer = observer if isinstance(observer, PoseObserver) else None
        self.config, self._timing, self._on_report = config or VrpnConfig(), timing or VrpnTiming(), on_report
        self._address = TrackerAddress.parse(port)
        self._lock, self._sessions, self._trouble = threading.RLock(), 0, "not streaming"
        self._frames_begun = self._lost = False
        self._lost_messages = 0
        """Messages that UDP has lost in earlier connections."""
        self._pinged = False
        self._line: ServerConnection | None = None
        self._strange: set[int] = set()
        self._heard: list[tuple[PoseReport, float]] = []
        """Reports that came while the tracker was opened, and when [s]."""
        try:
            self._open()
        except (ConnectionLost, MalformedMessage) as error:
            self.close()
            raise self._refusal(error) from error
        except BaseException:
            self.close()
            raise

    @property
    def stations(self) -> tuple[str, ...]:
        return self._stations

    @property
    def rate_hz(self) -> float:
        return self._rate_hz

    @property
    def sensors(self) -> tuple[int, ...]:
        """Number of each station's sensor."""
        return self._sensors

    @property
    def identification(self) -> str:
        return f"{self._address.tracker} of a VRPN server"

    @property
    def station_list(self) -> str:
        named = [
            f"{n} {name}" if str(n) != name else name for n, name in zip(self._sensors, self._stations, strict=True)
        ]
        return ", ".join(named) + (f"; not read: {self._unread}" if self._unread else "")

    @property
    def setup_note(self) -> str:
        return f"times are the server's; {self._rate_hz:.4g} reports per second of each sensor"

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of `frames`, `records`, `copies` (redundant reports), reports of `other_sensors`, `clock_resets`,
        `reconnects`, messages that UDP has `lost`, and `out_of_range`, which is 0.
        """
        lost = self._lost_messages + (0 if self._line is None else self._line.lost_messages)
        return self._reader.counts | {"reconnects": max(self._sessions - 1, 0), "lost": lost, "out_of_range": 0}

    @property
    def start_unix_s(self) -> float:
        """Unix time of the zero of `measured_s`, by the server's clock [s]."""
        return 1e-6 * (self._reader.start_us or 0)

    def measured_unix_s(self, frame: TrackerFrame) -> Floats:
        """(S,) time of each station's report since 1970, by the server's clock [s]."""
        out: Floats = frame.measured_s + self.start_unix_s
        return out

    def pause(self) -> None:
        """Leave the server until frames are read: it waits for a client that does not read, and so do its others."""
        with self._lock:
            self._heard, self._sessions = [], 0
            self._leave()

    def close(self) -> None:
        self._closing.set()
        with self._lock:
            self._leave()

    def _leave(self) -> None:
        """Close the connection, if there is one."""
        if self._line is not None:
            self._lost_messages += self._line.lost_messages
            self._line.close()
            self._line = None

    def _open(self) -> None:
        """Connect, and listen until the sensors and their rate are known."""
        self._line = ServerConnection(self._address, self._timing.connect_s)
        self._sessions = 1
        self._heard = self._listen(self._line)
        reports = [report for report, _ in self._heard]
        heard = Counter(report.sensor for report in reports)
        self._sensors, self._stations = self._select(sorted(heard))
        self._unread = ", ".join(str(sensor) for sensor in sorted(heard) if sensor not in self._sensors)
        self._strange.update(heard)
        self._rate_hz = self._measure_rate(reports)
        self._reader = ReportFrames(self._sensors, self._rate_hz)
        self._seen_s = self._quiet_s = self._monotonic_s()
        """Times of the latest report, and of the latest byte or ping [s]."""

    def _listen(self, line: ServerConnection) -> list[tuple[PoseReport, float]]:
        """The first reports, and when each was received [s]."""
        reports: list[tuple[PoseReport, float]] = []
        counts = Counter[int]()
        until_s = self._monotonic_s() + self._timing.silent_s
        while (left_s := until_s - self._monotonic_s()) > 0.0:
            new = [(report, self._monotonic_s()) for report in line.receive(min(left_s, self._timing.poll_s))]
            counts.update(report.sensor for report, _ in new)
            reports += new
            if reports:
                known = self.config.rate_hz is not None or max(counts.values()) >= _FEWEST_REPORTS
                until_s = reports[0][1] + (self._timing.measure_s if known else self._timing.longest_measure_s)
        if reports:
            return reports
        if not line.greeted:
            raise MalformedMessage("nothing arrives, not even a greeting")
        tracker = shorten(self._address.tracker)
        if line.answered:
            problem = f"{tracker} is there, but sends no report in {self._timing.silent_s:g} s"
            raise BadInput(f"Port {self.port}: {problem}.", "Switch the tracker on, and move a sensor into its sight.")
        others = sorted({name for name in line.senders if name not in (self._address.tracker, "VRPN Control")})
        raise BadInput(
            f"Port {self.port}: the server has no tracker called {tracker}.",
            f"It has {shorten(', '.join(others)) or 'none'}; vrpn.cfg of the server has the names.",
        )

    def _select(self, heard: list[int]) -> tuple[tuple[int, ...], tuple[str, ...]]:
        """The sensors that are read, and their names. Raises BadInput when one of them does not report."""
        names = self.config.stations
        sensors = self.config.sensors or tuple(heard if names is None else heard[: len(names)])
        missing = [str(sensor) for sensor in sensors if sensor not in heard]
        if len(sensors) > _MOST_SENSORS:
            advice = f"Name at most {_MOST_SENSORS:,} of them, as in --stations head=0,torso=1."
            raise BadInput(f"Port {self.port}: {len(sensors):,} sensors report.", advice)
        if missing or (names is not None and len(names) > len(sensors)):
            what = f"sensor {', '.join(missing)}" if missing else f"{len(names or ())} sensors"
            raise BadInput(
                f"Port {self.port}: {what} asked for, but the sensors {', '.join(map(str, heard))} report.",
                "Name these, as in --stations head=0,torso=1.",
            )
        return sensors, names or tuple(map(str, sensors))

    def _measure_rate(self, reports: list[PoseReport]) -> float:
        """Reports per second of the sensor that reports most."""
        times_us = max(
            ([report.time_us for report in reports if report.sensor == sensor] for sensor in self._sensors), key=len
        )
        distinct = sorted(set(times_us))
        if len(distinct) < _FEWEST_REPORTS:
            if self.config.rate_hz is not None:
                return self.config.rate_hz
            what = f"only {len(distinct)} reports of a sensor in {self._timing.longest_measure_s:g} s"
            raise BadInput(f"Port {self.port}: {what}, too few to measure the rate.", "Give it: --rate HZ.")
        return 1e6 * (len(distinct) - 1) / (distinct[-1] - distinct[0])

    def _add_frames(self, frames: Sequence[TrackerFrame], now_s: float) -> None:
        if self._pose_observer is not None:
            if frames and not self._frames_begun:
                self._frames_begun = True
                clock = "seconds by the clock of the VRPN server"
                assumed = {"length unit": ("m", "VRPN's convention")}
                self._pose_observer.on_bodies(
                    TrackedBodies(self._stations, self.port, clock, self.start_unix_s, assumed)
                )
            for frame in frames:
                self._pose_observer.on_frame(frame)
        super()._add_frames(frames, now_s)

    def _step(self) -> None:
        """Wait once for reports and process them."""
        with self._lock:
            if self._closing.is_set():
                raise DriverClosed
            try:
                if self._heard:
                    heard, self._heard = self._heard, []
                    for report, at_s in heard:
                        self._take(report, at_s)
                elif self._line is None:
                    self._connect()
                else:
                    self._receive(self._line)
            except (ConnectionLost, MalformedMessage) as error:
                self._lose(error)

    def _receive(self, line: ServerConnection) -> None:
        before, reported = line.received_bytes, False
        try:
            for report in line.receive(self._timing.poll_s):
                reported = True
                self._take(report, self._monotonic_s())
        finally:
            now_s = self._monotonic_s()
            self._add_frames(self._reader.expire(now_s), now_s)
        if line.received_bytes > before:
            self._last_byte_s = self._quiet_s = now_s
            self._pinged = False
        if reported:
            self._seen_s = now_s
        elif now_s - self._quiet_s > self._timing.silent_s:
            if self._pinged:
                raise ConnectionLost("the server does not answer")
            line.ping()
            self._pinged, self._quiet_s = True, now_s
        elif now_s - self._seen_s > self._timing.silent_s:
            self._tell("silent", "silent", f"no report for {now_s - self._seen_s:.1f} s")

    def _take(self, report: PoseReport, now_s: float) -> None:
        """Deliver a report."""
        if self._trouble:
            self._tell("connected", "", f"{self._address.tracker} reports: {len(self._stations)} sensors")
        self._on_report(report, now_s)
        if report.sensor not in self._strange and len(self._strange) < _MOST_SENSORS:
            self._strange.add(report.sensor)
            self._report("unexpected", f"sensor {report.sensor} reports now and is left out: it is no station")
        self._add_frames(self._reader.add(report, now_s), now_s)

    def _connect(self) -> None:
        """Try once to connect; after a failure it waits before."""
        if self._lost and self._closing.wait(self._timing.retry_s):
            raise DriverClosed
        self._line = ServerConnection(self._address, self._timing.connect_s)
        self._sessions += 1
        self._seen_s = self._quiet_s = self._monotonic_s()
        self._pinged = False

    def _lose(self, error: ConnectionLost | MalformedMessage) -> None:
        """Report a lost connection once, and close what is left of it."""
        self._lost = True
        if self._closing.is_set():
            raise DriverClosed from error
        self._leave()
        if isinstance(error, MalformedMessage):
            self._tell("garbage", "garbage", f"the server sends what is no message of VRPN: {error.problem}")
        else:
            self._tell("unplugged", "unplugged", error.why)

    def _tell(self, kind: LineEventKind, trouble: str, text: str) -> None:
        """Report a change of the line's state; the same state is reported once."""
        if trouble != self._trouble:
            self._trouble = trouble
            self._report(kind, text)

    def _refusal(self, error: ConnectionLost | MalformedMessage) -> BadInput:
        if isinstance(error, MalformedMessage):
            advice = "Is it the port of a VRPN server? VRPN itself takes 3883."
            return BadInput(f"Port {self.port}: no VRPN server: {error.problem}.", advice)
        return BadInput(f"Port {self.port}: {error.why}.", "Start the VRPN server first, and check its host and port.")
