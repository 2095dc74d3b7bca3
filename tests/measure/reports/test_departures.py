"""Departures against the normal distribution, and measured numbers that contradict themselves."""

import math

import pytest

from harness.core.number_format import Interval
from harness.measure.reports.departures import compare_with_expected


def test_a_difference_of_196_deviations_has_p_of_5_percent() -> None:
    measured = Interval.normal(1.0, 0.1)
    at_the_end = compare_with_expected("x", "", measured, Interval(measured.low, measured.low, measured.low))
    assert at_the_end.p == pytest.approx(0.05)
    assert compare_with_expected("x", "", measured, measured).p == 1.0


def test_the_interval_of_the_expected_number_counts() -> None:
    exact = compare_with_expected("x", "", Interval.normal(2.0, 0.3), Interval.normal(1.0, 0.0))
    uncertain = compare_with_expected("x", "", Interval.normal(2.0, 0.3), Interval.normal(1.0, 0.4))
    assert exact.p == pytest.approx(math.erfc(1.0 / 0.3 / math.sqrt(2.0)))
    assert uncertain.p == pytest.approx(math.erfc(2.0 / math.sqrt(2.0)))


def test_the_side_of_a_skewed_interval_counts() -> None:
    skewed = Interval(1.0, 0.9, 3.0)
    assert skewed.deviation_towards(2.0) == pytest.approx(20.0 * skewed.deviation_towards(0.5))
