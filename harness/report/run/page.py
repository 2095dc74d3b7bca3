"""The page of a run: verdict, ranking and a picture first, then tables, charts and pictures of the worst seconds."""

import shlex
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from harness.core.arrays import Ints
from harness.core.number_format import NOT_MEASURED, format_number
from harness.report.kit.chart import clear_plots
from harness.report.kit.document import chart_figure, facts_list, picture_uri
from harness.report.kit.error_lines import choose_highlights
from harness.report.kit.markup import Markup, join, scroll_box, tag
from harness.report.kit.motion_player import player_card
from harness.report.kit.page import (
    Block,
    BrowserOnly,
    Bullets,
    Code,
    DataTable,
    Drawing,
    Page,
    Prose,
    Section,
    Stack,
    json_listing,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.render_process import RenderJob, RenderProcess
from harness.report.kit.style import Chart
from harness.report.kit.text import list_first, metric_name
from harness.report.run.calibration import calibration_tables
from harness.report.run.charts import effect_charts, error_distribution, error_over_time
from harness.report.run.data import RunData, read_run
from harness.report.run.expectations import expected_orders, recovery_table
from harness.report.run.headline import run_facts, run_verdict
from harness.report.run.joint_errors import body_drawing, error_against_sigma, error_per_joint, highlighted_means
from harness.report.run.losses import decompose_losses, describe_loss, loss_blocks
from harness.report.run.player_data import run_motion
from harness.report.run.ranking import ranking_charts
from harness.report.run.tables import (
    all_metrics_table,
    coverage_tables,
    effect_tables,
    health_tables,
    results_tables,
    sigma_table,
)
from harness.report.run.worst_window import WorstWindow, group_overlapping, worst_windows
from harness.results import Cell
from harness.score import DEFINITIONS

_PLAYER = (
    "Every clip with up to three methods. Drag to turn, wheel or pinch to zoom, drag with the right button or two "
    "fingers to pan; space plays, the arrow keys step."
)
_REPRODUCE = (
    "Run the command in a folder from which it finds the scenario file and, for recorded motion, the library. To write "
    "this page alone again: "
)
_LEADING_FACTS = ("Motion", "Coverage")
"""Facts on the first screen; all of them are in a section of their own."""
_MOST_NAMED, _INSTANTS, _STILL_SIZE = 8, 5, (640, 600)
"""Most behaviours in a title; pictures in a film strip; size of the picture on the first screen [px]."""
Windows = Sequence[WorstWindow]
"""Worst seconds by several metrics that coincide; the first is shown."""


def write_run_page(out: Path, *, rendered: bool = True) -> Path:
    """Write OUT/plots and OUT/report.html of the run in `out`; returns the path of the page.

    Without `rendered`, OpenGL or an optional package, the page says which pictures are missing and why. BadFile if the
    folder holds no finished run.
    """
    run = read_run(out)
    plots = clear_plots(out)
    verdict, lowest = run_verdict(run)
    windows = worst_windows(run)
    strips = group_overlapping(window for (series, _), window in windows.items() if series == lowest)
    reader = cache(run.cell)
    with RenderProcess(_render_jobs(run, strips, plots, reader) if rendered else ()) as rendering:
        rankings, drawn = _draw_charts(run, lowest)
        player, losses = _player(run, windows, reader), decompose_losses(run)
        explained = loss_blocks(losses)
        reason = rendering.finish() if rendered else "rendering was turned off"
    why = reason if strips else "no method has the lowest error" if windows else ""
    for chart in rankings:
        chart.write(plots)
    opening, end, rest = verdict.partition(". ")
    rest = " ".join(filter(None, [rest, *map(describe_loss, losses[:1])]))
    measured, summary = bool(run.cells), run.full_summary
    page = Page(
        verb="report",
        name=run.name,
        headline=opening + end.rstrip(),
        facts={},
        lead=[BrowserOnly([_overview(run, rest, rankings, _still(run, strips, plots, reason))])],
        missing=[f"Rendered pictures of the worst two seconds: {why}"] if why else [],
        sections=[
            Section("In 3-D", "look", player),
            Section("Where methods lose", "losses", explained),
            Section("Varied", "varied", [*drawn["varied"], *effect_tables(run)]),
            Section("Expected orders", "expected_orders", expected_orders(summary)),
            Section("Results", "results", [*drawn["results"], *results_tables(run)] if measured else []),
            Section("Error over time", "time", drawn["time"]),
            Section("Error by joint", "joints", drawn["joints"]),
            Section("Worst two seconds", "worst", _worst(run, windows, strips, plots)),
            Section("Error distribution", "cdf", drawn["cdf"]),
            Section("Stated uncertainty", "sigma", [sigma_table(run), *drawn["sigma"]]),
            Section("Recovery", "recovery", [recovery_table(run.summary)]),
            Section("Calibration", "calibration", calibration_tables(summary)),
            Section("Coverage", "coverage", coverage_tables(run)),
            Section("Stream health", "health", health_tables(run) if measured else []),
            Section("All metrics", "metrics", [all_metrics_table(run)] if measured else []),
            Section("Conditions", "conditions", _conditions(run)),
            Section("Reproduce", "reproduce", _reproduce(run)),
        ],
    )
    return write_page(page, out / "report.html", plots)


def _draw_charts(run: RunData, lowest: str | None) -> tuple[list[Chart], Mapping[str, list[Block]]]:
    """The charts that rank methods, and section -> its other charts; nothing if no frame was scored."""
    drawn = defaultdict[str, list[Block]](list)
    scored = {trace.series for trace in run.traces if trace.scored.any()}
    ranked = [name for name in run.ranked if name in scored and name in run.charted_series]
    if not ranked:
        return [], drawn
    highlights = choose_highlights(sorted(ranked, key=lambda name: name != lowest))
    rankings = ranking_charts(run)
    drawn["results"] = [Drawing(chart, level=3) for chart in rankings[1:]]
    drawn["varied"] = [Drawing(chart, level=3) for chart in effect_charts(run, highlights)]
    behaviours = [name for name in run.behaviours if any(t.scored.any() for t in run.traces if t.behaviour == name)]
    drawn["time"] = _over_time([error_over_time(run, behaviour, highlights) for behaviour in behaviours])
    per_joint = BrowserOnly([Drawing(error_per_joint(run, highlights))], "Distribution at each joint")
    drawn["joints"] = [body_drawing(highlighted_means(run, highlights)), per_joint]
    drawn["cdf"] = [Drawing(error_distribution(run, highlights))]
    for series in run.series_with_sigma[:1]:
        chart = error_against_sigma(run, series)
        drawn["sigma"] = [BrowserOnly([Drawing(chart, level=3)], "Error of each hinge")]
    return rankings, drawn


def _over_time(charts: Sequence[Chart]) -> list[Block]:
    """The chart of the first behaviour, and the others folded."""
    hint = tag("p", "Point at a line for its value. Click a name to hide or show its line.", class_="screen-only")
    first, *others = [Drawing(chart, level=3) for chart in charts]
    title = f"Other behaviours: {list_first([chart.title for chart in charts[1:]], _MOST_NAMED)}"
    return [BrowserOnly([hint]), first, *([BrowserOnly(others, title)] if others else [])]


def _overview(run: RunData, rest: str, rankings: Sequence[Chart], still: Markup) -> Markup:
    """The first screen after the heading: the other sentences, the ranking and a picture of the leading method."""
    facts = run_facts(run)
    about = [f"{title}: {facts[title]}." for title in _LEADING_FACTS if title in facts]
    return join(
        tag("p", rest, class_="verdict-text") if rest else None,
        tag("p", " ".join(about), class_="about"),
        tag("div", chart_figure(rankings[0]), still, class_="overview") if rankings else None,
    )


def _still(run: RunData, strips: Sequence[Windows], plots: Path, reason: str) -> Markup:
    """The leading method at the instant of its largest error, or why there is no picture."""
    picture = _still_picture(plots)
    if not strips or not picture.is_file():
        why = reason or "no method has the lowest error"
        return tag("figure", tag("p", f"There is no picture of truth and estimate: {why}."), class_="still absent")
    window = strips[0][0]
    trace, row, unit = run.trace(window.key), _worst_row(run, window), DEFINITIONS[window.metric].unit
    value = f"{metric_name(window.metric)} {format_number(float(trace.errors[window.metric][row]), unit)} {unit}"
    what = f"{trace.series} at its worst instant: {trace.clip}, {trace.time_s[row]:.2f} s, {value}"
    caption = tag("figcaption", tag("b", f"{what}. "), _colour_key())
    return tag("figure", _image(picture, f"Truth and estimate of {what}"), caption, class_="still")


def _worst(
    run: RunData, windows: Mapping[tuple[str, str], WorstWindow], strips: Sequence[Windows], plots: Path
) -> list[Block]:
    """Film strips of the leading method's worst seconds, and those of all methods in numbers."""
    metrics = list(dict.fromkeys(metric for _, metric in windows))
    clips = {trace.key: trace.clip for trace in run.traces}
    rows = [
        [
            series,
            *(
                Stack(window.mean_text, f"{clips[window.key]}, {window.span}")
                if (window := windows.get((series, metric)))
                else NOT_MEASURED
                for metric in metrics
            ),
        ]
        for series in run.series
        if windows
    ]
    caption = "The two seconds with the largest mean of each metric: mean, clip and time."
    table = DataTable(["method", *metrics], rows, caption=caption, label="worst two seconds")
    shown = [_film_strip(run, strip, _strip_picture(plots, strip)) for strip in strips]
    if not any(shown):
        return [table]
    key = tag("p", "The method with the lowest error, in its worst two seconds. ", _colour_key())
    return [BrowserOnly([key, *shown]), replace(table, fold="All methods")]


def _film_strip(run: RunData, strip: Windows, picture: Path) -> Markup:
    """The pictures of a strip side by side; nothing if they were not rendered."""
    if not picture.is_file():
        return Markup()
    window, trace = strip[0], run.trace(strip[0].key)
    title = f"{trace.series} on {trace.clip}, {window.start_s:.2f} to {window.end_s:.2f} s"
    instants_s = trace.time_s[_instants(run, window)]
    times = tag("div", *(tag("span", f"{time_s:.2f} s") for time_s in instants_s), class_="times")
    image = _image(picture, f"Truth and estimate at {len(instants_s)} instants of {title}")
    means = [f"{each.metric} {each.mean_text} ({each.span})" for each in strip]
    caption = join(tag("b", f"{title}. "), f"Means: {', '.join(means)}.")
    return tag("figure", scroll_box(join(image, times), title), tag("figcaption", caption), class_="strip")


def _image(picture: Path, alt: str) -> Markup:
    return tag("img", src=picture_uri(picture), alt=alt)


def _colour_key() -> Markup:
    truth, estimate = (tag("span", class_=f"chip {name}") for name in ("truth", "estimate"))
    return join(truth, "truth, pale; ", estimate, "estimate, slimmer: it lies inside the truth where it is right.")


def _render_jobs(
    run: RunData, strips: Sequence[Windows], plots: Path, reader: Callable[[str], Cell]
) -> list[RenderJob]:
    """What is rendered of the leading method's worst seconds: the picture of the first screen, then the film strips."""
    jobs = [
        _render_job(reader(strip[0].key), _instants(run, strip[0]), _strip_picture(plots, strip)) for strip in strips
    ]
    for window in [strip[0] for strip in strips[:1]]:
        still = _render_job(reader(window.key), np.array([_worst_row(run, window)]), _still_picture(plots))
        jobs.insert(0, replace(still, size=_STILL_SIZE))
    return jobs


def _render_job(cell: Cell, rows: Ints, picture: Path) -> RenderJob:
    return RenderJob(picture, cell.bone_m, cell.estimate_bone_m, cell.truth_qpos[rows], cell.estimate_qpos[rows])


def _still_picture(plots: Path) -> Path:
    return plots / "worst_instant.png"


def _strip_picture(plots: Path, strip: Windows) -> Path:
    return plots / f"worst_{strip[0].metric}.png"


def _worst_row(run: RunData, window: WorstWindow) -> int:
    """Row of the frame with the largest value of the window's metric."""
    rows = window.scored_rows(run)
    return int(rows[np.nanargmax(run.trace(window.key).errors[window.metric][rows])])


def _instants(run: RunData, window: WorstWindow) -> Ints:
    """Rows of the frames of a film strip."""
    rows = window.scored_rows(run)
    out: Ints = rows[np.unique(np.linspace(0, len(rows) - 1, _INSTANTS).round().astype(int))]
    return out


def _player(run: RunData, windows: Mapping[tuple[str, str], WorstWindow], reader: Callable[[str], Cell]) -> list[Block]:
    """The interactive view of all clips and methods; nothing without an estimate."""
    motion, note = run_motion(run, windows, reader)
    player = [player_card(motion, "Truth, estimates and stations in 3-D; drag to turn")] if motion.clips else []
    return [Prose(_PLAYER), *([Prose(note)] if note else []), BrowserOnly(player)] if player else []


def _conditions(run: RunData) -> list[Block]:
    """Facts, the manifest, and notes on the motion."""
    notes = list(dict.fromkeys(f"{trace.clip}: {note}" for trace in run.traces for note in trace.notes))
    return [
        BrowserOnly([facts_list(run_facts(run))]),
        json_listing(run.manifest.as_dict(), "Inputs, metric versions, circumstances"),
        BrowserOnly([Bullets(notes)], "Notes on the motion"),
    ]


def _reproduce(run: RunData) -> list[Block]:
    command = run.manifest.circumstances.get("command")
    if not command:
        return [Prose("The run was started from Python, so no command was recorded.")]
    report = shlex.join(["harness", "report", str(run.out)])
    return [Code(str(command)), BrowserOnly([tag("p", _REPRODUCE, tag("code", report), ".")])]
