"""Frames from pose reports: sensors become stations, and times count from the first report."""

import math
from collections.abc import Sequence

import numpy as np

from harness.stream.frame import TrackerFrame
from harness.stream.vrpn.messages import PoseReport

_PERIODS_PER_FRAME = 1.5
"""Longest time between the measurements of one frame, in periods."""
_CLOCK_RESET_S = 1.0
"""A larger step back of the server's clock is a reset [s]; the device time then goes on by the host's clock."""
_NORM_TOLERANCE = 1e-9
"""A quaternion this near to norm 1 keeps the digits that were sent."""


class ReportFrames:
    """Joins reports to frames of the S sensors.

    A frame closes when every sensor has reported, when one reports again, and after 1.5 periods. A report that repeats
    time and pose of the sensor's last one is a redundant copy and belongs to no frame. A report that is not later than
    the sensor's last one is suspect.
    """

    def __init__(self, sensors: Sequence[int], rate_hz: float) -> None:
        self.counts = dict.fromkeys(("frames", "records", "copies", "other_sensors", "clock_resets"), 0)
        self.start_us: int | None = None
        """Time of the first report, since 1970 [us]: the zero of `measured_s`."""
        self._rows = {sensor: row for row, sensor in enumerate(sensors)}
        self._longest_s = _PERIODS_PER_FRAME / rate_hz
        self._reports: dict[int, tuple[PoseReport, float, bool]] = {}
        """Reports of the open frame, with their times and whether they are suspect, by row."""
        self._began_s = 0.0
        """Host clock at the first report of the open frame [s]."""
        self._newest: dict[int, PoseReport] = {}
        self._received_s = -math.inf
        self._latest_s, self._latest_host_s = -math.inf, 0.0

    def add(self, report: PoseReport, now_s: float) -> list[TrackerFrame]:
        """Take a report that was received at a time of the host's clock [s]; return the frames that it completes."""
        row = self._rows.get(report.sensor)
        if row is None:
            self.counts["other_sensors"] += 1
            return []
        self.counts["records"] += 1
        before = self._newest.get(row)
        if report == before:
            self.counts["copies"] += 1
            return []
        measured_s, reset = self._measured_s(report, now_s)
        suspect = before is not None and report.time_us <= before.time_us and not reset
        self._newest[row] = report
        frames = []
        if self._reports:
            first_s = next(iter(self._reports.values()))[1]
            if row in self._reports or abs(measured_s - first_s) > self._longest_s:
                frames.append(self._close(now_s))
        if not self._reports:
            self._began_s = now_s
        self._reports[row] = report, measured_s, suspect
        if len(self._reports) == len(self._rows):
            frames.append(self._close(now_s))
        return frames

    def expire(self, now_s: float) -> list[TrackerFrame]:
        """Return the open frame if it is overdue."""
        overdue = bool(self._reports) and now_s - self._began_s > self._longest_s
        return [self._close(now_s)] if overdue else []

    def _measured_s(self, report: PoseReport, now_s: float) -> tuple[float, bool]:
        """Time of a report since the first one [s], and whether the server's clock was reset before it."""
        if self.start_us is None:
            self.start_us = report.time_us
        measured_s = 1e-6 * (report.time_us - self.start_us)
        reset = measured_s < self._latest_s - _CLOCK_RESET_S
        if reset:
            self.counts["clock_resets"] += 1
            self._newest.clear()
            advance_s = self._latest_s + max(now_s - self._latest_host_s, 1e-6)
            self.start_us -= round(1e6 * (advance_s - measured_s))
            measured_s = 1e-6 * (report.time_us - self.start_us)
        if measured_s >= self._latest_s:
            self._latest_s, self._latest_host_s = measured_s, now_s
        return measured_s, reset

    def _close(self, now_s: float) -> TrackerFrame:
        count = len(self._rows)
        measured_s, suspect = np.full(count, np.nan), np.zeros(count, dtype=bool)
        position_m, quaternion = np.full((count, 3), np.nan), np.full((count, 4), np.nan)
        for row, (report, at_s, doubtful) in self._reports.items():
            measured_s[row], suspect[row] = at_s, doubtful
            if all(map(math.isfinite, report.position_m)):
                position_m[row] = report.position_m
            norm = math.hypot(*report.quaternion)
            if 0.5 < norm < 2.0:
                kept = abs(norm - 1.0) <= _NORM_TOLERANCE
                quaternion[row] = report.quaternion if kept else np.array(report.quaternion) / norm
        self._reports = {}
        self._received_s = max(now_s, float(np.nextafter(self._received_s, np.inf)))
        self.counts["frames"] += 1
        position_valid, orientation_valid = ~np.isnan(position_m[:, 0]), ~np.isnan(quaternion[:, 0])
        return TrackerFrame(
            received_s=self._received_s,
            measured_s=measured_s,
            position_m=position_m,
            tracker_from_station=quaternion,
            position_valid=position_valid,
            orientation_valid=orientation_valid,
            quality=(position_valid | orientation_valid).astype(float),
            suspect=suspect,
        )
