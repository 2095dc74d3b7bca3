"""Names of units, as files and people write them."""

import pytest

from harness.core.units import LENGTH_UNITS_M, TIME_UNITS_S, find_unit, parse_length_unit
from harness.errors import BadInput


@pytest.mark.parametrize(
    ("text", "name"),
    [
        *[("mm", "mm"), ("Millimeters", "mm"), ("metres", "m"), ("[m]", "m"), ("CM", "cm"), ("inches", "in")],
        *[("inch", "in"), ("feet", "ft"), ("m s^-1", ""), ("rad", ""), ("", "")],
    ],
)
def test_units_of_length(text: str, name: str) -> None:
    assert find_unit(text, LENGTH_UNITS_M) == name


@pytest.mark.parametrize(
    ("text", "name"),
    [*[("Seconds", "s"), ("sec", "s"), ("msec", "ms"), ("µs", "us"), ("usec", "us"), ("[ns]", "ns"), ("mm", "")]],
)
def test_units_of_time(text: str, name: str) -> None:
    assert find_unit(text, TIME_UNITS_S) == name


def test_a_unit_is_a_name_or_a_number_of_metres() -> None:
    assert [parse_length_unit(text) for text in ("mm", "0.0254", "Inches", "1e-3")] == [0.001, 0.0254, 0.0254, 0.001]
    for text in ("furlong", "0", "-1", "nan", "inf", "s"):
        with pytest.raises(BadInput, match=r"Name one of m, mm, cm, in, ft, or give its length in metres\."):
            parse_length_unit(text)
