"""Every verb ends with a command that makes sense next, and it parses."""

import json
import shlex
from pathlib import Path

import pytest

from harness.cli import build_parser, main
from tests.report.fabricate import Plan, fabricate


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plan = Plan(methods={"ik": 2.0, "mean_pose": 4.0}, takes=1, duration_s=2.0)
    return fabricate(tmp_path_factory.mktemp("next") / "a run", plan)  # a blank is quoted


@pytest.mark.parametrize(
    ("words", "following"),
    [
        (["list"], "demo"),
        (["status", "RUN"], "report"),
        (["plot", "RUN", "--force"], "table"),
        (["table", "RUN"], "plot"),
    ],
)
def test_the_next_command_parses(
    words: list[str], following: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(run) if word == "RUN" else word for word in words]
    assert main(words) == 0
    captured = capsys.readouterr()
    (line,) = [line for line in captured.err.splitlines() if line.startswith("next: ")]
    assert "next: " not in captured.out  # stdout is for data
    program, *parts = shlex.split(line.removeprefix("next: "))
    assert (program, parts[0]) == ("harness", following)
    build_parser().parse_args(parts)
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["next"] == line.removeprefix("next: ")
