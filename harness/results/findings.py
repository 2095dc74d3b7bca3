"""What a paper's experiments came to, published figure beside ours: plain records that are stored as JSON.

An experiment answers one question of a paper. It has claims, each a published statement with our figure and a verdict,
tables, and figures as the numbers that they are drawn from, so that a page can be drawn from the file alone.
"""

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from harness.core.fields import build
from harness.core.files import read_json, to_json_types, write_json
from harness.errors import BadFile, UnknownName

SCHEMA = 1
ClaimVerdict = Literal["reproduced", "not reproduced", "cannot tell", "not comparable", "not run"]
"""*Reproduced*: the paired 95 % interval lies on the published side; *not reproduced*: on the other; *cannot tell*: it
holds zero, or there are fewer than 6 clips; *not comparable*: absolute figures of other motion."""


@dataclass(frozen=True)
class Claim:
    """One published statement, and what we found."""

    text: str
    """Such as "walking, position + orientation: dynamic_map errs less than ik"."""
    published: str
    """The figure as printed, such as "1.25 deg", or "order" where only bars are."""
    ours: str
    verdict: ClaimVerdict
    why: str = ""
    """Of a verdict that is not *reproduced*: what differs, or what is missing."""
    clips: int = 0
    """On which both sides were measured."""
    difference: float | None = None
    """Mean paired difference over clips, in `unit`, or the figure that is held against the published one."""
    low: float | None = None
    high: float | None = None
    """Ends of its 95 % interval."""
    unit: str = ""


@dataclass(frozen=True)
class FindingsTable:
    """Texts in rows; TypeError if one has not a text for each column."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise TypeError(f"{self.title}: a row of {len(row)} texts under {len(self.columns)} columns: {row}")


@dataclass(frozen=True)
class BarChart:
    """A bar for each group and series; intervals where they are known."""

    title: str
    unit: str
    groups: tuple[str, ...]
    series: dict[str, tuple[float | None, ...]]
    """Name -> a value for each group."""
    low: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    high: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    spread: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    """Standard deviations over clips, where the paper shows them."""
    published: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    """The paper's own figures, where it prints them; of series that are drawn."""
    horizontal: bool = False
    caption: str = ""
    """What the reader should look for, and over what it was measured."""
    kind: Literal["bars"] = "bars"


@dataclass(frozen=True)
class LineChart:
    """Curves over a common axis."""

    title: str
    x_label: str
    y_label: str
    x: tuple[float, ...]
    series: dict[str, tuple[float | None, ...]]
    caption: str = ""
    kind: Literal["lines"] = "lines"


@dataclass(frozen=True)
class PaperExperiment:
    """One experiment of a paper, rerun."""

    name: str
    """Of its folder in the study, such as "leave_one_out"."""
    title: str
    question: str
    """What the paper asked and showed, so that nobody needs the paper to read on."""
    differences: tuple[str, ...]
    """In which this is another experiment than the paper's."""
    claims: tuple[Claim, ...] = ()
    tables: tuple[FindingsTable, ...] = ()
    figures: tuple[BarChart | LineChart, ...] = ()
    runs: tuple[str, ...] = ()
    """Folders of the runs that it rests on, relative to the study's."""
    notes: tuple[str, ...] = ()
    """What came out besides: negative results, cells that failed, clips that were left out and why."""


@dataclass(frozen=True)
class PaperFindings:
    """A paper rerun; findings.json in the folder of the study."""

    paper: str
    """Such as "liu2011"."""
    reference: str
    """Authors, title, venue, year."""
    motion: str
    """Such as "built-in performer" or "cmu"."""
    command: str
    seed: int
    experiments: tuple[PaperExperiment, ...]
    circumstances: dict[str, Any]
    """See `manifest.here`."""
    tables: tuple[FindingsTable, ...] = ()
    """Of the whole study: databases, clips, what was left out and why, tuned constants and what they were chosen on."""
    schema: int = SCHEMA


def write_findings(path: Path, findings: PaperFindings) -> None:
    write_json(path, to_json_types(dataclasses.asdict(findings)))


def read_findings(path: Path) -> PaperFindings:
    """BadFile when it is none."""
    expected = "the findings of a paper's study"
    content = read_json(path, expected)
    try:
        return build(PaperFindings, content, "findings")
    except (TypeError, UnknownName) as error:
        raise BadFile(path, str(error), expected, "Give the command of the study again.") from error
