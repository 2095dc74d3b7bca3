"""A comparison in words: its outcome in one sentence, counts of verdicts, and numbers with suitable decimals."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import get_args

from harness.compare import MARGINS, MIN_UNITS, Comparison, Difference, Verdict, count_units
from harness.core.number_format import Interval, count_noun, decimals_for, format_change_percent, format_fixed
from harness.errors import Outcome
from harness.report.kit.text import list_first

KINDS: tuple[Verdict, ...] = get_args(Verdict)
"""All verdicts."""
MARKS: Mapping[Verdict, str] = {"worse": "✗", "cannot tell": "?", "better": "✓", "same": "="}
"""Verdict -> its mark, in the order of importance to the reader."""
MEANINGS: Mapping[Verdict, str] = {
    "worse": "Holm-corrected p is at most 0.05, the 95 % interval excludes zero, and the mean is worse by more than "
    "the margin",
    "cannot tell": "none of the others: there are too few units, or they vary too much for the margin",
    "better": "the conditions of worse hold in the other direction",
    "same": "the 95 % interval lies within the margin, or no unit differs",
}
OUTCOME_TITLES: Mapping[Outcome, str] = {
    Outcome.PASS: "Pass",
    Outcome.REGRESSED: "Regressed",
    Outcome.NOT_COMPARABLE: "Not comparable",
    Outcome.INCOMPLETE: "Incomplete",
}


_LEAST_SHARE = 0.01
"""Share of the margin below which a difference is of no interest [choice]."""


def outcome_title(outcome: Outcome, comparisons: Iterable[Comparison]) -> str:
    """The word for an outcome. Where everything can be compared and lines are undecided it is "Cannot tell"."""
    undecided = [each for each in comparisons if each.outcome is outcome is Outcome.NOT_COMPARABLE]
    if undecided and all(_is_comparable(each) for each in undecided):
        return "Cannot tell"
    return OUTCOME_TITLES[outcome]


def _is_comparable(each: Comparison) -> bool:
    """Whether gated lines were measured, and nothing in the inputs, cells and coverage differs."""
    differs = each.inputs_that_differ or each.only_a or each.only_b or each.coverage
    return not differs and any(line.gated for line in each.differences)


def comparison_sentence(comparison: Comparison) -> str:
    """The outcome in one sentence."""
    gated = [line for line in comparison.differences if line.gated]
    counts = count_verdicts(gated)
    lines = f"{count_noun(len(gated), 'gated line')} on {count_units(unit for line in gated for unit in line.units)}"
    match comparison.outcome:
        case Outcome.REGRESSED:
            worse = [
                f"{line_title(line)} {format_change_percent(percent_of_a(line, line.difference))}"
                for line in gated
                if line.verdict == "worse"
            ]
            return f"B is worse than A in {counts['worse']} of {lines}: {list_first(worse)}."
        case Outcome.PASS:
            return f"B is no worse than A in {lines}: {counts['same']} same, {counts['better']} better."
        case _:
            return f"It cannot be decided whether B is worse than A: {comparison.why.rstrip('.')}."


def deciding_parts(comparison: Comparison) -> list[str]:
    """For each gated line that is not the same, in which behaviours and performers its sides differ."""
    lines = [line for line in comparison.differences if line.gated and line.verdict != "same"]
    return [
        f"{MARKS[line.verdict]} {line_title(line)}: {parts}"
        for line in sort_by_verdict(lines)
        if (parts := describe_parts(comparison, line))
    ]


def describe_parts(comparison: Comparison, line: Difference) -> str:
    """What decides a gated line: the behaviours, and the kinds of performers, in which the sides differ.

    "" where the line has no parts.
    """
    parts = parts_of(comparison, line)
    of_performers = [part for part in parts if part.part.endswith(" performers")]
    behaviours = [part for part in parts if part not in of_performers]
    kinds = ("behaviour", behaviours), ("group of performers", of_performers)
    return "; ".join(_describe_kind(name, kind) for name, kind in kinds if kind)


def _describe_kind(name: str, parts: Sequence[Difference]) -> str:
    differing = [part for part in parts if part.verdict in ("worse", "better")]
    if not differing:
        if all(part.verdict == "same" for part in parts):
            return f"the same for {list_first([_part_name(part) for part in parts])}"
        largest = max(parts, key=lambda part: abs(part.difference))
        change = format_change_percent(percent_of_a(largest, largest.difference))
        few = all(len(part.units) < MIN_UNITS for part in parts)
        told = f"has {MIN_UNITS} units, which a verdict needs" if few else "shows a difference"
        return f"no {name} alone {told}, the largest is {change} for {_part_name(largest)}"
    texts = []
    for verdict in ("worse", "better"):
        names = [_part_name(part) for part in differing if part.verdict == verdict]
        texts += [f"{verdict} for {list_first(names)}"] if names else []
    rest = [part.verdict for part in parts if part not in differing]
    if rest:
        texts.append("the same elsewhere" if set(rest) == {"same"} else "no difference shown elsewhere")
    return ", ".join(texts)


def _part_name(part: Difference) -> str:
    name = part.part.removesuffix(" performers").replace("_", " ")
    return f"{name} ({count_units(part.units)})"


def parts_of(comparison: Comparison, line: Difference) -> list[Difference]:
    """The parts of a gated line."""
    name = line.method, line.group, line.metric
    return [part for part in comparison.differences if part.part and (part.method, part.group, part.metric) == name]


def count_verdicts(lines: Sequence[Difference]) -> dict[Verdict, int]:
    """Verdict -> number of lines, the most important verdict first."""
    counts = Counter(line.verdict for line in lines)
    return {kind: counts[kind] for kind in MARKS}


def sort_by_verdict(lines: Sequence[Difference]) -> list[Difference]:
    """The lines sorted by verdict, worse ones first; lines of one verdict keep their order."""
    order = list(MARKS)
    return sorted(lines, key=lambda line: order.index(line.verdict))


def line_title(line: Difference) -> str:
    """Method and metric of a line."""
    return f"{line.method} {line.metric}"


def clips_of(lines: Sequence[Difference]) -> list[str]:
    """The clips of all lines, sorted."""
    return sorted({clip for line in lines for clip in line.clips})


def groups_vary(comparison: Comparison) -> bool:
    """Whether lines differ in inputs or split, so that each must name its group."""
    return len({line.group for line in comparison.differences}) > 1


def listed_issues(comparison: Comparison) -> dict[str, tuple[str, ...]]:
    """Title -> what prevents a comparison, or was allowed; empty lists are left out."""
    issues = {
        "Inputs that differ": comparison.inputs_that_differ,
        "Cells only in A": comparison.only_a,
        "Cells only in B": comparison.only_b,
        "Coverage": comparison.coverage,
        "Failed cells": comparison.failed,
        "Allowed": comparison.allowed,
    }
    return {title: texts for title, texts in issues.items() if texts}


def excerpt_pair(a: str, b: str, letters: int) -> tuple[str, str]:
    """Two texts in one line of at most `letters` characters each, cut to where they begin to differ."""
    a, b = (" ".join(text.split()) for text in (a, b))
    same = next((n for n, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    start = max(0, same - letters // 3) if max(len(a), len(b)) > letters else 0
    return _excerpt(a, start, letters), _excerpt(b, start, letters)


def _excerpt(text: str, start: int, letters: int) -> str:
    excerpt = text[start : start + letters]
    return ("…" if start else "") + excerpt + ("…" if start + letters < len(text) else "")


def percent_of_a(line: Difference, value: float | None) -> float:
    """A value in per cent of A's mean; NaN where there is no value or A's mean is zero."""
    return math.nan if value is None or not line.mean_a else 100.0 * value / abs(line.mean_a)


def format_mean(line: Difference, value: float) -> str:
    """A mean with the decimals of the line."""
    return format_fixed(value, _decimals(line), grouped=True)


def format_signed(line: Difference, value: float | None) -> str:
    """A difference with its sign and the decimals of the line; a dash for None."""
    return "–" if value is None else format_fixed(value, _decimals(line), signed=True, grouped=True)


def format_margin(line: Difference) -> str:
    """The margin with the decimals of the line, or more where it would seem to be zero."""
    return format_fixed(line.margin, max(_decimals(line), decimals_for(line.margin, most=6)), grouped=True)


def line_interval(line: Difference) -> Interval:
    """The difference with its 95 % interval. What is below a hundredth of the margin counts as 0."""
    least = _LEAST_SHARE * line.margin
    value, low, high = (
        0.0 if number is not None and abs(number) < least else number
        for number in (line.difference, line.low, line.high)
    )
    return Interval.of(value, low, high, signed=True)


def clip_steps(line: Difference) -> list[tuple[str, float]]:
    """Each clip with its difference B - A."""
    return [(clip, b - a) for clip, a, b in zip(line.clips, line.a, line.b, strict=True)]


def rise_is_worse(metric: str) -> bool:
    """Whether larger values of the metric are worse, as for errors; not so for frames per second."""
    return metric not in MARGINS or MARGINS[metric].rise_is_worse


def count_directions(line: Difference) -> tuple[int, int, int]:
    """Number of clips whose value rises, falls and stays from A to B."""
    steps = [step for _, step in clip_steps(line)]
    return sum(step > 0 for step in steps), sum(step < 0 for step in steps), sum(step == 0 for step in steps)


def _decimals(line: Difference) -> int:
    """Decimals that show two digits of the interval's width, or of the margin where that is a hundred times as wide."""
    width = line.high - line.low if line.low is not None and line.high is not None else 0.0
    narrow = width <= _LEAST_SHARE * line.margin
    return decimals_for(line.margin if narrow else width, digits=2, most=6)
