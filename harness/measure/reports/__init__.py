"""What the pages of a measured unit and of its validation show."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.measure.reports.departures import Departure as Departure
    from harness.measure.reports.departures import compare_with_expected as compare_with_expected
    from harness.measure.reports.unit_report import EPISODE_KINDS as EPISODE_KINDS
    from harness.measure.reports.unit_report import STATION_FIGURES as STATION_FIGURES
    from harness.measure.reports.unit_report import CaptureSummary as CaptureSummary
    from harness.measure.reports.unit_report import DensityCurve as DensityCurve
    from harness.measure.reports.unit_report import DeviationCurve as DeviationCurve
    from harness.measure.reports.unit_report import EpisodeMark as EpisodeMark
    from harness.measure.reports.unit_report import ParameterRow as ParameterRow
    from harness.measure.reports.unit_report import RecordingAdvice as RecordingAdvice
    from harness.measure.reports.unit_report import StationFigures as StationFigures
    from harness.measure.reports.unit_report import UnitReport as UnitReport
    from harness.measure.reports.unit_report import make_unit_report as make_unit_report
    from harness.measure.reports.validation_report import ErrorQuantiles as ErrorQuantiles
    from harness.measure.reports.validation_report import ResidualSeries as ResidualSeries
    from harness.measure.reports.validation_report import StationAccuracy as StationAccuracy
    from harness.measure.reports.validation_report import ValidationReport as ValidationReport
    from harness.measure.reports.validation_report import error_quantiles as error_quantiles
    from harness.measure.reports.validation_report import estimated_poses as estimated_poses
    from harness.measure.reports.validation_report import residual_series as residual_series
else:
    __getattr__, __dir__ = lazy_names(__name__)
