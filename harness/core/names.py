"""Names that users choose, for things and for files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from harness.errors import BadInput, shorten

_MOST_FILE_BYTES = 255
"""Longest name of a file or folder on the usual file systems."""


@dataclass(frozen=True)
class Label:
    """Text of one line, declared in the annotation of a field as a `core.ranges.Range` is for numbers."""

    most: int = 100
    """Largest number of characters."""
    fewest: int = 1
    of_file: bool = False
    """Whether a folder gets this name: no path, not `.` and not `..`."""

    def accepts(self, value: Any) -> bool:
        """Whether a text has a permitted length, and no character without a glyph, such as NUL or a newline."""
        if not self.fewest <= len(value) <= self.most or not value.isprintable() or value != value.strip():
            return False
        return not self.of_file or (value == Path(value).name and value != ".." and "\\" not in value)

    def __str__(self) -> str:
        """The rule in words."""
        kind = "a plain name" if self.of_file else "a text"
        return f"{kind} of {self.fewest} to {self.most} characters in one line" + (", no path" if self.of_file else "")


Name = Annotated[str, Label()]
FileName = Annotated[str, Label(of_file=True)]
"""A name that a folder of results gets."""
MethodName = Annotated[str, Label(most=1000)]
"""A name with options in brackets."""
Text = Annotated[str, Label(most=1000, fewest=0)]


def check_command_line(words: Sequence[str]) -> None:
    """BadInput for an empty word of a command line, which would name the working folder."""
    for before, word in zip(("", *words), words, strict=False):
        option = before if not word else word.removesuffix("=")
        if not word or (word.startswith("--") and option != word):
            raise BadInput(f"The argument after '{shorten(option, 60)}' is empty.", "Give it a value, or leave it out.")


def check_words(words: object) -> None:
    """BadInput for a text with a control character, and for a path with a part that is too long for a file's name.

    `words` is a text, a path, or a collection of such; anything else is accepted.
    """
    if isinstance(words, str | Path):
        text = str(words)
        if not text.isprintable():
            raise BadInput(f"'{shorten(text, 60)}' contains a control character.", "Names and paths have none.")
        longest = max(Path(text).parts, key=len, default="") if isinstance(words, Path) else ""
        if len(longest.encode()) > _MOST_FILE_BYTES:
            advice = f"A name in a path has at most {_MOST_FILE_BYTES} bytes."
            raise BadInput(f"'{shorten(text, 60)}' is too long.", advice)
    elif isinstance(words, list | tuple):
        for word in words:
            check_words(word)
