"""Formats of numbers: decimals by unit, a true minus sign, no negative zero."""

import math
import re

import numpy as np
import pytest

from harness.core.number_format import (
    Interval,
    count_noun,
    decimals_for,
    format_change_percent,
    format_fixed,
    format_mean_sd,
    format_number,
    format_p_value,
    format_share,
)
from harness.errors import BadInput


@pytest.mark.parametrize(
    ("value", "decimals", "signed", "text"),
    [
        (1234.5, 1, False, "1234.5"),
        (-0.004, 2, False, "0.00"),
        (-0.5, 1, False, "−0.5"),
        (0.5, 1, True, "+0.5"),
        (0.0, 2, True, "0.00"),
        (-1234.0, 0, True, "−1234"),
        (None, 2, False, "not measured"),
    ],
)
def test_fixed_decimals(value: float | None, decimals: int, signed: bool, text: str) -> None:
    assert format_fixed(value, decimals, signed=signed) == text


def test_a_unit_gives_its_decimals() -> None:
    assert format_number(1.234, "deg") == "1.23"
    assert format_number(1.234, "mm") == "1.2"
    assert format_number(1.234, "mm", decimals=2) == "1.23"
    assert format_number(1.234, "unknown") == "1.23"
    assert format_number(1234.0, "frames/s") == "1,234"


def test_combined_numbers() -> None:
    assert format_mean_sd(1.5, 0.25, 2) == "1.50 ± 0.25"
    assert format_mean_sd(1.5, None, 2) == "1.50"
    assert format_mean_sd(None, None, 2) == "not measured"
    assert format_share(0.123, 1) == "12.3 %"
    assert (count_noun(1, "clip"), count_noun(1200, "clip")) == ("1 clip", "1,200 clips")


@pytest.mark.parametrize(
    ("percent", "text"), [(12.3, "+12 %"), (-1.25, "−1.2 %"), (0.05, "+0.05 %"), (0.001, "0 %"), (math.nan, "–")]
)
def test_changes_have_two_significant_digits(percent: float, text: str) -> None:
    assert format_change_percent(percent) == text


def test_p_values() -> None:
    assert [format_p_value(p) for p in (None, 0.0001, 0.0316)] == ["–", "< 0.001", "0.032"]


@pytest.mark.parametrize(
    ("values", "digits", "decimals"), [((0.3, 0.02), 1, 2), ((12.0,), 1, 0), ((0.03,), 2, 3), ((0.0, None), 1, 0)]
)
def test_decimals_show_the_smallest_value(values: tuple[float | None, ...], digits: int, decimals: int) -> None:
    assert decimals_for(*values, digits=digits) == decimals


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
        (Interval(39.9992, 39.999199, 39.999201), "39.9992 (± 0.000001)"),
        (Interval(0.0, -3e-14, 3e-14, unit="ms"), "0 ms"),
        (Interval(2e-14, -3e-14, 5e-14, unit="deg"), "0 deg"),
        (Interval(-12345.0, -12345.0003, -12344.9997, unit="ms"), "−12,345 ms (± 0.0003)"),
        (Interval(-0.1, -0.1, -0.1 + 1e-16, signed=True), "−0.1"),  # a width of rounding alone
        (Interval(-12345.0, -12345.0 - 1e-9, -12345.0 + 1e-9, unit="ms"), "−12,345 ms"),
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


def test_no_interval_has_ends_that_read_alike_or_a_negative_zero(rng: np.random.Generator) -> None:
    for _ in range(2000):
        value = float(rng.choice([-1.0, 0.0, 1.0]) * 10.0 ** rng.uniform(-8.0, 8.0))
        below, above = (float(each) for each in rng.choice([0.0, 1.0], 2) * 10.0 ** rng.uniform(-16.0, 8.0, 2))
        text = str(Interval(value, value - below, value + above, unit="ms", signed=bool(rng.integers(2))))
        ends = re.search(r"\((.+) to (.+)\)", text)
        assert ends is None or ends[1] != ends[2], text
        assert not re.search(r"[−+]0(\.0*)?(?![\d.])", text), text
        assert not re.search(r"± 0(\.0*)?\)", text), text
