"""The page of a run: its verdict, tables and pictures in order."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.core.files import to_json_types
from harness.report.kit.document import Section, chart_figure, data_uri, document
from harness.report.kit.markup import Markup, details, join, scroll_box, table, tag
from harness.report.kit.style import Chart
from harness.report.run import (
    calibration_cost,
    calibration_errors,
    expected_orders,
    parameter_effects,
    recovery,
    tables,
)
from harness.report.run.data import RunData
from harness.report.run.headline import Headline
from harness.report.run.worst_window import WorstWindow
from harness.score.metrics import DEFINITIONS

_REPRODUCE_NOTE = "Run it where the scenario file and, for recorded motion, the library lie."


@dataclass(frozen=True)
class FilmStrip:
    """The worst two seconds of the leading method by one metric, as a picture."""

    windows: Sequence[WorstWindow]
    """Which coincide; the first is shown."""
    title: str
    instants_s: Sequence[float]
    picture: Path
    """May be absent: then the page says so."""


@dataclass(frozen=True)
class RunContent:
    """All that the page shows."""

    run: RunData
    verdict: Headline
    varied: Sequence[Chart]
    over_time: Sequence[Chart]
    per_joint: Chart | None
    distribution: Chart | None
    windows: Mapping[tuple[str, str], WorstWindow]
    """(series, metric) -> its worst two seconds."""
    strips: Sequence[FilmStrip]
    scrubber: Markup
    movies: Sequence[Path]
    missing: Sequence[str]
    """What is not on the page, and why."""


def run_page(content: RunContent) -> str:
    """The whole file."""
    run = content.run
    return document(
        title=f"{run.name}: harness report",
        kicker=f"harness report · {run.name}",
        heading=content.verdict.sentence,
        facts=content.verdict.facts,
        missing=content.missing,
        sections=_sections(content),
    )


def _sections(content: RunContent) -> list[Section]:
    run = content.run
    measured = bool(run.cells)
    nothing, cells = Markup(), run.full_summary["cells"]
    return [
        (
            "Varied",
            "varied",
            join(*(chart_figure(chart, 3) for chart in content.varied), parameter_effects.effect_tables(run)),
        ),
        ("Expected orders", "expected_orders", expected_orders.section(run.full_summary)),
        ("Calibration", "calibration", join(calibration_errors.section(cells), calibration_cost.section(cells))),
        ("Results", "results", tables.results_tables(run) if measured else nothing),
        ("Recovery", "recovery", recovery.section(run.summary)),
        ("Coverage", "coverage", tables.coverage_tables(run)),
        ("Error over time", "time", join(*(chart_figure(chart, 3) for chart in content.over_time))),
        ("Each joint", "joints", chart_figure(content.per_joint) if content.per_joint else nothing),
        ("Error distribution", "cdf", chart_figure(content.distribution) if content.distribution else nothing),
        ("Stream health", "health", tables.health_tables(run) if measured else nothing),
        ("Worst two seconds", "worst", _worst_section(content) if content.windows else nothing),
        ("In 3-D", "look", _view_3d(content)),
        (
            "Every metric",
            "metrics",
            _every_metric(run) if measured else nothing,
        ),
        ("Manifest", "manifest", _manifest(run)),
        ("Reproduce", "reproduce", _reproduce(run)),
    ]


def _worst_section(content: RunContent) -> Markup:
    metrics = list(dict.fromkeys(metric for _, metric in content.windows))
    clips = {trace.key: trace.clip for trace in content.run.traces}
    rows = []
    for series in content.run.series:
        cells: list[Any] = []
        for metric in metrics:
            window = content.windows.get((series, metric))
            if window is None:
                cells.append(tables.NOT_MEASURED)
                continue
            place = join(clips[window.key], tag("br"), _format_span(window))
            cells.append(join(_format_mean(window), tag("span", place, class_="spread under")))
        rows.append([series, *cells])
    head = ["method", *metrics]
    caption = "The two seconds with the largest mean of each metric, and where they are."
    summary = table(caption, head, rows, label="worst two seconds")
    key = tag("p", "The leading method, where it was worst. ", _colour_key())
    strips = [_film_strip(strip) for strip in content.strips if strip.picture.is_file()]
    links = [tag("li", tag("a", path.name, href=path.name)) for path in content.movies]
    movies = join(tag("h3", "Movies"), tag("ul", *links)) if links else None
    return join(summary, key if strips else None, *strips, movies)


def _film_strip(strip: FilmStrip) -> Markup:
    alt = f"Truth and estimate at {len(strip.instants_s)} instants of {strip.title}"
    times = tag("div", *(tag("span", f"{t:.2f} s") for t in strip.instants_s), class_="times")
    image = tag("img", src=data_uri(strip.picture.read_bytes(), "image/png"), alt=alt)
    means = [f"{window.metric} {_format_mean(window)} ({_format_span(window)})" for window in strip.windows]
    caption = join(tag("b", f"{strip.title}. "), f"Means: {', '.join(means)}.")
    return tag("figure", scroll_box(join(image, times), strip.title), tag("figcaption", caption), class_="strip")


def _colour_key() -> Markup:
    truth, estimate = (tag("span", class_=f"chip {name}") for name in ("truth", "estimate"))
    return join(truth, "truth, pale and full; ", estimate, "estimate, slimmer: where it is right it lies inside.")


def _view_3d(content: RunContent) -> Markup:
    if not content.scrubber:
        return Markup()
    text = "The worst two seconds of every method. Drag to turn; the camera follows the true root."
    return join(tag("p", text, " ", _colour_key()), content.scrubber)


def _every_metric(run: RunData) -> Markup:
    return details("All metrics, all methods", tables.all_metrics_table(run))


def _manifest(run: RunData) -> Markup:
    text = json.dumps(to_json_types(run.manifest.as_dict()), indent=2, ensure_ascii=False)
    notes = list(dict.fromkeys(f"{trace.clip}: {note}" for trace in run.traces for note in trace.notes))
    listed = details("Notes on the motion", tag("ul", *(tag("li", note) for note in notes))) if notes else None
    return join(details("Inputs, metric versions, circumstances", tag("pre", text)), listed)


def _reproduce(run: RunData) -> Markup:
    command = run.manifest.circumstances.get("command")
    again = shlex.join(["harness", "report", str(run.out)])
    if not command:
        return tag("p", "The run was started from a program: no command was recorded.")
    return join(
        tag("pre", tag("code", str(command))), tag("p", f"{_REPRODUCE_NOTE} This page alone: ", tag("code", again))
    )


def _format_mean(window: WorstWindow) -> str:
    unit = DEFINITIONS[window.metric].unit
    return f"{tables.format_number(window.mean, unit)} {unit}"


def _format_span(window: WorstWindow) -> str:
    return f"{window.start_s:.1f}–{window.end_s:.1f} s"
