"""An emulator at a port, in real time: one loop that waits for the client or for the next byte that is due."""

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

from harness.core.seeds import generator
from harness.errors import BadInput
from harness.stream.codec.samples import DeviceSamples
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.emulator import Emulator
from harness.stream.emulator.message import SentMessage
from harness.stream.emulator.port import Port
from harness.stream.emulator.tcp_port import LogCallback, TcpPort

SentCallback = Callable[[SentMessage], None]
MAX_WAIT_S = 1.0
_KEPT_LATENCIES = 100_000
"""Pacing errors kept for the quantiles: some minutes of them."""


@dataclass
class ServerCounts:
    """What has happened so far."""

    records: int = 0
    """Written."""
    replies: int = 0
    damaged: int = 0
    """Of these, records and replies that a fault befell."""
    unread: int = 0
    """Records and replies that found no room, or no client."""
    bytes: int = 0
    late_s: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT_LATENCIES))
    """From when a message's last byte was due to when it was written [s]."""
    latest_s: float = 0.0

    def add(self, sent: SentMessage) -> None:
        if sent.unread:
            self.unread += 1
            return
        self.records += bool(sent.message.station)
        self.replies += not sent.message.station
        self.damaged += bool(sent.damage)
        self.bytes += len(sent.data)
        self.late_s.append(sent.written_s - sent.due_s)
        self.latest_s = max(self.latest_s, self.late_s[-1])


class EmulatorServer:
    """Plays until it is told to stop."""

    def __init__(self, emulator: Emulator, port: Port, on_sent: SentCallback | None = None) -> None:
        self.emulator, self.port, self.counts = emulator, port, ServerCounts()
        self._on_sent = on_sent
        self._woken, self._waker = socket.socketpair()
        self._stopped = False
        self._wrong_rate = generator(emulator.config.seed, "wrong rate")

    def run(self) -> None:
        """Until `stop`, or an exception such as KeyboardInterrupt; the port is closed then."""
        try:
            while not self._stopped:
                called = self._wait()
                now_s = time.monotonic()
                if called and (data := self.port.read()):
                    self.emulator.receive(self._heard(data), now_s)
                for sent in self.emulator.advance(now_s):
                    self._write(sent)
                self._plug(now_s)
        finally:
            self.port.close()
            self._woken.close()
            self._waker.close()

    def stop(self) -> None:
        """From any thread."""
        self._stopped = True
        try:
            self._waker.send(b"x")
        except OSError:
            return  # it has ended by itself

    def _wait(self) -> bool:
        """Until something is due or comes; whether the port has something to read, or room for what it kept."""
        wait_s = min(max(self.emulator.next_s - time.monotonic(), 0.0), MAX_WAIT_S)
        waking = self._woken.fileno()
        ready, free, _ = select.select([*self.port.readable(), waking], self.port.writable(), [], wait_s)
        return bool(free) or any(end != waking for end in ready)

    def _plug(self, now_s: float) -> None:
        if self.emulator.unplugged(now_s):
            self.port.unplug()
        else:
            self.port.plug()

    def _write(self, sent: SentMessage) -> None:
        taken = self.port.write(self._heard(sent.data))
        sent = replace(sent, written_s=time.monotonic(), unread=not taken)
        self.counts.add(sent)
        if self._on_sent is not None:
            self._on_sent(sent)

    def _heard(self, data: bytes) -> bytes:
        """Bytes as the other side hears them: noise where it listens at another rate, and that is looked at."""
        if self.emulator.config.check_baud and self.port.baud() not in (None, self.emulator.device.settings.baud):
            return self._wrong_rate.bytes(len(data))
        return data

    def summary(self) -> dict[str, float]:
        """Counts, and the pacing error [ms]."""
        counts, line, device = self.counts, self.emulator.line, self.emulator.device
        late_ms = 1e3 * np.array(counts.late_s or [0.0])
        return {
            "records_sent": float(counts.records),
            "records_dropped": float(line.dropped),
            "replies_sent": float(counts.replies),
            "messages_unread": float(counts.unread),
            "messages_unplugged": float(self.emulator.unplugged_messages),
            "messages_damaged": float(counts.damaged),
            "commands": float(device.command_count),
            "commands_refused": float(device.refused_count),
            "pacing_p50_ms": float(np.quantile(late_ms, 0.5)),
            "pacing_p99_ms": float(np.quantile(late_ms, 0.99)),
            "pacing_max_ms": 1e3 * counts.latest_s,
        }


def play_samples(samples: DeviceSamples, config: EmulatorConfig, port: Port) -> dict[str, float]:
    """Play samples at a port until Ctrl-C, the normal end; what was sent, as `EmulatorServer.summary` has it."""
    server = EmulatorServer(Emulator(samples, config, time.monotonic()), port)
    with contextlib.suppress(KeyboardInterrupt):
        server.run()
    return server.summary()


@dataclass(frozen=True)
class RunningEmulator:
    """An emulator that runs in a thread of its own."""

    name: str
    """What a client opens: a link to a pty, or tcp://host:port."""
    server: EmulatorServer

    @property
    def emulator(self) -> Emulator:
        return self.server.emulator

    def summary(self) -> dict[str, float]:
        return self.server.summary()


@contextlib.contextmanager
def serve_emulator(
    samples: DeviceSamples,
    config: EmulatorConfig | None = None,
    *,
    pty: Path | str | None = None,
    tcp: str | None = None,
    on_sent: SentCallback | None = None,
) -> Iterator[RunningEmulator]:
    """Play samples at a pty behind this link or at this `host:port` (port 0 takes a free one) while the block runs.

    `on_sent` sees each record and reply that was written, with its times and damage, in the emulator's thread.
    """
    port = open_port(pty, tcp)
    server = EmulatorServer(Emulator(samples, config, time.monotonic()), port, on_sent)
    name = port.name
    failed: list[BaseException] = []

    def run() -> None:
        try:
            server.run()
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=run, name="emulator")
    thread.start()
    try:
        yield RunningEmulator(name, server)
    finally:
        server.stop()
        thread.join()
    if failed:
        raise failed[0]


def open_port(
    pty: Path | str | None, tcp: str | None, *, anywhere: bool = False, say: LogCallback = lambda line: None
) -> Port:
    """The port that is asked for, one of the two; BadInput."""
    if (pty is None) == (tcp is None):
        raise BadInput("Neither or both of a pty and a TCP port are asked for.", "Name one of them.")
    if pty is not None:
        if sys.platform == "win32":
            raise BadInput("Windows has no pseudo terminals.", "Use --tcp.")
        from harness.stream.emulator.pty_port import PtyPort

        return PtyPort(pty)
    host, colon, number = (tcp or "").rpartition(":")
    if not colon or not (number.isascii() and number.isdecimal()) or int(number) > 65535:
        raise BadInput(f"{tcp!r} is no HOST:PORT.", "For example 127.0.0.1:5005; port 0 takes a free one.")
    return TcpPort(host.strip("[]"), int(number), anywhere=anywhere, say=say)
