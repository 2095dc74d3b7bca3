"""`harness emulate`: what it plays, what it refuses, how it ends; and the faults of scenarios."""

import json
import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest

from harness.core.split import ClipPart
from harness.errors import BadInput, HarnessError
from harness.experiment import ClipEvaluation
from harness.experiment.scenarios import Scenario, find_scenario, load_scenario
from harness.mocap import open_motion_source
from harness.reconstruct import make_method
from harness.stream.polhemus import EmulatorConfig, FaultKind, LineEmulator, open_transport
from tests.command import Command
from tests.interrupts import interrupt, start_harness


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_it_plays_until_it_is_told_to_end(end: signal.Signals, tmp_path: Path) -> None:
    link = tmp_path / "is900"
    with start_harness("emulate", "builtin_walking", "--pty", link, "--json") as program:
        assert program.stderr is not None
        said = [program.stderr.readline() for _ in range(3)][1:]
        client = open_transport(str(link))
        client.write(b"cSl*\r")
        answer = b""
        while len(answer) < 55 + 37 and (more := client.read(20.0)):
            answer += more
        client.close()
        code, out, talk = interrupt(program, end)
    assert "stations 1 left_hand, 2 right_hand, 3 left_ankle, 4 right_ankle\n" in said[0]
    assert said[1] == f"an IS-900 at {link}; Ctrl-C ends it\n"
    assert answer[55:] == b"21l1111" + b"0" * 28 + b"\r\n"
    assert "Traceback" not in talk
    assert code == 0
    counts = json.loads(out)
    assert (counts["outcome"], counts["commands"]) == ("pass", 3)
    assert counts["replies_sent"] in (1, 2)  # the end may come between the last one's writing and its counting
    assert not os.path.lexists(link)


def test_the_shipped_scenario_shows_every_fault() -> None:
    assert {fault.kind for fault in load_scenario("emulator_faults").fault} == set(get_args(FaultKind))


def test_runs_know_nothing_of_faults() -> None:
    scenario = load_scenario("emulator_faults")
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)

    def inputs(of: Scenario) -> dict[str, object]:
        evaluation = ClipEvaluation(of, source, ClipPart("walking_p1_01"), "walking")
        return evaluation.conditions_of(make_method("ik:previous"), "pos+ori")

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
        scenario.variants()


def test_stations_have_the_numbers_that_are_asked_for(monkeypatch: pytest.MonkeyPatch, command: Command) -> None:
    """A unit whose devices share receivers, with item 16 as two programs expect it."""
    played: list[tuple[tuple[str, ...], EmulatorConfig]] = []

    def play(emulator: LineEmulator, *_: object) -> dict[str, float]:
        played.append((emulator.device.samples.stations, emulator.config))
        return {}

    monkeypatch.setattr("harness.stream.polhemus.emulator.server.play_emulator", play)
    words = ["emulate", "builtin_walking", "--tcp", "127.0.0.1:0", "--stylus-bytes", "2"]
    talk = command(*words, "--stations", "head=9,left_hand=2").err
    assert "stations 2 left_hand, 9 head\n" in talk
    assert "--stations head=9,left_hand=2 " in talk, "the next command has the numbers too"
    ((stations, config),) = played
    assert (stations, config.characters, config.stylus_bytes) == (("left_hand", "head"), "29", 2)
    assert "'0' is no station of a device" in command(*words, "--stations", "head=0", code=2).err
