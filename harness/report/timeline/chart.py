"""The chart of one metric over the entries of a timeline: a line for each method, as change since its first entry."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from harness.compare.timeline import TimelineSeries
from harness.core.number_format import format_change_percent
from harness.report.kit.chart import add_legend, draw_chart
from harness.report.kit.style import DASHES, FAINT, INK, MUTED, Chart, Figure

_MOST_TICKS, _HEIGHT_IN = 10, 2.6
_MARKERS = {"worse": "^", "better": "v"}


def timeline_chart(
    name: str, label: str, entries: Sequence[str], series: Sequence[TimelineSeries], colours: Mapping[str, str]
) -> Chart:
    """The chart of the series of one metric; methods without a colour are grey."""
    texts = [
        f"{each.method} {format_change_percent(each.percent(change))} at {entries[each.entries[change.at]]}"
        for each in series
        for change in each.changes
    ]
    caption = "Change of the mean since the first entry of each series. A mark: a change that was found there."
    alt = f"{label} over {len(entries)} entries. {'; '.join(texts) or 'No change was found'}."
    title = f"{label}, change since the first entry"
    draw = partial(_draw, entries=entries, series=series, colours=colours)
    return draw_chart(name, title, caption, alt, draw, _HEIGHT_IN, hover=True)


def _draw(figure: Figure, entries: Sequence[str], series: Sequence[TimelineSeries], colours: Mapping[str, str]) -> None:
    axes = figure.subplots()
    methods = list(dict.fromkeys(each.method for each in series))
    axes.axhline(0.0, color=FAINT, linewidth=0.8)
    named = set[str]()
    for each in series:
        at, first = np.array(each.entries, dtype=float), each.means[0]
        change = 100.0 * (np.array(each.means) / first - 1.0) if first else np.zeros(len(at))
        style = DASHES[methods.index(each.method) % len(DASHES)]
        colour = colours.get(each.method, MUTED)
        label = each.method if each.method not in named else f"_{each.method}"
        named.add(each.method)
        axes.plot(at, change, color=colour, linestyle=style, label=label, marker="." if len(at) < 3 else "")
        for found in each.changes:
            mark = _MARKERS[each.verdict(found)]
            axes.plot(at[found.at], change[found.at], mark, color=colour, markeredgecolor=INK, label="_", zorder=4)
    step = max(1, -(-len(entries) // _MOST_TICKS))
    ticks = range(0, len(entries), step)
    axes.set_xticks(ticks, [entries[at] for at in ticks])
    axes.set_xlim(-0.5, len(entries) - 0.5)
    axes.set_ylabel("change [%]")
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:+g}".replace("+0", "0").replace("-", "−"))
    add_legend(figure, axes)
