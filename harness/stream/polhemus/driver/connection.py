"""Exchange with the device over a line that may carry data records as well, and detection of a device at a port."""

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from harness.core.network import FASTRAK_PREFIX
from harness.errors import BadInput
from harness.stream.line_events import LineObserver
from harness.stream.polhemus.codec.commands import RESUME, STATUS, STOP
from harness.stream.polhemus.codec.items import BAUD_RATES, DEVICE_NAMES, DeviceFamily, with_article
from harness.stream.polhemus.codec.replies import DeviceError, ParsedReply, StatusRecord, parse_reply
from harness.stream.polhemus.driver.config import DriverTiming, LineConfig
from harness.stream.polhemus.driver.open_transport import open_transport
from harness.stream.polhemus.driver.transport import LineLost, Transport
from harness.stream.tracker import DriverClosed


@dataclass(frozen=True)
class Host:
    """Ports and clocks of the computer that the driver runs on."""

    open: Callable[[str, int], Transport] = open_transport
    """Opens a port at a baud rate. Raises BadInput."""
    monotonic_s: Callable[[], float] = time.monotonic
    wall_s: Callable[[], float] = time.time
    sleep: Callable[[float], None] = time.sleep


MAX_UNFINISHED_BYTES = 4096
"""An unfinished line longer than this is no reply [bytes]."""
WAKE_UP = RESUME + b"\r" + STOP
"""Resumes a suspended device, ends an unfinished line, stops streaming; has no effect on any other device. In this
sequence, a device that reads 11 as an ordinary byte still sees `c` at the start of a line."""
_STOP_TIMEOUT_FACTOR = 10
"""Multiple of `quiet_s` for which a device may go on sending after `c`, because its buffers empty first."""

ReplyType = TypeVar("ReplyType", bound=ParsedReply)


class DeviceConnection:
    """A transport together with the host's clocks and an observer of all bytes that pass."""

    def __init__(self, transport: Transport, host: Host, observer: LineObserver, timing: DriverTiming) -> None:
        self.transport, self.timing = transport, timing
        self.received_bytes = 0
        """Number of bytes received."""
        self.closing: Callable[[], bool] = lambda: False
        """Called before each wait, which is short; True ends the wait with `DriverClosed`."""
        self.on_data: Callable[[bytes, float], None] = lambda data, now_s: None
        """Called with the bytes received and their time on the host's monotonic clock [s]."""
        self.errors: list[DeviceError] = []
        """Error records among the replies that were read here."""
        self._host, self._observer = host, observer
        self._partial = b""
        """The beginning of an unfinished reply."""

    def send(self, data: bytes) -> None:
        """Send bytes to the device. Raises LineLost."""
        now_s, wall_s = self._host.monotonic_s(), self._host.wall_s()
        self.transport.write(data)
        self._observer.on_sent(data, now_s, wall_s)

    def receive(self, timeout_s: float) -> bytes:
        """Return the bytes that are available, after a wait of at most `timeout_s` or `poll_s` [s].

        Raises LineLost, and DriverClosed when the driver is closing.
        """
        if self.closing():
            raise DriverClosed
        data = self.transport.read(min(timeout_s, self.timing.poll_s))
        if data:
            now_s = self._host.monotonic_s()
            self.received_bytes += len(data)
            self._observer.on_received(data, now_s, self._host.wall_s())
            self.on_data(data, now_s)
        return data

    def wait_for_silence(self) -> bool:
        """Wait for silence and discard a partial reply. Returns False when the device keeps sending."""
        until_s = self._host.monotonic_s() + _STOP_TIMEOUT_FACTOR * self.timing.quiet_s
        silent_from_s = self._host.monotonic_s()
        while (now_s := self._host.monotonic_s()) < silent_from_s + self.timing.quiet_s:
            if now_s > until_s:
                return False
            if self.receive(silent_from_s + self.timing.quiet_s - now_s):
                silent_from_s = self._host.monotonic_s()
        self._partial = b""
        return True

    def listen(self, duration_s: float) -> bytes:
        """Return all bytes that arrive within `duration_s` [s]."""
        until_s, data = self._host.monotonic_s() + duration_s, b""
        while (left_s := until_s - self._host.monotonic_s()) > 0.0:
            data += self.receive(left_s)
        return data

    def listen_until_silence(self) -> bytes:
        """Return what arrives until `quiet_s` of silence: the first byte within `answer_s`, all within twice that."""
        began_s, data = self._host.monotonic_s(), b""
        silent_from_s = began_s
        while (now_s := self._host.monotonic_s()) < began_s + 2.0 * self.timing.answer_s:
            left_s = silent_from_s + (self.timing.quiet_s if data else self.timing.answer_s) - now_s
            if left_s <= 0.0:
                break
            if chunk := self.receive(left_s):
                data, silent_from_s = data + chunk, self._host.monotonic_s()
        return data

    def stop(self, command: bytes = STOP) -> bool:
        """Stop the data stream. Returns False when the device keeps sending after three attempts."""
        for _ in range(3):
            self.send(command)
            if self.wait_for_silence():
                return True
        return False

    def ask(self, query: bytes, reply_type: type[ReplyType], timeout_s: float) -> ReplyType | None:
        """Send a query and return the first reply of this type; None when none arrives within `timeout_s` [s]."""
        self.send(query)
        until_s = self._host.monotonic_s() + timeout_s
        while (left_s := until_s - self._host.monotonic_s()) > 0.0:
            for reply in self._replies(self.receive(left_s)):
                if isinstance(reply, reply_type):
                    return reply
        last, self._partial = parse_reply(self._partial), b""  # very old firmware omits CR LF (docs/is900.md 6.2)
        return last if isinstance(last, reply_type) else None

    def collect(self, queries: bytes, count: int) -> list[ParsedReply]:
        """Send queries and return the next `count` replies, or fewer when no more arrive in time."""
        self.send(queries)
        replies: list[ParsedReply] = []
        until_s = self._host.monotonic_s() + self.timing.answer_s
        while len(replies) < count and (left_s := until_s - self._host.monotonic_s()) > 0.0:
            replies += self._replies(self.receive(left_s))
        return replies

    def _replies(self, data: bytes) -> list[ParsedReply]:
        *lines, partial = (self._partial + data).split(b"\n")
        self._partial = partial[-MAX_UNFINISHED_BYTES:]
        replies = [parse_reply(line) for line in lines]
        self.errors += [reply for reply in replies if isinstance(reply, DeviceError)]
        return replies


