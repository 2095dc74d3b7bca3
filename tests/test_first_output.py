"""The table of `python -m tests.first_output` covers every verb; what it measures, and how it judges."""

import shlex
import sys
from pathlib import Path

import pytest

from harness.cli import build_parser
from tests import first_output
from tests.first_output import FirstOutput, measure_first_output
from tests.verb_examples import EXAMPLES, NEEDS_NONE, unpack_files, verb_parsers


def test_each_verb_has_a_valid_command_or_a_reason_why_it_needs_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unpack_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert sorted([*EXAMPLES, *NEEDS_NONE]) == sorted(verb_parsers())
    for verb in verb_parsers():
        assert build_parser().parse_args(shlex.split(f"{verb} {EXAMPLES.get(verb, '')}")).action


@pytest.mark.parametrize(
    ("code", "line"),
    [
        ("print('a\\nb')", "a"),
        ("import sys; print('a', file=sys.stderr)", "a"),
        ("import sys, signal; print('a', flush=True); sys.stdout.close(); signal.pause()", "a"),
        ("import sys; sys.stdout.close(); print('a', file=sys.stderr)", "a"),
        ("pass", ""),
    ],
)
def test_a_command_is_ended_at_its_first_line(code: str, line: str, tmp_path: Path) -> None:
    assert measure_first_output([sys.executable, "-c", code], tmp_path).line == line


def test_cpu_time_counts_what_comes_before_the_first_line(tmp_path: Path) -> None:
    code = "import time\nwhile time.process_time() < 0.3: pass\nprint('a')"
    found = measure_first_output([sys.executable, "-c", code], tmp_path)
    assert 0.3 <= found.cpu_s <= found.wall_s + 0.02


@pytest.mark.parametrize(
    ("found", "fault"),
    [
        (FirstOutput("list: loading", 1.0, 9.0), ""),
        (FirstOutput("list: loading", 1.01, 1.0), "more than 1 s of CPU time"),
        (FirstOutput("", 0.1, 0.1), "it prints nothing"),
        (FirstOutput("harness: no such file", 0.1, 0.1), "it was refused"),
    ],
)
def test_the_exit_code_tells_of_a_verb_that_is_late(
    found: FirstOutput, fault: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(first_output, "measure_first_output", lambda command, folder: found)
    assert first_output.main(["list"]) == (1 if fault else 0)
    assert found.fault == fault
    assert (fault or "ok") in capsys.readouterr().out
