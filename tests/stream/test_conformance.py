"""One motion through simulation, recording, pty and TCP: the same frames, and the same estimates of every method."""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from harness.experiment.playback import Playback, prepare_playback
from harness.reconstruct import registry
from harness.stream.driver import DriverConfig, Is900
from harness.stream.emulator import serve_emulator
from harness.stream.frame import TrackerFrame
from harness.stream.recording.recording import RecordingWriter, record_capture
from harness.stream.recording.replay import RecordingStream

FRAMES = 80
MAX_START_FRAMES, ESTIMATED_FRAMES = 15, 60
"""The motion begins with `MZ`. A client has sent its `C` at most this many samples later."""
RATE_HZ, ATTEMPTS, MAX_LATE_MS = 10.0, 5, 100.0
"""A period is 100 ms, and a frame waits for 1.5 periods."""
SOURCES = ("recorded simulation", "pty", "recorded pty", "tcp", "recorded tcp")

Sources = dict[str, list[TrackerFrame]]


@pytest.fixture(scope="module")
def playback() -> Playback:
    """Four stations with all errors of the device, at a rate that a busy computer can sustain."""
    return prepare_playback("demo", clip="boxing_p1_01", stations=4, rate_hz=RATE_HZ)


@pytest.fixture(scope="module")
def frames_by_source(playback: Playback, tmp_path_factory: pytest.TempPathFactory) -> Sources:
    """The frames of each source. Those of ports are read in real time, at the same time."""
    folder = tmp_path_factory.mktemp("conformance")
    simulation = playback.simulation
    record_capture(folder / "simulated", simulation.wire_format, simulation.wire, {})
    with ThreadPoolExecutor() as pool:
        pty = pool.submit(_read_from_port, playback, folder / "recorded pty", pty=folder / "link")
        tcp = pool.submit(_read_from_port, playback, folder / "recorded tcp", tcp="127.0.0.1:0")
    return {
        "recorded simulation": list(RecordingStream(folder / "simulated")),
        "pty": pty.result(),
        "recorded pty": list(islice(RecordingStream(folder / "recorded pty"), FRAMES)),
        "tcp": tcp.result(),
        "recorded tcp": list(islice(RecordingStream(folder / "recorded tcp"), FRAMES)),
    }


def _read_from_port(
    playback: Playback, path: Path, *, pty: Path | None = None, tcp: str | None = None
) -> list[TrackerFrame]:
    """Read frames at a port; try again when the emulator was too late.

    A frame is closed when its stations are late, so an emulator that the computer delays is no reference.
    """
    for _ in range(ATTEMPTS):
        path.unlink(missing_ok=True)
        with serve_emulator(playback.samples, pty=pty, tcp=tcp) as device, RecordingWriter(path) as recording:
            stream = Is900(device.name, DriverConfig(stations=playback.samples.stations), observer=recording)
            frames = list(islice(stream, FRAMES))
            stream.close()
        if device.summary()["pacing_max_ms"] < MAX_LATE_MS:
            return frames
    raise AssertionError(f"the emulator was more than {MAX_LATE_MS} ms late in each of {ATTEMPTS} attempts")


def _overlap(first: Sequence[TrackerFrame], second: Sequence[TrackerFrame]) -> tuple[list[TrackerFrame], ...]:
    """Return both from the first sample that both have, which must come soon, to the end of the shorter one."""
    begin = next(i for i, frame in enumerate(first) if np.array_equal(frame.measured_s, second[0].measured_s))
    assert begin < MAX_START_FRAMES
    count = min(len(first) - begin, len(second))
    assert count >= FRAMES - MAX_START_FRAMES
    return list(first[begin : begin + count]), list(second[:count])


def _differences(first: Iterable[TrackerFrame], second: Iterable[TrackerFrame]) -> list[str]:
    """Describe all differences except the times of reception."""
    names = [field.name for field in fields(TrackerFrame) if field.name != "received_s"]
    return [
        f"{name} of frame {i}"
        for i, (a, b) in enumerate(zip(first, second, strict=True))
        for name in names
        if not np.array_equal(getattr(a, name), getattr(b, name), equal_nan=getattr(a, name).dtype == float)
    ]


@pytest.mark.parametrize("source", SOURCES)
def test_every_source_yields_the_frames_of_the_simulation(
    playback: Playback, frames_by_source: Sources, source: str
) -> None:
    simulated, received = _overlap(playback.simulation.frames, frames_by_source[source])
    assert _differences(simulated, received) == []
    assert any(not frame.position_valid.all() for frame in received), "no station was lost: the motion is too easy"


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(registry.methods()))
def test_every_method_estimates_the_same_from_every_source(
    playback: Playback, frames_by_source: Sources, name: str
) -> None:
    """Bit by bit, although a busy host receives the frames of ports at other times than the simulation says."""
    reconstructor = playback.clip_evaluation.fit_method(registry.resolve(name), name)
    sources = {"simulation": list(playback.simulation.frames), **frames_by_source}
    first_s = max(frames[0].measured_s[0] for frames in sources.values())

    def estimates(source: str) -> list[tuple[bytes, int]]:
        session = reconstructor.begin(playback.calibration)
        frames = [frame for frame in sources[source] if frame.measured_s[0] >= first_s][:ESTIMATED_FRAMES]
        assert len(frames) == ESTIMATED_FRAMES
        return [(e.qpos.tobytes(), int(e.status)) for e in map(session.step, frames)]

    simulated = estimates("simulation")
    for source in ("pty", "tcp", "recorded pty"):
        assert estimates(source) == simulated, source
