"""One motion through simulation, recording, pty and TCP: the same frames, and the same estimates of every method."""

import pytest

from harness.experiment.playback import Playback, prepare_playback
from harness.reconstruct import registry
from tests.long_demo import write_long_demo
from tests.stream.sources import RATE_HZ, SOURCES, PlayedTake, Sources, differences, overlap, read_sources

ESTIMATED_FRAMES = 60


@pytest.fixture(scope="module")
def playback(tmp_path_factory: pytest.TempPathFactory) -> Playback:
    """Four stations with all errors of the device, at a rate that a busy computer can sustain."""
    scenario = write_long_demo(tmp_path_factory.mktemp("scenario"))
    return prepare_playback(scenario, clip="boxing_p1_01", stations=4, rate_hz=RATE_HZ)


@pytest.fixture(scope="module")
def frames_by_source(playback: Playback, tmp_path_factory: pytest.TempPathFactory) -> Sources:
    return read_sources(PlayedTake.of(playback), tmp_path_factory.mktemp("conformance"))


@pytest.mark.parametrize("source", SOURCES)
def test_every_source_yields_the_frames_of_the_simulation(
    playback: Playback, frames_by_source: Sources, source: str
) -> None:
    simulated, received = overlap(playback.simulation.frames, frames_by_source[source])
    assert differences(simulated, received) == []
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
