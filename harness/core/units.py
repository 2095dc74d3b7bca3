"""Units of length, time and angle, by the names that files and people give them."""

import math

from harness.errors import BadInput

LENGTH_UNITS_M = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254, "ft": 0.3048}
"""Unit of length -> metres."""
TIME_UNITS_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "100ns": 1e-7, "ns": 1e-9}
"""Unit of time -> seconds."""
ANGLE_UNITS_RAD = {"deg": math.pi / 180.0, "rad": 1.0}
"""Unit of angle -> radians."""
_WORDS = {
    **{"metre": "m", "meter": "m", "millimetre": "mm", "millimeter": "mm", "centimetre": "cm", "centimeter": "cm"},
    **{"inche": "in", "inch": "in", "feet": "ft", "foot": "ft"},
    **{"sec": "s", "second": "s", "msec": "ms", "millisecond": "ms", "usec": "us", "microsecond": "us", "µ": "us"},
    **{"nsec": "ns", "nanosec": "ns", "nanosecond": "ns", "μ": "us", "milli": "ms", "micro": "us", "nano": "ns"},
    **{"degree": "deg", "°": "deg", "radian": "rad", "sekunde": "s", "sekunden": "s", "millisekunden": "ms"},
}


def find_unit(text: str, units: dict[str, float]) -> str:
    """The name in `units` that a text such as "mm", "Millimeters" or "[s]" stands for; "" for no such unit."""
    word = text.strip(" []().").lower()
    if word in units:
        return word
    word = _WORDS.get(word.removesuffix("s"), "")
    return word if word in units else ""


def parse_length_unit(text: str) -> float:
    """Metres of a unit of length, which is named or given as a number of metres. Raises BadInput."""
    name = find_unit(text, LENGTH_UNITS_M)
    try:
        metres = LENGTH_UNITS_M[name] if name else float(text)
    except ValueError:
        metres = math.nan
    if not 0.0 < metres < math.inf:
        raise BadInput(f"Unit {text!r}.", f"Name one of {', '.join(LENGTH_UNITS_M)}, or give its length in metres.")
    return metres
