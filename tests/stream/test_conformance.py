"""One take through simulation, recording, pty and TCP: the same frames, the contract of streams, the same estimates."""

from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from harness.experiment import Playback, prepare_playback
from harness.reconstruct import list_methods, make_method
from harness.stream.emulators import serve_emulator
from harness.stream.is900.driver.is900 import Is900
from harness.stream.polhemus.codec.reader import ByteCapture, WireFormat
from harness.stream.polhemus.codec.records import RecordValues, encode_records
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.recording.replay import RecordingStream
from harness.testing.stream_checks import check_stream
from tests.long_demo import write_long_demo
from tests.stream.is900.emulator.played import make_samples, with_filter
from tests.stream.sources import RATE_HZ, SOURCES, PlayedTake, Sources, differences, overlap, read_sources

ESTIMATED_FRAMES, CHECKED_FRAMES = 60, 25
PHYSICAL = """
methods = ["ik:previous"]
stations = "liu2011"
worn = ["left_hand", "right_hand", "torso", "head"]

[motion]
source = "builtin"
behaviours = ["boxing"]
test = ["boxing_p1_01"]

[physics]
constellation.range_m = 2.0
fusion = { prediction_ms = { head = 50, left_hand = 11 }, enhancement = { torso = 1, left_hand = 2 } }
"""


@pytest.fixture(scope="module")
def playback(tmp_path_factory: pytest.TempPathFactory) -> Playback:
    """Four stations with all errors of the device, at a rate that a busy computer can sustain."""
    scenario = write_long_demo(tmp_path_factory.mktemp("scenario"))
    return prepare_playback(scenario, clip="boxing_p1_01", stations=4, rate_hz=RATE_HZ)


def physical_take(folder: Path) -> PlayedTake:
    """Four stations of a physical tracker under all causes of errors, two with prediction and two with enhancement."""
    path = folder / "physical.toml"
    path.write_text(PHYSICAL, encoding="utf-8")
    return PlayedTake.of(prepare_playback(path, rate_hz=RATE_HZ))


def filter_take(folder: Path) -> PlayedTake:
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


FILTERED: list[Callable[[Path], PlayedTake]] = [physical_take, filter_take]


@pytest.fixture(scope="module", params=[None, *(pytest.param(make, marks=pytest.mark.long) for make in FILTERED)])
def take(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> PlayedTake:
    if request.param is None:
        return PlayedTake.of(request.getfixturevalue("playback"))
    made: PlayedTake = request.param(tmp_path_factory.mktemp("take"))
    return made


@pytest.fixture(scope="module")
def frames_by_source(take: PlayedTake, tmp_path_factory: pytest.TempPathFactory) -> Sources:
    return read_sources(take, tmp_path_factory.mktemp("conformance"))


def test_every_source_yields_the_frames_of_the_simulation(take: PlayedTake, frames_by_source: Sources) -> None:
    for source in SOURCES:
        simulated, received = overlap(take.frames, frames_by_source[source])
        assert differences(simulated, received) == [], source
        assert any(not frame.position_valid.all() for frame in received), "no station was lost: the motion is too easy"


def test_prediction_and_enhancement_show_in_the_frames(take: PlayedTake) -> None:
    """A take whose stations all report plain poses would conform without a filter."""
    if (made := take.samples.filter) is None:
        return
    position_m = np.array([frame.position_m for frame in take.frames])
    off_m = np.nanmax(np.abs(position_m - take.samples.position_m[: len(position_m)]), axis=(0, 2))
    assert ((off_m > 1e-4) == (made.prediction_ms > 0) | (made.enhancement > 0)).all()


@pytest.mark.long
@pytest.mark.parametrize("source", SOURCES)
def test_every_source_keeps_the_contract_of_streams(source: str, tmp_path: Path) -> None:
    take, path = filter_take(tmp_path), tmp_path / "recording"
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


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(list_methods()))
@pytest.mark.parametrize("take", [None], indirect=True)
def test_every_method_estimates_the_same_from_every_source(
    playback: Playback, frames_by_source: Sources, name: str
) -> None:
    """Bit by bit, although a busy host receives the frames of ports at other times than the simulation says."""
    reconstructor = playback.clip_evaluation.fit_method(make_method(name), name)
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
