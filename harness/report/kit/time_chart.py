"""Lines of errors over time: the leader and the control in colour, the other series grey."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from harness.core.arrays import Floats
from harness.report.kit.chart import decimate, insert_gaps
from harness.report.kit.highlights import Highlights
from harness.report.kit.scales import set_log_scale
from harness.report.kit.style import mark_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MARKERS_PER_LINE = 8


def draw_over_time(
    axes: "Axes", lines: Mapping[str, tuple[Floats, Floats]], highlights: Highlights, label: str
) -> None:
    """Draw times (F,) [s] and values (F,) of each series on a logarithmic axis; NaN and missing frames leave gaps."""
    for name, style in highlights.styles(lines).items():
        time_s, values = decimate(*insert_gaps(*lines[name]))
        every, size = max(1, len(time_s) // _MARKERS_PER_LINE), 3.0 * mark_scale()
        axes.plot(time_s, values, label=name + highlights.role(name), markevery=every, markersize=size, **style)
    set_log_scale(axes, "y")
    axes.set_ylabel(label)
