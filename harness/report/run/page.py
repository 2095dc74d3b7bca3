"""The page of a run: headline, tables, charts and pictures."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.compare.units import Sampling
from harness.core.files import to_json_types
from harness.core.number_format import format_number
from harness.core.text_table import Table
from harness.report.kit.document import Section, chart_figure, data_uri, document, facts_list
from harness.report.kit.markup import Markup, bullet_list, details, join, scroll_box, tag
from harness.report.kit.style import Chart
from harness.report.kit.table import NOT_MEASURED_CELL, html_table, stacked_cell
from harness.report.kit.text import list_first
from harness.report.run import (
    calibration_cost,
    calibration_errors,
    expected_orders,
    parameter_effects,
    recovery,
    tables,
    uncertainty,
)
from harness.report.run.data import RunData
from harness.report.run.headline import Headline
from harness.report.run.joint_errors import JointMeans, joint_table
from harness.report.run.worst_window import WorstWindow
from harness.score.metrics import DEFINITIONS

_REPRODUCE_NOTE = (
    "Run the command in a folder from which it finds the scenario file and, for recorded motion, the library. To write "
    "this page alone again: "
)

_LEADING_FACTS = ("Motion", "Coverage")
"""Facts on the first screen; the others are in a section of their own."""
_MOST_NAMED = 8


@dataclass(frozen=True)
class FilmStrip:
    """A picture of the two seconds in which the leading method was worst by some metric."""

    windows: Sequence[WorstWindow]
    """Windows of several metrics that coincide; the first is shown."""
    title: str
    instants_s: Sequence[float]
    picture: Path
    """PNG file; if it does not exist, the page leaves the strip out and says why under "Missing"."""


@dataclass(frozen=True)
class Still:
    """A picture of the leading method at the instant of its largest error."""

    caption: str
    picture: Path
    """PNG file; if it does not exist, the page says why in its place."""


@dataclass(frozen=True)
class RunCharts:
    """The charts of the page; empty or None where nothing was measured."""

    rankings: Sequence[Chart] = ()
    """One for each group of methods that are ranked together, that of the headline first."""
    varied: Sequence[Chart] = ()
    over_time: Sequence[Chart] = ()
    """One for each behaviour."""
    on_body: Chart | None = None
    per_joint: Chart | None = None
    distribution: Chart | None = None
    sigma: Chart | None = None
    """Errors of each hinge against the standard deviations that a method states; None where none does."""

    def all(self) -> list[Chart]:
        """Every chart once."""
        single = (self.on_body, self.per_joint, self.distribution, self.sigma)
        return [*self.rankings, *self.varied, *self.over_time, *(chart for chart in single if chart)]


@dataclass(frozen=True)
class RunContent:
    """Everything that the page of a run shows."""

    run: RunData
    headline: Headline
    charts: RunCharts
    joints: JointMeans
    """Errors at each bone of the leader and of the control."""
    still: Still | None
    """None if no method has the lowest error."""
    no_still: str
    """Why the picture is missing, "" if it is not."""
    windows: Mapping[tuple[str, str], WorstWindow]
    """(series, metric) -> its worst two seconds."""
    strips: Sequence[FilmStrip]
    player: Markup
    """Interactive 3-D view; empty without one."""
    missing: Sequence[str]
    """Parts that are not on the page, and why."""


def run_page(content: RunContent) -> str:
    """The HTML of the page."""
    run, headline = content.run, content.headline
    return document(
        title=f"{run.name}: harness report",
        kicker=f"harness report · {run.name}",
        heading=headline.opening,
        facts={},
        missing=content.missing,
        sections=_sections(content),
        lead=_overview(content),
    )


def _overview(content: RunContent) -> Markup:
    """The first screen after the heading: the other sentences, the ranking and a picture of the leading method."""
    headline, charts = content.headline, content.charts
    about = [f"{title}: {headline.facts[title]}." for title in _LEADING_FACTS if title in headline.facts]
    return join(
        tag("p", headline.rest, class_="verdict-text") if headline.rest else None,
        tag("p", " ".join(about), class_="about"),
        tag("div", chart_figure(charts.rankings[0]), _still(content), class_="overview") if charts.rankings else None,
    )


def _still(content: RunContent) -> Markup:
    still = content.still
    if still is None or not still.picture.is_file():
        reason = content.no_still or "no method has the lowest error"
        return tag("figure", tag("p", f"There is no picture of truth and estimate: {reason}."), class_="still absent")
    image = tag(
        "img", src=data_uri(still.picture.read_bytes(), "image/png"), alt=f"Truth and estimate of {still.caption}"
    )
    caption = tag("figcaption", tag("b", f"{still.caption}. "), _colour_key())
    return tag("figure", image, caption, class_="still")


def _sections(content: RunContent) -> list[Section]:
    run, charts = content.run, content.charts
    measured = bool(run.cells)
    nothing, cells = Markup(), run.full_summary["cells"]
    effects = join(*(chart_figure(chart, 3) for chart in charts.varied), parameter_effects.effect_tables(run))
    further = join(*(chart_figure(chart, 3) for chart in charts.rankings[1:]))
    return [
        ("In 3-D", "look", _view_3d(content)),
        ("Varied", "varied", effects),
        ("Expected orders", "expected_orders", expected_orders.section(run.full_summary)),
        ("Results", "results", join(further, tables.results_tables(run)) if measured else nothing),
        ("Error over time", "time", _over_time(charts.over_time)),
        ("Error by joint", "joints", _joint_section(content)),
        ("Worst two seconds", "worst", _worst_section(content) if content.windows else nothing),
        ("Error distribution", "cdf", chart_figure(charts.distribution) if charts.distribution else nothing),
        ("Stated uncertainty", "sigma", _sigma_section(content)),
        ("Recovery", "recovery", recovery.section(run.summary)),
        (
            "Calibration",
            "calibration",
            join(
                calibration_errors.section(cells),
                calibration_cost.section(cells, Sampling.of_summary(run.full_summary)),
            ),
        ),
        ("Coverage", "coverage", tables.coverage_tables(run)),
        ("Stream health", "health", tables.health_tables(run) if measured else nothing),
        ("All metrics", "metrics", _every_metric(run) if measured else nothing),
        ("Conditions", "conditions", join(facts_list(content.headline.facts), _manifest(run))),
        ("Reproduce", "reproduce", _reproduce(run)),
    ]


def _over_time(charts: Sequence[Chart]) -> Markup:
    """The chart of the first behaviour, and the others folded."""
    if not charts:
        return Markup()
    hint = tag("p", "Point at a line for its value. Click a name to hide or show its line.", class_="screen-only")
    first, *others = (chart_figure(chart, 3) for chart in charts)
    names = list_first([chart.title for chart in charts[1:]], _MOST_NAMED)
    return join(hint, first, details(f"Other behaviours: {names}", *others) if others else None)


def _joint_section(content: RunContent) -> Markup:
    charts = content.charts
    if charts.on_body is None:
        return Markup()
    boxes = details("Distribution at each joint", chart_figure(charts.per_joint)) if charts.per_joint else None
    return join(chart_figure(charts.on_body), details("Numbers of this chart", joint_table(content.joints)), boxes)


def _sigma_section(content: RunContent) -> Markup:
    sigma = content.charts.sigma
    chart = details("Error of each hinge", chart_figure(sigma, 3)) if sigma else None
    return join(uncertainty.sigma_table(content.run), chart)


def _worst_section(content: RunContent) -> Markup:
    metrics = list(dict.fromkeys(metric for _, metric in content.windows))
    clips = {trace.key: trace.clip for trace in content.run.traces}
    rows = []
    for series in content.run.series:
        cells: list[Any] = []
        for metric in metrics:
            window = content.windows.get((series, metric))
            if window is None:
                cells.append(NOT_MEASURED_CELL)
                continue
            where = join(clips[window.key], tag("br"), _format_span(window))
            cells.append(stacked_cell(_format_mean(window), where))
        rows.append([series, *cells])
    head = ["method", *metrics]
    caption = "The two seconds with the largest mean of each metric: mean, clip and time."
    summary = html_table(Table(head, rows), caption, label="worst two seconds")
    key = tag("p", "The method with the lowest error, in its worst two seconds. ", _colour_key())
    strips = [_film_strip(strip) for strip in content.strips if strip.picture.is_file()]
    return join(key if strips else None, *strips, details("All methods", summary) if strips else summary)


def _film_strip(strip: FilmStrip) -> Markup:
    alt = f"Truth and estimate at {len(strip.instants_s)} instants of {strip.title}"
    times = tag("div", *(tag("span", f"{t:.2f} s") for t in strip.instants_s), class_="times")
    image = tag("img", src=data_uri(strip.picture.read_bytes(), "image/png"), alt=alt)
    means = [f"{window.metric} {_format_mean(window)} ({_format_span(window)})" for window in strip.windows]
    caption = join(tag("b", f"{strip.title}. "), f"Means: {', '.join(means)}.")
    return tag("figure", scroll_box(join(image, times), strip.title), tag("figcaption", caption), class_="strip")


def _colour_key() -> Markup:
    truth, estimate = (tag("span", class_=f"chip {name}") for name in ("truth", "estimate"))
    return join(truth, "truth, pale; ", estimate, "estimate, slimmer: it lies inside the truth where it is right.")


def _view_3d(content: RunContent) -> Markup:
    if not content.player:
        return Markup()
    text = (
        "Every clip with up to three methods. Drag to turn, wheel or pinch to zoom, drag with the right button or two "
        "fingers to pan; space plays, the arrow keys step."
    )
    return join(tag("p", text), content.player)


def _every_metric(run: RunData) -> Markup:
    return details("All metrics of all methods", tables.all_metrics_table(run))


def _manifest(run: RunData) -> Markup:
    text = json.dumps(to_json_types(run.manifest.as_dict()), indent=2, ensure_ascii=False)
    notes = list(dict.fromkeys(f"{trace.clip}: {note}" for trace in run.traces for note in trace.notes))
    motion_notes = details("Notes on the motion", bullet_list(notes, class_=None)) if notes else None
    return join(details("Inputs, metric versions, circumstances", tag("pre", text)), motion_notes)


def _reproduce(run: RunData) -> Markup:
    command = run.manifest.circumstances.get("command")
    report_command = shlex.join(["harness", "report", str(run.out)])
    if not command:
        return tag("p", "The run was started from Python, so no command was recorded.")
    return join(tag("pre", tag("code", str(command))), tag("p", _REPRODUCE_NOTE, tag("code", report_command), "."))


def _format_mean(window: WorstWindow) -> str:
    unit = DEFINITIONS[window.metric].unit
    return f"{format_number(window.mean, unit)} {unit}"


def _format_span(window: WorstWindow) -> str:
    return f"{window.start_s:.1f}–{window.end_s:.1f} s"
