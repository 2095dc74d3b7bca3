"""The program in this process, with what it printed."""

import json
import re
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from harness.cli import main


class Said(NamedTuple):
    """What a command printed, without the line that it loads."""

    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """Lines of stdout."""
        return self.out.splitlines()

    @property
    def content(self) -> Any:
        """The JSON of `--json`."""
        return json.loads(self.out)

    def line(self, begin: str) -> str:
        """The one line of stderr that begins so, without its beginning."""
        (line,) = [line for line in self.err.splitlines() if line.startswith(begin)]
        return line.removeprefix(begin)


Command = Callable[..., Said]


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Command:
    """Gives a command of these words, which ends with exit code `code`."""

    def give(*words: object, code: int = 0) -> Said:
        capsys.readouterr()
        try:
            ended = main([*map(str, words)])
        except SystemExit as refused:  # argparse's way
            ended = int(str(refused.code))
        out, err = capsys.readouterr()
        said = Said(out, re.sub(r"\A[a-z]+: loading.*\n", "", err))  # what comes first (test_cli) is left out
        assert ended == code, said.err
        return said

    return give
