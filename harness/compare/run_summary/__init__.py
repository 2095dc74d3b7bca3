"""What the summary of a run says beside its cells: expected orders, recovery, differences between methods."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.compare.run_summary.decomposition import Decomposition, DifferencePart, decompose_difference
    from harness.compare.run_summary.expected_orders import DECIMALS, ExpectedOrder
    from harness.compare.run_summary.recovery import MAX_RECOVERED_RATIO, SETTLING_S, WINDOW_S, tabulate_recovery
    from harness.compare.run_summary.run_statistics import GROUP_KEYS, compute_run_statistics
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "DECIMALS",
    "GROUP_KEYS",
    "MAX_RECOVERED_RATIO",
    "SETTLING_S",
    "WINDOW_S",
    "Decomposition",
    "DifferencePart",
    "ExpectedOrder",
    "compute_run_statistics",
    "decompose_difference",
    "tabulate_recovery",
]
