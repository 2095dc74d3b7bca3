"""Every verb ends with a command that makes sense next, and it parses."""

import argparse
import shlex
from pathlib import Path

import pytest

from harness.cli import build_parser
from harness.commands.flags import LINE_FLAGS, repeat_flags
from harness.experiment import prepare_playback
from harness.stream.recording import record_capture
from tests.command import Command
from tests.planted import Plan, planted_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plan = Plan(methods={"ik": 2.0, "mean_pose": 4.0}, takes=1, duration_s=2.0)
    return planted_run(tmp_path_factory.mktemp("next") / "a run", plan)  # a blank is quoted


@pytest.mark.parametrize(
    ("words", "following"),
    [
        ("list", "demo"),
        ("status RUN", "report"),
        ("plot RUN --force", "table"),
        ("table RUN", "plot"),
    ],
)
def test_the_next_command_parses(words: str, following: str, run: Path, command: Command) -> None:
    given = [run if word == "RUN" else word for word in words.split()]
    said = command(*given)
    assert "next: " not in said.out  # stdout is for data
    program, *parts = shlex.split(said.line("next: "))
    assert (program, parts[0]) == ("harness", following)
    build_parser().parse_args(parts)
    assert command(*given, "--json").content["next"] == said.line("next: ")


def parsed(*words: str) -> argparse.Namespace:
    return build_parser().parse_args(words)


@pytest.mark.parametrize(
    "words",
    [
        "--stations 6 --rate 40 --seed 0",
        "--stations head=3,torso=1 --rate 39.99999 --seed -4",
        "--alignment 0,0,0,1,0,0,0,1,0 --items 40,2,11,21,1 --baud 9600 --boresight",
        "--alignment=-0.5,0,0,1,0,0,0,1,0 --keep-settings --quality mp",
        "--mocap 'a folder' --mocap b",
    ],
)
def test_flags_are_repeated_as_they_were_given(words: str) -> None:
    live = ["live", "--port", "a port", "--scenario", "my scenario.toml"]
    given = parsed(*live, *shlex.split(words))
    names = ("port", "scenario", "stations", "rate", "seed", "mocap", *LINE_FLAGS)
    assert vars(parsed("live", *shlex.split(shlex.join(repeat_flags(given, *names))))) == vars(given)
    assert repeat_flags(parsed(*live), *names[2:]) == []


EMULATE = "emulate demo --tcp 127.0.0.1:0"


@pytest.mark.parametrize(
    ("words", "following"),
    [
        ("plot RUN --force --methods ik", "table RUN --format latex --methods ik"),
        ("plot RUN --force --metric mpjpe_mm", "table RUN --format latex --metrics mpjpe_mm"),
        ("table RUN --methods ik", "plot RUN --kind ranking --methods ik"),
        ("table RUN --metrics mpjpe_mm", "plot RUN --kind ranking --metric mpjpe_mm"),
        (
            f"{EMULATE} --stations 6 --seed 5 --clip boxing_p1_01",
            "live --port PORT --scenario demo --stations 6 --clip boxing_p1_01 --seed 5 --view browser",
        ),
        (f"{EMULATE} --stations 6 --poses", "calibrate --port PORT --scenario demo --stations 6 --out me.toml"),
        (f"{EMULATE} --firmware 4.1105", "live --port PORT --scenario demo --quality mp --view browser"),  # no item 40
    ],
)
def test_the_next_command_repeats_what_matters(
    words: str, following: str, run: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("harness.stream.polhemus.emulator.server.play_emulator", lambda *_: {})
    said = command(*(run if word == "RUN" else word for word in words.split())).err
    (line,) = [line for line in said.splitlines() if line.startswith("next")]
    named = {"RUN": str(run), "PORT": said.partition("an IS-900 at ")[2].partition(",")[0]}
    assert shlex.split(line.partition(": ")[2])[1:] == [named.get(word, word) for word in following.split()]


def test_a_recording_of_an_unknown_motion_is_shown_and_not_scored(tmp_path: Path, command: Command) -> None:
    """`replay` of a device's line named `--scenario demo`, which refuses every other motion."""
    path = tmp_path / "a take.rec"
    simulation = prepare_playback("demo", stations=2).simulation
    record_capture(path, simulation.wire_format, simulation.wire, {"source": "port"}, seconds=1.0)
    assert f"next: harness view '{path}'\n" in command("replay", path).err
