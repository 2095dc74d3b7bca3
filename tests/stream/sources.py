"""The five sources of one take: its recorded simulation, a pty and a TCP port, and the recordings of both ports."""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from itertools import islice
from pathlib import Path

import numpy as np

from harness.experiment import Playback
from harness.stream.emulators import serve_emulator
from harness.stream.frame import TrackerFrame
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.polhemus.codec.reader import ByteCapture, FrameReader, WireFormat
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.recording.recording_writer import RecordingWriter, record_capture
from harness.stream.recording.replay import RecordingStream

FRAMES = 80
MAX_START_FRAMES = 15
"""The motion begins with `MZ`. A client has sent its `C` at most this many samples later."""
RATE_HZ, ATTEMPTS, MAX_LATE_MS = 10.0, 5, 100.0
"""A period is 100 ms, and a frame waits for 1.5 periods."""
SOURCES = ("recorded simulation", "pty", "recorded pty", "tcp", "recorded tcp")

Sources = dict[str, list[TrackerFrame]]


@dataclass(frozen=True, eq=False)
class PlayedTake:
    """Samples of a device, and the bytes of the simulation of their first loop."""

    samples: DeviceSamples
    wire_format: WireFormat
    wire: ByteCapture

    @classmethod
    def of(cls, playback: Playback) -> "PlayedTake":
        return cls(playback.samples, playback.simulation.wire_format, playback.simulation.wire)

    @property
    def frames(self) -> list[TrackerFrame]:
        """The frames of the simulation."""
        reader = FrameReader(self.wire_format)
        return [*reader.feed_all(self.wire), *reader.finish()]

    def record(self, path: Path) -> Path:
        """Write the simulation as a recording."""
        record_capture(path, self.wire_format, self.wire, {})
        return path

    @property
    def driver_config(self) -> DriverConfig:
        """The driver leaves prediction and enhancement as the samples have them."""
        return DriverConfig(stations=self.samples.stations, keep_settings=self.samples.filter is not None)


def read_sources(take: PlayedTake, folder: Path) -> Sources:
    """Return the frames of each source. Those of ports are read in real time, at the same time."""
    simulated = take.record(folder / "simulated")
    with ThreadPoolExecutor() as pool:
        pty = pool.submit(_read_from_port, take, folder / "recorded pty", pty=folder / "link")
        tcp = pool.submit(_read_from_port, take, folder / "recorded tcp", tcp="127.0.0.1:0")
    return {
        "recorded simulation": list(RecordingStream(simulated)),
        "pty": pty.result(),
        "recorded pty": list(islice(RecordingStream(folder / "recorded pty"), FRAMES)),
        "tcp": tcp.result(),
        "recorded tcp": list(islice(RecordingStream(folder / "recorded tcp"), FRAMES)),
    }


def _read_from_port(
    take: PlayedTake, path: Path, *, pty: Path | None = None, tcp: str | None = None
) -> list[TrackerFrame]:
    """Read frames at a port; try again when the emulator was too late.

    A frame is closed when its stations are late, so an emulator that the computer delays is no reference.
    """
    for _ in range(ATTEMPTS):
        path.unlink(missing_ok=True)
        with serve_emulator(take.samples, pty=pty, tcp=tcp) as device, RecordingWriter(path) as recording:
            stream = Is900(device.name, take.driver_config, observer=recording)
            frames = list(islice(stream, FRAMES))
            stream.close()
        if device.summary()["pacing_max_ms"] < MAX_LATE_MS:
            return frames
    raise AssertionError(f"the emulator was more than {MAX_LATE_MS} ms late in each of {ATTEMPTS} attempts")


def overlap(first: Sequence[TrackerFrame], second: Sequence[TrackerFrame]) -> tuple[list[TrackerFrame], ...]:
    """Return both from the first sample that both have, which must come soon, to the end of the shorter one."""
    begin = next(i for i, frame in enumerate(first) if np.array_equal(frame.measured_s, second[0].measured_s))
    assert begin < MAX_START_FRAMES
    count = min(len(first) - begin, len(second))
    assert count >= FRAMES - MAX_START_FRAMES
    return list(first[begin : begin + count]), list(second[:count])


def differences(first: Iterable[TrackerFrame], second: Iterable[TrackerFrame]) -> list[str]:
    """Describe all differences except the times of reception."""
    names = [field.name for field in fields(TrackerFrame) if field.name != "received_s"]
    return [
        f"{name} of frame {i}"
        for i, (a, b) in enumerate(zip(first, second, strict=True))
        for name in names
        if not np.array_equal(getattr(a, name), getattr(b, name), equal_nan=getattr(a, name).dtype == float)
    ]
