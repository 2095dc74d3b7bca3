"""Frames in numbers: counts of what stations reported, a summary of a stream, and rows for other programs."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.csv_text import csv_line
from harness.core.number_format import format_fixed, format_share
from harness.core.text_table import Table
from harness.stream.frame import TrackerFrame


class StationCounts:
    """Counts (S,) over any number of frames; those of one second, of a recording or of a capture."""

    def __init__(self, stations: int) -> None:
        self.frames = 0
        self.records = np.zeros(stations, dtype=np.int64)
        self.positions, self.orientations, self.readings, self.suspect = (self.records.copy() for _ in range(4))
        """Frames with a valid position, with a valid orientation, with either, and with a suspect record."""
        self.quality: Floats = np.zeros(stations)
        """Sum of the quality over frames with a reading."""

    def add(self, frame: TrackerFrame) -> None:
        """Count a frame."""
        valid = frame.position_valid | frame.orientation_valid
        self.frames += 1
        self.records += ~np.isnan(frame.measured_s) | valid
        self.positions += frame.position_valid
        self.orientations += frame.orientation_valid
        self.readings += valid
        self.suspect += frame.suspect
        self.quality += np.where(valid, frame.quality, 0.0)

    @property
    def mean_quality(self) -> Floats:
        """(S,) mean quality over all frames, where one without a reading counts as 0; 0 without frames."""
        out: Floats = self.quality / max(self.frames, 1)
        return out

    @property
    def loss(self) -> Floats:
        """(S,) share of the frames without a reading; 1 without frames."""
        out: Floats = 1.0 - self.readings / max(self.frames, 1)
        return out


class StreamSummary:
    """Statistics over any number of frames."""

    def __init__(self, stations: Sequence[str]) -> None:
        self._stations = tuple(stations)
        self._counts = StationCounts(len(stations))
        self._began_s = self._ended_s = self._longest_gap_s = 0.0

    def add(self, frame: TrackerFrame) -> None:
        """Add a frame to the statistics."""
        if self._counts.frames:
            self._longest_gap_s = max(self._longest_gap_s, frame.received_s - self._ended_s)
        else:
            self._began_s = frame.received_s
        self._ended_s = frame.received_s
        self._counts.add(frame)

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last [s]."""
        return self._ended_s - self._began_s

    def as_dict(self) -> dict[str, Any]:
        """Return the totals, and for each station its counts and mean quality.

        The counts are frames with a record, with a position, with an orientation, and suspect ones.
        """
        counts = self._counts
        columns = (counts.records, counts.positions, counts.orientations, counts.suspect, counts.mean_quality)
        names = ("records", "positions", "orientations", "suspect", "quality")
        by_station = zip(self._stations, zip(*(column.tolist() for column in columns), strict=True), strict=True)
        return {
            "frames": counts.frames,
            "duration_s": self.duration_s,
            "rate_hz": (counts.frames - 1) / self.duration_s if self.duration_s > 0.0 else None,
            "longest_gap_s": self._longest_gap_s,
            "stations": {station: dict(zip(names, row, strict=True)) for station, row in by_station},
        }

    def __str__(self) -> str:
        counts, frames = self._counts, self._counts.frames
        rate = f", {(frames - 1) / self.duration_s:.2f} Hz" if self.duration_s > 0.0 else ""
        head = f"{frames} frames in {self.duration_s:.2f} s{rate}, longest gap {1e3 * self._longest_gap_s:.0f} ms"
        rows = []
        for i, station in enumerate(self._stations):
            seen = (counts.records[i], counts.positions[i], counts.orientations[i])
            shares = [format_share(count / max(frames, 1), 1) for count in seen]
            rows.append([station, *shares, str(counts.suspect[i]), format_fixed(float(counts.mean_quality[i]), 2)])
        table = Table(["station", "with a record", "position", "orientation", "suspect", "mean quality"], rows)
        return "\n".join([head, "", *table.lines()])


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
