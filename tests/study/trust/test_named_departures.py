"""Naming of departures after Holm's correction."""

import numpy as np

from harness.compare.significance import holm
from harness.core.number_format import Interval
from harness.study.trust.named_departures import check_departures

EXACT_ONE = Interval(1.0, 1.0, 1.0)


def test_a_departure_is_named_after_the_correction_alone() -> None:
    measured = {(f"key {i}", ""): Interval.normal(1.0, 0.1) for i in range(30)}
    measured["odd", ""] = Interval.normal(1.3, 0.1)  # p = 0.0027, but there are 31 checks
    expected = dict.fromkeys(measured, EXACT_ONE)
    checks = check_departures(measured, expected)
    assert not any(check.is_named for check in checks)
    assert [check.p_holm for check in checks] == holm([check.p for check in checks])
    few = check_departures({key: one for key, one in measured.items() if key[0] in ("odd", "key 1")}, expected)
    assert [check.key for check in few if check.is_named] == ["odd"]


def test_a_station_is_compared_with_the_expectation_of_all() -> None:
    checks = check_departures({("x", "head"): Interval.normal(2.0, 0.1)}, {("x", ""): EXACT_ONE})
    assert checks[0].is_named
    assert checks[0].station == "head"


def test_what_was_not_measured_or_is_not_expected_is_no_check() -> None:
    measured = {("a", ""): Interval.missing("why"), ("b", ""): EXACT_ONE, ("c", ""): EXACT_ONE}
    expected = {("a", ""): EXACT_ONE, ("c", ""): Interval.missing("not in the earlier file")}
    assert check_departures(measured, expected) == []


def test_without_a_fault_one_study_in_twenty_names_something() -> None:
    rng = np.random.default_rng(3)
    named = 0
    for _ in range(400):
        measured = {(str(i), ""): Interval.normal(1.0 + 0.1 * rng.normal(), 0.1) for i in range(40)}
        named += any(check.is_named for check in check_departures(measured, dict.fromkeys(measured, EXACT_ONE)))
    assert 0.02 <= named / 400 <= 0.08
