"""A real IS-900 as a `TrackerStream`."""

import contextlib
from collections.abc import Callable

from harness.stream.is900.driver.broadcast import Is900Broadcast
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.configurator import DeviceConfigurator
from harness.stream.is900.driver.session_settings import SessionSettings, read_settings, restore_settings, set_defaults
from harness.stream.line_events import LineEvent, LineEventKind, LineObserver
from harness.stream.polhemus.codec import commands
from harness.stream.polhemus.codec.capacity import emitter_reach_m
from harness.stream.polhemus.codec.items import STANDARD_LIST, position_range_m
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.replies import Emitter, StatusRecord
from harness.stream.polhemus.driver.connection import DeviceConnection
from harness.stream.polhemus.driver.line_tracker import LineTracker
from harness.stream.polhemus.driver.network_transport import UDP_SCHEME
from harness.stream.polhemus.driver.tracker import Tracker
from harness.stream.polhemus.driver.transport import LineLost

MAX_EMITTERS = 200
"""More emitters than any constellation has."""


class Is900(LineTracker):
    """Driver of a real IS-900: opens the port, detects the device and configures it; streams while it is iterated.

    It has no thread: frames are read in the thread that iterates. `close` may be called from any thread. Use it as a
    context manager, so that Ctrl-C leaves the device silent. Raises BadInput when the first configuration fails. Later
    trouble is reported as events, and the driver reconnects by itself.
    """

    config: DriverConfig
    _config_type = DriverConfig
    _found: SessionSettings | None = None
    _tracked_s = _zeroed_s = 0.0

    @property
    def setup_note(self) -> str:
        """What a person at the device should know of its set-up, in one line."""
        if self.config.keep_settings:
            return "settings of other programs are kept: see the events"
        note = f"boresight of station {', '.join(self._stations.characters)} undone: it cannot be read or put back"
        unreadable = self._found.unreadable if self._found else ()
        return note + (f"; nor can {', '.join(unreadable)}, now at their defaults" if unreadable else "")

    def _put_back(self, line: DeviceConnection) -> None:
        """Give the device the settings and stations that it had, as far as the line still works."""
        found, config = self._found, self.config
        keep, aligned = config.keep_settings, config.alignment is not None
        is_back = False
        with contextlib.suppress(LineLost):
            is_back = found is not None and restore_settings(line, found, keep, aligned, config.boresight)
            self._restore_stations(line)
            # A port that is closed may drop bytes that have not left it, so wait until the device has answered.
            is_back = is_back and line.ask(commands.STATUS, StatusRecord, self._timing.answer_s) is not None
        if found is not None and (text := found.describe()) and not keep:
            self._report("settings", f"{'put back' if is_back else 'not put back, the device is gone'}: {text}")

    def _read_settings(self) -> None:
        self._found = read_settings(self._line, self._stations.characters, self._status)
        self._report_settings(self._found)

    def _check_set_up(self) -> None:
        """Report emitters whose stations are farther away than the list can carry."""
        range_m = position_range_m(self._wire.items)
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

    def _send_periodic_commands(self, now_s: float) -> None:
        """Send `MP` and `MZ` when they are due."""
        if self.config.quality == "mp" and now_s - self._tracked_s >= self._timing.tracking_s:
            self._tracked_s = now_s
            self._line.send(commands.TRACKING)
        if 21 in self._wire.items and now_s - self._zeroed_s >= self._timing.rezero_s:
            self._zeroed_s = now_s
            self._watchdog.expect_clock_reset()
            self._line.send(commands.ZERO_CLOCK)

    def _report(self, kind: LineEventKind, text: str) -> None:
        """Send an event to the observer and the callback."""
        if kind == "reset" and self.config.boresight:
            text += "; boresight is lost and not repeated, since nobody may stand in the reference pose now"
        super()._report(kind, text)

    def _configure(self, status: StatusRecord, previous_hz: float | None) -> WireFormat:
        """Configure the device. Boresight is set only the first time, when no rate is known yet."""
        first = previous_hz is None
        if not self.config.keep_settings:
            characters = self._stations.characters
            found = self._found if first and self._found else read_settings(self._line, characters, status)
            set_defaults(self.port, self._line, found, undo_boresight=first or not self.config.boresight)
        configurator = DeviceConfigurator(self.port, self._baud, self._line, status, self.config)
        return configurator.configure(self._stations, self.config.boresight and first, previous_hz)

    def _prepare_stream(self) -> None:
        """Set the device's clock to zero before `C`: records between the two would carry the old clock."""
        self._line.send(commands.ZERO_CLOCK)
        self._zeroed_s = self._tracked_s = self._host.monotonic_s()


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
