"""The verb itself, against an emulator."""

import csv
import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.experiment.playback import Playback, prepare_playback
from harness.reconstruct import registry
from harness.stream.emulator.server import serve_emulator
from tests.interrupts import heeding_interrupts

WHAT = ["--scenario", "demo", "--clip", "boxing_p1_01", "--method", "ik"]


@pytest.fixture(scope="module")
def rehearsal() -> Playback:
    return prepare_playback("demo", clip="boxing_p1_01", stations=4)


@contextmanager
def live(*arguments: str) -> Iterator["subprocess.Popen[str]"]:
    """The verb in a process of its own, as from a terminal."""
    command = [sys.executable, "-m", "harness.cli", "live", *WHAT, *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding_interrupts
    ) as program:
        try:
            yield program
        finally:
            program.kill()


def wait_for_rows(path: Path, count: int, program: "subprocess.Popen[str]") -> None:
    until_s = time.monotonic() + 300.0
    while time.monotonic() < until_s and program.poll() is None:
        if path.exists() and path.read_text().count("\n") > count:
            return
        time.sleep(0.05)
    program.kill()
    raise AssertionError(f"no {count} poses came: {program.communicate()}")


@pytest.mark.parametrize("ending", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_ctrl_c_ends_it_well(tmp_path: Path, rehearsal: Playback, ending: signal.Signals) -> None:
    poses, bvh = tmp_path / "poses.csv", tmp_path / "live.bvh"
    outputs = ["--poses", str(poses), "--bvh", str(bvh), "--json"]
    with serve_emulator(rehearsal.samples, pty=tmp_path / "tracker") as device:
        with live("--port", device.name, *outputs) as program:
            wait_for_rows(poses, 40, program)
            program.send_signal(ending)
            said, talk = program.communicate(timeout=120.0)
        assert program.returncode == 0, talk
        assert "Traceback" not in talk
        content = json.loads(said)
        assert content["outcome"] == "pass"
        assert content["poses"] > 40
        assert content["line"]["sessions"] == 1
        assert content["floor"]["timer"]["p50_ms"] >= 0.0
        assert not device.emulator.device.streaming
    text = bvh.read_text()
    assert f"Frames: {content['poses'] + content['frames_dropped']:>10}" in text or content["frames_dropped"]
    with poses.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == content["poses"]
    if content["frames_dropped"] == 0:  # which on a busy machine may be
        _same_as_a_run(rehearsal, rows)


def test_ctrl_c_before_the_first_pose_is_an_interrupt(tmp_path: Path, rehearsal: Playback) -> None:
    with (
        serve_emulator(rehearsal.samples, tcp="127.0.0.1:0") as device,
        live("--port", device.name, "--poses", str(tmp_path / "poses.csv")) as program,
    ):
        assert program.stderr is not None
        while "learning" not in program.stderr.readline():
            assert program.poll() is None
        program.send_signal(signal.SIGINT)
        said, talk = program.communicate(timeout=120.0)
    assert program.returncode == 130, talk
    assert said.splitlines()[-2:] == ["stopped before the first pose", "interrupted"]
    assert "Traceback" not in talk
    assert not (tmp_path / "poses.csv").exists()


def _same_as_a_run(rehearsal: Playback, rows: list[dict[str, str]]) -> None:
    """Poses of the first lap are those of a run over the simulation."""
    frames = rehearsal.simulation.frames
    session = rehearsal.clip_evaluation.fit_method(registry.resolve("ik"), "ik").begin(rehearsal.calibration)
    stations = list(rehearsal.scenario.stations)
    for frame, row in zip(frames[: rehearsal.samples.take_frames], rows, strict=False):
        estimate = session.step(frame)
        stamps_s = [float(row[f"device_s.{name}"]) for name in stations]
        if not np.array_equal(stamps_s, frame.measured_s):
            return  # a frame was cut in two when the machine held its bytes up: from here on they differ
        qpos = [float(value) for name, value in row.items() if name.startswith("root.") or name.endswith("_rad")]
        np.testing.assert_array_equal(qpos, estimate.qpos)


@pytest.mark.long
def test_it_ends_after_its_time_and_says_how_it_went(tmp_path: Path, rehearsal: Playback) -> None:
    pytest.importorskip("pythonosc", reason="python-osc is not installed (extra `live`)")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        vmc = ["--vmc", str(listener.getsockname()[1])]
        with (
            serve_emulator(rehearsal.samples, tcp="127.0.0.1:0") as device,
            live("--port", device.name, "--seconds", "1", *vmc) as program,
        ):
            said, talk = program.communicate(timeout=120.0)
        assert listener.recv(2048).startswith(b"#bundle")
    assert program.returncode == 0, talk
    lines = said.strip().splitlines()
    assert lines[-1] == "pass"
    assert lines[0].split() == ["milliseconds", "p50", "p99", "max"]
    assert "the computer: a timer is late" in said
    assert "stations 1 left_hand, 2 right_hand, 3 left_ankle, 4 right_ankle" in talk


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (["--port", "/dev/no_such_port"], "no such port"),
        (["--method", "dynamic_mop"], "Did you mean 'dynamic_map'"),
        (["--scenario", "nothing"], "no scenario called 'nothing'"),
        (["--stations", "nose"], "no station called 'nose'"),
        (["--stations", "9"], "9 stations of 6"),
        (["--vmc", "nowhere"], "is not an address"),
        (["--view", "frames"], "needs a folder"),
        (["--bvh", "/no/such/folder/x.bvh"], "cannot be written"),
        (["--lsl", ""], "The argument after '--lsl' is empty"),
        (["--out", "there"], "--out without --view frames"),
        (["--anywhere"], "--anywhere without --lsl"),
        (["--seconds", "soon"], "not a positive number"),
        (["--items", "40;2"], "not a list such as"),
        (["--items", "2,11,21,1"], "(--quality mp)"),
        (["--clip", "walking_p1_01", "--items", "40,18,19,21,1"], "carries positions up to 3 m"),
        (["--quality", "best"], "invalid choice"),
        (["--port", "tcp://127.0.0.1:1", "--baud", "9600"], "--baud with tcp://127.0.0.1:1"),
        (["--stations", ""], "The argument after '--stations' is empty"),
    ],
)
def test_refusals(changed: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["live", "--port", "/dev/no_such_port", *WHAT, *changed]
    try:
        code = main(arguments)
    except SystemExit as ended:  # argparse's way
        code = int(str(ended.code))
    said = capsys.readouterr()
    assert code == 2
    assert said.out.strip().splitlines()[-1] == "refused"
    complaint = said.err.strip().splitlines()[-1]
    assert words in complaint


def test_another_rate_than_the_scenarios(capsys: pytest.CaptureFixture[str]) -> None:
    faster = prepare_playback("demo", clip="boxing_p1_01", stations=4, rate_hz=50.0)
    with serve_emulator(faster.samples, tcp="127.0.0.1:0") as device:
        assert main(["live", "--port", device.name, *WHAT, "--seconds", "1"]) == 2
    assert "Say --rate 50" in capsys.readouterr().err


def test_what_it_writes_is_gone_when_the_tracker_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = ["--bvh", str(tmp_path / "a.bvh"), "--poses", str(tmp_path / "a.csv")]
    assert main(["live", "--port", "/dev/no_such_port", *WHAT, *files]) == 2
    assert "no such port" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_file_survives_a_tracker_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    old = tmp_path / "a.bvh"
    old.write_text("mine")
    assert main(["live", "--port", "/dev/no_such_port", *WHAT, "--bvh", str(old), "--force"]) == 2
    assert "no such port" in capsys.readouterr().err
    assert old.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [old]
