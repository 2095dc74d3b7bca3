"""Summary of a stream, station by station."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import format_fixed, format_share
from harness.core.text_table import Table
from harness.stream.frame import TrackerFrame


class StreamSummary:
    """Statistics over any number of frames."""

    def __init__(self, stations: Sequence[str]) -> None:
        self._stations = tuple(stations)
        self._frames = 0
        self._began_s = self._ended_s = self._longest_gap_s = 0.0
        self._records = np.zeros(len(stations), dtype=np.int64)
        self._positions, self._orientations = self._records.copy(), self._records.copy()
        self._suspect = self._records.copy()
        self._quality_sum: Floats = np.zeros(len(stations))

    def add(self, frame: TrackerFrame) -> None:
        """Add a frame to the statistics."""
        if self._frames:
            self._longest_gap_s = max(self._longest_gap_s, frame.received_s - self._ended_s)
        else:
            self._began_s = frame.received_s
        self._ended_s = frame.received_s
        self._frames += 1
        self._records += ~np.isnan(frame.measured_s) | frame.position_valid | frame.orientation_valid
        self._positions += frame.position_valid
        self._orientations += frame.orientation_valid
        self._suspect += frame.suspect
        self._quality_sum += frame.quality

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last [s]."""
        return self._ended_s - self._began_s

    def as_dict(self) -> dict[str, Any]:
        """Return the totals, and for each station its counts and mean quality.

        The counts are frames with a record, with a position, with an orientation, and suspect ones.
        """
        columns = (
            self._records,
            self._positions,
            self._orientations,
            self._suspect,
            self._quality_sum / max(self._frames, 1),
        )
        names = ("records", "positions", "orientations", "suspect", "quality")
        by_station = zip(self._stations, zip(*(column.tolist() for column in columns), strict=True), strict=True)
        return {
            "frames": self._frames,
            "duration_s": self.duration_s,
            "rate_hz": (self._frames - 1) / self.duration_s if self.duration_s > 0.0 else None,
            "longest_gap_s": self._longest_gap_s,
            "stations": {station: dict(zip(names, row, strict=True)) for station, row in by_station},
        }

    def __str__(self) -> str:
        rate = f", {(self._frames - 1) / self.duration_s:.2f} Hz" if self.duration_s > 0.0 else ""
        head = f"{self._frames} frames in {self.duration_s:.2f} s{rate}, longest gap {1e3 * self._longest_gap_s:.0f} ms"
        frames, rows = max(self._frames, 1), []
        for i, station in enumerate(self._stations):
            counts = (self._records[i], self._positions[i], self._orientations[i])
            records, positions, orientations = (format_share(count / frames, 1) for count in counts)
            quality = format_fixed(self._quality_sum[i] / frames, 2)
            rows.append([station, records, positions, orientations, str(self._suspect[i]), quality])
        table = Table(["station", "with a record", "position", "orientation", "suspect", "mean quality"], rows)
        return "\n".join([head, "", *table.lines()])
