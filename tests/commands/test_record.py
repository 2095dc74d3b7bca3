"""`harness record` and `harness replay` as a user meets them."""

import csv
import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.experiment.playback import Playback, prepare_playback
from harness.experiment.scenario import find_scenario
from harness.stream.driver import DriverConfig, Is900
from harness.stream.driver.transport import open_transport
from harness.stream.emulator import EmulatorConfig, serve_emulator
from harness.stream.recording.blocks import CONFIGURED, FILE_HEADER, RECEIVED
from harness.stream.recording.recording import RecordingWriter, read_recording
from harness.stream.recording.replay import RecordingStream
from harness.stream.recording.station_readings import CaptureReader
from harness.stream.station_counts import FRAME_COLUMNS
from harness.study.trust.plan import plan_digest
from tests.interrupts import heeding_interrupts
from tests.stream.recording.test_recording import newer_file
from tests.stream.wire import frames_equal

HARNESS = [sys.executable, "-m", "harness.cli"]
CLIP = "boxing_p1_01"


@pytest.fixture(scope="module")
def played() -> Playback:
    return prepare_playback("demo", clip=CLIP, stations=4)


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("simulated") / "a.rec"
    assert main(["record", "sim:demo", str(path), "--clip", CLIP, "--stations", "4", "--seconds", "1.49"]) == 0
    return path


