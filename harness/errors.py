"""Errors that the package raises on purpose, and the outcomes of a command with their words and exit codes.

There is a type for each thing that the reader can do about it. A message names the cause, its place and the choices.
`super().__init__` gets the fields instead of the text, so that an error can be pickled out of a worker process.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from enum import Enum
from itertools import islice
from pathlib import Path


class Outcome(Enum):
    """How a command ended: its word (last line, JSON) and its exit code."""

    PASS = ("pass", 0)
    REGRESSED = ("regressed", 1)
    REFUSED = ("refused", 2)
    NOT_COMPARABLE = ("not comparable", 3)
    INCOMPLETE = ("incomplete", 4)
    FAILED = ("failed", 5)
    INTERRUPTED = ("interrupted", 130)

    @property
    def word(self) -> str:
        """The word in JSON and on the last printed line."""
        return str(self.value[0])

    @property
    def exit_code(self) -> int:
        """The exit code of the process."""
        return int(self.value[1])


MAX_TEXT = 400
"""Most characters of one part of a message, such as a name from a file."""


def shorten(text: str, limit: int = MAX_TEXT) -> str:
    """One printable line of at most `limit` characters; of a longer text the middle is left out."""
    if len(text) > limit:
        head = limit * 2 // 3
        text = f"{text[:head]}...{text[head + 3 - limit :]}"
    if not text.isprintable():
        text = "".join(sign if sign.isprintable() else " " if sign.isspace() else ascii(sign)[1:-1] for sign in text)
    return text if len(text) <= limit else shorten(text, limit)


def error_chain(error: BaseException | None) -> Iterator[BaseException]:
    """An error and what has led to it, each once: a method may raise an error from itself."""
    passed = set[int]()
    while error is not None and id(error) not in passed:
        passed.add(id(error))
        yield error
        error = error.__cause__ or error.__context__


def was_interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused an error: interrupted code may raise another error while it cleans up."""
    return any(isinstance(each, KeyboardInterrupt) for each in error_chain(error))


class HarnessError(Exception):
    """Base class of the errors that the package raises on purpose; the command line prints them without a traceback."""

    outcome = Outcome.REFUSED
    file = ""
    """The file that caused the error, where the text itself does not name it (see `name_file`)."""

    @property
    def place(self) -> str:
        """The beginning of the message that names the file; empty without one."""
        return f"{shorten(self.file)}: " if self.file else ""


@contextmanager
def name_file(path: Path) -> Iterator[None]:
    """Messages about names, keys and values that are raised in the block begin with the file that holds them."""
    try:
        yield
    except (UnknownName, RenamedKey, BadInput) as error:
        error.file = error.file or str(path)
        raise


class SystemFault(HarnessError):
    """A fault of the system that stopped the work: a full disk, a folder that vanished or cannot be written."""

    outcome = Outcome.FAILED

    def __init__(self, what: str, advice: str) -> None:
        super().__init__(what, advice)
        self.what, self.advice = self.args

    def __str__(self) -> str:
        return f"{self.what} {self.advice}"


def suggest(name: str, known: Iterable[str]) -> str:
    """The question " Did you mean 'ridge'?" after a wrong name, or "" where no known name is near."""
    import difflib  # only for a message: the pytest plugin is loaded by every pytest

    folded, word = {each.casefold(): each for each in islice(known, 1000)}, name.casefold()
    parts = [each for each in folded if len(word) > 2 and word in each]
    near = difflib.get_close_matches(word, folded, n=1) or parts
    return f" Did you mean {folded[near[0]]!r}?" if near else ""


class UnknownName(HarnessError):
    """A station, bone, method, clip or scenario key that does not exist."""

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        super().__init__(kind, name, tuple(known))
        self.kind, self.name, self.known = self.args

    def __str__(self) -> str:
        name, known = shorten(self.name, 100), [shorten(each, 100) for each in self.known]
        choices = shorten(", ".join(known) or "none", 2 * MAX_TEXT)
        return f"{self.place}no {shorten(self.kind)} called {name!r}.{suggest(name, known)} Known: {choices}."


class RenamedKey(HarnessError):
    """A key of a scenario, a study or an option that was renamed, or removed: `new` is then a sentence."""

    def __init__(self, where: str, old: str, new: str) -> None:
        super().__init__(where, old, new)
        self.where, self.old, self.new = self.args

    def __str__(self) -> str:
        end = f"was removed. {self.new}" if " " in self.new else f"is now called {self.new!r}. Use the new name."
        return f"{self.place}{shorten(self.where)}: the key {self.old!r} {end}"


class ShapeError(HarnessError):
    """Arrays of one record whose sizes do not agree."""

    def __init__(self, record: str, field: str, found: tuple[int, ...], expected: str) -> None:
        super().__init__(record, field, found, expected)
        self.record, self.field, self.found, self.expected = self.args

    def __str__(self) -> str:
        return f"{self.record}.{self.field} has shape {self.found}, expected {self.expected}."


class BadFile(HarnessError):
    """A file that cannot be used. The message tells what was found, what was expected, and what to try.

    `expected` is empty where `found` tells it.
    """

    def __init__(self, path: Path | str, found: str, expected: str, advice: str, line: int | None = None) -> None:
        super().__init__(str(path), found, expected, advice, line)
        self.path, self.found, self.expected, self.advice, self.line = self.args

    def __str__(self) -> str:
        path, found, expected, advice = map(shorten, (self.path, self.found, self.expected, self.advice))
        where = path if self.line is None else f"{path}, line {self.line}"
        return f"{where}: {found}{expected and f'; expected {expected}'}. {advice}".rstrip()


class BadInput(HarnessError):
    """An option, scenario value or combination that cannot be used. The message tells what to do instead."""

    def __init__(self, what: str, advice: str) -> None:
        super().__init__(what, advice)
        self.what, self.advice = self.args

    def __str__(self) -> str:
        return f"{self.place}{shorten(self.what, 2 * MAX_TEXT)} {shorten(self.advice, 2 * MAX_TEXT)}"


class NotComparable(BadInput):
    """Sound input that has too little in common to be compared."""

    outcome = Outcome.NOT_COMPARABLE


class NothingMeasured(HarnessError):
    """A folder of results without a measured cell: *incomplete* if cells failed, otherwise *not comparable*."""

    def __init__(self, folder: Path | str, failed: int) -> None:
        super().__init__(str(folder), failed)
        self.folder, self.failed = self.args
        self.outcome = Outcome.INCOMPLETE if failed else Outcome.NOT_COMPARABLE

    def __str__(self) -> str:
        folder, failed = shorten(self.folder), f" ({self.failed} failed)" if self.failed else ""
        return f"{folder}: no cell was measured{failed}. `harness status {folder}` tells what became of its cells."


class MissingExtra(HarnessError):
    """A part that needs a package of an optional extra, which is not installed."""

    def __init__(self, what: str, package: str, extra: str) -> None:
        super().__init__(what, package, extra)
        self.what, self.package, self.extra = self.args

    def __str__(self) -> str:
        return f"{self.what} needs {self.package}; install it with: pip install 'tracker-harness[{self.extra}]'."
