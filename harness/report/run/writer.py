"""Writes the report of a finished run: charts, rendered pictures, and the page."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from harness.core.arrays import Ints
from harness.core.files import write_text
from harness.core.number_format import format_number
from harness.report.kit.chart import clear_plots
from harness.report.kit.highlights import choose_highlights
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.metric_labels import metric_name
from harness.report.kit.motion_player import motion_player
from harness.report.kit.render_process import RenderJob, RenderProcess
from harness.report.run import charts, parameter_effects, uncertainty
from harness.report.run.data import WORST_METRICS, RunData, read_run
from harness.report.run.headline import Headline, build_headline
from harness.report.run.joint_errors import JointMeans, body_chart, highlighted_means
from harness.report.run.page import FilmStrip, RunCharts, RunContent, Still, run_page
from harness.report.run.player_data import run_motion
from harness.report.run.ranking_chart import ranking_charts
from harness.report.run.worst_window import WorstWindow, find_worst_window, group_overlapping, select_worst
from harness.results.cell import Cell
from harness.score.metrics import DEFINITIONS

_INSTANTS = 5
"""Pictures in a film strip."""
_STILL_SIZE = (640, 600)
"""Width and height of the picture on the first screen [px]."""


def write_run_page(out: Path, *, rendered: bool = True) -> Path:
    """Write OUT/plots and OUT/report.html of the run in `out`; returns the path of the page.

    Without `rendered`, OpenGL or an optional package, the page says which pictures are missing and why. BadFile if the
    folder holds no finished run.
    """
    run = read_run(out)
    plots = clear_plots(out)
    headline = build_headline(run)
    windows = _windows(run)
    reader = cache(run.cell)
    leading = [window for (series, _), window in windows.items() if series == headline.lowest]
    strips = [_strip(run, group, plots) for group in group_overlapping(leading)]
    still = _still(run, leading[0], plots) if leading else None
    jobs = [_strip_job(reader(s.windows[0].key), run, s) for s in strips] if rendered else []
    if rendered and still is not None:
        jobs.insert(0, _still_job(reader(leading[0].key), run, leading[0], still))
    with RenderProcess(jobs) as rendering:
        joints, drawn = _draw_charts(run, headline)
        player = _player(run, windows, reader)
        reason = rendering.finish() if rendered else "rendering was turned off"
    missing = []
    if windows and not strips:
        missing.append("Rendered pictures of the worst two seconds: no method has the lowest error")
    if strips and reason:
        missing.append(f"Rendered pictures of the worst two seconds: {reason}")
    for chart in drawn.all():
        chart.write(plots)
    content = RunContent(run, headline, drawn, joints, still, reason, windows, strips, player, missing)
    path = out / "report.html"
    write_text(path, run_page(content))
    return path


def _draw_charts(run: RunData, headline: Headline) -> tuple[JointMeans, RunCharts]:
    """The errors at each bone, and all charts; nothing if no frame was scored."""
    behaviours = [name for name in run.behaviours if any(t.scored.any() for t in run.traces if t.behaviour == name)]
    scored = {trace.series for trace in run.traces if trace.scored.any()}
    ranked = [name for name in run.ranked if name in scored and name in run.charted_series]
    if not ranked:
        return {}, RunCharts()
    highlights = choose_highlights(sorted(ranked, key=lambda name: name != headline.lowest))
    joints = highlighted_means(run, highlights)
    stated = run.series_with_sigma[:1]
    return joints, RunCharts(
        ranking_charts(run),
        parameter_effects.effect_charts(run, highlights),
        [charts.error_over_time(run, behaviour, highlights) for behaviour in behaviours],
        body_chart(joints),
        charts.error_per_joint(run, highlights),
        charts.error_distribution(run, highlights),
        uncertainty.error_against_sigma(run, stated[0]) if stated else None,
    )


def _windows(run: RunData) -> dict[tuple[str, str], WorstWindow]:
    """(series, metric) -> the worst two seconds over all clips."""
    windows = {}
    for series in run.series:
        for metric in WORST_METRICS:
            by_trace = [
                find_worst_window(t.key, metric, t.time_s, t.errors[metric], t.scored)
                for t in run.traces
                if t.series == series
            ]
            if worst := select_worst(window for window in by_trace if window is not None):
                windows[series, metric] = worst
    return windows


def _title(run: RunData, window: WorstWindow) -> str:
    trace = run.trace(window.key)
    return f"{trace.series} on {trace.clip}, {window.start_s:.2f} to {window.end_s:.2f} s"


def _scored_rows(run: RunData, window: WorstWindow) -> Ints:
    """Rows of the scored frames of a window."""
    trace = run.trace(window.key)
    out: Ints = window.first + np.flatnonzero(trace.scored[window.first : window.stop])
    return out


def _instants(run: RunData, window: WorstWindow) -> Ints:
    rows = _scored_rows(run, window)
    out: Ints = rows[np.unique(np.linspace(0, len(rows) - 1, _INSTANTS).round().astype(int))]
    return out


def _still(run: RunData, window: WorstWindow, plots: Path) -> Still:
    """The picture of the instant of a window with the largest value of its metric."""
    trace, row = run.trace(window.key), _worst_row(run, window)
    value = format_number(float(trace.errors[window.metric][row]), DEFINITIONS[window.metric].unit)
    where = f"{trace.series} at its worst instant: {trace.clip}, {trace.time_s[row]:.2f} s"
    unit = DEFINITIONS[window.metric].unit
    return Still(f"{where}, {metric_name(window.metric)} {value} {unit}", plots / "worst_instant.png")


def _worst_row(run: RunData, window: WorstWindow) -> int:
    trace, rows = run.trace(window.key), _scored_rows(run, window)
    return int(rows[np.nanargmax(trace.errors[window.metric][rows])])


def _still_job(cell: Cell, run: RunData, window: WorstWindow, still: Still) -> RenderJob:
    job = _job(still.picture, cell, np.array([_worst_row(run, window)]))
    return replace(job, size=_STILL_SIZE)


def _strip(run: RunData, windows: Sequence[WorstWindow], plots: Path) -> FilmStrip:
    instants_s = [float(t) for t in run.trace(windows[0].key).time_s[_instants(run, windows[0])]]
    return FilmStrip(windows, _title(run, windows[0]), instants_s, plots / f"worst_{windows[0].metric}.png")


def _strip_job(cell: Cell, run: RunData, strip: FilmStrip) -> RenderJob:
    return _job(strip.picture, cell, _instants(run, strip.windows[0]))


def _job(output: Path, cell: Cell, rows: Ints) -> RenderJob:
    return RenderJob(output, cell.bone_m, cell.estimate_bone_m, cell.truth_qpos[rows], cell.estimate_qpos[rows])


def _player(run: RunData, windows: Mapping[tuple[str, str], WorstWindow], reader: Callable[[str], Cell]) -> Markup:
    """The interactive view of all clips and methods; nothing without an estimate."""
    motion, note = run_motion(run, windows, reader)
    if not motion.clips:
        return Markup()
    player = motion_player(motion, "Truth, estimates and stations in 3-D; drag to turn")
    return join(tag("p", note) if note else None, player)
