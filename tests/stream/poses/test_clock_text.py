"""Dates and times of day as text."""

import pytest

from harness.stream.poses.clock_text import parse_clock


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("10:20:30.25", 37230.25),
        ("0:00:01", 1.0),
        ("1970-01-02T00:00:00Z", 86400.0),
        ("2024/05/01 10:00:00,5", 1714557600.5),
        ("2024-05-01T12:30:00+02:30", 1714557600.0),
        ("2024-05-01T06:30:00-0330", 1714557600.0),
        ("2024-13-01T10:00:00", None),
        ("10:20", None),
        ("a 10:20:30", None),
        ("2024-05-01", None),
    ],
)
def test_a_text_has_a_time(text: str, seconds: float | None) -> None:
    assert parse_clock(text) == seconds
