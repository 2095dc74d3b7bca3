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
AT_ONCE, SHOWN = 15, 60
"""The motion begins with `MZ`; by so many samples later a client that means to stream has sent its `C`."""
RATE_HZ, ATTEMPTS, LATEST_MS = 10.0, 5, 100.0
"""A period is 100 ms, and a frame waits for one and a half."""
SOURCES = ("recorded simulation", "pty", "recorded pty", "tcp", "recorded tcp")

Sources = dict[str, list[TrackerFrame]]


@pytest.fixture(scope="module")
def played() -> Playback:
    """Four stations with all errors of the device, at a rate that a busy computer can keep."""
    return prepare_playback("demo", clip="boxing_p1_01", stations=4, rate_hz=RATE_HZ)


@pytest.fixture(scope="module")
def seen(played: Playback, tmp_path_factory: pytest.TempPathFactory) -> Sources:
    """The frames of each source; those of ports are read in real time, at the same time."""
    folder = tmp_path_factory.mktemp("conformance")
    simulation = played.simulation
    record_capture(folder / "simulated", simulation.wire_format, simulation.wire, {})
    with ThreadPoolExecutor() as pool:
        pty = pool.submit(_from_port, played, folder / "recorded pty", pty=folder / "link")
        tcp = pool.submit(_from_port, played, folder / "recorded tcp", tcp="127.0.0.1:0")
    return {
        "recorded simulation": list(RecordingStream(folder / "simulated")),
        "pty": pty.result(),
        "recorded pty": list(islice(RecordingStream(folder / "recorded pty"), FRAMES)),
        "tcp": tcp.result(),
        "recorded tcp": list(islice(RecordingStream(folder / "recorded tcp"), FRAMES)),
    }


def _from_port(played: Playback, into: Path, *, pty: Path | None = None, tcp: str | None = None) -> list[TrackerFrame]:
    """A frame is closed when its stations are late, so a computer that holds the emulator up is no device to compare
    with: then it is tried again."""
    for _ in range(ATTEMPTS):
        into.unlink(missing_ok=True)
        with serve_emulator(played.samples, pty=pty, tcp=tcp) as device, RecordingWriter(into) as recording:
            stream = Is900(device.name, DriverConfig(stations=played.samples.stations), witness=recording)
            frames = list(islice(stream, FRAMES))
            stream.close()
        if device.summary()["pacing_max_ms"] < LATEST_MS:
            return frames
    raise AssertionError(f"the emulator was more than {LATEST_MS} ms late in each of {ATTEMPTS} attempts")


def _common(one: Sequence[TrackerFrame], other: Sequence[TrackerFrame]) -> tuple[list[TrackerFrame], ...]:
    """Both from the first sample on that both have, which must come soon, and as long as both go on."""
    begin = next(i for i, frame in enumerate(one) if np.array_equal(frame.measured_s, other[0].measured_s))
    assert begin < AT_ONCE
    count = min(len(one) - begin, len(other))
    assert count >= FRAMES - AT_ONCE
    return list(one[begin : begin + count]), list(other[:count])


def _differences(one: Iterable[TrackerFrame], other: Iterable[TrackerFrame]) -> list[str]:
    """All but when the host received them."""
    names = [field.name for field in fields(TrackerFrame) if field.name != "received_s"]
    return [
        f"{name} of frame {i}"
        for i, (a, b) in enumerate(zip(one, other, strict=True))
        for name in names
        if not np.array_equal(getattr(a, name), getattr(b, name), equal_nan=getattr(a, name).dtype == float)
    ]


@pytest.mark.parametrize("source", SOURCES)
def test_every_source_gives_the_frames_of_the_simulation(played: Playback, seen: Sources, source: str) -> None:
    simulated, came = _common(played.simulation.frames, seen[source])
    assert _differences(simulated, came) == []
    assert any(not frame.position_valid.all() for frame in came), "no loss was among them: the motion is too tame"


@pytest.mark.parametrize("name", sorted(registry.methods()))
def test_every_method_answers_alike_whatever_the_source(played: Playback, seen: Sources, name: str) -> None:
    """Bit by bit, although a busy host receives the frames of ports at other times than the simulation says."""
    fitted = played.clip_evaluation.fit_method(registry.resolve(name), name)
    sources = {"simulation": list(played.simulation.frames), **seen}
    first_s = max(frames[0].measured_s[0] for frames in sources.values())

    def estimates(source: str) -> list[tuple[bytes, int]]:
        session = fitted.begin(played.calibration)
        shown = [frame for frame in sources[source] if frame.measured_s[0] >= first_s][:SHOWN]
        assert len(shown) == SHOWN
        return [(e.qpos.tobytes(), int(e.status)) for e in map(session.step, shown)]

    simulated = estimates("simulation")
    for source in ("pty", "tcp", "recorded pty"):
        assert estimates(source) == simulated, source
