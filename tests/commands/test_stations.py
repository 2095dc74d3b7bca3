"""`--stations head=3,torso=1`: names of stations, and the device's stations that they belong to."""

from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.commands.flags import parse_station_map
from harness.errors import HarnessError
from harness.stream.emulator import serve_emulator
from harness.stream.recording.replay import RecordingStream
from tests.stream.driver.bench import make_samples

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
    verb: str, text: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(HarnessError):
        parse_station_map(text)
    commands = {
        "record": ["record", "tcp://127.0.0.1:1", str(tmp_path / "x.rec")],
        "live": LIVE,
        "calibrate": ["calibrate", "--port", "tcp://127.0.0.1:1", "--scenario", "demo", "--out"],
    }
    commands["calibrate"].append(str(tmp_path / "me.toml"))
    assert main([*commands[verb], "--stations", text]) == 2
    assert words in capsys.readouterr().err


def test_a_name_that_the_scenario_lacks_is_told_with_those_it_has(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*LIVE, "--stations", "nose=3,torso=1"]) == 2
    assert "no station called 'nose'" in capsys.readouterr().err


def test_a_verb_without_a_device_takes_names_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["record", "sim:demo", "never.rec", "--stations", "head=3"]) == 2
    assert "'head=3' names stations of a device" in capsys.readouterr().err


def test_rows_are_those_of_the_named_stations(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The device has four stations, at heights 0, 0.1, 0.2 and 0.3 m; the third is the head, the first the torso."""
    path = tmp_path / "two.rec"
    with serve_emulator(make_samples(4), tcp="127.0.0.1:0") as emulator:
        assert main(["record", emulator.name, str(path), "--seconds", "0.6", "--stations", "head=3,torso=1"]) == 0
        assert "stations 1 torso, 3 head" in capsys.readouterr().err
        assert [station.active for station in emulator.emulator.device.settings.stations[:5]] == [True] * 4 + [False]
        assert main(["record", emulator.name, str(tmp_path / "x.rec"), "--stations", "head=7,torso=1"]) == 2
        assert "the device has no station 7 (head); it has 1, 2, 3, 4. Plug it in" in capsys.readouterr().err
        assert main([*LIVE[:-1], emulator.name, "--stations", "head=7,torso=1"]) == 2
        said = capsys.readouterr().err
    assert "no station 7 (head)" in said
    assert "learning" not in said
    stream = RecordingStream(path)
    assert stream.stations == ("torso", "head")
    frames = [frame for frame in stream if frame.position_valid.all()]
    assert len(frames) > 5
    np.testing.assert_allclose([frame.position_m[:, 2] for frame in frames], [[0.0, 0.2]] * len(frames), atol=1e-5)


def test_a_named_station_that_is_off_is_on_for_the_session(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with serve_emulator(make_samples(4), tcp="127.0.0.1:0") as emulator:
        device = emulator.emulator.device
        device.receive(b"l3,0\r", 0.0)
        command = ["record", emulator.name, str(tmp_path / "x.rec"), "--seconds", "0.3", "--stations", "head=3"]
        assert main(command) == 0, capsys.readouterr().err
        assert not device.settings.station("3").active
        assert device.settings.station("1").active
    (frame, *_) = RecordingStream(tmp_path / "x.rec")
    assert frame.position_m[0, 2] == pytest.approx(0.2, abs=1e-5)


def test_a_number_of_thousands_of_digits_is_no_defect(capsys: pytest.CaptureFixture[str]) -> None:
    """`int` refuses more than 4,300 digits with a ValueError."""
    words = ["--port", "no_such_port", "--scenario", "demo", "--stations", "9" * 5000]
    assert main(["live", *words]) == 2
    assert "no station called '999" in capsys.readouterr().err
