"""A number with its interval: digits suit the width, and what was not measured says so."""

import math

import pytest

from harness.core.interval import Interval
from harness.errors import BadInput


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (Interval(1.2, 1.19, 1.21, unit="mm"), "1.20 mm (1.19 to 1.21)"),
        (Interval(-12345.08, -12345.31, -12344.85, unit="ms"), "−12,345.08 ms (−12,345.31 to −12,344.85)"),
        (Interval(1.5, 1.4, 1.6), "1.5 (1.4 to 1.6)"),
        (Interval(1.5012, 1.4034, 1.599), "1.501 (1.403 to 1.599)"),
        (Interval(150.3, 100.0, 200.6), "150 (100 to 201)"),
        (Interval(0.3, -0.0001, 0.6, signed=True, unit="deg"), "+0.3 deg (0.0 to +0.6)"),
        (Interval(0.0, 0.0, 5e-3, unit="%"), "0 % (0.000 to 0.005)"),
        (Interval(39.9992, 39.999199, 39.999201), "39.9992 (39.9992 to 39.9992)"),
        (Interval(-1.0, -2.0, math.inf), "−1 (−2 to ∞)"),
        (Interval(2.0, 2.0, 2.0, unit="mm"), "2 mm"),
        (Interval(1.23456), "1.23"),
        (Interval(1.23456, 1.23456, 1.23456), "1.235"),
        (Interval(12345.6), "12,346"),
        (Interval(5e-5), "0.00005"),
        (Interval(-1.234e-7, -1.234e-7, -1.234e-7), "−0.0000001234"),
        (Interval(1.2e7), "12,000,000"),
        (Interval.missing("4 gaps are too few"), "not measured"),
        (Interval.of(None, None, None, "deg"), "not measured"),
        (Interval.of(1.5, None, None, "deg"), "1.5 deg"),
        (Interval.of(1.5, 1.6, 1.7), "1.5 (1.5 to 1.7)"),
        (Interval(0.0015, 0.0014, 0.0016).scaled(1e3, "mm"), "1.5 mm (1.4 to 1.6)"),
    ],
)
def test_digits_suit_the_width(number: Interval, text: str) -> None:
    assert str(number) == text


def test_number_and_ends_stand_apart_in_a_table() -> None:
    number = Interval(1.2, 1.19, 1.21, unit="mm")
    assert (number.number, number.ends) == ("1.20 mm", "1.19 to 1.21")
    assert Interval(0.0, 0.0, 0.0, signed=True).ends == "0 to 0"
    assert (Interval(2.0, 2.0, 2.0).ends, Interval(2.0).ends, Interval.missing("no events").ends) == ("exact", "", "")


def test_an_interval_contains_its_estimate() -> None:
    with pytest.raises(BadInput, match="must contain"):
        Interval(1.0, 2.0, 3.0)
    with pytest.raises(BadInput, match="must contain"):
        Interval(math.nan)
