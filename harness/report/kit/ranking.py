"""A ranking of methods in words, as pages and the terminal print it."""

from collections.abc import Callable

import numpy as np

from harness.compare.ranking import MethodRanking
from harness.compare.units import count_units
from harness.core.number_format import count_noun, format_share
from harness.report.kit.text import list_first

BOLD_NOTE = " Bold: better than every other method, by the rules of harness compare."
"""End of the caption of a table with bold cells."""
LAG_NOTE = "Methods that wait for later frames are ranked apart from causal ones, each lag for itself."
"""Sentence of pages and tables with methods of several lags."""
_MOST_NAMED = 4


def name_lag(lag: int) -> str:
    """A lag in words, such as "a lag of 2 frames"."""
    return f"a lag of {count_noun(lag, 'frame')}"


def describe_ranking(ranking: MethodRanking, where: str, format_error: Callable[[float], str]) -> str:
    """Which method is best, or has the lowest error, and what can be told about the others.

    `where` names the motion, such as "15 clips of 3 performers of built-in motion".
    """
    lowest, error = ranking.lowest, format_error(ranking.means[ranking.lowest])
    if not ranking.results:
        return f"{lowest}: {error} mean joint-angle error on {where}. No other method was measured."
    if ranking.best:
        return f"{lowest} is best: {error} mean joint-angle error on {where}. {_lead(ranking, format_error)}"
    first = f"{lowest} has the lowest mean joint-angle error, {error} on {where}"
    undecided = ranking.others("cannot tell")
    why = ranking.results[undecided[0]].why if undecided else ""
    if len(undecided) == len(ranking.results):
        others = "the other method" if len(undecided) == 1 else f"any of the other {len(undecided)}"
        return f"{first}, but cannot be called better than {others} ({why})."
    parts = [f"{first}."]
    if better := ranking.others("better"):
        parts.append(f"It is better than {list_first(better, _MOST_NAMED)}.")
    if same := ranking.others("same"):
        parts.append(f"The same within the margin: {list_first(same, _MOST_NAMED)}.")
    if undecided:
        parts.append(f"Cannot tell whether it is better than {list_first(undecided, _MOST_NAMED)}: {why}.")
    return " ".join(parts)


def _lead(ranking: MethodRanking, format_error: Callable[[float], str]) -> str:
    """The sentence on how much lower the best error is than the next."""
    (_, best), (second, next_lowest), *_ = ranking.values.items()
    difference, wins = float(np.mean(next_lowest - best)), int(np.sum(best < next_lowest))
    share = format_share(difference / float(next_lowest.mean()))
    counted = count_units(ranking.units)
    return (
        f"That is {format_error(difference)} ({share}) less than {second}, the next, and lower on {wins} of {counted}."
    )