@pytest.fixture
def port(played: Playback) -> Iterator[str]:
    with serve_emulator(played.samples, tcp="127.0.0.1:0") as device:
        yield device.name


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line that a refusal says."""
    capsys.readouterr()
    assert main(words) == 2
    said = capsys.readouterr()
    assert said.out == "refused\n"
    (line,) = said.err.splitlines()
    return line


def test_a_simulation_is_recorded_and_replayed(simulated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    note = read_recording(simulated).note
    assert (note["scenario"], note["clip"], note["seed"], note["rate_hz"]) == ("demo", CLIP, 1, 40.0)
    assert main(["replay", str(simulated)]) == 0
    text = capsys.readouterr().out
    assert text.startswith("60 frames in 1.4")
    assert text.endswith("pass\n")
    for station in note["stations"]:
        assert f"\n{station} " in text
    assert main(["replay", str(simulated), "--json", "--speed", "100"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["frames"], said["records"], said["lost"], said["outcome"]) == (60, 240, [], "pass")


def test_a_rig_is_marked_with_its_stretches(tmp_path: Path) -> None:
    path = tmp_path / "rig.rec"
    command = ["record", "sim:lab", str(path), "--clip", "rig_p1_01", "--stations", "2", "--rate", "10"]
    assert main(command) == 0
    marks = [(mark["monotonic_s"], mark["stretch"]) for mark in read_recording(path).marks]
    assert marks == [(0.0, "static"), (70.0, "slow"), (110.0, "fast"), (150.0, "covered")]
    moved_m = {
        block.stretch: float(np.nanstd(next(iter(block.stations.values())).position_m, axis=0).max())
        for block in CaptureReader(path).blocks()
    }
    assert max(moved_m["static"], moved_m["covered"]) < 0.03 < 0.1 < min(moved_m["slow"], moved_m["fast"])


def test_faults_of_records_are_recorded_and_others_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = find_scenario("demo").read_text("utf-8")
    faults = '[[fault]]\nkind = "repeated"\nshare = 0.1\n[[fault]]\nkind = "stall"\nat_s = [1.0]\nlasts_s = 0.5\n'
    (tmp_path / "faulty.toml").write_text(text + "\n" + faults, "utf-8")
    for name in ("demo", str(tmp_path / "faulty.toml")):
        capsys.readouterr()
        file = tmp_path / f"{Path(name).stem}.rec"
        assert main(["record", f"sim:{name}", str(file), "--clip", CLIP, "--seconds", "5"]) == 0
        said = capsys.readouterr().err
        assert ("left out: stall" in said) == (name != "demo")
    twice, once = (
        [block.payload for block in read_recording(tmp_path / f"{name}.rec").blocks() if block.kind == RECEIVED]
        for name in ("faulty", "demo")
    )
    assert all(one in (other, other + other) for one, other in zip(twice, once, strict=True))
    assert 0.05 * len(once) < sum(map(len, twice)) / len(once[0]) - len(once) < 0.2 * len(once)


def test_frames_come_as_a_table(simulated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(simulated), "--frames"]) == 0
    said = capsys.readouterr()
    *lines, word = said.out.splitlines()
    assert word == "pass"
    assert said.err.startswith("60 frames")
    table = list(csv.DictReader(io.StringIO("\n".join(lines))))
    frames = list(RecordingStream(simulated))
    assert (tuple(table[0]), len(table)) == (FRAME_COLUMNS, 4 * len(frames))
    assert [float(row["x_m"]) for row in table[:4]] == frames[0].position_m[:, 0].tolist()
    assert [float(row["received_s"]) for row in table[::4]] == [frame.received_s for frame in frames]
    assert main(["replay", str(simulated), "--frames", "--json"]) == 0
    *rows, last = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [row["qw"] for row in rows[:4]] == frames[0].tracker_from_station[:, 0].tolist()
    assert last["outcome"] == "pass"


def test_it_steps_by_lines_of_input(
    simulated: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("\n\n"))
    assert main(["replay", str(simulated), "--speed", "step", "--frames"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 1 + 2 * 4 + 1


def test_methods_are_scored_by_what_the_recording_says(simulated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(simulated), "--methods", "ik:previous"]) == 0
    text = capsys.readouterr().out
    assert f"played from demo, {CLIP}" in text
    assert "ik:previous    20/20" in text
    assert (
        main(["replay", str(simulated), "--scenario", "demo", "--clip", CLIP, "--methods", "mean_pose", "--json"]) == 0
    )
    (judged,) = json.loads(capsys.readouterr().out)["methods"]
    assert (judged["method"], judged["frames_matched"]) == ("mean_pose", 20)


def test_damage_is_named_and_the_rest_is_played(
    simulated: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.rec"
    cut.write_bytes(simulated.read_bytes()[:-3])
    assert main(["replay", str(cut)]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("60 frames")
    assert said.err.startswith("lost: the last 67 bytes are cut off")


def test_bad_input_is_one_clear_line(simulated: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    new, text, empty, bare = (tmp_path / name for name in ("new.rec", "a.txt", "empty.rec", "bare.rec"))
    new.write_bytes(newer_file())
    text.write_text("hello\n")
    empty.touch()
    bare.write_bytes(FILE_HEADER)
    before = simulated.read_bytes()
    for words, expected in (
        (["replay", str(new)], "a recording of version 2; expected version 1 at most"),
        (["replay", str(text)], "no recording; expected a recording by `harness record`"),
        (["replay", str(empty)], "an empty file"),
        (["replay", str(bare)], "the device was never configured in it"),
        (["replay", str(tmp_path / "none.rec")], "no such file"),
        (
            ["replay", str(simulated), "--speed", "fast"],
            "Speed 'fast' is not possible. Give `step`, `max`, or a positive number",
        ),
        (["replay", str(simulated), "--methods", "il"], "no method called 'il'"),
        (["replay", str(simulated), "--scenario", "dem"], "no scenario called 'dem'"),
        (["replay", str(simulated), "--clip", "walking_p1_01", "--methods", "ik:previous"], "of another motion"),
        (["record", "sim:dem", str(tmp_path / "b.rec")], "no scenario called 'dem'"),
        (["record", "sim:demo", str(text)], "no recording"),
        (["record", "sim:demo", str(new)], "a recording of version 2"),
        (["record", "sim:demo", str(tmp_path / "b.rec"), "--stations", "13"], "13 stations of 6"),
        (["record", "sim:demo", str(tmp_path / "b.rec"), "--seconds", "-1"], "--seconds -1."),
        (["record", "sim:demo", str(simulated), "--clip", CLIP], "Record other stations into another file"),
        (["record", "tcp://127.0.0.1:1", str(tmp_path / "b.rec")], "127.0.0.1:1"),
        (["record", "/dev/nothing", str(tmp_path / "b.rec")], "there is no such port"),
        (["record", str(tmp_path / "b.rec"), "/dev/null"], "The port comes first"),
        (["record", "tcp://127.0.0.1:1", str(tmp_path / "b.rec"), "--seed", "3"], "--seed with tcp://127.0.0.1:1"),
        (["record", "tcp://127.0.0.1:1", str(tmp_path / "b.rec"), "--baud", "9600"], "--baud with tcp://127.0.0.1:1"),
        (["record", "tcp://127.0.0.1:1", str(tmp_path / "b.rec"), "--stations", ""], "'--stations' is empty"),
        (["record", "tcp://127.0.0.1:1", str(tmp_path / "b.rec"), "--items", "2,11,21,1"], "(--quality mp)"),
        (["record", "sim:demo", str(tmp_path / "b.rec"), "--stations", "a,,b"], "names no station"),
        (["record", "sim:demo", str(tmp_path / "b.rec"), "--stations", "²"], "no station called '²'"),
        (["record", "sim:demo", str(tmp_path / "b.rec"), "--quality", "mp"], "--quality with sim:demo"),
    ):
        assert expected in refused(words, capsys), words
    assert not (tmp_path / "b.rec").exists()
    assert text.read_text() == "hello\n"
    assert new.read_bytes() == newer_file()
    assert simulated.read_bytes() == before


@pytest.mark.long
def test_what_is_recorded_of_a_port_replays_as_it_was_live(port: str, played: Playback, tmp_path: Path) -> None:
    """Frame by frame, times of reception and all, through two connections into one file."""
    live = []
    for _ in range(2):
        with (
            RecordingWriter(tmp_path / "a.rec") as writer,
            Is900(port, DriverConfig(stations=played.samples.stations), observer=writer) as device,
        ):
            frames = iter(device)
            live.append([next(frames) for _ in range(60)])
    replayed = list(RecordingStream(tmp_path / "a.rec"))
    assert all(frames_equal(a, b) for a, b in zip(live[0], replayed, strict=False))
    start = next(i for i, frame in enumerate(replayed) if frame.received_s == live[1][0].received_s)
    again = replayed[start : start + 60]
    assert [f.received_s for f in again] == [f.received_s for f in live[1]]
    assert all(np.array_equal(a.position_m, b.position_m, equal_nan=True) for a, b in zip(again, live[1], strict=True))


def test_a_device_that_was_gone_replays_as_it_was_live(played: Playback, tmp_path: Path) -> None:
    """Bit by bit, device time and times of reception included, whether decoded at once or chunk by chunk."""
    link, path, wanted = tmp_path / "link", tmp_path / "a.rec", DriverConfig(stations=played.samples.stations)
    with RecordingWriter(path) as writer:
        with serve_emulator(played.samples, pty=link):
            device = Is900(str(link), wanted, observer=writer)
            frames = iter(device)
            live = [next(frames) for _ in range(40)]
        with device, ThreadPoolExecutor() as beside:
            rest = beside.submit(lambda: [next(frames) for _ in range(40)])
            with serve_emulator(played.samples, pty=link):
                live += rest.result(timeout=120.0)
    assert [event["kind"] for event in read_recording(path).events][:2] == ["connected", "unplugged"]
    for speed in ("max", 1e9):
        stream = RecordingStream(path, speed)
        replayed = list(stream)
        assert all(frames_equal(one, other) for one, other in zip(live, replayed, strict=False))
        assert len(replayed) >= len(live)
        assert stream.counts["sessions"] == 2


def test_seconds_end_a_recording(port: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.rec"
    assert main(["record", port, str(path), "--seconds", "0.8", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["outcome"] == "pass"
    assert said["received_bytes"] > 0 < said["sent_bytes"]
    stream = RecordingStream(path)
    assert stream.stations == tuple("1234")
    assert len(list(stream)) > 5


@pytest.mark.parametrize("source", ["port", "simulation"])
def test_a_plan_is_named_by_its_digest(
    source: str, port: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan, file = tmp_path / "plan.toml", tmp_path / "a.rec"
    plan.write_text('kind = "trust plan"\nscenario = "demo"\nmethods = ["ik"]\n[margins]\nmpjpe_mm = 5.0\n', "utf-8")
    name = port if source == "port" else "sim:demo"
    assert main(["record", name, str(file), "--seconds", "0.5", "--plan", str(plan)]) == 0
    assert read_recording(file).note["plan"] == plan_digest(plan)
    before = file.read_bytes()
    plan.write_text(plan.read_text("utf-8").replace("5.0", "50.0"), "utf-8")
    assert "never renewed" in refused(["record", name, str(file), "--seconds", "0.5", "--plan", str(plan)], capsys)
    assert "never renewed" in refused(["record", name, str(file), "--seconds", "0.5"], capsys)
    assert file.read_bytes() == before
    plan.write_text('kind = "trust plan"\n', "utf-8")
    assert "margins" in refused(["record", name, str(tmp_path / "b.rec"), "--plan", str(plan)], capsys)
    assert not (tmp_path / "b.rec").exists()
    assert "--send" in refused(["record", port, str(file), "--send", "S", "--plan", str(plan)], capsys)


def test_old_firmware_is_recorded_by_mp_and_refused_without(
    played: Playback, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.rec"
    with serve_emulator(played.samples, EmulatorConfig(firmware="4.1105"), tcp="127.0.0.1:0") as device:
        assert "--quality mp" in refused(["record", device.name, str(path), "--seconds", "0.5"], capsys)
        assert not path.exists()
        assert main(["record", device.name, str(path), "--seconds", "0.5", "--quality", "mp"]) == 0
    (wire,) = read_recording(path).formats
    assert wire.items == (2, 11, 21, 1)


def test_a_list_may_be_named(port: str, tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    assert main(["record", port, str(path), "--seconds", "0.5", "--items", "40,18,19,21,1"]) == 0
    (wire,) = read_recording(path).formats
    assert wire.items == (40, 18, 19, 21, 1)


@pytest.mark.parametrize(
    "flag", [["--items", "40,²"], ["--baud", "²"], ["--rate", "-1"], ["--rate", "nan"], ["--quality", "best"]]
)
def test_a_flag_that_makes_no_sense_is_refused(flag: list[str], tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as raised:
        main(["record", "tcp://127.0.0.1:1", str(tmp_path / "a.rec"), *flag])
    assert raised.value.code == 2


def recording(port: str, path: Path, begun: int = 2000) -> subprocess.Popen[str]:
    """`harness record` in its own process, once it has set the device up and written so many bytes since."""
    process = subprocess.Popen(
        [*HARNESS, "record", port, str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heeding_interrupts,
    )
    until_s = time.monotonic() + 300.0
    while not path.exists() or len(path.read_bytes().partition(CONFIGURED.encode())[2]) < begun:
        assert time.monotonic() < until_s
        assert process.poll() is None
        time.sleep(0.02)
    return process


@pytest.mark.long
@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_is_the_normal_end_of_a_recording(port: str, tmp_path: Path, stop: signal.Signals) -> None:
    with recording(port, tmp_path / "a.rec") as process:
        process.send_signal(stop)
        out, err = process.communicate(timeout=120.0)
    assert process.returncode == 0, err
    assert out.splitlines()[-1] == "pass"
    assert "Traceback" not in err
    read = read_recording(tmp_path / "a.rec")
    assert read.damage == ()
    sent = [block.payload for block in read.blocks() if block.kind == "sent"]
    assert b"c" in sent[-20:]
    assert sent[-1] == b"S", "the device has answered after its settings were put back"


def test_settings_of_another_program_are_told_and_put_back(
    port: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def talk(data: bytes) -> bytes:
        line = open_transport(port, 115200)
        line.write(data)
        received, until_s = b"", time.monotonic() + 60.0
        while not received.endswith(b"\r\n") and time.monotonic() < until_s:
            received += line.read(0.1)
        line.close()
        return received

    talk(b"N1,30,0,0\rS")
    command = ["record", port, str(tmp_path / "a.rec"), "--seconds", "0.3"]
    assert main(command) == 0
    said = capsys.readouterr().err
    assert "settings of another program: tip offset N 30, 0, 0 cm (station 1); at defaults for this session" in said
    assert "boresight of station 1, 2, 3, 4 undone: it cannot be read or put back" in said
    assert "put back: tip offset N 30, 0, 0 cm (station 1)" in said
    assert [event["kind"] for event in read_recording(tmp_path / "a.rec").events].count("settings") == 2
    assert main([*command, "--keep-settings"]) == 0
    assert "tip offset N 30, 0, 0 cm (station 1); kept, as asked" in capsys.readouterr().err
    assert talk(b"N1\r") == b"21N  30.000   0.000   0.000\r\n"


def test_a_killed_recording_keeps_what_came(port: str, tmp_path: Path) -> None:
    with recording(port, tmp_path / "a.rec", begun=6000) as process:
        process.kill()
    stream = RecordingStream(tmp_path / "a.rec")
    assert len(stream.recording.damage) <= 1
    received = sum(len(block.payload) for block in stream.recording.blocks() if block.kind == RECEIVED)
    assert received > 2000
    assert len(list(stream)) > 5


def test_ctrl_c_ends_a_replay_without_a_word_too_many(simulated: Path) -> None:
    with subprocess.Popen(
        [*HARNESS, "replay", str(simulated), "--speed", "0.01", "--frames"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
        preexec_fn=heeding_interrupts,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("received_s,")
        assert ",left_hand," in process.stdout.readline()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120.0)
    assert process.returncode == 130
    assert out.splitlines()[-1] == "interrupted"
    assert "Traceback" not in err
