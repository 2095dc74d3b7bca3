"""`--stations head=3,torso=1`: names of stations, and the device's stations that they belong to."""

from pathlib import Path

import numpy as np
import pytest

from harness.commands.flags import parse_station_map
from harness.errors import HarnessError
from harness.stream import serve_emulator
from harness.stream.recording import RecordingStream
from tests.command import Command
from tests.stream.is900.driver.bench import make_samples

LIVE = ["live", "--scenario", "demo", "--clip", "boxing_p1_01", "--method", "ik", "--port", "tcp://127.0.0.1:1"]


def test_names_come_in_the_order_of_the_device() -> None:
    assert list(parse_station_map("head=3, torso=1,left_hand=a").items()) == [
        ("torso", "1"),
        ("head", "3"),
        ("left_hand", "A"),
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("head=3,torso", "torso has no counterpart. Write NAME=STATION for each, such as head=3,torso=1"),
        ("head=,torso=1", "head has no counterpart"),
        ("=3,torso=1", "3 has no counterpart"),
        ("head=3,torso=3", "station 3 occurs 2 times"),
        ("head=a,torso=A", "station A occurs 2 times"),
        ("head=3,head=1", "name head occurs 2 times"),
        ("head=12,torso=1", "'12' is no station of a device. Write NAME=STATION for each"),
        ("head=D", "'D' is no station of a device"),
        ("head=0", "'0' is no station of a device"),
    ],
)
@pytest.mark.parametrize("verb", ["record", "live", "calibrate"])
def test_wrong_maps_are_refused_before_a_port_is_opened(
    verb: str, text: str, words: str, tmp_path: Path, command: Command
) -> None:
    with pytest.raises(HarnessError):
        parse_station_map(text)
    commands = {
        "record": ["record", "tcp://127.0.0.1:1", str(tmp_path / "x.rec")],
        "live": LIVE,
        "calibrate": ["calibrate", "--port", "tcp://127.0.0.1:1", "--scenario", "demo", "--out"],
    }
    commands["calibrate"].append(str(tmp_path / "me.toml"))
    assert words in command(*commands[verb], "--stations", text, code=2).err


def test_rows_are_those_of_the_named_stations(tmp_path: Path, command: Command) -> None:
    """The device has four stations, at heights 0, 0.1, 0.2 and 0.3 m; the third is the head, the first the torso."""
    path = tmp_path / "two.rec"
    with serve_emulator(make_samples(4), tcp="127.0.0.1:0") as emulator:
        said = command("record", emulator.name, path, "--seconds", "0.6", "--stations", "head=3,torso=1").err
        assert "stations 1 torso, 3 head" in said
        assert [station.active for station in emulator.emulator.device.settings.stations[:5]] == [True] * 4 + [False]
        said = command("record", emulator.name, tmp_path / "x.rec", "--stations", "head=7,torso=1", code=2).err
        assert "the device has no station 7 (head); it has 1, 2, 3, 4. Plug it in" in said
        said = command(*LIVE[:-1], emulator.name, "--stations", "head=7,torso=1", code=2).err
    assert "no station 7 (head)" in said
    assert "learning" not in said
    stream = RecordingStream(path)
    assert stream.stations == ("torso", "head")
    frames = [frame for frame in stream if frame.position_valid.all()]
    assert len(frames) > 5
    np.testing.assert_allclose([frame.position_m[:, 2] for frame in frames], [[0.0, 0.2]] * len(frames), atol=1e-5)


def test_a_named_station_that_is_off_is_on_for_the_session(tmp_path: Path, command: Command) -> None:
    with serve_emulator(make_samples(4), tcp="127.0.0.1:0") as emulator:
        device = emulator.emulator.device
        device.receive(b"l3,0\r", 0.0)
        command("record", emulator.name, tmp_path / "x.rec", "--seconds", "0.3", "--stations", "head=3")
        assert not device.settings.station("3").active
        assert device.settings.station("1").active
    (frame, *_) = RecordingStream(tmp_path / "x.rec")
    assert frame.position_m[0, 2] == pytest.approx(0.2, abs=1e-5)
