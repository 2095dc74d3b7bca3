"""A physical tracker through simulation, recording, pty and TCP: the same frames."""

from pathlib import Path

import numpy as np
import pytest

from harness.experiment.playback import Playback, prepare_playback
from tests.stream.sources import RATE_HZ, SOURCES, PlayedTake, Sources, differences, overlap, read_sources

pytestmark = pytest.mark.long
SCENARIO = """
methods = ["ik:previous"]
stations = "liu2011"
worn = ["left_hand", "right_hand", "torso", "head"]
[motion]
source = "builtin"
behaviours = ["boxing"]
test = ["boxing_p1_01"]
[physics]
fusion = { prediction_ms = { head = 50, left_hand = 11 }, enhancement = { torso = 1, left_hand = 2 } }
"""


@pytest.fixture(scope="module")
def playback(tmp_path_factory: pytest.TempPathFactory) -> Playback:
    """Four stations under all causes of errors, two with prediction and two with enhancement."""
    path: Path = tmp_path_factory.mktemp("scenario") / "physical.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return prepare_playback(path, rate_hz=RATE_HZ)


@pytest.fixture(scope="module")
def frames_by_source(playback: Playback, tmp_path_factory: pytest.TempPathFactory) -> Sources:
    return read_sources(PlayedTake.of(playback), tmp_path_factory.mktemp("physical"))


@pytest.mark.parametrize("source", SOURCES)
def test_every_source_yields_the_frames_of_the_simulation(
    playback: Playback, frames_by_source: Sources, source: str
) -> None:
    simulated, received = overlap(playback.simulation.frames, frames_by_source[source])
    assert differences(simulated, received) == []
    assert any(not frame.position_valid.all() for frame in received), "no station was lost: the motion is too easy"


def test_prediction_and_enhancement_show_in_the_frames(playback: Playback) -> None:
    made = playback.samples.filter
    assert made is not None
    position_m = np.array([frame.position_m for frame in playback.simulation.frames])
    off_m = np.nanmax(np.abs(position_m - playback.samples.position_m[: len(position_m)]), axis=(0, 2))
    assert ((off_m > 1e-4) == (made.prediction_ms > 0) | (made.enhancement > 0)).all()
