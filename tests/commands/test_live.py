"""The verb itself, against an emulator."""

import csv
import json
import re
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import numpy as np
import pytest

from harness.experiment import Playback, prepare_playback
from harness.reconstruct import make_method
from harness.stream import serve_emulator
from harness.view import COMMAND_HEADER
from tests.command import Command
from tests.interrupts import interrupt, start_harness

WHAT = ["--scenario", "demo", "--clip", "boxing_p1_01", "--method", "ik"]


@contextmanager
def live(*arguments: object) -> Iterator["subprocess.Popen[str]"]:
    """The verb in a process of its own, as from a terminal."""
    with start_harness("live", *WHAT, *arguments) as program:
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
def test_ctrl_c_ends_it_well(tmp_path: Path, played: Playback, ending: signal.Signals) -> None:
    poses, bvh = tmp_path / "poses.csv", tmp_path / "live.bvh"
    with serve_emulator(played.samples, pty=tmp_path / "tracker") as device:
        with live("--port", device.name, "--poses", poses, "--bvh", bvh, "--json") as program:
            wait_for_rows(poses, 40, program)
            code, said, talk = interrupt(program, ending)
        assert code == 0, talk
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
        _same_as_a_run(played, rows)


def test_ctrl_c_before_the_first_pose_is_an_interrupt(tmp_path: Path, played: Playback) -> None:
    with (
        serve_emulator(played.samples, tcp="127.0.0.1:0") as device,
        live("--port", device.name, "--poses", tmp_path / "poses.csv") as program,
    ):
        assert program.stderr is not None
        while "learning" not in program.stderr.readline():
            assert program.poll() is None
        code, said, talk = interrupt(program)
    assert code == 130, talk
    assert said.splitlines()[-2:] == ["stopped before the first pose", "interrupted"]
    assert "Traceback" not in talk
    assert not (tmp_path / "poses.csv").exists()


def _same_as_a_run(played: Playback, rows: list[dict[str, str]]) -> None:
    """Poses of the first lap are those of a run over the simulation."""
    frames = played.simulation.frames
    session = played.clip_evaluation.fit_method(make_method("ik"), "ik").begin(played.calibration)
    stations = list(played.scenario.stations)
    for frame, row in zip(frames[: played.samples.take_frames], rows, strict=False):
        estimate = session.step(frame)
        stamps_s = [float(row[f"device_s.{name}"]) for name in stations]
        if not np.array_equal(stamps_s, frame.measured_s):
            return  # a frame was cut in two when the machine held its bytes up: from here on they differ
        qpos = [float(value) for name, value in row.items() if name.startswith("root.") or name.endswith("_rad")]
        np.testing.assert_array_equal(qpos, estimate.qpos)


@pytest.mark.long
def test_it_ends_after_its_time_and_says_how_it_went(tmp_path: Path, played: Playback) -> None:
    pytest.importorskip("pythonosc", reason="python-osc is not installed (extra `live`)")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        vmc = ["--vmc", str(listener.getsockname()[1])]
        with (
            serve_emulator(played.samples, tcp="127.0.0.1:0") as device,
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


@pytest.mark.long
def test_the_page_commands_a_session_and_its_recording_can_be_scored(
    tmp_path: Path, played: Playback, command: Command
) -> None:
    recorded, before = tmp_path / "recorded", sorted(Path().iterdir())
    recorded.mkdir()
    words = ["--view", "browser", "--no-browser", "--out", recorded, "--json"]
    with (
        serve_emulator(played.samples, tcp="127.0.0.1:0") as device,
        live("--port", device.name, *words) as program,
    ):
        page = LivePage(program)
        page.wait_for_pose(20)
        assert page.command("record", on=True)["recording"].startswith("live_2")
        assert abs(page.command("heading")["turn_deg"]) < 180.0
        page.wait_for_pose(page.number + 160)
        path = Path(page.command("record", on=False)["saved"])
        assert page.command("record", on=True)["recording"] != path.name
        code, said, talk = interrupt(program)
    assert code == 0, talk
    assert json.loads(said)["poses"] > 180
    assert path.parent == recorded
    assert len(list(recorded.iterdir())) == 2, "the second recording ends with the session"
    assert sorted(Path().iterdir()) == before
    scored = command("replay", path, "--scenario", "demo", "--clip", "boxing_p1_01", "--methods", "ik", "--json")
    (method,) = json.loads(scored.out)["methods"]
    assert method["frames_matched"] > 50
    assert method["metrics"]["joint_angle_mean_deg"] < 10.0


class LivePage:
    """The page of a session in another process, as a program commands it."""

    def __init__(self, program: "subprocess.Popen[str]") -> None:
        """Wait until the session takes commands."""
        said, line = "", ""
        while "Ctrl-C ends it" not in line:
            assert program.stderr is not None
            line = program.stderr.readline()
            said += line
            assert line, said
        found = re.search(r"view: (\S+)#(\S+)", said)
        assert found
        self._url, self._token = found.groups()
        self.number = -1

    def wait_for_pose(self, number: int) -> None:
        """Wait until the page has the pose of this number, or a later one."""
        until_s = time.monotonic() + 120.0
        while self.number < number:
            assert time.monotonic() < until_s
            with urlopen(f"{self._url}events") as answer:  # noqa: S310
                self.number = dict(json.load(answer)["messages"]).get("frame", {}).get("number", -1)

    def command(self, name: str, **content: object) -> dict[str, Any]:
        """The answer to a command."""
        headers = {COMMAND_HEADER: self._token}
        request = Request(f"{self._url}command/{name}", json.dumps(content).encode(), headers)  # noqa: S310
        with urlopen(request) as answer:  # noqa: S310
            found: dict[str, Any] = json.load(answer)
            return found


def test_another_rate_than_the_scenarios(command: Command) -> None:
    faster = prepare_playback("demo", clip="boxing_p1_01", stations=4, rate_hz=50.0)
    with serve_emulator(faster.samples, tcp="127.0.0.1:0") as device:
        said = command("live", "--port", device.name, *WHAT, "--seconds", "1", code=2)
    assert "Say --rate 50" in said.err


def test_a_file_survives_a_tracker_that_is_not_there(tmp_path: Path, command: Command) -> None:
    old = tmp_path / "a.bvh"
    old.write_text("mine")
    assert "no such port" in command("live", "--port", "/dev/no_such_port", *WHAT, "--bvh", old, "--force", code=2).err
    assert old.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [old]
