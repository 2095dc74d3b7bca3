"""Server of an emulator at a port, in real time: one loop that waits for the client or for the next byte due."""

import contextlib
import select
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from harness.core.network import LOOPBACK, parse_address
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.stream.polhemus.emulator.device_state import SentMessage
from harness.stream.polhemus.emulator.emulator import LineEmulator
from harness.stream.polhemus.emulator.tcp_port import LogCallback, Port, TcpPort
from harness.stream.polhemus.emulator.udp_broadcast import UdpBroadcast, UdpPort

SentCallback = Callable[[SentMessage], None]
MAX_WAIT_S = 1.0
_KEPT_LATENCIES = 100_000
"""Number of pacing errors kept for the quantiles, enough for some minutes."""


@dataclass
class ServerCounts:
    """Counts of what has happened so far."""

    records: int = 0
    """Records written."""
    replies: int = 0
    """Replies written."""
    damaged: int = 0
    """Records and replies, among those written, that a fault changed."""
    unread: int = 0
    """Records and replies that were not written: no client, or no room."""
    bytes: int = 0
    """Bytes written."""
    late_s: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT_LATENCIES))
    """Time from when a message's last byte was due to when it was written [s], of the latest messages."""
    max_late_s: float = 0.0
    """Greatest such time [s]."""

    def add(self, sent: SentMessage) -> None:
        """Count a message."""
        if sent.unread:
            self.unread += 1
            return
        self.records += bool(sent.message.station)
        self.replies += not sent.message.station
        self.damaged += bool(sent.damage)
        self.bytes += len(sent.data)
        self.late_s.append(sent.written_s - sent.due_s)
        self.max_late_s = max(self.max_late_s, self.late_s[-1])


class EmulatorServer:
    """Serves an emulator until it is told to stop."""

    def __init__(
        self, emulator: LineEmulator, port: Port, on_sent: SentCallback | None = None, udp_host: str = LOOPBACK
    ) -> None:
        """`udp_host` is the address to which the device broadcasts while `MEthUdp` is on."""
        self.emulator, self.port, self.counts = emulator, port, ServerCounts()
        self.name = port.name
        """The name that a client opens: a link to a pty, or tcp://host:port."""
        self._broadcast, self._udp = UdpBroadcast(emulator.device, time.monotonic()), UdpPort(udp_host)
        self._on_sent = on_sent
        self._woken, self._waker = socket.socketpair()
        self._stopped = False
        self._wrong_rate = generator(emulator.config.seed, "wrong rate")

    def run(self) -> None:
        """Serve until `stop`, or an exception such as KeyboardInterrupt; then close the port."""
        try:
            while not self._stopped:
                ready_port = self._wait()
                now_s = time.monotonic()
                if ready_port and (data := self.port.read()):
                    self.emulator.receive(self._distort(data), now_s)
                for sent in self.emulator.advance(now_s):
                    self._write(sent)
                for packet in self._broadcast.packets(now_s):
                    if not self.emulator.unplugged(now_s):
                        self._udp.send(packet, self.emulator.device.settings.udp_port)
                self._plug(now_s)
        finally:
            self.port.close()
            self._udp.close()
            self._woken.close()
            self._waker.close()

    def stop(self) -> None:
        """End `run`; may be called from any thread."""
        self._stopped = True
        try:
            self._waker.send(b"x")
        except OSError:
            return  # `run` has ended already

    def _wait(self) -> bool:
        """Wait until something is due or arrives; return whether the port can be read or takes more of a message."""
        due_s = min(self.emulator.next_s, self._broadcast.next_s)
        wait_s = min(max(due_s - time.monotonic(), 0.0), MAX_WAIT_S)
        waking = self._woken.fileno()
        ready, free, _ = select.select([*self.port.readable(), waking], self.port.writable(), [], wait_s)
        return bool(free) or any(end != waking for end in ready)

    def _plug(self, now_s: float) -> None:
        if self.emulator.unplugged(now_s):
            self.port.unplug()
        else:
            self.port.plug()

    def _write(self, sent: SentMessage) -> None:
        written_s = time.monotonic()  # before the client can have read it
        accepted = self.port.write(self._distort(sent.data))
        sent = replace(sent, written_s=written_s, unread=not accepted)
        self.counts.add(sent)
        if self._on_sent is not None:
            self._on_sent(sent)

    def _distort(self, data: bytes) -> bytes:
        """Return bytes as the other side receives them: noise where the baud rates differ and this is checked."""
        if self.emulator.config.check_baud and self.port.baud() not in (None, self.emulator.device.settings.baud):
            return self._wrong_rate.bytes(len(data))
        return data

    def summary(self) -> dict[str, float]:
        """Return the counts, and quantiles of the pacing error [ms]."""
        counts, line, device = self.counts, self.emulator.line, self.emulator.device
        late_ms = 1e3 * np.array(counts.late_s or [0.0])
        return {
            "records_sent": float(counts.records),
            "records_dropped": float(line.dropped),
            "replies_sent": float(counts.replies),
            "messages_unread": float(counts.unread),
            "messages_unplugged": float(self.emulator.unplugged_messages),
            "messages_damaged": float(counts.damaged),
            "packets_sent": float(self._udp.sent),
            "packets_unsent": float(self._udp.unsent),
            "commands": float(device.command_count),
            "commands_refused": float(device.refused_count),
            "pacing_p50_ms": float(np.quantile(late_ms, 0.5)),
            "pacing_p99_ms": float(np.quantile(late_ms, 0.99)),
            "pacing_max_ms": 1e3 * counts.max_late_s,
        }


def play_emulator(emulator: LineEmulator, port: Port, udp_host: str = LOOPBACK) -> dict[str, float]:
    """Serve an emulator at a port until Ctrl-C, the normal end; return `EmulatorServer.summary`."""
    server = EmulatorServer(emulator, port, udp_host=udp_host)
    with contextlib.suppress(KeyboardInterrupt):
        server.run()
    return server.summary()


@contextlib.contextmanager
def serve_in_thread(server: EmulatorServer) -> Iterator[EmulatorServer]:
    """Run a server in a thread of its own while the block runs."""
    errors: list[BaseException] = []

    def run() -> None:
        try:
            server.run()
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, name="emulator")
    thread.start()
    try:
        yield server
    finally:
        server.stop()
        thread.join()
    if errors:
        raise errors[0]


def open_port(
    pty: Path | str | None, tcp: str | None, *, anywhere: bool = False, log: LogCallback = lambda line: None
) -> Port:
    """Open the requested port, either a pty or TCP. Raises BadInput."""
    if (pty is None) == (tcp is None):
        raise BadInput("Neither or both of a pty and a TCP port are given.", "Name one of them.")
    if pty is not None:
        if sys.platform == "win32":
            raise BadInput("Windows has no pseudo terminals.", "Use --tcp.")
        from harness.stream.polhemus.emulator.pty_port import PtyPort

        return PtyPort(pty)
    return TcpPort(*parse_address(tcp or ""), anywhere=anywhere, log=log)
