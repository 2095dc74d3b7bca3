"""What a stream was like, station by station: for whoever has a device on the bench."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import format_fixed, format_share
from harness.core.text_table import Table
from harness.stream.frame import TrackerFrame


class StreamSummary:
    """Counts over frames, however many there are."""

    def __init__(self, stations: Sequence[str]) -> None:
        self._stations = tuple(stations)
        self._frames = 0
        self._began_s = self._ended_s = self._longest_s = 0.0
        self._came = np.zeros(len(stations), dtype=np.int64)
        self._placed, self._turned, self._suspect = self._came.copy(), self._came.copy(), self._came.copy()
        self._quality: Floats = np.zeros(len(stations))

    def add(self, frame: TrackerFrame) -> None:
        if self._frames:
            self._longest_s = max(self._longest_s, frame.received_s - self._ended_s)
        else:
            self._began_s = frame.received_s
        self._ended_s = frame.received_s
        self._frames += 1
        self._came += ~np.isnan(frame.measured_s) | frame.position_valid | frame.orientation_valid
        self._placed += frame.position_valid
        self._turned += frame.orientation_valid
        self._suspect += frame.suspect
        self._quality += frame.quality

    @property
    def duration_s(self) -> float:
        """From the first frame to the last [s]."""
        return self._ended_s - self._began_s

    def as_dict(self) -> dict[str, Any]:
        """Per station: frames with a record, with a position, with an orientation, under suspicion; mean quality."""
        columns = (self._came, self._placed, self._turned, self._suspect, self._quality / max(self._frames, 1))
        names = ("records", "positions", "orientations", "suspect", "quality")
        by_station = zip(self._stations, zip(*(column.tolist() for column in columns), strict=True), strict=True)
        return {
            "frames": self._frames,
            "duration_s": self.duration_s,
            "rate_hz": (self._frames - 1) / self.duration_s if self.duration_s > 0.0 else None,
            "longest_gap_s": self._longest_s,
            "stations": {station: dict(zip(names, row, strict=True)) for station, row in by_station},
        }

    def __str__(self) -> str:
        rate = f", {(self._frames - 1) / self.duration_s:.2f} Hz" if self.duration_s > 0.0 else ""
        head = f"{self._frames} frames in {self.duration_s:.2f} s{rate}, longest gap {1e3 * self._longest_s:.0f} ms"
        rows = []
        for i, station in enumerate(self._stations):
            came, placed, turned = (
                format_share(count[i] / max(self._frames, 1), 1) for count in (self._came, self._placed, self._turned)
            )
            quality = self._quality[i] / max(self._frames, 1)
            rows.append([station, came, placed, turned, str(self._suspect[i]), format_fixed(quality, 2)])
        table = Table(["station", "with a record", "position", "orientation", "suspect", "mean quality"], rows)
        return "\n".join([head, "", *table.lines()])
