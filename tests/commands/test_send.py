"""`harness record --send`: any command, its answer printed, decoded and recorded; boresight and alignment by flags."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.stream.emulator import EmulatorConfig, serve_emulator
from harness.stream.emulator.server import EmulatorServer
from harness.stream.recording.recording import read_recording
from harness.stream.recording.replay import RecordingStream
from tests.stream.emulator.played import make_samples


@pytest.fixture
def device() -> Iterator[EmulatorServer]:
    with serve_emulator(make_samples(), EmulatorConfig(paced=False), tcp="127.0.0.1:0") as running:
        yield running


def send(device: EmulatorServer, path: Path, *texts: str, more: tuple[str, ...] = ()) -> int:
    return main(["record", device.name, str(path), *(word for text in texts for word in ("--send", text)), *more])


def test_answers_are_printed_decoded_and_recorded(
    device: EmulatorServer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "answers.rec"
    assert send(device, path, "S", "O1", "x0.2,0.2,0.8,0.8", "O1,2,2", more=("--json",)) == 0
    said = json.loads(capsys.readouterr().out)
    status, items, silent, error = said["exchanges"]
    assert bytes.fromhex(status["received"])[:6] == b"21S3F0"
    assert status["answers"][0]["firmware"] == "4.2301"
    assert (items["sent"], items["answers"][0]["items"]) == ("4f 31 0d 0a", [2, 4, 1])
    assert (silent["received"], silent["answers"]) == ("", [])
    assert (error["answers"][0]["kind"], error["answers"][0]["code"]) == ("DeviceError", -3)
    recording = read_recording(path)
    assert recording.damage == ()
    assert [answer["command"] for answer in recording.answers] == ["S", "O1", "x0.2,0.2,0.8,0.8", "O1,2,2"]
    received = b"".join(block.payload for block in recording.blocks() if block.kind == "recv")
    assert bytes.fromhex(error["received"]) in received
    assert device.emulator.device.settings.station("1").items == (2, 4, 1)  # nothing was set
    assert main(["replay", str(path)]) == 0
    assert "O1: 21O 2 4 1\\r\\n\n    OutputList: station 1, items 2 4 1\n" in capsys.readouterr().out


def test_default_ascii_records_are_recorded_and_replayed(device: EmulatorServer, tmp_path: Path) -> None:
    """List 2,4,1 in inches, which no set-up of the driver asks for; station 1 moves on y = -0.5 m, z = 1.5 m."""
    path = tmp_path / "ascii.rec"
    assert send(device, path, "F", "C", more=("--seconds", "1")) == 0
    assert not device.emulator.device.streaming
    (wire,) = read_recording(path).formats
    assert (wire.items, wire.settings.binary, wire.settings.metres_per_unit) == ((2, 4, 1), False, 0.0254)
    frames = list(RecordingStream(path))
    assert len(frames) > 20
    np.testing.assert_allclose(frames[5].position_m[:, 1:], [[-0.5, 1.5]] * 4, atol=1.3e-4)  # half a hundredth inch


def test_polled_records_are_decoded_in_si_units(
    device: EmulatorServer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert send(device, tmp_path / "a.rec", "O1,2,22,23,1", "P", more=("--json",)) == 0
    *_, poll = json.loads(capsys.readouterr().out)["exchanges"]
    assert bytes.fromhex(poll["received"]).count(b"\r\n") == 4
    capsys.readouterr()
    assert send(device, tmp_path / "b.rec", *(f"O{k},2,22,23,1" for k in "1234"), "P", more=("--json",)) == 0
    *_, poll = json.loads(capsys.readouterr().out)["exchanges"]
    assert [record["station"] for record in poll["answers"]] == ["1", "2", "3", "4"]
    assert poll["answers"][0]["position_m"][1:] == pytest.approx([-0.5, 1.5], abs=1.3e-4)
    assert len(poll["answers"][0]["joystick"]) == 2


def test_replies_between_records_of_a_stream_are_decoded(
    device: EmulatorServer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.rec"
    assert send(device, path, "C", "MG", "c", "S") == 0
    text = capsys.readouterr().out
    assert "C: starts the stream\n" in text
    assert "    GenlockReply: state 0" in text
    assert "more records\n" in text
    assert "continuous no" in text
    assert read_recording(path).damage == ()


@pytest.mark.parametrize("text", ["^K", "^Y", "W", "o96,N,8,0", "MCC", "MSystemTest1", "MEthUdp1", "Q"])
def test_commands_that_last_are_refused_before_the_port_is_opened(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["record", "/dev/nothing", str(tmp_path / "a.rec"), "--send", "S", "--send", text]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"harness: --send {text!r} ")
    assert "--allow-writes" in said
    assert said.count("\n") == 1


def test_they_are_sent_when_they_are_allowed(device: EmulatorServer, tmp_path: Path) -> None:
    assert send(device, tmp_path / "a.rec", "ML0", "^K", "ML1", "^Y", more=("--allow-writes",)) == 0
    assert not device.emulator.device.settings.lights  # the saved settings returned with the restart


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["tcp://127.0.0.1:1", "--allow-writes"], "--allow-writes without --send"),
        (["tcp://127.0.0.1:1", "--send", "S", "--items", "2,4,1"], "--items with --send"),
        (["tcp://127.0.0.1:1", "--send", "S", "--stations", "head"], "--stations with --send"),
        (["tcp://127.0.0.1:1", "--send", "S", "--boresight"], "--boresight with --send"),
        (["sim:demo", "--send", "S"], "--send with sim:demo"),
        (["sim:demo", "--boresight"], "--boresight with sim:demo"),
        (["tcp://127.0.0.1:1", "--send", "SW"], "'SW' is 2 commands"),
        (["tcp://127.0.0.1:1", "--send", "S"], "nothing listens"),
    ],
)
def test_flags_that_do_not_fit_are_refused(
    words: list[str], complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port, *flags = words
    assert main(["record", port, str(tmp_path / "a.rec"), *flags]) == 2
    assert complaint in capsys.readouterr().err
    assert not (tmp_path / "a.rec").exists()


def test_boresight_and_alignment_reach_the_device(device: EmulatorServer, tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    frame = "1,0,0,1,1,0,0,0,0"  # the origin 1 m along X; X along the old Y, Y against the old X
    flags = ["--boresight", "--alignment", frame, "--seconds", "0.5"]
    assert main(["record", device.name, str(path), *flags]) == 0
    sent = b"".join(block.payload for block in read_recording(path).blocks() if block.kind == "sent")
    for station in b"1234":
        assert b"R%c\r\n" % station in sent
        assert b"A%c,100.00,0.00,0.00,100.00,100.00,0.00,0.00,0.00,0.00\r\n" % station in sent
        assert b"B%c\r\n" % station in sent
    frame_read = list(RecordingStream(path))[5]
    assert frame_read.position_m[0, 0] == pytest.approx(-0.5, abs=1e-5)  # the old y
    assert -frame_read.position_m[0, 1] == pytest.approx(0.05, abs=0.06)  # the old x is 1 to 1.1 m


@pytest.mark.parametrize("text", ["1,2,3", "0,0,0,1,0,0,0,1,nan", "0,0,0,1,0,0,0,1,x", "0,0,0,1,0,0,0,1,inf"])
def test_an_alignment_is_nine_numbers(text: str, tmp_path: Path) -> None:
    with pytest.raises(SystemExit):
        main(["record", "tcp://127.0.0.1:1", str(tmp_path / "a.rec"), "--alignment", text])
