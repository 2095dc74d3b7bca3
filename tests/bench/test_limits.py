"""A value against its limits: what is met, what has no verdict, and keys of earlier files."""

import math

import pytest

from harness.bench.limits import hold_to_limit, state_verdict
from harness.core.fields import build
from harness.results.findings import BenchmarkStatement, Verdict


@pytest.mark.parametrize(
    ("value", "least", "most", "target", "verdict"),
    [
        (3.0, 3.0, None, ">= 3", "met"),
        (2.9, 3.0, None, ">= 3", "missed"),
        (5.0, None, 5.0, "<= 5", "met"),
        (5.1, None, 5.0, "<= 5", "missed"),
        (0.0, None, 0.0, "0", "met"),
        (1.0, None, 0.0, "0", "missed"),
        (1.0, None, None, "", ""),
        (math.nan, None, 5.0, "<= 5", "no verdict"),
        (math.inf, None, 5.0, "<= 5", "no verdict"),
        (math.nan, None, None, "", ""),
    ],
)
def test_a_value_is_met_missed_or_has_no_verdict(
    value: float, least: float | None, most: float | None, target: str, verdict: Verdict
) -> None:
    found = hold_to_limit("a", value, "ms", least=least, most=most)
    assert (found.target, found.verdict) == (target, verdict)
    assert found.value == (value if math.isfinite(value) else None)
    assert (found.measured == "not measured") == (found.value is None)
    assert found.why == ("nothing was measured" if verdict == "no verdict" else "")


@pytest.mark.parametrize(
    ("value", "least", "most", "measured"),
    [
        (7.996, 8.0, None, "7.996 x"),
        (1.0004, None, 1.0, "1.0004 x"),
        (99.99999, 100.0, None, "99.99999 x"),
        (100.4, None, 100.0, "100.4 x"),
        (8.004, 8.0, None, "8 x"),
        (1234.4, None, 2000.0, "1,234 x"),
        (0.0125, None, 1.0, "0.0125 x"),
    ],
)
def test_a_value_has_the_digits_that_show_its_verdict(
    value: float, least: float | None, most: float | None, measured: str
) -> None:
    assert hold_to_limit("a", value, "x", least=least, most=most).measured == measured


def test_a_doubt_takes_the_verdict_of_targets_alone() -> None:
    assert hold_to_limit("a", 9.0, most=5.0, doubt="busy").verdict == "no verdict"
    assert hold_to_limit("a", 9.0, most=5.0, doubt="busy").why == "busy"
    assert hold_to_limit("a", 9.0, doubt="busy").why == ""


@pytest.mark.parametrize(("met", "verdict"), [(True, "met"), (False, "missed"), (None, "no verdict")])
def test_a_statement_in_words(met: bool | None, verdict: Verdict) -> None:
    assert state_verdict("a", "none", "two", met).verdict == verdict
    assert state_verdict("a", "", "two", met).verdict == ""


def test_keys_of_earlier_files_are_read() -> None:
    earlier = {"text": "a", "published": "1 deg", "ours": "2 deg", "verdict": "not reproduced", "difference": 2.0}
    found = build(BenchmarkStatement, earlier, "claim")
    assert found == BenchmarkStatement("a", "1 deg", "2 deg", "not reproduced", value=2.0)


def test_entries_for_programs_are_beside_the_others() -> None:
    content = hold_to_limit("a", 2.0, most=5.0, more={"fps": 7.0}).as_dict()
    assert (content["fps"], content["text"], content["verdict"]) == (7.0, "a", "met")
    assert "more" not in content
