"""Results of one scenario over commits or dates: series of means, and the changes in them."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.compare.timeline.change_points import CHANGE_LEVEL as CHANGE_LEVEL
    from harness.compare.timeline.change_points import MIN_ENTRIES as MIN_ENTRIES
    from harness.compare.timeline.change_points import ChangePoint as ChangePoint
    from harness.compare.timeline.series import Timeline as Timeline
    from harness.compare.timeline.series import TimelineSeries as TimelineSeries
    from harness.compare.timeline.series import build_timeline as build_timeline
else:
    __getattr__, __dir__ = lazy_names(__name__)
