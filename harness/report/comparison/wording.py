"""A comparison in words: what it comes to in one sentence, its counts, and figures with the decimals that they need."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import get_args

from harness.compare.comparison import Comparison, Difference, Verdict
from harness.compare.margins import MARGINS
from harness.errors import Outcome
from harness.report.paper.verdicts import MINUS

KINDS: tuple[Verdict, ...] = get_args(Verdict)
MARKS: Mapping[Verdict, str] = {"worse": "✗", "cannot tell": "?", "better": "✓", "same": "="}
"""In the order of what a reader must know first."""
MEANINGS: Mapping[Verdict, str] = {
    "worse": "p after Holm is at most 0.05, the 95 % interval excludes zero, and the mean is worse by more than the "
    "margin",
    "cannot tell": "neither: too few clips, or clips that disagree too much for so small a margin",
    "better": "as worse, the other way round",
    "same": "the whole 95 % interval lies within the margin",
}
OUTCOME_TITLES: Mapping[Outcome, str] = {
    Outcome.PASS: "Pass",
    Outcome.REGRESSED: "Regressed",
    Outcome.NOT_COMPARABLE: "Not comparable",
    Outcome.INCOMPLETE: "Incomplete",
}
_MOST_NAMED, _MOST_DECIMALS = 3, 6


def sentence(comparison: Comparison) -> str:
    """What a reader should know first."""
    gated = [line for line in comparison.differences if line.gated]
    counts = count_verdicts(gated)
    over = f"{_count_noun(len(gated), 'gated line')} on {_count_noun(len(clips_of(gated)), 'clip')}"
    match comparison.outcome:
        case Outcome.REGRESSED:
            worse = [
                f"{line_title(line)} {format_percent(percent_of_a(line, line.difference))}"
                for line in gated
                if line.verdict == "worse"
            ]
            return f"B is worse than A in {counts['worse']} of {over}: {list_first(worse)}."
        case Outcome.PASS:
            return f"B is no worse than A: of {over} {counts['same']} are the same and {counts['better']} better."
        case _:
            return f"Whether B is worse than A cannot be told: {comparison.why.rstrip('.')}."


def count_verdicts(lines: Sequence[Difference]) -> dict[Verdict, int]:
    """How many have each verdict, those that must be known first in front."""
    counts = Counter(line.verdict for line in lines)
    return {kind: counts[kind] for kind in MARKS}


def sort_by_verdict(lines: Sequence[Difference]) -> list[Difference]:
    """Worse ones first, then as they came."""
    places = list(MARKS)
    return sorted(lines, key=lambda line: places.index(line.verdict))


def line_title(line: Difference) -> str:
    return f"{line.method} {line.metric}"


def clips_of(lines: Sequence[Difference]) -> list[str]:
    """All on which anything was compared."""
    return sorted({clip for line in lines for clip in line.clips})


def groups_vary(comparison: Comparison) -> bool:
    """Whether lines must say which group of inputs, split and performer they are of."""
    return len({line.group for line in comparison.differences}) > 1


def listed_issues(comparison: Comparison) -> dict[str, tuple[str, ...]]:
    """Title -> what hinders a comparison or was let pass; those that hold anything."""
    found = {
        "Inputs that differ": comparison.inputs_that_differ,
        "Cells in A alone": comparison.only_a,
        "Cells in B alone": comparison.only_b,
        "Coverage": comparison.coverage,
        "Failed cells": comparison.failed,
        "Allowed": comparison.allowed,
    }
    return {title: texts for title, texts in found.items() if texts}


def excerpt_pair(a: str, b: str, letters: int) -> tuple[str, str]:
    """Two long texts on a line each, cut to where they begin to differ."""
    a, b = (" ".join(text.split()) for text in (a, b))
    alike = next((n for n, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    start = max(0, alike - letters // 3) if max(len(a), len(b)) > letters else 0
    return _excerpt(a, start, letters), _excerpt(b, start, letters)


def _excerpt(text: str, start: int, letters: int) -> str:
    shown = text[start : start + letters]
    return ("…" if start else "") + shown + ("…" if start + letters < len(text) else "")


def list_first(names: Sequence[str], most: int = _MOST_NAMED) -> str:
    """The first few, and how many more."""
    more = f" and {len(names) - most:,} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def percent_of_a(line: Difference, value: float | None) -> float:
    """In percent of A's mean; NaN where there is no value or A's mean is zero."""
    return math.nan if value is None or not line.mean_a else 100.0 * value / abs(line.mean_a)


def format_mean(line: Difference, value: float) -> str:
    return f"{value:,.{_decimals(line)}f}".replace("-", MINUS)


def format_signed(line: Difference, value: float | None) -> str:
    """A difference, with the decimals that its interval needs."""
    if value is None:
        return "–"
    text = f"{value:+,.{_decimals(line)}f}"
    return (text if text.strip("+-0.,") else text.lstrip("+-")).replace("-", MINUS)


def format_interval(line: Difference) -> str:
    return "–" if line.low is None else f"{format_signed(line, line.low)} to {format_signed(line, line.high)}"


def format_percent(value: float) -> str:
    """A share with two digits that count."""
    if math.isnan(value):
        return "–"
    size = abs(value)
    text = f"{value:+,.{0 if size >= 9.95 else 1 if size >= 0.0995 else 2}f} %"
    return (text if text.strip("+-0.% ") else "0 %").replace("-", MINUS)


def format_p_value(value: float | None) -> str:
    if value is None:
        return "–"
    return "< 0.001" if value < 0.0005 else f"{value:.3f}"


def clip_steps(line: Difference) -> list[tuple[str, float]]:
    """B - A of each clip."""
    return [(clip, b - a) for clip, a, b in zip(line.clips, line.a, line.b, strict=True)]


def rise_is_worse(metric: str) -> bool:
    """As of an error; frames per second are another matter."""
    return metric not in MARGINS or MARGINS[metric].rise_is_worse


def count_directions(line: Difference) -> tuple[int, int, int]:
    """Clips whose figure went up, down and nowhere from A to B."""
    steps = [step for _, step in clip_steps(line)]
    return sum(step > 0 for step in steps), sum(step < 0 for step in steps), sum(step == 0 for step in steps)


def _decimals(line: Difference) -> int:
    """So many that the interval's width has two digits, or without one the lesser of difference and margin."""
    width = line.high - line.low if line.low is not None and line.high is not None else 0.0
    sizes = (width,) if width > 1e-3 * line.margin else (abs(line.difference), line.margin)
    finest = min((size for size in sizes if size > 0.0), default=1.0)
    return min(_MOST_DECIMALS, max(0, 1 - math.floor(math.log10(finest))))


def _count_noun(count: int, what: str) -> str:
    return f"{count:,} {what}{'s'[: count != 1]}"
