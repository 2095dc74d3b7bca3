"""Results of one scenario over commits or dates: series of means, and the changes in them."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.compare.timeline.change_points import CHANGE_LEVEL, MIN_ENTRIES, ChangePoint
    from harness.compare.timeline.series import Timeline, TimelineSeries, build_timeline
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "CHANGE_LEVEL",
    "MIN_ENTRIES",
    "ChangePoint",
    "Timeline",
    "TimelineSeries",
    "build_timeline",
]
