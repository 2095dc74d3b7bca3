"""Writes the report of a finished run: charts, rendered pictures, movies on request, and the page."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from harness.core.arrays import Ints
from harness.core.files import write_text
from harness.core.number_format import format_number
from harness.core.progress import ProgressCallback
from harness.report.kit.chart import clear_plots
from harness.report.kit.highlights import choose_highlights
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.metric_labels import quantity
from harness.report.kit.motion_player import motion_player
from harness.report.kit.render_process import RenderJob, RenderProcess
from harness.report.kit.text import to_file_name
from harness.report.run import charts, parameter_effects, uncertainty
from harness.report.run.data import WORST_METRICS, RunData, read_run
from harness.report.run.headline import Headline, build_headline
from harness.report.run.joint_errors import JointMeans, body_chart, highlighted_means
from harness.report.run.page import FilmStrip, RunCharts, RunContent, Still, run_page
from harness.report.run.player_data import run_motion
from harness.report.run.ranking_chart import ranking_charts
from harness.report.run.worst_window import WorstWindow, find_worst_window, group_overlapping, select_worst
from harness.results.cell import Cell
from harness.results.reported_metrics import PRIMARY_METRIC
from harness.score.metrics import DEFINITIONS

_INSTANTS = 5
"""Pictures in a film strip."""
_STILL_SIZE = (640, 600)
"""Width and height of the picture on the first screen [px]."""
_MOVIE_FPS = (20.0, 30.0)
"""Lowest and highest frame rate of a movie [1/s]."""


def write_run_page(
    out: Path,
    *,
    movie: bool = False,
    rendered: bool = True,
    progress: ProgressCallback = lambda last, done, planned: None,
) -> Path:
    """Write OUT/plots and OUT/report.html of the run in `out`; returns the path of the page.

    `movie` adds OUT/movie_*.mp4 of each method's worst cell; `progress` is called while movies are rendered. Without
    `rendered`, OpenGL or an optional package, the page says which pictures are missing and why. BadFile if the folder
    holds no finished run.
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
    movies, no_movies = _movies(run, reader, progress) if movie else ([], "")
    if no_movies:
        missing.append(f"Movies: {no_movies}")
    for chart in drawn.all():
        chart.write(plots)
    content = RunContent(run, headline, drawn, joints, still, reason, windows, strips, player, movies, missing)
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
    return Still(f"{where}, {quantity(window.metric)} {value} {unit}", plots / "worst_instant.png")


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


def _job(output: Path, cell: Cell, rows: Ints, fps: float = 0.0, title: str = "") -> RenderJob:
    qpos = cell.truth_qpos[rows], cell.estimate_qpos[rows]
    return RenderJob(output, cell.bone_m, cell.estimate_bone_m, *qpos, fps, title)


def _player(run: RunData, windows: Mapping[tuple[str, str], WorstWindow], reader: Callable[[str], Cell]) -> Markup:
    """The interactive view of all clips and methods; nothing without an estimate."""
    motion, note = run_motion(run, windows, reader)
    if not motion.clips:
        return Markup()
    player = motion_player(motion, "Truth, estimates and stations in 3-D; drag to turn")
    return join(tag("p", note) if note else None, player)


def _movies(run: RunData, reader: Callable[[str], Cell], progress: ProgressCallback) -> tuple[list[Path], str]:
    """Movies of each method's worst cell in real time: the files that were made, and why others are missing."""
    jobs = []
    for series in run.series:
        rows = [row for row in run.cells if run.series_of(row) == series and row[PRIMARY_METRIC] is not None]
        if rows:
            worst = max(rows, key=lambda row: float(row[PRIMARY_METRIC]))
            jobs.append(_movie_job(reader(str(worst["key"])), series, run.out))
    with RenderProcess(jobs) as rendering:
        reason = rendering.finish(progress)
    return [job.output for job in jobs if job.output.is_file()], reason


def _movie_job(cell: Cell, series: str, out: Path) -> RenderJob:
    """Shows at each time of the movie the latest estimate of that time."""
    finite = np.flatnonzero(np.isfinite(cell.estimate_qpos).all(axis=1))
    fps = movie_fps(cell.rate_hz)
    time_s = cell.time_s[finite]
    movie_s = np.arange(time_s[0], time_s[-1] + 1e-9, 1.0 / fps)
    rows = finite[np.searchsorted(time_s, movie_s + 1e-6, side="right") - 1]
    path = out / f"movie_{to_file_name(series)}_{to_file_name(cell.clip)}_{cell.key[:8]}.mp4"
    return _job(path, cell, rows, fps, f"{series} on {cell.clip}")


def movie_fps(rate_hz: float) -> float:
    """The stream's rate divided by an integer, between 20 and 30 1/s, so that steps are even; else 25."""
    low, high = _MOVIE_FPS
    rates = [rate_hz / n for n in range(1, 1 + int(rate_hz / low)) if low <= rate_hz / n <= high]
    return max(rates, default=25.0)
