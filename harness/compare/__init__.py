"""Paired comparison of results: what is worse, better, the same, or cannot be told."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.compare.baseline import write_baseline
    from harness.compare.comparison import Comparison, compare_results, compare_runs
    from harness.compare.differences import Difference
    from harness.compare.margins import GATED_METRICS, MARGINS, TIME_METRICS, margin_of
    from harness.compare.paired_statistics import (
        CONFIDENCE_LEVEL,
        MIN_UNITS,
        PairedDifference,
        compare_paired,
        mean_interval,
    )
    from harness.compare.rank_correlation import compare_orders, decide_pairs, side_difference, tau_b, tau_interval
    from harness.compare.ranking import ClipValues, MethodRanking, find_best, rank_methods, shared_clips, split_by_lag
    from harness.compare.side_names import name_sides
    from harness.compare.sides import ComparisonSet, compare_sides
    from harness.compare.significance import SIGNIFICANCE, Verdict, count_needed, decide_verdicts, holm, sign_flip_p
    from harness.compare.units import BY_NAME, Sampling, average_units, count_clips, count_units
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "BY_NAME",
    "CONFIDENCE_LEVEL",
    "GATED_METRICS",
    "MARGINS",
    "MIN_UNITS",
    "SIGNIFICANCE",
    "TIME_METRICS",
    "ClipValues",
    "Comparison",
    "ComparisonSet",
    "Difference",
    "MethodRanking",
    "PairedDifference",
    "Sampling",
    "Verdict",
    "average_units",
    "compare_orders",
    "compare_paired",
    "compare_results",
    "compare_runs",
    "compare_sides",
    "count_clips",
    "count_needed",
    "count_units",
    "decide_pairs",
    "decide_verdicts",
    "find_best",
    "holm",
    "margin_of",
    "mean_interval",
    "name_sides",
    "rank_methods",
    "shared_clips",
    "side_difference",
    "sign_flip_p",
    "split_by_lag",
    "tau_b",
    "tau_interval",
    "write_baseline",
]
