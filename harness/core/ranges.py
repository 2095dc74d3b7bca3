"""Rules for values, declared in the annotation of a field: `share: Annotated[float, Range(0.0, 1.0)] = 0.1`.

A `Range` is for numbers, a `Label` for names that users choose. `core.fields` checks them where it reads a value from a
file or an option, and `check_fields` when a record is made.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from harness.errors import BadInput, shorten

_MOST_FILE_BYTES = 255
"""Longest name of a file or folder on the usual file systems."""


@dataclass(frozen=True)
class Label:
    """Text of one line."""

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


@dataclass(frozen=True)
class Range:
    """The numbers that a field may have, both ends included; for a tuple, the numbers that each entry may have."""

    low: float
    high: float
    ascending: bool = False
    """Whether the entries of a tuple must not descend."""

    def accepts(self, value: Any) -> bool:
        """Whether a number, or each entry of a tuple, is in the range; NaN never is, None always."""
        if value is None:
            return True
        numbers = value if isinstance(value, tuple) else (value,)
        if self.ascending and any(a > b for a, b in itertools.pairwise(numbers)):
            return False
        return all(self.low <= number <= self.high for number in numbers)

    def __str__(self) -> str:
        """The range in words, such as "a number from 0 to 1"."""
        kind = "two ascending numbers" if self.ascending else "a number"
        high = f"{self.high:,}" if isinstance(self.high, int) else f"{self.high:g}"
        return f"{kind} from {self.low:g}" + (f" to {high}" if math.isfinite(self.high) else "")


Constraint = Range | Label
"""A rule for the values of a field; `str` puts it into words."""


def constraints_of(hint: Any) -> tuple[Constraint, ...]:
    """The rules that an annotation declares for the value itself."""
    extras = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    return tuple(extra for extra in extras if isinstance(extra, Constraint))


def check_fields(record: object, **more: Range) -> None:
    """BadInput unless each field of a dataclass obeys its annotation; `more` has further ranges by name."""
    kind: type = type(record)
    for name, hint in _hints(kind).items():
        for value, broken in _violations(hint, getattr(record, name)):
            raise _error(record, name, value, broken)
    for name, allowed in more.items():
        if not allowed.accepts(getattr(record, name)):
            raise _error(record, name, getattr(record, name), allowed)


class CheckedFields:
    """Base of a dataclass whose fields obey their annotations from the start (`check_fields`)."""

    def __post_init__(self) -> None:
        check_fields(self)


def _error(record: object, name: str, value: Any, broken: Constraint) -> BadInput:
    return BadInput(f"{type(record).__name__}.{name} = {shorten(repr(value), 60)}.", f"Give {broken}.")


@cache
def _hints(kind: type) -> Mapping[str, Any]:
    return get_type_hints(kind, include_extras=True)


def _violations(hint: Any, value: Any) -> Iterator[tuple[Any, Constraint]]:
    """Values that break a rule, the entries of tuples and tables too, and the rules."""
    origin, args = get_origin(hint), get_args(hint)
    if origin is Annotated:
        yield from ((value, rule) for rule in constraints_of(hint) if not rule.accepts(value))
    elif origin is tuple and args[-1] is Ellipsis:
        for item in value:
            yield from _violations(args[0], item)
    elif origin is dict:
        for key, item in value.items():
            yield from _violations(args[0], key)
            yield from _violations(args[1], item)
