"""The table of a run for a README: methods in rows, conditions in columns, means over performers with intervals.

Clips of one performer are not independent. Each performer therefore counts once, with the mean over the clips.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap

import numpy as np

from harness.compare import MIN_UNITS, average_units, compare_paired, mean_interval, shared_clips
from harness.core.number_format import format_number
from harness.report.figures.conditions import RunCondition, read_conditions
from harness.report.figures.table_formats import markdown_code
from harness.report.kit.marked_block import describe_code, replace_block
from harness.report.kit.text import metric_label
from harness.results import PRIMARY_METRIC, Manifest
from harness.score import DEFINITIONS

_WIDTH = 118
"""Most characters of a line of text."""
_UNIT = DEFINITIONS[PRIMARY_METRIC].unit


@dataclass(frozen=True)
class PerformerColumn:
    """One condition: the primary error of each method on each performer."""

    title: str
    errors: Mapping[str, Mapping[str, float]]
    """Method -> performer -> mean error over the performer's clips; the methods share their performers."""

    @property
    def performers(self) -> int:
        return len(self._units)

    @property
    def _units(self) -> list[str]:
        return list(next(iter(self.errors.values()), {}))

    def text(self, method: str) -> str:
        """Mean and 95 % interval; bold if it is lowest or tied and another method is worse. A dash if not measured."""
        if not (found := self.errors.get(method)):
            return "–"
        values = np.array(list(found.values()))
        mean = format_number(float(values.mean()), _UNIT)
        bold = bool(self._worse) and method not in self._worse
        ends = mean_interval(values) if len(values) > 1 else ()
        interval = f" ({' to '.join(format_number(end, _UNIT) for end in ends)})" if ends else ""
        return f"**{mean}**{interval}" if bold else f"{mean}{interval}"

    def lowest_on(self) -> str:
        """On how many performers each method has the lowest error, such as "`ik` 4, `ridge` 1"."""
        errors = [[(error[unit], name) for name, error in self.errors.items()] for unit in self._units]
        lowest = Counter(min(of_unit)[1] for of_unit in errors)
        return ", ".join(f"{markdown_code(name)} {count}" for name, count in lowest.most_common())

    @property
    def _worse(self) -> list[str]:
        """Methods whose paired difference from the lowest mean is shown to be positive; none with few performers."""
        lowest = min(self.errors, key=lambda name: np.mean(list(self.errors[name].values())))
        differences = {name: compare_paired(found, self.errors[lowest]) for name, found in self.errors.items()}
        return [name for name, difference in differences.items() if difference.verdict == "reproduced"]


def performer_columns(folder: Path, methods: Sequence[str] = ()) -> list[PerformerColumn]:
    """The conditions of the run in `folder`, known performers first, with all methods or these.

    Raises what `read_conditions` raises, and UnknownName for a method that the run lacks.
    """
    run = read_conditions(folder).select(methods=methods)
    ordered = sorted(run.conditions, key=lambda each: each.group.performer)
    titles = _titles(ordered)
    return [PerformerColumn(title, _errors(each)) for title, each in zip(titles, ordered, strict=True)]


def _errors(condition: RunCondition) -> dict[str, dict[str, float]]:
    """Errors by method and unit, of the clips that every method has."""
    by_clip = {name: values.get(PRIMARY_METRIC, {}) for name, values in condition.values().items()}
    by_clip = {name: errors for name, errors in by_clip.items() if errors}
    shared = shared_clips(by_clip.values())
    return {
        name: average_units({clip: errors[clip] for clip in shared}, condition.sampling)
        for name, errors in by_clip.items()
    }


def _titles(conditions: Sequence[RunCondition]) -> list[str]:
    """Performers and setting of each condition, without keys that tell no conditions apart."""
    parts: list[dict[str, str]] = [
        {"": each.group.performer, **{key: str(value) for key, value in each.setting.items()}} for each in conditions
    ]
    for key in [name for name in parts[0] if name][::-1]:
        fewer = [{name: text for name, text in part.items() if name != key} for part in parts]
        if len({tuple(part.items()) for part in fewer}) == len(parts):
            parts = fewer
    return [", ".join(filter(None, part.values())) or "error" for part in parts]


def update_readme(readme: Path, folder: Path, methods: Sequence[str] = ()) -> None:
    """Replace the table of the run in `folder`, by the name of its scenario, or append it.

    Raises what `performer_columns` and `replace_block` raise.
    """
    manifest = Manifest.read(folder / "manifest.json")
    label = f"run {manifest.inputs.get('name', folder.name)}"
    replace_block(readme, label, table_lines(performer_columns(folder, methods), manifest.circumstances))


def table_lines(columns: Sequence[PerformerColumn], circumstances: Mapping[str, object]) -> list[str]:
    """Lines of Markdown: the table, what its numbers are, and the command that computed them."""
    methods = dict.fromkeys(name for column in columns for name in column.errors)
    rows = [
        ["method", *(column.title for column in columns)],
        ["---", *["--:"] * len(columns)],
        *([markdown_code(name), *(column.text(name) for column in columns)] for name in methods),
        ["lowest on", *(column.lowest_on() for column in columns)],
        ["units (performers)", *(str(column.performers) for column in columns)],
    ]
    tied = "Bold: the lowest mean, and means not shown to be higher."
    few = f"Fewer than {MIN_UNITS} performers cannot show a difference."
    counts = [column.performers for column in columns]
    note = [
        f"Mean {metric_label(PRIMARY_METRIC)} over performers and its 95 % interval.",
        *([tied] if any("**" in text for row in rows for text in row) else []),
        *([few] if min(counts) < MIN_UNITS else []),
        f"Made by {_command(circumstances)} ({describe_code(circumstances)}).",
    ]
    return [*(f"| {' | '.join(row)} |" for row in rows), "", *wrap(" ".join(note), _WIDTH, break_on_hyphens=False)]


def _command(circumstances: Mapping[str, object]) -> str:
    """The command of the run as code, without flags that change no number."""
    command = re.sub(r" --(out|jobs)[ =]\S+| --(no-report|json)\b", "", str(circumstances.get("command", "")))
    return markdown_code(command) if command else "an unknown command"
