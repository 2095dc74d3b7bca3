"""A device that is recorded while another program uses it."""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial

from harness.experiment import Playback, prepare_playback
from harness.stream.emulators import serve_emulator
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.polhemus.emulator.pty_port import ABSENT_S, MAX_WAITING_BYTES, ClientPty
from harness.stream.recording.line_server import serve_line
from harness.stream.recording.recording import read_recording
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.recording.replay import RecordingStream


@pytest.fixture(scope="module")
def played() -> Playback:
    return prepare_playback("demo", clip="boxing_p1_01", stations=4)


@contextmanager
def serving(port: str, folder: Path, config: DriverConfig, seconds: float) -> Iterator[dict[str, int]]:
    """Serve in a thread; the counts are there after the block."""
    counts: dict[str, int] = {}
    link = folder / "link"

    def serve() -> None:
        with RecordingWriter(folder / "a.rec") as writer:
            counts.update(serve_line(port, link, config, writer, seconds=seconds))

    thread = threading.Thread(target=serve)
    thread.start()
    until_s = time.monotonic() + 20.0
    while not link.is_symlink() and time.monotonic() < until_s:
        time.sleep(0.01)
    yield counts
    thread.join()


@pytest.mark.long
@pytest.mark.parametrize("line", ["pty", "tcp"])
def test_a_driver_uses_the_device_and_the_recording_replays(tmp_path: Path, played: Playback, line: str) -> None:
    address = {"pty": tmp_path / "tracker"} if line == "pty" else {"tcp": "127.0.0.1:0"}
    names = ("a", "b", "c", "d")
    with serve_emulator(played.samples, **address) as device:
        with (
            serving(device.name, tmp_path, DriverConfig(stations=names), 8.0) as counts,
            Is900(str(tmp_path / "link"), DriverConfig(stations=names)) as program,
        ):
            frames = [frame for frame, _ in zip(program, range(60), strict=False)]
        assert not device.emulator.device.streaming
    assert not (tmp_path / "link").is_symlink()
    replayed = {tuple(f.position_m.ravel().tolist()) for f in RecordingStream(tmp_path / "a.rec")}
    assert all(tuple(frame.position_m.ravel().tolist()) in replayed for frame in frames[1:-1])
    assert read_recording(tmp_path / "a.rec").formats[0].stations == names
    assert counts == {"unread": 0, "undelivered": 0}


@pytest.mark.long
def test_a_plain_client_gets_only_answers_to_its_own_questions(tmp_path: Path, played: Playback) -> None:
    with (
        serve_emulator(played.samples, tcp="127.0.0.1:0") as device,
        serving(device.name, tmp_path, DriverConfig(), 4.0),
        serial.Serial(str(tmp_path / "link"), 115200, timeout=0.5) as program,
    ):
        program.write(b"S")
        assert program.read(300).count(b"\r\n") == 1
        program.write(b"u\rfC")
        data = program.read(400)
        assert data.startswith(b"01")
        program.write(b"c")
    assert len(read_recording(tmp_path / "a.rec").formats) == 1


def test_the_pty_has_a_baud_rate_and_takes_the_place_of_a_killed_process(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("/dev/pts/999999")  # left by a process that was killed
    pty = ClientPty(link, 9600)
    assert os.path.exists(link)
    assert pty.baud() == 9600
    pty.close()
    assert not link.is_symlink()


def test_bytes_that_no_program_reads_are_bounded_and_counted(tmp_path: Path) -> None:
    pty = ClientPty(tmp_path / "link", None)
    pty.write(bytes(MAX_WAITING_BYTES + 10_000))
    assert pty.unread == 10_000
    time.sleep(ABSENT_S + 0.1)
    assert not pty.flush()
    assert pty.unread == MAX_WAITING_BYTES + 10_000
    pty.write(b"new")
    with serial.Serial() as program:
        program.port, program.timeout = str(tmp_path / "link"), 0.2
        program._reset_input_buffer = lambda: None
        program.open()
        assert program.read(100) == b"new"
    pty.close()


def test_bytes_that_wait_take_room_from_later_ones(tmp_path: Path) -> None:
    pty = ClientPty(tmp_path / "link", None)
    pty.write(bytes(MAX_WAITING_BYTES))  # of which the terminal takes 3800
    pty.write(bytes(10_000))
    pty.close()
    assert pty.unread == 10_000 - 3_800


def test_a_slow_program_gets_every_byte_in_sequence(tmp_path: Path) -> None:
    pty, sent, received = ClientPty(tmp_path / "link", None), bytes(range(256)) * 100, b""
    end = os.open(tmp_path / "link", os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
    pty.write(sent)
    while pty.flush() or len(received) < len(sent):
        received += os.read(end, 1000)
    os.close(end)
    pty.close()
    assert received == sent
    assert pty.unread == 0
