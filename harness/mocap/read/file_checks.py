"""Checks of a motion file before it is parsed (missing, empty, too large, not text), and parsers of numbers."""

from collections.abc import Sequence
from pathlib import Path

from harness.core.file_kind import wrong_file
from harness.core.input_file import check_input_file, read_input_file
from harness.errors import BadFile

LIMIT_BYTES = 256 * 2**20
"""Largest motion file that is read: about 330,000 AMC frames, or 46 minutes at 120 Hz."""
MAX_VALUE = 1e6
"""Larger numbers are treated as damage [the file's unit]."""


def check_size(path: Path, expected: str, limit_bytes: int = LIMIT_BYTES) -> None:
    """Raise BadFile unless `path` is a file that is neither empty nor larger than the limit; reads nothing."""
    if check_input_file(path, expected, limit_bytes) == 0:
        raise BadFile(path, "an empty file", expected, "Fetch or export it again.")


def check_last_line(path: Path) -> None:
    """Raise BadFile if the last line has no line break: a file that is cut inside its last number still parses."""
    with path.open("rb") as file:
        file.seek(-1, 2)
        if file.read(1) not in b"\r\n":
            advice = "The file may be truncated: fetch it again, or add a line break if it is complete."
            raise BadFile(path, "a last line without an end", "a line break at the end of the file", advice)


def read_lines(path: Path, expected: str, limit_bytes: int = LIMIT_BYTES) -> list[str]:
    """The lines of a text file; `expected` names what it should be, for the message of BadFile.

    Latin-1, so that any byte of a capture machine's path in a comment is readable; a NUL byte is not text.
    """
    check_size(path, expected, limit_bytes)
    data = read_input_file(path, expected, limit_bytes)
    if b"\0" in data:
        raise wrong_file(path, "binary data", expected, "Is it another format under this name?")
    if not data.strip():
        raise BadFile(path, "blank lines only", expected, "Fetch or export it again.")
    return data.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").split("\n")


def parse_numbers(path: Path, words: Sequence[str], count: int, what: str, line: int) -> list[float]:
    """Exactly `count` numbers from the words of a line; BadFile names a word that is not a number below MAX_VALUE."""
    if len(words) != count:
        plural = "" if len(words) == 1 else "s"
        raise BadFile(path, f"{len(words)} number{plural} for {what}", str(count), "Is the line complete?", line)
    return [parse_number(path, word, what, line) for word in words]


def parse_number(path: Path, word: str, what: str, line: int) -> float:
    """One number between -1e6 and 1e6; BadFile otherwise."""
    try:
        value = float(word)
    except ValueError:
        value = float("nan")
    if not abs(value) < MAX_VALUE:
        raise BadFile(path, f"{word[:40]!r} for {what}", "a finite number", "Fetch or export the file again.", line)
    return value
