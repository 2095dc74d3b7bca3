"""What tests of verbs share: a take that is played over a line, and its recording."""

from pathlib import Path

import pytest

from harness.cli import main
from harness.experiment import Playback, prepare_playback

CLIP = "boxing_p1_01"


@pytest.fixture(scope="session")
def played() -> Playback:
    """Four stations of the demo on a clip of boxing."""
    return prepare_playback("demo", clip=CLIP, stations=4)


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a second and a half of it."""
    path = tmp_path_factory.mktemp("simulated") / "a.rec"
    assert main(["record", "sim:demo", str(path), "--clip", CLIP, "--stations", "4", "--seconds", "1.49"]) == 0
    return path
