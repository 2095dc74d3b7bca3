"""The standard deviations that methods state, against their errors: a table of coverage and a chart of each hinge."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.text_table import Table
from harness.report.kit.chart import draw_chart
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.rows import label_rows
from harness.report.kit.scales import set_root_scale
from harness.report.kit.style import COLOURS, INK, Chart
from harness.report.kit.table import html_table
from harness.report.run.charts import draw_boxes
from harness.report.run.data import RunData, Trace
from harness.results.reported_metrics import SIGMA_COLUMNS, format_sigma_scores
from harness.score.uncertainty import SigmaSums, sum_sigma

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_CAPTION = (
    "Standard deviations that methods state for the hinge angles, pooled over the scored frames and the hinges of each "
    "behaviour. Normal errors with the stated deviations would lie within one in 68 % and within two in 95 %. The log "
    "score is the mean negative logarithm of the stated normal density of the true angle, per degree: lower is better."
)


def sigma_table(run: RunData) -> Markup:
    """A row for each series that states standard deviations and each behaviour; nothing if none does."""
    rows = []
    for series in run.series_with_sigma:
        for behaviour in run.behaviours:
            sums = _pool([trace for trace in run.traces if (trace.series, trace.behaviour) == (series, behaviour)])
            if sums is not None:
                texts = format_sigma_scores(sums.scores())
                lowest = standard_skeleton().dof_names[int(np.argmin(sums.within_1))]
                cells = [
                    join(text, tag("span", f" {lowest}", class_="spread"))
                    if name == "sigma_lowest_coverage_1"
                    else text
                    for text, (_, name, *_) in zip(texts, SIGMA_COLUMNS, strict=True)
                ]
                rows.append([series, behaviour.replace("_", " "), *cells])
    if not rows:
        return Markup()
    head = ["method", "behaviour", *(title for title, *_ in SIGMA_COLUMNS)]
    return html_table(Table(head, rows), _CAPTION, label="stated standard deviations")


def error_against_sigma(run: RunData, series: str) -> Chart:
    """Box plots of the error of each hinge of one series, on bands of its mean standard deviation."""
    traces = [trace for trace in run.traces if trace.series == series and len(trace.hinge_deg)]
    error_deg = np.concatenate([trace.hinge_deg for trace in traces])
    sigma_deg = np.concatenate([trace.sigma_deg[trace.scored] for trace in traces])
    names = standard_skeleton().dof_names
    share = np.mean(error_deg <= sigma_deg, axis=0)

    def draw(figure: "Figure") -> None:
        panels = figure.subplots(1, 2)
        halves = np.array_split(np.arange(len(names)), 2)
        for axes, hinges in zip(panels, halves, strict=True):
            _draw_bands(axes, sigma_deg[:, hinges].mean(axis=0))
            draw_boxes(axes, error_deg[:, hinges], COLOURS[0])
            label_rows(axes, [names[hinge] for hinge in hinges])
            axes.set_title("error of the hinge angle [deg]")
            set_root_scale(axes)
            for row, hinge in enumerate(hinges):
                place = {"transform": axes.get_yaxis_transform(), "ha": "left", "va": "center", "fontsize": 8.0}
                axes.text(1.01, row, f"{100.0 * share[hinge]:.0f} %", color=INK, **place)

    return draw_chart(
        "sigma",
        f"Error of each hinge against its standard deviation, {series}",
        f"{series}: bands to one and two times the mean standard deviation that it states. Boxes of the error from "
        "quartile to quartile, lines at the median, whiskers at the 5th and 95th percentile of all scored frames. "
        "Right of each row: share of frames within one standard deviation of that frame. The axes have a square-root "
        "scale.",
        f"Box plots of the error of 48 hinge angles of {series} on bands of the standard deviation that it states.",
        draw,
        6.4,
    )


def _draw_bands(axes: "Axes", sigma_deg: Floats) -> None:
    """Bands (D,) from 0 to one and to two standard deviations [deg]."""
    rows = np.arange(len(sigma_deg))
    for times, alpha in ((2.0, 0.14), (1.0, 0.24)):
        axes.barh(rows, times * sigma_deg, height=0.94, color=COLOURS[1], alpha=alpha, linewidth=0)


def _pool(traces: Sequence[Trace]) -> SigmaSums | None:
    """Sums over all scored frames; None where no standard deviations are stated."""
    parts = [
        sum_sigma(t.hinge_deg.astype(float), t.sigma_deg[t.scored].astype(float)) for t in traces if len(t.hinge_deg)
    ]
    return sum(parts[1:], start=parts[0]) if parts else None
