"""VRPN as a user meets it: a port of `record` and `live`, and a server of `emulate`, `replay` and `live`."""

import argparse
import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from harness.commands.flags import parse_station_map, tracker_config
from harness.errors import BadInput
from harness.stream import PoseLog
from harness.stream.recording import open_poses
from harness.stream.vrpn import PoseReport, VrpnConfig, VrpnTracker
from tests.command import Command
from tests.interrupts import interrupt, start_harness


@contextmanager
def served(*words: object) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """A verb that serves the tracker Tracker0 at a free port of this computer, and the port that a client opens."""
    with start_harness(*words, "--vrpn", "Tracker0@:0", "--json") as program:
        try:
            assert program.stderr is not None
            place = next(line.split()[1] for line in program.stderr if line.startswith("VRPN: Tracker0@"))
            yield program, f"vrpn:{place}"
        finally:
            program.kill()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str, Path]]:
    """The port of an emulated tracker, what `record` said about it, and the recording of a second."""
    path = tmp_path_factory.mktemp("vrpn") / "a.rec"
    with served("emulate", "builtin_walking", "--noise", "clean") as (program, port):
        names = "left_hand=0,right_hand=1,right_ankle=3"
        with start_harness("record", port, path, "--seconds", "1", "--stations", names, "--json") as recording:
            out, talk = recording.communicate(timeout=120.0)
        assert recording.returncode == 0, talk
        yield port, out, path
        code, said, _ = interrupt(program)
    assert code == 0
    assert json.loads(said)["reports"] > 100


def poses_of(path: Path) -> PoseLog:
    return open_poses([path]).log


def test_an_emulated_tracker_is_served_and_recorded(recorded: tuple[str, str, Path]) -> None:
    port, out, path = recorded
    said, log = json.loads(out), poses_of(path)
    assert log.names == ("left_hand", "right_hand", "right_ankle")
    assert log.source == port
    assert said["poses"] == sum(len(body.times_s) for body in log.bodies) > 60
    assert (said["left_out"], said["copies"], said["outcome"]) == (0, 0, "pass")
    for body in log.bodies:
        assert np.median(np.diff(body.times_s)) == pytest.approx(0.025, abs=0.002)


def test_a_live_session_takes_it_and_serves_the_joints(recorded: tuple[str, str, Path], command: Command) -> None:
    what = ("--scenario", "builtin_walking", "--method", "ik", "--stations", "left_hand=0,right_hand=1,torso=2")
    said = command("live", "--port", recorded[0], *what, "--seconds", "1", "--vrpn", "Body@:0", "--json")
    assert said.content["poses"] > 20
    assert said.content["stations"] == ["left_hand", "right_hand", "torso"]
    assert "Body-joints@127.0.0.1:" in said.line("VRPN: Body@127.0.0.1:")


def test_a_recording_is_served_as_it_was(recorded: tuple[str, str, Path]) -> None:
    log, seen = poses_of(recorded[2]), list[PoseReport]()
    with served("replay", recorded[2]) as (program, port):
        with VrpnTracker(port, on_report=lambda report, now_s: seen.append(report)) as client:
            count = sum(len(body.times_s) for body in log.bodies)
            for _ in client:
                if len(seen) == count:
                    break
        out, talk = program.communicate(timeout=60.0)
    assert (program.returncode, json.loads(out)["reports"]) == (0, count), talk
    assert log.start_unix_s is not None
    for number, body in enumerate(log.bodies):
        served_again = [report for report in seen if report.sensor == number]
        assert [report.position_m for report in served_again] == [tuple(place) for place in body.positions_m.tolist()]
        assert [report.quaternion for report in served_again] == [tuple(turn) for turn in body.quaternions.tolist()]
        expected_us = 1e6 * (log.start_unix_s + body.times_s)
        assert [report.time_us for report in served_again] == np.round(expected_us).astype(int).tolist()


def test_flags_of_other_uses_are_refused(tmp_path: Path, command: Command) -> None:
    port, path = "vrpn:Tracker0@127.0.0.1:1", tmp_path / "a.rec"
    assert "nothing listens at 127.0.0.1, port 1" in command("record", port, path, code=2).err
    assert "needs commands, and VRPN carries none" in command("record", port, path, "--baud", "9600", code=2).err
    assert "VRPN carries no commands" in command("record", port, path, "--serve", tmp_path / "l", code=2).err
    assert "no tracker of a VRPN server" in command("record", "vrpn:Tracker0", path, code=2).err
    assert "--anywhere without --vrpn" in command("replay", path, "--anywhere", code=2).err
    assert "--frames with --vrpn" in command("replay", path, "--vrpn", "T", "--frames", code=2).err
    assert "--udp with --vrpn" in command("emulate", "demo", "--vrpn", "T", "--udp", "1", code=2).err
    assert not path.exists()


def test_names_of_sensors() -> None:
    assert parse_station_map("torso=10,head=2", "vrpn:T@lab") == {"head": "2", "torso": "10"}
    with pytest.raises(BadInput, match="sensors are whole numbers from 0"):
        parse_station_map("head=A", "vrpn:T@lab")
    with pytest.raises(BadInput, match="stations are 1 to 9 and A to C"):
        parse_station_map("head=10")
    none = dict.fromkeys(("baud", "items", "quality", "keep_settings", "boresight", "alignment"))
    args = argparse.Namespace(stations="torso=10,head=2", rate=60.0, **none)
    assert tracker_config(args, "vrpn:T@lab", ["head", "torso"]) == VrpnConfig(("head", "torso"), (2, 10), 60.0)
