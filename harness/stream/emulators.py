"""Emulators of every device family: the configuration tells which device it is."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

from harness.stream.fastrak import FastrakEmulator, FastrakEmulatorConfig
from harness.stream.is900 import Emulator
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.emulator import LineEmulator
from harness.stream.polhemus.emulator.server import EmulatorServer, SentCallback, open_port, serve_in_thread


def open_emulator(samples: DeviceSamples, config: EmulatorConfig | None = None) -> LineEmulator:
    """Switch an emulated device on now, an IS-900 unless `config` is that of a FASTRAK.

    Raises BadInput for samples that no such device can have, UnknownName for a fault's station that is not in them.
    """
    if isinstance(config, FastrakEmulatorConfig):
        return FastrakEmulator(samples, config, time.monotonic())
    return Emulator(samples, config, time.monotonic())


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
    emulator = open_emulator(samples, config)
    with serve_in_thread(EmulatorServer(emulator, open_port(pty, tcp), on_sent)) as server:
        yield server
