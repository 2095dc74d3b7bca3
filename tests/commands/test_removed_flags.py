"""Flags that verbs had once are refused with what to write instead."""

import shlex

import pytest

from harness.cli import build_parser, main
from harness.commands.flags import REMOVED_FLAGS


@pytest.mark.parametrize(("verb", "flag"), [(verb, flag) for verb, flags in REMOVED_FLAGS.items() for flag in flags])
@pytest.mark.parametrize("value", ["", " 3", "=3"])
def test_a_removed_flag_is_refused_with_advice(
    verb: str, flag: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(shlex.split(f"{verb} {flag}{value}")) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"harness: `harness {verb}` no longer has {flag}. {REMOVED_FLAGS[verb][flag]}."


def test_no_help_shows_a_removed_flag(capsys: pytest.CaptureFixture[str]) -> None:
    for verb, flags in REMOVED_FLAGS.items():
        with pytest.raises(SystemExit):
            build_parser().parse_args([verb, "--help"])
        said = capsys.readouterr().out
        assert "usage: harness" in said
        assert [flag for flag in flags if f"{flag} " in said] == []
