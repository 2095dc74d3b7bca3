"""`harness record --send`: any command, its answer printed, decoded and recorded; boresight and alignment by flags."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from harness.stream import serve_emulator
from harness.stream.polhemus import EmulatorConfig, EmulatorServer
from harness.stream.recording import RecordingStream, read_recording
from tests.command import Command, Said
from tests.stream.is900.emulator.played import make_samples


@pytest.fixture
def device() -> Iterator[EmulatorServer]:
    with serve_emulator(make_samples(), EmulatorConfig(paced=False), tcp="127.0.0.1:0") as running:
        yield running


@pytest.fixture
def send(device: EmulatorServer, command: Command) -> Callable[..., Said]:
    """Sends texts to the device and records into a file."""

    def give(path: Path, *texts: str, more: tuple[str, ...] = ()) -> Said:
        return command("record", device.name, path, *(word for text in texts for word in ("--send", text)), *more)

    return give


def test_answers_are_printed_decoded_and_recorded(
    device: EmulatorServer, send: Callable[..., Said], tmp_path: Path, command: Command
) -> None:
    path = tmp_path / "answers.rec"
    said = send(path, "S", "O1", "x0.2,0.2,0.8,0.8", "O1,2,2", more=("--json",)).content
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
    assert "O1: 21O 2 4 1\\r\\n\n    OutputList: station 1, items 2 4 1\n" in command("replay", path).out


def test_default_ascii_records_are_recorded_and_replayed(
    device: EmulatorServer, send: Callable[..., Said], tmp_path: Path
) -> None:
    """List 2,4,1 in inches, which no set-up of the driver asks for; station 1 moves on y = -0.5 m, z = 1.5 m."""
    path = tmp_path / "ascii.rec"
    send(path, "F", "C", more=("--seconds", "1"))
    assert not device.emulator.device.streaming
    (wire,) = read_recording(path).formats
    assert (wire.items, wire.settings.binary, wire.settings.metres_per_unit) == ((2, 4, 1), False, 0.0254)
    frames = list(RecordingStream(path))
    assert len(frames) > 20
    np.testing.assert_allclose(frames[5].position_m[:, 1:], [[-0.5, 1.5]] * 4, atol=1.3e-4)  # half a hundredth inch


def test_polled_records_are_decoded_in_si_units(send: Callable[..., Said], tmp_path: Path) -> None:
    *_, poll = send(tmp_path / "a.rec", "O1,2,22,23,1", "P", more=("--json",)).content["exchanges"]
    assert bytes.fromhex(poll["received"]).count(b"\r\n") == 4
    lists = (f"O{k},2,22,23,1" for k in "1234")
    *_, poll = send(tmp_path / "b.rec", *lists, "P", more=("--json",)).content["exchanges"]
    assert [record["station"] for record in poll["answers"]] == ["1", "2", "3", "4"]
    assert poll["answers"][0]["position_m"][1:] == pytest.approx([-0.5, 1.5], abs=1.3e-4)
    assert len(poll["answers"][0]["joystick"]) == 2


def test_replies_between_records_of_a_stream_are_decoded(send: Callable[..., Said], tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    text = send(path, "C", "MG", "c", "S").out
    assert "C: starts the stream\n" in text
    assert "    GenlockReply: state 0" in text
    assert "more records\n" in text
    assert "continuous no" in text
    assert read_recording(path).damage == ()


@pytest.mark.parametrize("text", ["^K", "^Y", "W", "o96,N,8,0", "MCC", "MSystemTest1", "MEthUdp1", "Q"])
def test_commands_that_last_are_refused_before_the_port_is_opened(text: str, tmp_path: Path, command: Command) -> None:
    said = command("record", "/dev/nothing", tmp_path / "a.rec", "--send", "S", "--send", text, code=2).err
    assert said.startswith(f"harness: --send {text!r} ")
    assert "--allow-writes" in said
    assert said.count("\n") == 1


def test_they_are_sent_when_they_are_allowed(device: EmulatorServer, send: Callable[..., Said], tmp_path: Path) -> None:
    send(tmp_path / "a.rec", "ML0", "^K", "ML1", "^Y", more=("--allow-writes",))
    assert not device.emulator.device.settings.lights  # the saved settings returned with the restart


def test_boresight_and_alignment_reach_the_device(device: EmulatorServer, tmp_path: Path, command: Command) -> None:
    path = tmp_path / "a.rec"
    frame = "1,0,0,1,1,0,0,0,0"  # the origin 1 m along X; X along the old Y, Y against the old X
    command("record", device.name, path, "--boresight", "--alignment", frame, "--seconds", "0.5")
    sent = b"".join(block.payload for block in read_recording(path).blocks() if block.kind == "sent")
    for station in b"1234":
        assert b"R%c\r\n" % station in sent
        assert b"A%c,100.00,0.00,0.00,100.00,100.00,0.00,0.00,0.00,0.00\r\n" % station in sent
        assert b"B%c\r\n" % station in sent
    frame_read = list(RecordingStream(path))[5]
    assert frame_read.position_m[0, 0] == pytest.approx(-0.5, abs=1e-5)  # the old y
    assert -frame_read.position_m[0, 1] == pytest.approx(0.05, abs=0.06)  # the old x is 1 to 1.1 m
