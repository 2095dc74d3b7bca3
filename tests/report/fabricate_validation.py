"""A made-up validation of a capture: six stations, known offsets, a turned station and a late stream."""

from dataclasses import replace

import numpy as np

from harness.core.number_format import Interval
from harness.core.seeds import generator
from harness.measure.departures import compare_with_expected
from harness.measure.profile import StretchLength
from harness.measure.unit_report import CaptureSummary
from harness.measure.validation_report import (
    ROOM,
    ErrorQuantiles,
    EstimatedPose,
    ResidualSeries,
    StationAccuracy,
    ValidationReport,
)
from tests.report.fabricate_lab import STATIONS, exact, number

NO_STAMPS = "The stream has no stamps."


SCORES: dict[str, dict[str, float | None]] = {
    "ik": {"joint_angle_mean_deg": 5.31, "mpjpe_mm": 41.2},
    "local_pca": {"joint_angle_mean_deg": 3.02, "mpjpe_mm": None},
}


def made_up_validation() -> ValidationReport:
    """A capture with two departures, and something to show in every section."""
    rng = generator(1, "fabricate_validation")
    return ValidationReport(
        name="walk.is900rec",
        capture=CaptureSummary("walk.is900rec", 60.0, STATIONS, 40.0, (StretchLength("motion", 60.0, 14_400),)),
        truth="clip boxing_p1_01, 60.0 s at 120 Hz",
        matched_frames=2390,
        expected_frames=2400,
        expected_from="the preset default",
        numbers={
            "time_offset_orientation_s": Interval(0.0240, 0.0236, 0.0244, 300),
            "time_offset_position_s": Interval(0.0220, 0.0215, 0.0225, 300),
            "position_ahead_s": Interval(0.0020, 0.0014, 0.0026, 300),
            "clock_ratio_ppm": Interval(21.0, 14.0, 28.0, 300),
            "scale": Interval(0.0009, -0.0001, 0.0019, 300),
            "heading_rad": Interval(0.001, -0.009, 0.02, 300),
        },
        poses=tuple(_pose(name, n) for n, name in enumerate((ROOM, *STATIONS))),
        accuracy={station: _accuracy(n) for n, station in enumerate(STATIONS)},
        checks=(
            replace(compare_with_expected("latency_s", "", Interval(0.024, 0.0236, 0.0244), exact(0.004)), p_holm=1e-9),
            replace(
                compare_with_expected("mount_turn_rad", "head", Interval(0.052, 0.047, 0.057), exact(0.0)), p_holm=1e-6
            ),
            replace(compare_with_expected("scale", "", Interval(0.0009, -0.0001, 0.0019), exact(0.0)), p_holm=0.3),
        ),
        residuals=tuple(_residuals(station, rng) for station in STATIONS),
        exchanged=("left_foot and right_foot are exchanged.",),
        notes=("Latency is known to 0.4 ms only if the clocks of both recordings agree.",),
    )


def without_exchange() -> ValidationReport:
    """A capture without a fault."""
    full = made_up_validation()
    return replace(full, exchanged=(), checks=tuple(replace(check, p_holm=1.0) for check in full.checks))


def without_truth_of_time() -> ValidationReport:
    """A capture of which hardly anything could be told."""
    full = made_up_validation()
    missing = {"time_offset_position_s": Interval.missing(NO_STAMPS)}
    return replace(
        full, numbers=missing, poses=(), accuracy={}, checks=(), residuals=(), exchanged=(),
        notes=(),
        capture=replace(full.capture, stretches=()),
    )  # fmt: skip


def _pose(name: str, n: int) -> EstimatedPose:
    position = tuple(Interval(value, value - 0.0015, value + 0.0015, 300) for value in (0.05 * n, -0.02, 2.5 - 0.4 * n))
    body = "" if name == ROOM else f"{name}_bone"
    return EstimatedPose(name, body, position, np.array([1.0, 0.0, 0.0, 0.0]), 0.0035)


def _accuracy(n: int) -> StationAccuracy:
    figures = [number(value * (1.0 + 0.05 * n), 0.05) for value in (0.0025, 0.0032, 0.0071, 0.008, 0.010, 0.021)]
    median, rms, high, turn_median, turn_rms, turn_high = figures
    turns = ErrorQuantiles(turn_rms, turn_median, turn_high)
    return StationAccuracy(ErrorQuantiles(rms, median, high), turns, 2390, 0.004)


def _residuals(station: str, rng: np.random.Generator) -> ResidualSeries:
    time_s = np.arange(2400) / 40.0
    position_m, angle_rad = (scale * np.abs(rng.normal(size=2400)) for scale in (0.003, 0.01))
    position_m[800:840] = np.nan
    position_m[1200:1320] += 0.02
    return ResidualSeries(station, time_s, position_m, angle_rad)
