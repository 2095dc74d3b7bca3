"""A driver and a device on a simulated bench with its own time: hours pass at once, and nothing is random."""

from collections.abc import Callable, Iterator
from itertools import takewhile
from typing import Any, Protocol

import numpy as np

from harness.errors import BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.is900.emulator.emulator import Emulator
from harness.stream.line_events import LineEvent
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.driver.config import DriverTiming
from harness.stream.polhemus.driver.connection import Host
from harness.stream.polhemus.driver.tracker import Tracker
from harness.stream.polhemus.driver.transport import LineLost, Transport
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.emulator import LineEmulator
from harness.stream.polhemus.emulator.faults import Fault

NAMES = ("head", "torso", "left_wrist", "right_wrist", "left_ankle", "right_ankle")
LOOP_S = 10.0
START_S = 1000.0
TICK_S = 2e-4
"""Shortest time step on the bench [s]."""


def make_samples(stations: int, rate_hz: float = 50.0) -> DeviceSamples:
    """Samples of stations that sway; no station is at the same place in two successive readings."""
    count = round(LOOP_S * rate_hz)
    taken_s = np.arange(count)[:, None] / rate_hz + np.arange(stations) / (4.0 * stations * rate_hz)
    angle = 2.0 * np.pi * taken_s / LOOP_S
    zero = np.zeros_like(angle)
    return DeviceSamples(
        stations=NAMES[:stations],
        rate_hz=rate_hz,
        take_frames=count,
        taken_s=taken_s,
        ready_s=0.002,
        device_s=taken_s,
        position_m=np.stack([np.cos(angle), np.sin(angle), zero + 0.1 * np.arange(stations)], axis=-1),
        tracker_from_station=np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=-1),
        quality=np.ones_like(angle),
    )


class Device(Protocol):
    """The device's end of the line."""

    def receive(self, data: bytes, now_s: float) -> None: ...
    def pop_due(self, now_s: float) -> bytes: ...
    @property
    def next_s(self) -> float: ...


