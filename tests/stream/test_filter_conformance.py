"""A device with a filter through simulation, recording, pty and TCP: the same frames, and the contract of streams."""

from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from harness.stream.codec.reader import ByteCapture, WireFormat
from harness.stream.codec.records import RecordValues, encode_records
from harness.stream.driver import Is900
from harness.stream.emulator import serve_emulator
from harness.stream.recording.recording import RecordingWriter
from harness.stream.recording.replay import RecordingStream
from harness.testing.stream_checks import check_stream
from tests.stream.emulator.played import make_samples, with_filter
from tests.stream.sources import RATE_HZ, SOURCES, PlayedTake, Sources, differences, overlap, read_sources

pytestmark = pytest.mark.long
CHECKED_FRAMES = 25


@pytest.fixture(scope="module")
def take() -> PlayedTake:
    """Four stations with a filter, of which the second loses track for a second.

    Every station has another prediction and enhancement. The simulation computes all its instants at once.
    """
    plain = make_samples(rate_hz=RATE_HZ)
    plain = replace(plain, device_s=plain.device_s - plain.device_s[0, 0])  # the clock is set to zero at first
    quality = plain.quality.copy()
    quality[40:50, 1] = 0.0
    samples = with_filter(plain, prediction_ms=(0, 11, 50, 33), enhancement=(0, 1, 2, 2), quality=quality)
    made = samples.filter
    assert made is not None
    position_m, turn = made.report_poses(
        samples.position_m, samples.tracker_from_station, made.prediction_ms, made.enhancement
    )
    wire_format = WireFormat(samples.stations, samples.rate_hz)
    characters = np.tile(np.frombuffer(wire_format.characters, np.uint8), len(samples))
    values = RecordValues(
        samples.device_s.ravel(), position_m.reshape(-1, 3), turn.reshape(-1, 4), samples.quality.ravel()
    )
    table = encode_records(wire_format.items, characters, values, wire_format.settings)
    ends = table.itemsize * np.arange(1, len(table) + 1)
    wire = ByteCapture(table.tobytes(), ends, samples.taken_s.ravel() + samples.ready_s)
    return PlayedTake(samples, wire_format, wire)


@pytest.fixture(scope="module")
def frames_by_source(take: PlayedTake, tmp_path_factory: pytest.TempPathFactory) -> Sources:
    return read_sources(take, tmp_path_factory.mktemp("filter"))


@pytest.mark.parametrize("source", SOURCES)
def test_every_source_yields_the_frames_of_the_simulation(
    take: PlayedTake, frames_by_source: Sources, source: str
) -> None:
    simulated, received = overlap(take.frames, frames_by_source[source])
    assert differences(simulated, received) == []
    assert any(not frame.position_valid.all() for frame in received), "no station was lost"


def test_prediction_and_enhancement_show_in_the_frames(take: PlayedTake) -> None:
    """A take whose stations all report plain poses would conform without a filter."""
    position_m = np.array([frame.position_m for frame in take.frames])
    off_m = np.nanmax(np.abs(position_m - take.samples.position_m[: len(position_m)]), axis=(0, 2))
    changed = (take.samples.filter.prediction_ms > 0) | (take.samples.filter.enhancement > 0)  # type: ignore[union-attr]
    assert ((off_m > 1e-3) == changed).all()


@pytest.mark.parametrize("source", SOURCES)
def test_every_source_keeps_the_contract_of_streams(take: PlayedTake, source: str, tmp_path: Path) -> None:
    path = tmp_path / "recording"
    pty, tcp = (tmp_path / "link", None) if "pty" in source else (None, "127.0.0.1:0")
    if source == "recorded simulation":
        check_stream(lambda: RecordingStream(take.record(path)), rate_hz=RATE_HZ)
        return
    with serve_emulator(take.samples, pty=pty, tcp=tcp) as device:
        if source in ("pty", "tcp"):
            check_stream(lambda: Is900(device.name, take.driver_config), rate_hz=RATE_HZ, at_most=CHECKED_FRAMES)
            return
        with RecordingWriter(path) as recording, Is900(device.name, take.driver_config, observer=recording) as stream:
            list(islice(stream, CHECKED_FRAMES))
    check_stream(lambda: RecordingStream(path), rate_hz=RATE_HZ)
