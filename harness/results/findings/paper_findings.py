"""Findings of a paper study: published figures next to ours, as plain records that are stored as JSON.

An experiment answers one question of a paper. It has claims (each a published statement with our figure and a verdict),
tables, and charts as the numbers that they are drawn from, so that a page can be drawn from the file alone.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from harness.results.files.digests import check_study, read_record, write_record
from harness.results.findings.benchmark_statement import BenchmarkStatement

SCHEMA = 1


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
    claims: tuple[BenchmarkStatement, ...] = ()
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
    write_record(path, findings)


def read_findings(path: Path) -> PaperFindings:
    """Read the findings of a paper study; BadFile when they are missing, damaged, edited, malformed or another's."""
    expected, advice = "the findings of a paper's study", "Give the command of the study again."
    findings = read_record(PaperFindings, path, expected, advice)
    identity = {"paper": findings.paper, "motion": findings.motion, "seed": findings.seed}
    check_study(path, identity, expected, advice)
    return findings
