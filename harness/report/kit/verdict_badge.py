"""Verdicts on a page: a badge of mark and word, and the list of how many cases have each verdict."""

from collections.abc import Mapping
from typing import TypeVar

from harness.report.kit.markup import Markup, tag
from harness.report.kit.text import to_file_name


def verdict_badge(verdict: str, mark: str) -> Markup:
    """A verdict as a mark and a word, so that it does not depend on colour alone."""
    sign = tag("span", mark, aria_hidden="true", class_="mark")
    return tag("span", sign, verdict, class_=f"verdict {to_file_name(verdict)}")


_V = TypeVar("_V", bound=str)


def tally_list(counts: Mapping[_V, int], marks: Mapping[_V, str], meanings: Mapping[_V, str]) -> Markup:
    """For each verdict its count, its badge and its meaning."""
    items = [
        tag("li", tag("b", count), verdict_badge(verdict, marks[verdict]), tag("span", meaning, class_="meaning"))
        for verdict, count in counts.items()
        for meaning in [meanings[verdict]]
    ]
    return tag("ul", *items, class_="tally")
