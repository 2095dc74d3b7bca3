"""`harness emulate`: what it plays, what it refuses, how it ends; and the faults of scenarios."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest

from harness.cli import main
from harness.core.split import ClipPart
from harness.errors import BadInput, HarnessError
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.scenario import Scenario, find_scenario, load_scenario, variants
from harness.mocap.sources import open_motion_source
from harness.reconstruct.methods.ik import PREVIOUS
from harness.stream.codec.samples import DeviceSamples
from harness.stream.driver.transport import open_transport
from harness.stream.emulator import server
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.faults import FaultKind
from tests.interrupts import heeding_interrupts


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_it_plays_until_it_is_told_to_end(end: signal.Signals, tmp_path: Path) -> None:
    link = tmp_path / "is900"
    command = [sys.executable, "-m", "harness.cli", "emulate", "builtin_walking", "--pty", str(link), "--json"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding_interrupts
    ) as program:
        assert program.stderr is not None
        said = [program.stderr.readline(), program.stderr.readline()]
        client = open_transport(str(link))
        client.write(b"cSl*\r")
        answer = b""
        while len(answer) < 55 + 37 and (more := client.read(20.0)):
            answer += more
        client.close()
        program.send_signal(end)
        out, talk = program.communicate(timeout=120)
    assert "stations 1 left_hand, 2 right_hand, 3 left_ankle, 4 right_ankle\n" in said[0]
    assert said[1] == f"an IS-900 at {link}; Ctrl-C ends it\n"
    assert answer[55:] == b"21l1111" + b"0" * 28 + b"\r\n"
    assert "Traceback" not in talk
    assert program.returncode == 0
    counts = json.loads(out)
    assert (counts["outcome"], counts["commands"]) == ("pass", 3)
    assert counts["replies_sent"] in (1, 2)  # the end may come between the last one's writing and its counting
    assert not os.path.lexists(link)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["builtin_walking", "--rate", "120"], "18240 bytes/s; a line of 115200 baud carries 11520. Try --stations 2"),
        (["builtin_walking", "--baud", "9600"], "carries 960"),
        (["demo", "--clip", "boxing_p1_01", "--rate", "131", "--items", "40,18,19,21,1"], "11528 bytes/s"),
        (["builtin_walking", "--items", "40,18,19,21,1"], "list 40,18,19,21,1 (22 bytes, range 3 m) carries less"),
        (["builtin_walking", "--stations", "7"], "7 stations of 6"),
        (["builtin_walking", "--stations", "head,tail"], "no station called 'tail'"),
        (["builtin_walking", "--clip", "nobody_01"], "nobody_01"),
        (["no_such_scenario"], "no scenario called"),
        (["builtin_walking", "--firmware", "new"], "such as 4.2301"),
        (["builtin_walking", "--baud", "115201"], "An IS-900 supports 300"),
        (["builtin_walking", "--rate", "1000000"], "rate_hz = 1000000.0. Give a number from 1 to 1000."),
        (["builtin_walking", "--anywhere"], "--anywhere with --pty"),
        (["builtin_walking", "--baud", "9600"], "a line of 9600 baud carries 960. Try --rate 6;"),
        (["builtin_walking", "--noise", "loud"], "loud"),
        (["walking"], "HARNESS_MOCAP"),
    ],
)
def test_what_cannot_be_played_is_refused(
    options: list[str],
    complaint: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("HARNESS_MOCAP", raising=False)
    assert main(["emulate", *options, "--pty", str(tmp_path / "is900")]) == 2
    said = capsys.readouterr()
    assert complaint in said.err
    assert said.out.splitlines()[-1] == "refused"
    assert not os.path.lexists(tmp_path / "is900")


def test_a_place_that_is_taken_or_open_to_all_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine").write_text("mine")
    assert main(["emulate", "builtin_walking", "--pty", str(tmp_path / "mine")]) == 2
    assert "no link of an emulator" in capsys.readouterr().err
    assert main(["emulate", "builtin_walking", "--tcp", "0.0.0.0:0"]) == 2
    assert "--anywhere" in capsys.readouterr().err
    assert main(["emulate", "builtin_walking", "--tcp", "127.0.0.1:²"]) == 2
    assert "is no HOST:PORT" in capsys.readouterr().err
    assert main(["emulate", "builtin_walking", "--tcp", "127.0.0.1:0", "--check-baud"]) == 2
    assert "--check-baud with --tcp" in capsys.readouterr().err


@pytest.mark.parametrize("rate", ["-5", "0", "nan", "inf", "fast"])
def test_no_rate(rate: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["emulate", "builtin_walking", "--tcp", "127.0.0.1:0", "--rate", rate])
    assert f"{rate!r} is not a positive number" in capsys.readouterr().err


def test_the_shipped_scenario_shows_every_fault() -> None:
    assert {fault.kind for fault in load_scenario("emulator_faults").fault} == set(get_args(FaultKind))


def test_runs_know_nothing_of_faults() -> None:
    scenario = load_scenario("emulator_faults")
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)

    def inputs(of: Scenario) -> dict[str, object]:
        return ClipEvaluation(of, source, ClipPart("walking_p1_01"), "walking").conditions_of(PREVIOUS, "pos+ori")

    assert scenario.fault
    assert inputs(scenario) == inputs(replace(scenario, fault=()))
    assert "fault" not in inputs(scenario)


def test_a_slip_in_a_fault_is_told_with_its_place(tmp_path: Path) -> None:
    text = find_scenario("emulator_faults").read_text()
    for wrong, message in (
        ('kind = "lost"', "lots"),
        ("per_minute = 2.0", "per_hour"),
        ("share = 0.002", "0 to 1"),
    ):
        slip = {"lots": 'kind = "lots"', "per_hour": "per_hour = 2.0", "0 to 1": "share = 2.0"}[message]
        path = tmp_path / "slip.toml"
        path.write_text(text.replace(wrong, slip, 1))
        with pytest.raises(HarnessError, match=message):
            load_scenario(path)


def test_faults_cannot_be_varied() -> None:
    scenario = replace(load_scenario("emulator_faults"), vary={"fault": [[], []]})
    with pytest.raises(BadInput, match="cannot be varied"):
        variants(scenario)


def test_stations_have_the_numbers_that_are_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A unit whose devices share receivers, with item 16 as two programs expect it."""
    played: list[tuple[tuple[str, ...], EmulatorConfig]] = []

    def play(samples: DeviceSamples, config: EmulatorConfig, *_: object) -> dict[str, float]:
        played.append((samples.stations, config))
        return {}

    monkeypatch.setattr(server, "play_samples", play)
    words = ["emulate", "builtin_walking", "--tcp", "127.0.0.1:0", "--stylus-bytes", "2"]
    assert main([*words, "--stations", "head=9,left_hand=2"]) == 0
    talk = capsys.readouterr().err
    assert "stations 2 left_hand, 9 head\n" in talk
    assert "--stations head=9,left_hand=2 " in talk, "the next command has the numbers too"
    ((stations, config),) = played
    assert (stations, config.characters, config.stylus_bytes) == (("left_hand", "head"), "29", 2)
    assert main([*words, "--stations", "head=0"]) == 2
    assert "'0' is no station of a device" in capsys.readouterr().err
