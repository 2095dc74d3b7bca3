"""An emulated IS-900 with its line, and its service at a port."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

from harness.stream.is900.emulator.device import Device
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.emulator import LineEmulator
from harness.stream.polhemus.emulator.server import EmulatorServer, SentCallback, open_port, serve_in_thread


class Emulator(LineEmulator):
    """An IS-900 and the line as a host sees them. Calls must have increasing times."""

    def __init__(self, samples: DeviceSamples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        """Switch the device on. Raises UnknownName when a fault names a station that is not in the samples."""
        super().__init__(Device(samples, config, now_s), now_s)


@contextlib.contextmanager
def serve_emulator(
    samples: DeviceSamples,
    config: EmulatorConfig | None = None,
    *,
    pty: Path | str | None = None,
    tcp: str | None = None,
    on_sent: SentCallback | None = None,
) -> Iterator[EmulatorServer]:
    """Play samples at a pty behind a link, or at `host:port` (port 0 takes a free one), while the block runs.

    `on_sent` receives each record and reply that was written, with its times and damage, in the emulator's thread.
    """
    emulator = Emulator(samples, config, time.monotonic())
    with serve_in_thread(EmulatorServer(emulator, open_port(pty, tcp), on_sent)) as server:
        yield server
