"""Counts of what the stations of a stream reported: records, readings, suspect ones and quality."""

import numpy as np

from harness.core.arrays import Floats
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
