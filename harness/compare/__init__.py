"""Paired comparison of results: what is worse, better, the same, or cannot be told."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.compare.baseline import write_baseline as write_baseline
    from harness.compare.comparison import Comparison as Comparison
    from harness.compare.comparison import compare_results as compare_results
    from harness.compare.comparison import compare_runs as compare_runs
    from harness.compare.differences import Difference as Difference
    from harness.compare.margins import GATED_METRICS as GATED_METRICS
    from harness.compare.margins import MARGINS as MARGINS
    from harness.compare.margins import TIME_METRICS as TIME_METRICS
    from harness.compare.margins import margin_of as margin_of
    from harness.compare.paired_statistics import CONFIDENCE_LEVEL as CONFIDENCE_LEVEL
    from harness.compare.paired_statistics import MIN_UNITS as MIN_UNITS
    from harness.compare.paired_statistics import PairedDifference as PairedDifference
    from harness.compare.paired_statistics import compare_paired as compare_paired
    from harness.compare.paired_statistics import mean_interval as mean_interval
    from harness.compare.rank_correlation import compare_orders as compare_orders
    from harness.compare.rank_correlation import decide_pairs as decide_pairs
    from harness.compare.rank_correlation import side_difference as side_difference
    from harness.compare.rank_correlation import tau_b as tau_b
    from harness.compare.rank_correlation import tau_interval as tau_interval
    from harness.compare.ranking import ClipValues as ClipValues
    from harness.compare.ranking import MethodRanking as MethodRanking
    from harness.compare.ranking import find_best as find_best
    from harness.compare.ranking import rank_methods as rank_methods
    from harness.compare.ranking import shared_clips as shared_clips
    from harness.compare.ranking import split_by_lag as split_by_lag
    from harness.compare.side_names import name_sides as name_sides
    from harness.compare.sides import ComparisonSet as ComparisonSet
    from harness.compare.sides import compare_sides as compare_sides
    from harness.compare.significance import SIGNIFICANCE as SIGNIFICANCE
    from harness.compare.significance import Verdict as Verdict
    from harness.compare.significance import count_needed as count_needed
    from harness.compare.significance import decide_verdicts as decide_verdicts
    from harness.compare.significance import holm as holm
    from harness.compare.significance import sign_flip_p as sign_flip_p
    from harness.compare.units import BY_NAME as BY_NAME
    from harness.compare.units import Sampling as Sampling
    from harness.compare.units import average_units as average_units
    from harness.compare.units import count_clips as count_clips
    from harness.compare.units import count_units as count_units
else:
    __getattr__, __dir__ = lazy_names(__name__)
