"""What the summary of a run says beside its cells: expected orders, recovery, differences between methods."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.compare.run_summary.decomposition import Decomposition as Decomposition
    from harness.compare.run_summary.decomposition import DifferencePart as DifferencePart
    from harness.compare.run_summary.decomposition import decompose_difference as decompose_difference
    from harness.compare.run_summary.expected_orders import DECIMALS as DECIMALS
    from harness.compare.run_summary.expected_orders import ExpectedOrder as ExpectedOrder
    from harness.compare.run_summary.recovery import MAX_RECOVERED_RATIO as MAX_RECOVERED_RATIO
    from harness.compare.run_summary.recovery import SETTLING_S as SETTLING_S
    from harness.compare.run_summary.recovery import WINDOW_S as WINDOW_S
    from harness.compare.run_summary.recovery import tabulate_recovery as tabulate_recovery
    from harness.compare.run_summary.run_statistics import GROUP_KEYS as GROUP_KEYS
    from harness.compare.run_summary.run_statistics import compute_run_statistics as compute_run_statistics
else:
    __getattr__, __dir__ = lazy_names(__name__)
