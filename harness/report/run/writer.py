"""The report of a finished run: plots, pictures, movies on request, and the page that holds them."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from harness.core.arrays import Ints
from harness.core.files import write_text
from harness.core.humanoid24 import standard_skeleton
from harness.report.kit.markup import Markup
from harness.report.kit.render_process import ProgressCallback, RenderJob, RenderProcess
from harness.report.kit.skeleton_player import PlayerSegment, skeleton_player
from harness.report.run import charts, parameter_effects
from harness.report.run.data import WORST_METRICS, RunData, pose_pair, read_run, to_file_name
from harness.report.run.headline import PRIMARY_METRIC, build_headline
from harness.report.run.page import FilmStrip, RunContent, run_page
from harness.report.run.worst_window import WorstWindow, find_worst_window, group_overlapping, select_worst
from harness.results.cell import Cell

_INSTANTS = 5
"""Pictures in a strip."""
_MOVIE_FPS = (20.0, 30.0)


def write_run_page(
    out: Path,
    *,
    movie: bool = False,
    rendered: bool = True,
    progress: ProgressCallback = lambda last, done, planned: None,
) -> Path:
    """Write OUT/plots and OUT/report.html of the run in `out`; returns the page.

    `movie` adds OUT/movie_*.mp4 of each method's worst cell. Without `rendered`, OpenGL or an extra, the page says
    which pictures are missing and why. `progress` follows the movies. Raises BadFile when the folder holds no
    finished run.
    """
    run = read_run(out)
    plots = out / "plots"
    plots.mkdir(exist_ok=True)
    for old in (*plots.glob("*.svg"), *plots.glob("*.png")):
        old.unlink()
    found = build_headline(run)
    windows = _windows(run)
    reader = cache(run.cell)
    leading = [window for (series, _), window in windows.items() if series == found.best]
    strips = [_strip(run, group, plots) for group in group_overlapping(leading)]
    rendering = RenderProcess([_strip_job(reader(s.windows[0].key), run, s) for s in strips] if rendered else [])
    try:
        measured = [name for name in run.behaviours if any(t.scored.any() for t in run.traces if t.behaviour == name)]
        curves = parameter_effects.effect_charts(run)
        over_time = [charts.error_over_time(run, behaviour) for behaviour in measured]
        per_joint = charts.error_per_joint(run, found.best) if found.best else None
        distribution = charts.error_distribution(run) if measured else None
        view, no_view = _scrubber(run, windows, found.best, reader)
        reason = rendering.finish() if rendered else "rendering was turned off"
    finally:
        rendering.close()
    missing = []
    if windows and not strips:
        missing.append("Rendered pictures of the worst two seconds: no method leads")
    if strips and reason:
        missing.append(f"Rendered pictures of the worst two seconds: {reason}")
    if no_view:
        missing.append(f"Interactive view: {no_view}")
    movies, no_movies = _movies(run, reader, progress) if movie else ([], "")
    if no_movies:
        missing.append(f"Movies: {no_movies}")
    for chart in (*curves, *over_time, *(chart for chart in (per_joint, distribution) if chart)):
        chart.write(plots)
    content = RunContent(run, found, curves, over_time, per_joint, distribution, windows, strips, view, movies, missing)
    path = out / "report.html"
    write_text(path, run_page(content))
    return path


def _windows(run: RunData) -> dict[tuple[str, str], WorstWindow]:
    """(series, metric) -> the worst two seconds of all its clips."""
    found = {}
    for series in run.series:
        for metric in WORST_METRICS:
            each = [
                find_worst_window(t.key, metric, t.time_s, t.errors[metric], t.scored)
                for t in run.traces
                if t.series == series
            ]
            if worst := select_worst(window for window in each if window is not None):
                found[series, metric] = worst
    return found


def _title(run: RunData, window: WorstWindow) -> str:
    trace = run.trace(window.key)
    return f"{trace.series} on {trace.clip}, {window.start_s:.2f} to {window.end_s:.2f} s"


def _scored_rows(run: RunData, window: WorstWindow) -> Ints:
    """The frames of a window that have a finite estimate."""
    trace = run.trace(window.key)
    out: Ints = window.first + np.flatnonzero(trace.scored[window.first : window.stop])
    return out


def _instants(run: RunData, window: WorstWindow) -> Ints:
    rows = _scored_rows(run, window)
    out: Ints = rows[np.unique(np.linspace(0, len(rows) - 1, _INSTANTS).round().astype(int))]
    return out


def _strip(run: RunData, windows: Sequence[WorstWindow], plots: Path) -> FilmStrip:
    instants_s = [float(t) for t in run.trace(windows[0].key).time_s[_instants(run, windows[0])]]
    return FilmStrip(windows, _title(run, windows[0]), instants_s, plots / f"worst_{windows[0].metric}.png")


def _strip_job(cell: Cell, run: RunData, strip: FilmStrip) -> RenderJob:
    rows = _instants(run, strip.windows[0])
    return _job(strip.picture, cell, rows)


def _job(output: Path, cell: Cell, rows: Ints, fps: float = 0.0, title: str = "") -> RenderJob:
    shown = cell.truth_qpos[rows], cell.estimate_qpos[rows]
    return RenderJob(output, cell.bone_m, cell.estimate_bone_m, *shown, fps, title)


def _scrubber(
    run: RunData, windows: Mapping[tuple[str, str], WorstWindow], best: str | None, reader: Callable[[str], Cell]
) -> tuple[Markup, str]:
    """The interactive view of every method's worst seconds, the leading one's first; or nothing and why."""
    shots = []
    for name in sorted(run.series, key=lambda name: name != best):
        groups = group_overlapping(window for (series, _), window in windows.items() if series == name)
        shots += [_shot(run, name, group, reader(group[0].key)) for group in groups]
    return skeleton_player(standard_skeleton(), shots) if shots else (Markup(), "")


def _shot(run: RunData, series: str, windows: Sequence[WorstWindow], cell: Cell) -> PlayerSegment:
    rows = _scored_rows(run, windows[0])
    metrics = ", ".join(window.metric for window in windows)
    title = f"{series} on {cell.clip}, {windows[0].start_s:.1f}–{windows[0].end_s:.1f} s: {metrics}"
    return PlayerSegment(title, cell.time_s[rows].tolist(), *pose_pair(cell, rows))


def _movies(run: RunData, reader: Callable[[str], Cell], progress: ProgressCallback) -> tuple[list[Path], str]:
    """The whole worst cell of each method, in real time; the files that could be made, and why not the others."""
    jobs = []
    for series in run.series:
        rows = [row for row in run.cells if run.series_of(row) == series and row[PRIMARY_METRIC] is not None]
        if rows:
            worst = max(rows, key=lambda row: float(row[PRIMARY_METRIC]))
            jobs.append(_movie_job(reader(str(worst["key"])), series, run.out))
    rendering = RenderProcess(jobs)
    try:
        reason = rendering.finish(progress)
    finally:
        rendering.close()
    return [job.output for job in jobs if job.output.is_file()], reason


def _movie_job(cell: Cell, series: str, out: Path) -> RenderJob:
    """At each picture's time the last estimate that had come by then."""
    known = np.flatnonzero(np.isfinite(cell.estimate_qpos).all(axis=1))
    fps = movie_fps(cell.rate_hz)
    time_s = cell.time_s[known]
    shown_s = np.arange(time_s[0], time_s[-1] + 1e-9, 1.0 / fps)
    rows = known[np.searchsorted(time_s, shown_s + 1e-6, side="right") - 1]
    path = out / f"movie_{to_file_name(series)}_{to_file_name(cell.clip)}_{cell.key[:8]}.mp4"
    return _job(path, cell, rows, fps, f"{series} on {cell.clip}")


def movie_fps(rate_hz: float) -> float:
    """A whole part of the stream's rate between 20 and 30 pictures/s, so that no step is uneven; else 25."""
    low, high = _MOVIE_FPS
    parts = [rate_hz / n for n in range(1, 1 + int(rate_hz / low)) if low <= rate_hz / n <= high]
    return max(parts, default=25.0)
