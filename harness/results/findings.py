"""Findings of a paper study: published figures next to ours, as plain records that are stored as JSON.

An experiment answers one question of a paper. It has claims (each a published statement with our figure and a verdict),
tables, and charts as the numbers that they are drawn from, so that a page can be drawn from the file alone.
"""

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from harness.core.fields import build
from harness.core.files import to_json_types
from harness.errors import BadFile, UnknownName
from harness.results.digests import check_study, read_result_json, write_result_json

SCHEMA = 1
ClaimVerdict = Literal["reproduced", "same", "not reproduced", "cannot tell", "not comparable", "not run"]
"""Verdict on a claim, by the paired 95 % interval of the difference.

*reproduced*: it lies on the published side; *same*: it lies within the margin of `compare.margins`, so the difference
is too small to matter; *not reproduced*: it lies on the other side; *cannot tell*: it contains zero, there are too few
units, or the difference is not significant after Holm's correction; *not comparable*: absolute figures of other motion.
"""
ClaimKind = Literal["printed", "derived", "repeated", "speed"]
"""Kind of a claim.

*printed*: the paper prints the statement; *derived*: it follows from printed ones, or is our reading of a word;
*repeated*: a printed statement asked of one more method; *speed*: today's speed against the paper's. Only printed
statements count in the headline.
"""
Reading = Literal["", "as printed", "ours"]
"""Methods of a claim: the paper's as printed, our best, or "" where the statement is not about a method."""


@dataclass(frozen=True)
class Claim:
    """One published statement and our result."""

    text: str
    """The statement, such as "walking, position + orientation: dynamic_map errs less than ik"."""
    published: str
    """The figure as printed, such as "1.25 deg", or "order" where only bars are."""
    ours: str
    verdict: ClaimVerdict
    why: str = ""
    """Reason for a verdict other than *reproduced*: what differs, or what is missing."""
    clips: int = 0
    """Number of units on which both sides were measured: performers, or clips where the scenario says so."""
    difference: float | None = None
    """Mean paired difference over units, or our figure that the published one is compared with, in `unit`."""
    low: float | None = None
    high: float | None = None
    """Ends of the 95 % interval of `difference`."""
    unit: str = ""
    kind: ClaimKind = "printed"
    reading: Reading = ""
    p: float | None = None
    """Two-sided p of the difference; None where nothing was tested."""
    p_holm: float | None = None
    """`p` corrected for the number of printed statements of the paper with this reading (see `correct_claims`)."""


@dataclass(frozen=True)
class FindingsTable:
    """A table of texts; TypeError if a row does not have one text per column."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise TypeError(f"{self.title}: a row of {len(row)} texts under {len(self.columns)} columns: {row}")


@dataclass(frozen=True)
class BarChart:
    """A bar chart with one bar per group and series, and intervals where they are known."""

    title: str
    unit: str
    groups: tuple[str, ...]
    series: dict[str, tuple[float | None, ...]]
    """Name of a series -> its value in each group."""
    low: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    high: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    spread: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    """Standard deviations over units, where the paper shows them."""
    published: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    """Figures that the paper prints, by series."""
    horizontal: bool = False
    caption: str = ""
    """What to look for in the chart, and what it was measured on."""
    kind: Literal["bars"] = "bars"


@dataclass(frozen=True)
class LineChart:
    """A chart of curves over a common axis."""

    title: str
    x_label: str
    y_label: str
    x: tuple[float, ...]
    series: dict[str, tuple[float | None, ...]]
    caption: str = ""
    kind: Literal["lines"] = "lines"


@dataclass(frozen=True)
class PaperExperiment:
    """Findings of one reproduced experiment of a paper."""

    name: str
    """Name of its folder in the study, such as "leave_one_out"."""
    title: str
    question: str
    """What the paper asked and showed, for readers without the paper."""
    differences: tuple[str, ...]
    """Differences between this experiment and the paper's."""
    claims: tuple[Claim, ...] = ()
    tables: tuple[FindingsTable, ...] = ()
    figures: tuple[BarChart | LineChart, ...] = ()
    runs: tuple[str, ...] = ()
    """Folders of the runs that it is computed from, relative to the study's."""
    notes: tuple[str, ...] = ()
    """Further results: negative results, failed cells, and clips that were left out with the reason."""


@dataclass(frozen=True)
class PaperFindings:
    """Findings of a reproduced paper: findings.json in the folder of the study."""

    paper: str
    """Name of the paper, such as "liu2011"."""
    reference: str
    """Authors, title, venue, year."""
    motion: str
    """Title of the motion source, such as "built-in performer" or "cmu"."""
    command: str
    seed: int
    experiments: tuple[PaperExperiment, ...]
    circumstances: dict[str, Any]
    """See `manifest.current_circumstances`."""
    tables: tuple[FindingsTable, ...] = ()
    """Tables of the whole study: databases, clips, omissions with reasons, tuned constants and their tuning clips."""
    schema: int = SCHEMA


def write_findings(path: Path, findings: PaperFindings) -> None:
    """Write findings as JSON with a digest."""
    write_result_json(path, to_json_types(dataclasses.asdict(findings)))


def read_findings(path: Path) -> PaperFindings:
    """Read the findings of a paper study; BadFile when they are missing, damaged, edited, malformed or another's."""
    expected, advice = "the findings of a paper's study", "Give the command of the study again."
    content = read_result_json(path, expected, advice)
    try:
        findings = build(PaperFindings, content, "findings")
    except (TypeError, ValueError, UnknownName) as error:
        raise BadFile(path, str(error), expected, advice) from error
    identity = {"paper": findings.paper, "motion": findings.motion, "seed": findings.seed}
    check_study(path, identity, expected, advice)
    return findings
