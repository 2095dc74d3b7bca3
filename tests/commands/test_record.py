"""`harness record` and `harness replay` as a user meets them."""

import csv
import io
import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from harness.experiment import Playback
from harness.experiment.scenarios import find_scenario
from harness.stream import FRAME_COLUMNS, serve_emulator
from harness.stream.is900 import DriverConfig, Is900
from harness.stream.polhemus import EmulatorConfig, open_transport
from harness.stream.recording import (
    CONFIGURED,
    RECEIVED,
    CaptureReader,
    RecordingStream,
    RecordingWriter,
    read_recording,
)
from harness.study.trust.plan import plan_digest
from tests.command import Command
from tests.interrupts import interrupt, start_harness
from tests.stream.wire import frames_equal

CLIP = "boxing_p1_01"


@pytest.fixture
def port(played: Playback) -> Iterator[str]:
    with serve_emulator(played.samples, tcp="127.0.0.1:0") as device:
        yield device.name


def test_a_simulation_is_recorded_and_replayed(simulated: Path, command: Command) -> None:
    note = read_recording(simulated).note
    assert (note["scenario"], note["clip"], note["seed"], note["rate_hz"]) == ("demo", CLIP, 1, 40.0)
    text = command("replay", simulated).out
    assert text.startswith("60 frames in 1.4")
    assert text.endswith("pass\n")
    for station in note["stations"]:
        assert f"\n{station} " in text
    said = command("replay", simulated, "--json", "--speed", "100").content
    assert (said["frames"], said["records"], said["lost"], said["outcome"]) == (60, 240, [], "pass")


def test_a_rig_is_marked_with_its_stretches(tmp_path: Path, command: Command) -> None:
    path = tmp_path / "rig.rec"
    command("record", "sim:lab", path, "--clip", "rig_p1_01", "--stations", "2", "--rate", "10")
    marks = [(mark["monotonic_s"], mark["stretch"]) for mark in read_recording(path).marks]
    assert marks == [(0.0, "static"), (70.0, "slow"), (110.0, "fast"), (150.0, "covered")]
    moved_m = {
        block.stretch: float(np.nanstd(next(iter(block.stations.values())).position_m, axis=0).max())
        for block in CaptureReader(path).blocks()
    }
    assert max(moved_m["static"], moved_m["covered"]) < 0.03 < 0.1 < min(moved_m["slow"], moved_m["fast"])


def test_faults_of_records_are_recorded_and_others_are_named(tmp_path: Path, command: Command) -> None:
    text = find_scenario("demo").read_text("utf-8")
    faults = '[[fault]]\nkind = "repeated"\nshare = 0.1\n[[fault]]\nkind = "stall"\nat_s = [1.0]\nlasts_s = 0.5\n'
    (tmp_path / "faulty.toml").write_text(text + "\n" + faults, "utf-8")
    for name in ("demo", str(tmp_path / "faulty.toml")):
        file = tmp_path / f"{Path(name).stem}.rec"
        said = command("record", f"sim:{name}", file, "--clip", CLIP, "--seconds", "5").err
        assert ("left out: stall" in said) == (name != "demo")
    twice, once = (
        [block.payload for block in read_recording(tmp_path / f"{name}.rec").blocks() if block.kind == RECEIVED]
        for name in ("faulty", "demo")
    )
    assert all(one in (other, other + other) for one, other in zip(twice, once, strict=True))
    assert 0.05 * len(once) < sum(map(len, twice)) / len(once[0]) - len(once) < 0.2 * len(once)


def test_frames_come_as_a_table(simulated: Path, command: Command) -> None:
    said = command("replay", simulated, "--frames")
    *lines, word = said.out.splitlines()
    assert word == "pass"
    assert said.err.startswith("60 frames")
    table = list(csv.DictReader(io.StringIO("\n".join(lines))))
    frames = list(RecordingStream(simulated))
    assert (tuple(table[0]), len(table)) == (FRAME_COLUMNS, 4 * len(frames))
    assert [float(row["x_m"]) for row in table[:4]] == frames[0].position_m[:, 0].tolist()
    assert [float(row["received_s"]) for row in table[::4]] == [frame.received_s for frame in frames]
    *rows, last = [json.loads(line) for line in command("replay", simulated, "--frames", "--json").lines]
    assert [row["qw"] for row in rows[:4]] == frames[0].tracker_from_station[:, 0].tolist()
    assert last["outcome"] == "pass"


def test_it_steps_by_lines_of_input(simulated: Path, command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("\n\n"))
    assert len(command("replay", simulated, "--speed", "step", "--frames").lines) == 1 + 2 * 4 + 1


def test_methods_are_scored_by_what_the_recording_says(simulated: Path, command: Command) -> None:
    text = command("replay", simulated, "--methods", "ik:previous").out
    assert f"played from demo, {CLIP}" in text
    assert "ik:previous    20/20" in text
    words = ("--scenario", "demo", "--clip", CLIP, "--methods", "mean_pose", "--json")
    (judged,) = command("replay", simulated, *words).content["methods"]
    assert (judged["method"], judged["frames_matched"]) == ("mean_pose", 20)


