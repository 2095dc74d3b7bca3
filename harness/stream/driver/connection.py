"""Talk with the device: questions and answers over a line on which data may flow as well."""

from collections.abc import Callable
from typing import TypeVar

from harness.stream.codec.commands import RESUME, STOP
from harness.stream.codec.replies import DeviceError, ParsedReply, parse_reply
from harness.stream.driver.config import DriverTiming
from harness.stream.driver.host import Host
from harness.stream.driver.transport import Transport
from harness.stream.line_events import LineObserver

MAX_UNFINISHED_BYTES = 4096
"""An unfinished line beyond this is no reply [bytes]."""
WAKE_UP = RESUME + b"\r" + STOP
"""Resumes a suspended device, ends a line that somebody began, stops a streaming one; does no harm to any other. In
this order, one that takes 11 for an ordinary byte still sees `c` at the start of a line."""
_STOP_TIMEOUT_FACTOR = 10
"""Times `quiet_s`: so long a device may go on after `c`, since its buffers empty first."""

Answer = TypeVar("Answer", bound=ParsedReply)


class DriverClosed(Exception):
    """How a wait ends when the driver is closed meanwhile."""


class DeviceConnection:
    """A transport with the host's clocks and a witness to all that passes."""

    def __init__(self, transport: Transport, host: Host, witness: LineObserver, timing: DriverTiming) -> None:
        self.transport, self.timing = transport, timing
        self.received_bytes = 0
        """Bytes received."""
        self.closing: Callable[[], bool] = lambda: False
        """Asked before each wait, which is short; True ends it with `DriverClosed`."""
        self.on_data: Callable[[bytes, float], None] = lambda data, now_s: None
        """Called with whatever comes, and when (host's monotonic clock [s])."""
        self.errors: list[DeviceError] = []
        """What the device could not do, of the replies that were read here."""
        self._host, self._witness = host, witness
        self._begun = b""
        """The beginning of a reply."""

    def send(self, data: bytes) -> None:
        """To the device; LineLost."""
        now_s, wall_s = self._host.monotonic_s(), self._host.wall_s()
        self.transport.write(data)
        self._witness.on_sent(data, now_s, wall_s)

    def receive(self, timeout_s: float) -> bytes:
        """What is there, after a wait of so long, or of `poll_s`, at most; LineLost, Closing."""
        if self.closing():
            raise DriverClosed
        data = self.transport.read(min(timeout_s, self.timing.poll_s))
        if data:
            now_s = self._host.monotonic_s()
            self.received_bytes += len(data)
            self._witness.on_received(data, now_s, self._host.wall_s())
            self.on_data(data, now_s)
        return data

    def wait_for_silence(self) -> bool:
        """Wait for silence and forget what came before; False when the device goes on."""
        until_s = self._host.monotonic_s() + _STOP_TIMEOUT_FACTOR * self.timing.quiet_s
        silent_from_s = self._host.monotonic_s()
        while (now_s := self._host.monotonic_s()) < silent_from_s + self.timing.quiet_s:
            if now_s > until_s:
                return False
            if self.receive(silent_from_s + self.timing.quiet_s - now_s):
                silent_from_s = self._host.monotonic_s()
        self._begun = b""
        return True

    def listen(self, for_s: float) -> bytes:
        """All that comes in so long a time."""
        until_s, heard = self._host.monotonic_s() + for_s, b""
        while (left_s := until_s - self._host.monotonic_s()) > 0.0:
            heard += self.receive(left_s)
        return heard

    def stop(self, command: bytes = STOP) -> bool:
        """End the stream of data; False when it goes on though it was told so three times."""
        for _ in range(3):
            self.send(command)
            if self.wait_for_silence():
                return True
        return False

    def ask(self, question: bytes, kind: type[Answer], timeout_s: float) -> Answer | None:
        """The first answer of this kind; None when none comes in time."""
        self.send(question)
        until_s = self._host.monotonic_s() + timeout_s
        while (left_s := until_s - self._host.monotonic_s()) > 0.0:
            for reply in self._replies(self.receive(left_s)):
                if isinstance(reply, kind):
                    return reply
        last, self._begun = parse_reply(self._begun), b""  # very old firmware leaves out CR LF (docs/is900.md 6.2)
        return last if isinstance(last, kind) else None

    def _replies(self, data: bytes) -> list[ParsedReply]:
        *lines, begun = (self._begun + data).split(b"\n")
        self._begun = begun[-MAX_UNFINISHED_BYTES:]
        replies = [parse_reply(line) for line in lines]
        self.errors += [reply for reply in replies if isinstance(reply, DeviceError)]
        return replies
