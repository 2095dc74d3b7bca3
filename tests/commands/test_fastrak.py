"""The verbs with a FASTRAK: its ports, its emulator and its recordings."""

import shlex
from pathlib import Path

import pytest

from harness.stream import serve_emulator
from harness.stream.fastrak import Fastrak, FastrakConfig, FastrakEmulator, FastrakEmulatorConfig
from harness.stream.polhemus import LineEmulator
from harness.stream.recording import RecordingWriter
from tests.command import Command
from tests.stream.is900.driver.bench import make_samples


@pytest.fixture
def emulated(monkeypatch: pytest.MonkeyPatch) -> list[LineEmulator]:
    """Emulators that were to be served."""
    played: list[LineEmulator] = []

    def play(emulator: LineEmulator, *_: object) -> dict[str, float]:
        played.append(emulator)
        return {}

    monkeypatch.setattr("harness.stream.polhemus.emulator.server.play_emulator", play)
    return played


@pytest.mark.parametrize(("stations", "rate_hz"), [("1", 120.0), ("3", 40.0), ("head=2,left_hand=4", 60.0)])
def test_emulate_gives_the_rate_of_a_fastrak(
    stations: str, rate_hz: float, emulated: list[LineEmulator], command: Command
) -> None:
    talk = command("emulate", "demo", "--device", "fastrak", "--tcp", "127.0.0.1:0", "--stations", stations).err
    (emulator,) = emulated
    assert isinstance(emulator, FastrakEmulator)
    assert isinstance(emulator.config, FastrakEmulatorConfig)
    assert emulator.device.samples.rate_hz == rate_hz
    (line,) = [line for line in talk.splitlines() if line.startswith("next")]
    words = shlex.split(line.partition(": ")[2])
    assert words[words.index("--port") + 1].startswith("fastrak:tcp://127.0.0.1:")
    assert words[words.index("--rate") + 1] == f"{rate_hz:g}"
    assert "--quality" not in words


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ("--stations 6", "do not fit 6 stations. The device has 1234: wear at most 4 stations,"),
        ("--stations 2 --rate 90", "It sends 120 records per second in total"),
        ("--udp 5001", "--udp with --device fastrak"),
        ("--firmware 4.1105", "--firmware with --device fastrak"),
        ("--stations head=7", "characters = '7' do not fit"),
    ],
)
def test_emulate_refuses_what_no_fastrak_has(flags: str, message: str, command: Command) -> None:
    words = ["emulate", "demo", "--device", "fastrak", "--tcp", "127.0.0.1:0", *flags.split()]
    assert message in command(*words, code=2).err


def test_a_device_is_recorded_and_replayed(tmp_path: Path, command: Command) -> None:
    link, file = tmp_path / "port", tmp_path / "one.rec"
    with serve_emulator(make_samples(2, 60.0), FastrakEmulatorConfig(), pty=link):
        said = command("record", f"fastrak:{link}", file, "--seconds", "1", "--stations", "left,right")
        assert "FASTRAK, firmware 3.02 at fastrak:" in said.err
        sent = command("record", f"fastrak:{link}", tmp_path / "two.rec", "--send", "S", "--send", "P").out
        with Fastrak(str(link), FastrakConfig(rate_hz=60.0)) as tracker:
            assert next(iter(tracker)).position_valid.all()
    assert "StatusRecord: station 1, binary no, centimetres no" in sent, "the device has its own settings again"
    assert sent.count("    record: station ") == 2
    replayed = command("replay", file, "--json").content
    assert list(replayed["stations"]) == ["left", "right"]
    assert "no stretch in which a station rests" in command("characterize", file, code=2).err
    said = command("inspect", file)
    assert said.lines[0] == f"{file}: a recording of a FASTRAK at 60 Hz, items 2,11,1 in binary"
    assert any(line.startswith("right ") for line in said.lines)
    assert f"next: harness replay {file}" in said.err
    assert "--unit with one.rec" in command("inspect", file, "--unit", "mm", code=2).err
    assert command("inspect", tmp_path / "two.rec").lines[0].endswith(" a FASTRAK at 60 Hz, items 2,4,1 in ASCII")


def test_a_recording_of_stretches_is_inspected(tmp_path: Path, command: Command) -> None:
    file = tmp_path / "lab.rec"
    command("record", "sim:lab", file, "--seconds", "3")
    said = command("inspect", file, "--json")
    assert said.content["recording"].startswith(f"{file}: a recording of an IS-900 at ")
    assert said.content["stretches"][0] == "static"
    assert f"harness characterize {file}" in said.out
    with RecordingWriter(tmp_path / "sent.rec") as writer:
        writer.on_sent(b"S", 0.0, 0.0)
        writer.on_answer({"command": "S", "received": "", "answers": []})
    assert "a recording of 1 command and their answers" in command("inspect", tmp_path / "sent.rec").lines[0]


@pytest.mark.parametrize("flag", ["--quality mp", "--boresight", "--keep-settings", "--alignment 0,0,0,1,0,0,0,1,0"])
def test_flags_of_an_is900_are_refused(flag: str, tmp_path: Path, command: Command) -> None:
    words = ["record", "fastrak:/dev/ttyUSB0", tmp_path / "one.rec", *flag.split()]
    assert f"{flag.split()[0]} with fastrak:/dev/ttyUSB0. It is for an IS-900" in command(*words, code=2).err
    assert not (tmp_path / "one.rec").exists()


@pytest.mark.parametrize("verb", ["record", "live"])
def test_the_help_names_its_ports(verb: str, command: Command) -> None:
    assert "fastrak:PORT" in command(verb, "--help").out
