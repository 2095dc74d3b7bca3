"""A FASTRAK on the bench of the IS-900's driver."""

from typing import Any

from harness.stream.fastrak.driver import Fastrak, FastrakConfig
from harness.stream.fastrak.emulator import FastrakEmulator, FastrakEmulatorConfig
from harness.stream.line_events import LineObserver
from harness.stream.polhemus.emulator.faults import Fault
from tests.stream.is900.driver.bench import START_S, Bench, EmulatedDevice, make_samples

PORT = "fastrak:bench"


class EmulatedFastrak(EmulatedDevice):
    """The emulator of a FASTRAK as a device."""

    def __init__(self, stations: int, rate_hz: float, config: FastrakEmulatorConfig) -> None:
        self.emulator = FastrakEmulator(make_samples(stations, rate_hz), config, START_S)


def fastrak_bench(*faults: Fault, stations: int = 3, rate_hz: float = 40.0, **config: Any) -> Bench:
    """A bench with a FASTRAK of this configuration."""
    return Bench(EmulatedFastrak(stations, rate_hz, FastrakEmulatorConfig(faults=faults, **config)), PORT)


def open_fastrak(bench: Bench, config: FastrakConfig | None = None, observer: LineObserver | None = None) -> Fastrak:
    """The driver of the device on the bench."""
    return Fastrak(bench.port, config, on_event=bench.events.append, host=bench.host, observer=observer)
