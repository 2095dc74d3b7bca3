"""A page as data: what it says is written once, `page_html` and `page_text` render it for a browser and a terminal."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.core.files import to_json_types
from harness.errors import Outcome
from harness.report.kit.markup import Markup
from harness.report.kit.style import Chart


@dataclass(frozen=True)
class Badge:
    """A verdict in a cell: a mark and a word, so that it does not depend on colour alone, and the reason."""

    verdict: str
    mark: str
    why: str = ""

    def __str__(self) -> str:
        return f"{self.mark} {self.verdict}" + (f": {self.why}" if self.why else "")


@dataclass(frozen=True)
class Stack:
    """A cell with a second part, which a browser shows below the first in small type."""

    upper: object
    lower: str

    def __str__(self) -> str:
        return f"{self.upper} ({self.lower})" if self.lower else str(self.upper)


@dataclass(frozen=True)
class Strong:
    """A cell that a browser sets in bold, such as the best of a column."""

    cell: object

    def __str__(self) -> str:
        return str(self.cell)


@dataclass(frozen=True)
class Prose:
    """A paragraph; code stands between backticks."""

    text: str
    is_warning: bool = False


@dataclass(frozen=True)
class Bullets:
    """A list; nothing without items. Code stands between backticks; Markup is for lists that only a browser shows."""

    items: Sequence[str]
    title: str = ""
    prefix: str = "- "
    """What each item starts with in a terminal."""


@dataclass(frozen=True)
class Code:
    """A command or a listing; a browser folds it under the title if there is one, and the terminal leaves it out."""

    text: str
    title: str = ""


def json_listing(content: Any, title: str) -> Code:
    """A folded listing of a record as JSON."""
    return Code(json.dumps(to_json_types(content), indent=2, ensure_ascii=False), title)


@dataclass(frozen=True)
class Tally:
    """Number of cases of each verdict."""

    counts: Mapping[Any, int]
    marks: Mapping[Any, str]
    meanings: Mapping[Any, str]


@dataclass(frozen=True)
class DataTable:
    """A table whose first column names the rows; nothing without rows. A row of one cell is a heading of rows."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    """Cells are text, whole numbers, `Interval`, `Badge`, `Stack` or `Strong`; code stands between backticks."""
    title: str = ""
    caption: str = ""
    """What the numbers are; a browser shows it."""
    label: str = ""
    """Name for readers who hear the page; by default the title."""
    fold: str = ""
    """Title under which a browser folds the table; "" leaves it open."""
    most_printed: int | None = None
    """Most rows in a terminal; None prints all."""
    omitted: int = 0
    """Rows that the table leaves out; both renderings say how many."""
    cards: bool = False
    """Whether a phone shows each row as a card, for rows of many words."""
    intervals_printed: bool = True
    """Whether a terminal shows intervals; not so in tables that are too wide for them."""
    caption_printed: bool = False
    """Whether a terminal prints the caption too, behind the title."""


@dataclass(frozen=True)
class Drawing:
    """A chart, and its numbers, which a browser folds below it and a terminal prints."""

    chart: Chart | Callable[[], Chart | None]
    """The chart, or what draws it; None without anything to show: the numbers are open then."""
    numbers: "DataTable | tuple[DataTable, ...]" = ()
    fold: str = "Numbers of this chart"
    level: int | None = None
    """Level of the chart's heading, 0 for a title in the caption; by default 3 where a section has several charts."""

    @property
    def tables(self) -> tuple[DataTable, ...]:
        """The numbers as a tuple of tables."""
        return (self.numbers,) if isinstance(self.numbers, DataTable) else self.numbers


@dataclass(frozen=True)
class Panels:
    """Small charts in a grid; the terminal leaves them out."""

    charts: Sequence[tuple[Markup | None, Callable[[], Chart | None]]]
    """A heading, or None for the title of the chart, and what draws the chart."""
    broad: bool = False


@dataclass(frozen=True)
class BrowserOnly:
    """Blocks that the terminal leaves out; a browser folds them under the title if there is one."""

    blocks: "Sequence[Block | Markup]"
    """Markup is HTML that has no text, such as a player of motion."""
    fold: str = ""


@dataclass(frozen=True)
class TerminalOnly:
    """Blocks that a browser leaves out."""

    blocks: "Sequence[Block]"


Block = Prose | Bullets | Code | Tally | DataTable | Drawing | Panels | BrowserOnly | TerminalOnly


@dataclass(frozen=True)
class Section:
    """A part of a page with a title; left out without content."""

    title: str
    name: str
    """Name for links."""
    blocks: Sequence[Block]
    heading: str = ""
    """Title in a terminal; by default the title in lower case."""
    terminal: bool = True
    """Whether the terminal prints it."""


@dataclass(frozen=True)
class Page:
    """All that a page says."""

    verb: str
    """The verb that makes it, such as "trust"."""
    name: str
    """What it is about; "" where the verb says it all."""
    headline: str
    facts: Mapping[str, str]
    """Title -> text; a fact without text is left out."""
    sections: Sequence[Section]
    verdict: tuple[str, Outcome] | None = None
    """The outcome, after the page's own word for it."""
    lead: Sequence[Block] = ()
    """What follows the headline at once."""
    missing: Sequence[str] = ()
    """Parts that are not on the page, and why."""
    command: str = ""
    """The command that makes the page; it is the last section."""
    printed_facts: Sequence[str] | None = None
    """Titles of the facts that the terminal prints; None prints all."""
