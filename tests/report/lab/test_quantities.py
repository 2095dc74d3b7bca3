"""Numbers of the lab's pages: units, decimals from the interval, and words for numbers that were not measured."""

import math

import pytest

from harness.core.interval import Interval
from harness.measure.gauss_markov import NOISE_KEYS
from harness.measure.timing import TIMING_KEYS
from harness.report.lab.quantities import (
    Quantity,
    format_both,
    format_ends,
    format_plain,
    format_value,
    is_known,
    measured_decimals,
    quantity,
)
from harness.report.lab.unit_content import STATION_FIGURES
from harness.study.trust.expected_values import preset_values


def test_every_number_that_is_measured_has_a_name() -> None:
    assert [key for key in (*preset_values(), *NOISE_KEYS, *TIMING_KEYS) if not is_known(key)] == []
    assert all(is_known(f"station.{name}") for name in STATION_FIGURES)


def test_numbers_are_shown_in_the_unit_of_their_key() -> None:
    assert format_plain(0.00075, quantity("components.white.position_m")) == "0.75 mm"
    assert format_plain(math.radians(0.25), quantity("components.drift.pitch_roll_rad")) == "0.25 deg"
    assert format_plain(0.03, quantity("components.echo.share")) == "3 %"
    assert format_plain(0.002, quantity("components.speed.ahead_s")) == "2 ms"


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("a.b_m", "mm"),
        ("a.b_m.0", "mm"),
        ("a.b_rad", "deg"),
        ("a.b_s.1", "s"),
        ("a.b_hz", "Hz"),
        ("a.b_ppm", "ppm"),
        ("a.b_m_min", "mm/min"),
        ("a.b_per_min", "/min"),
        ("a.some_share", "%"),
        ("a.count", ""),
    ],
)
def test_an_unknown_key_is_its_own_name_with_the_unit_of_its_end(key: str, unit: str) -> None:
    found = quantity(key)
    assert (found.label, found.unit) == (key, unit)
    assert found.title == (f"{key} [{unit}]" if unit else key)


def test_the_interval_sets_the_decimals() -> None:
    length = Quantity("length", "mm", 1e3)
    assert format_both(Interval(0.0015, 0.0014, 0.0016), length) == "1.50 mm (1.40 to 1.60)"
    assert format_both(Interval(0.0015, 0.0005, 0.0025), length) == "1.5 mm (0.5 to 2.5)"
    assert format_value(Interval(1.23456, 1.2, 1.3), length) == "1,235 mm"
    assert format_value(Interval(1.23456, 1.2, 1.3), length, with_unit=False) == "1,235"
    assert measured_decimals(Interval(0.0015, 0.0, math.inf), length) == 1
    assert format_ends(Interval(-0.001, -0.002, math.inf), length) == "−2 to ∞"


def test_at_most_five_digits_of_a_value_are_shown() -> None:
    rate = Quantity("rate", "Hz")
    assert format_both(Interval(39.9992, 39.999199, 39.999201), rate) == "39.999 Hz (39.999 to 39.999)"
    assert format_value(Interval(0.0, 0.0, 5e-5), Quantity("share", "%", 100.0)) == "0 %"


def test_a_number_without_width_is_exact_and_one_that_is_missing_says_so() -> None:
    length = Quantity("length", "mm", 1e3)
    exact = Interval(0.002, 0.002, 0.002)
    assert (format_both(exact, length), format_ends(exact, length)) == ("2 mm", "exact")
    missing = Interval.missing("no events")
    assert (format_value(missing, length), format_ends(missing, length)) == ("not measured", "–")
    assert format_both(missing, length) == "not measured"
    assert format_plain(0.0, length) == "0 mm"
    assert format_plain(1234.56, length) == "1,235,000 mm"
