"""What the pages of a measured unit and of its validation show."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.measure.reports.departures import Departure, compare_with_expected
    from harness.measure.reports.unit_report import (
        EPISODE_KINDS,
        STATION_FIGURES,
        CaptureSummary,
        DensityCurve,
        DeviationCurve,
        EpisodeMark,
        ParameterRow,
        RecordingAdvice,
        StationFigures,
        UnitReport,
        make_unit_report,
    )
    from harness.measure.reports.validation_report import (
        ErrorQuantiles,
        ResidualSeries,
        StationAccuracy,
        ValidationReport,
        error_quantiles,
        estimated_poses,
        residual_series,
    )
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "EPISODE_KINDS",
    "STATION_FIGURES",
    "CaptureSummary",
    "DensityCurve",
    "Departure",
    "DeviationCurve",
    "EpisodeMark",
    "ErrorQuantiles",
    "ParameterRow",
    "RecordingAdvice",
    "ResidualSeries",
    "StationAccuracy",
    "StationFigures",
    "UnitReport",
    "ValidationReport",
    "compare_with_expected",
    "error_quantiles",
    "estimated_poses",
    "make_unit_report",
    "residual_series",
]
