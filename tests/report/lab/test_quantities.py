"""Numbers of the lab's pages: units, decimals from the interval, and words for numbers that were not measured."""

import math

import pytest

from harness.core.number_format import Interval
from harness.measure import NOISE_KEYS, TIMING_KEYS
from harness.measure.reports import STATION_FIGURES
from harness.report.lab.quantities import Quantity, find_quantity
from harness.study.trust.characterization import preset_values


def test_every_number_that_is_measured_has_a_name() -> None:
    keys = (*preset_values(), *NOISE_KEYS, *TIMING_KEYS, *(f"station.{name}" for name in STATION_FIGURES))
    assert [key for key in keys if find_quantity(key).label == key] == []


def test_numbers_are_shown_in_the_unit_of_their_key() -> None:
    assert find_quantity("components.white.position_m").exact(0.00075) == "0.75 mm"
    assert find_quantity("components.drift.pitch_roll_rad").exact(math.radians(0.25)) == "0.25 deg"
    assert find_quantity("components.echo.share").exact(0.03) == "3 %"
    assert find_quantity("components.speed.ahead_s").exact(0.002) == "2 ms"


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
    found = find_quantity(key)
    assert (found.label, found.unit) == (key, unit)
    assert found.title == (f"{key} [{unit}]" if unit else key)


def test_an_interval_is_scaled_to_the_unit_of_its_key() -> None:
    length = Quantity("length", "mm", 1e3)
    number = Interval(0.0015, 0.0014, 0.0016)
    assert (str(length.of(number)), length.bare(number).number) == ("1.5 mm (1.4 to 1.6)", "1.5")
    assert str(length.of(Interval.missing("no events"))) == "not measured"
    assert (length.exact(0.0), length.exact(1234.56)) == ("0 mm", "1,235,000 mm")