def test_damage_is_named_and_the_rest_is_played(simulated: Path, tmp_path: Path, command: Command) -> None:
    cut = tmp_path / "cut.rec"
    cut.write_bytes(simulated.read_bytes()[:-3])
    said = command("replay", cut)
    assert said.out.startswith("60 frames")
    assert said.err.startswith("lost: the last 67 bytes are cut off")


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


def test_seconds_end_a_recording(port: str, tmp_path: Path, command: Command) -> None:
    path = tmp_path / "a.rec"
    said = command("record", port, path, "--seconds", "0.8", "--json").content
    assert said["outcome"] == "pass"
    assert said["received_bytes"] > 0 < said["sent_bytes"]
    stream = RecordingStream(path)
    assert stream.stations == tuple("1234")
    assert len(list(stream)) > 5


@pytest.mark.parametrize("source", ["port", "simulation"])
def test_a_plan_is_named_by_its_digest(source: str, port: str, tmp_path: Path, command: Command) -> None:
    plan, file = tmp_path / "plan.toml", tmp_path / "a.rec"
    plan.write_text('kind = "trust plan"\nscenario = "demo"\nmethods = ["ik"]\n[margins]\nmpjpe_mm = 5.0\n', "utf-8")
    name = port if source == "port" else "sim:demo"
    command("record", name, file, "--seconds", "0.5", "--plan", plan)
    assert read_recording(file).note["plan"] == plan_digest(plan)
    before = file.read_bytes()
    plan.write_text(plan.read_text("utf-8").replace("5.0", "50.0"), "utf-8")
    for words in (("--plan", plan), ()):
        said = command("record", name, file, "--seconds", "0.5", *words, code=2)
        assert (said.out, said.err.count("\n"), "never renewed" in said.err) == ("refused\n", 1, True)
    assert file.read_bytes() == before
    plan.write_text('kind = "trust plan"\n', "utf-8")
    assert "margins" in command("record", name, tmp_path / "b.rec", "--plan", plan, code=2).err
    assert not (tmp_path / "b.rec").exists()
    assert "--send" in command("record", port, file, "--send", "S", "--plan", plan, code=2).err


def test_old_firmware_is_recorded_by_mp_and_refused_without(played: Playback, tmp_path: Path, command: Command) -> None:
    path = tmp_path / "a.rec"
    with serve_emulator(played.samples, EmulatorConfig(firmware="4.1105"), tcp="127.0.0.1:0") as device:
        assert "--quality mp" in command("record", device.name, path, "--seconds", "0.5", code=2).err
        assert not path.exists()
        command("record", device.name, path, "--seconds", "0.5", "--quality", "mp")
    (wire,) = read_recording(path).formats
    assert wire.items == (2, 11, 21, 1)


def test_a_list_may_be_named(port: str, tmp_path: Path, command: Command) -> None:
    path = tmp_path / "a.rec"
    command("record", port, path, "--seconds", "0.5", "--items", "40,18,19,21,1")
    (wire,) = read_recording(path).formats
    assert wire.items == (40, 18, 19, 21, 1)


def recording(port: str, path: Path, begun: int = 2000) -> subprocess.Popen[str]:
    """`harness record` in its own process, once it has set the device up and written so many bytes since."""
    process = start_harness("record", port, path)
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
        code, out, err = interrupt(process, stop)
    assert code == 0, err
    assert out.splitlines()[-1] == "pass"
    assert "Traceback" not in err
    read = read_recording(tmp_path / "a.rec")
    assert read.damage == ()
    sent = [block.payload for block in read.blocks() if block.kind == "sent"]
    assert b"c" in sent[-20:]
    assert sent[-1] == b"S", "the device has answered after its settings were put back"


def test_settings_of_another_program_are_told_and_put_back(port: str, tmp_path: Path, command: Command) -> None:
    def talk(data: bytes) -> bytes:
        line = open_transport(port, 115200)
        line.write(data)
        received, until_s = b"", time.monotonic() + 60.0
        while not received.endswith(b"\r\n") and time.monotonic() < until_s:
            received += line.read(0.1)
        line.close()
        return received

    talk(b"N1,30,0,0\rS")
    words = ("record", port, tmp_path / "a.rec", "--seconds", "0.3")
    said = command(*words).err
    assert "settings of another program: tip offset N 30, 0, 0 cm (station 1); at defaults for this session" in said
    assert "boresight of station 1, 2, 3, 4 undone: it cannot be read or put back" in said
    assert "put back: tip offset N 30, 0, 0 cm (station 1)" in said
    assert [event["kind"] for event in read_recording(tmp_path / "a.rec").events].count("settings") == 2
    assert "tip offset N 30, 0, 0 cm (station 1); kept, as asked" in command(*words, "--keep-settings").err
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
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with start_harness("replay", simulated, "--speed", "0.01", "--frames", env=environment) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("received_s,")
        assert ",left_hand," in process.stdout.readline()
        code, out, err = interrupt(process)
    assert code == 130
    assert out.splitlines()[-1] == "interrupted"
    assert "Traceback" not in err
