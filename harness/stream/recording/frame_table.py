"""Frames as a table for other programs: one row for each station of each frame."""

from collections.abc import Iterator, Sequence
from typing import Any

from harness.core.csv_text import csv_line
from harness.stream.frame import TrackerFrame

FRAME_COLUMNS = (
    "received_s",
    "wall_s",
    "station",
    "measured_s",
    "x_m",
    "y_m",
    "z_m",
    "qw",
    "qx",
    "qy",
    "qz",
    "position_valid",
    "orientation_valid",
    "quality",
    "suspect",
)


def frame_rows(frame: TrackerFrame, stations: Sequence[str], wall_s: float) -> Iterator[dict[str, Any]]:
    """Yield one row per station, keyed by `FRAME_COLUMNS`; None for numbers that are missing or not valid."""
    for i, station in enumerate(stations):
        numbers = (frame.measured_s[i], *frame.position_m[i], *frame.tracker_from_station[i])
        values = (
            frame.received_s,
            wall_s,
            station,
            *(None if number != number else float(number) for number in numbers),
            bool(frame.position_valid[i]),
            bool(frame.orientation_valid[i]),
            float(frame.quality[i]),
            bool(frame.suspect[i]),
        )
        yield dict(zip(FRAME_COLUMNS, values, strict=True))


def format_csv_row(row: dict[str, Any]) -> str:
    """Format a row as a CSV line.

    Floats have full precision, so that they read back unchanged. Booleans are 1 and 0.
    """
    values = (row[name] for name in FRAME_COLUMNS)
    return csv_line(int(value) if isinstance(value, bool) else value for value in values)[:-1]
