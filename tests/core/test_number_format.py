"""Formats of numbers: decimals by unit, a true minus sign, no negative zero."""

import math

import pytest

from harness.core.number_format import (
    count_noun,
    decimals_for,
    format_change_percent,
    format_fixed,
    format_mean_sd,
    format_number,
    format_p_value,
    format_share,
)


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