class NoAnswer(BadInput):
    """No reply of the device came over the line."""


@dataclass(frozen=True)
class DetectedDevice:
    """A device that answered."""

    line: DeviceConnection
    baud: int | None
    """Baud rate of the port [bit/s]; None over TCP, where there is no such limit."""
    status: StatusRecord


def describe_device(status: StatusRecord, family: DeviceFamily) -> str:
    """Return name and firmware of a device. A FASTRAK has a text of its owner where an IS-900 has its name."""
    name = status.identification.strip() if family == "is900" else ""
    return f"{name or DEVICE_NAMES[family]}, firmware {status.firmware}"


def detect_device(
    port: str, config: LineConfig, connect: Callable[[int | None], DeviceConnection], answer_s: float
) -> DetectedDevice:
    """Open the port at one baud rate after another until a device of the family answers; BadInput when none does.

    Without a rate in `config` each is tried; an address on a network has none.
    """
    bauds = (None,) if "://" in port else BAUD_RATES if config.baud is None else (config.baud,)
    total_bytes = 0
    for baud in bauds:
        line = connect(baud)
        try:
            status = query_status(line, answer_s)
            if status is not None:
                _check_kind(port, status, config.family)
                return DetectedDevice(line, baud, status)
            total_bytes += line.received_bytes
        except LineLost as lost:
            line.transport.close()
            raise NoAnswer(
                f"Port {port}: {lost.why}, before the device answered.", "Is another program connected to it?"
            ) from lost
        except BaseException:
            line.transport.close()
            raise
        line.transport.close()
    raise _no_answer_error(port, bauds, total_bytes, config.family)


def query_status(line: DeviceConnection, answer_s: float) -> StatusRecord | None:
    """Stop the device and return its reply to `S`; None when it does not stop or does not answer."""
    if not line.stop(WAKE_UP):
        return None
    status = line.ask(STATUS, StatusRecord, answer_s)
    if status is None and line.received_bytes:
        line.wait_for_silence()
        status = line.ask(b"\r" + STATUS, StatusRecord, answer_s)
    return status


def _check_kind(port: str, status: StatusRecord, expected: DeviceFamily) -> None:
    """Raise BadInput for a device of another family than is expected. Every IS-900 has its name in `S`."""
    is_is900 = "IS900" in re.sub("[- ]", "", status.identification.upper())
    if is_is900 == (expected == "is900"):
        return
    advice = f"Name the port of an IS-900; a FASTRAK is at {FASTRAK_PREFIX}{port}."
    if is_is900:
        advice = f"Name it {port.removeprefix(FASTRAK_PREFIX)}."
    raise BadInput(
        f"Port {port}: the device {status.identification.strip()!r}, firmware {status.firmware}, is "
        f"no {DEVICE_NAMES[expected]}.",
        advice,
    )


def _no_answer_error(port: str, bauds: Sequence[int | None], received_bytes: int, family: DeviceFamily) -> NoAnswer:
    device = with_article(family)
    rates = " at " + ", ".join(map(str, bauds)) + " baud" if bauds[0] else ""
    advice = "The baud rate may be wrong: omit it, and each is tried. " if bauds[0] and len(bauds) == 1 else ""
    if received_bytes == 0:
        return NoAnswer(
            f"Port {port}: nothing answers{rates}.",
            f"{advice}Is the device on and started (up to 20 s), the cable that of the device, and this its port?",
        )
    return NoAnswer(
        f"Port {port}: {received_bytes} bytes arrived{rates}, but no reply of {device}.",
        advice.strip() or f"Another device may be at this port, or the cable is bad. Name the port of {device}.",
    )