class EmulatedDevice:
    """The emulator as a device."""

    def __init__(self, samples: DeviceSamples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        self.emulator: LineEmulator = Emulator(samples, config, now_s)

    def receive(self, data: bytes, now_s: float) -> None:
        self.emulator.receive(data, now_s)

    def pop_due(self, now_s: float) -> bytes:
        return b"".join(sent.data for sent in self.emulator.advance(now_s))

    @property
    def next_s(self) -> float:
        return self.emulator.next_s


class Adapter:
    """An adapter between device and host that passes bytes on at intervals, as USB adapters do."""

    def __init__(self, device: Device, interval_s: float = 0.016) -> None:
        self._device, self._interval_s, self.next_s = device, interval_s, START_S

    def receive(self, data: bytes, now_s: float) -> None:
        self._device.receive(data, now_s)

    def pop_due(self, now_s: float) -> bytes:
        if now_s < self.next_s:
            return b""
        self.next_s += self._interval_s * (1 + (now_s - self.next_s) // self._interval_s)
        return self._device.pop_due(now_s)


class ScriptedDevice:
    """Sends a fixed reply to each command, and chatters if asked to."""

    def __init__(self, replies: dict[bytes, bytes], chatter: bytes = b"", interval_s: float = 0.02) -> None:
        self._replies, self._chatter, self._interval_s = replies, chatter, interval_s
        self._out, self._last_chatter_s = b"", START_S

    def receive(self, data: bytes, now_s: float) -> None:
        self._out += b"".join(reply for command, reply in self._replies.items() if command in data)

    def pop_due(self, now_s: float) -> bytes:
        out, self._out = self._out, b""
        while self._chatter and self._last_chatter_s + self._interval_s <= now_s:
            self._last_chatter_s += self._interval_s
            out += self._chatter
        return out

    @property
    def next_s(self) -> float:
        return self._last_chatter_s + self._interval_s if self._chatter else float("inf")


class Bench:
    """One port, `bench`, with a device or without one."""

    def __init__(self, device: Device | None, port: str = "bench") -> None:
        self.device, self.port = device, port
        self.now_s = START_S
        self.plugged = True
        self.opened: list[tuple[str, int]] = []
        self.open_lines = 0
        self.sent = bytearray()
        """Bytes sent by the host."""
        self.events: list[LineEvent] = []
        self.host = Host(self.open, lambda: self.now_s, lambda: 1.7e9 + self.now_s, self.sleep)
        self.corrupt: Callable[[bytes], bytes] = lambda data: data
        """Applied to bytes on their way to the host."""
        self._plans: list[tuple[float, Callable[[], None]]] = []

    def open(self, port: str, baud: int) -> Transport:
        self.opened.append((port, baud))
        if not self.plugged or port != self.port:
            raise BadInput(f"Port {port}: there is no such port.", "")
        return BenchLine(self)

    def driver(self, config: DriverConfig | None = None, timing: DriverTiming | None = None) -> Is900:
        return Is900(self.port, config, on_event=self.events.append, timing=timing, host=self.host)

    def schedule(self, delay_s: float, action: Callable[[], None]) -> None:
        """Schedule an action."""
        self._plans.append((self.now_s + delay_s, action))
        self._plans.sort(key=lambda plan: plan[0])

    def sleep(self, duration_s: float) -> None:
        until_s = self.now_s + duration_s
        while self.next_plan_s <= until_s:
            self.now_s, action = self._plans.pop(0)
            action()
        self.now_s = until_s

    @property
    def next_plan_s(self) -> float:
        return self._plans[0][0] if self._plans else float("inf")

    @property
    def kinds(self) -> list[str]:
        return [event.kind for event in self.events]


class BenchLine:
    """The host's end of the line."""

    def __init__(self, bench: Bench) -> None:
        self.name, self._bench, self._closed = bench.port, bench, False
        bench.open_lines += 1

    def read(self, timeout_s: float) -> bytes:
        bench, until_s = self._bench, self._bench.now_s + timeout_s
        while True:
            self._check()
            pop_due = bench.device.pop_due(bench.now_s) if bench.device else b""
            if data := bench.corrupt(pop_due):
                return data
            next_s = min(bench.device.next_s if bench.device else float("inf"), bench.next_plan_s)
            if bench.now_s >= until_s:
                return b""
            bench.sleep(max(min(next_s, until_s) - bench.now_s, TICK_S))

    def write(self, data: bytes) -> None:
        self._check()
        self._bench.sent += data
        if self._bench.device:
            self._bench.device.receive(data, self._bench.now_s)

    def close(self) -> None:
        self._bench.open_lines -= not self._closed
        self._closed = True

    def _check(self) -> None:
        if self._closed or not self._bench.plugged:
            raise LineLost(self.name, "closed" if self._closed else "unplugged")


def frames_for(stream: Tracker, bench: Bench, duration_s: float) -> list[TrackerFrame]:
    """Return the frames of this duration."""
    until_s = bench.now_s + duration_s
    frames: Iterator[TrackerFrame] = iter(stream)
    return list(takewhile(lambda frame: frame.received_s < until_s, frames))


class LineLog:
    """An observer that stores everything."""

    def __init__(self) -> None:
        self.received_data, self.sent_data = bytearray(), bytearray()
        self.formats: list[tuple[int, int, WireFormat]] = []
        """Number of bytes received and sent before, and the format."""
        self.events: list[LineEvent] = []
        self.times_s: list[float] = []

    def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        self.received_data += data
        self.times_s.append(monotonic_s)

    def on_sent(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        self.sent_data += data
        self.times_s.append(monotonic_s)

    def on_configured(self, wire: WireFormat) -> None:
        self.formats.append((len(self.received_data), len(self.sent_data), wire))

    def on_event(self, event: LineEvent) -> None:
        self.events.append(event)


def bench_of(*faults: Fault, stations: int = 4, rate_hz: float = 50.0, port: str = "bench", **config: Any) -> Bench:
    """A bench with a device of this configuration."""
    samples = make_samples(stations, rate_hz)
    return Bench(EmulatedDevice(samples, EmulatorConfig(faults=faults, **config), START_S), port)


def device_of(bench: Bench) -> Any:
    """The emulated device of a bench; Any, because tests replace its methods."""
    assert isinstance(bench.device, EmulatedDevice)
    return bench.device.emulator.device
