"""The page of a run: its verdict, tables and pictures in order."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.core.files import plain
from harness.report.kit.document import Section, document, embedded, pictured
from harness.report.kit.markup import Markup, folded, joined, scrolling, table, tag
from harness.report.kit.style import Chart
from harness.report.run import (
    calibration_cost,
    calibration_errors,
    expected_orders,
    parameter_effects,
    recovery,
    tables,
)
from harness.report.run.data import Run
from harness.report.run.headline import Verdict
from harness.report.run.worst_window import Window
from harness.score.metrics import DEFINITIONS

_WHERE = "Run it where the scenario file and, for recorded motion, the library lie."


@dataclass(frozen=True)
class Strip:
    """The worst two seconds of the leading method by one metric, as a picture."""

    windows: Sequence[Window]
    """Which coincide; the first is shown."""
    title: str
    instants_s: Sequence[float]
    picture: Path
    """May be absent: then the page says so."""


@dataclass(frozen=True)
class Content:
    """All that the page shows."""

    run: Run
    verdict: Verdict
    varied: Sequence[Chart]
    over_time: Sequence[Chart]
    per_joint: Chart | None
    distribution: Chart | None
    windows: Mapping[tuple[str, str], Window]
    """(series, metric) -> its worst two seconds."""
    strips: Sequence[Strip]
    scrubber: Markup
    movies: Sequence[Path]
    missing: Sequence[str]
    """What is not on the page, and why."""


def page(content: Content) -> str:
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


def _sections(content: Content) -> list[Section]:
    run = content.run
    measured = bool(run.cells)
    nothing, cells = Markup(), run.whole["cells"]
    return [
        ("Varied", "varied", joined(*(pictured(chart, 3) for chart in content.varied), parameter_effects.tables(run))),
        ("Expected orders", "orders", expected_orders.section(run.whole)),
        ("Calibration", "calibration", joined(calibration_errors.section(cells), calibration_cost.section(cells))),
        ("Results", "results", tables.results(run) if measured else nothing),
        ("Recovery", "recovery", recovery.section(run.summary)),
        ("Coverage", "coverage", tables.coverage(run)),
        ("Error over time", "time", joined(*(pictured(chart, 3) for chart in content.over_time))),
        ("Each joint", "joints", pictured(content.per_joint) if content.per_joint else nothing),
        ("Error distribution", "cdf", pictured(content.distribution) if content.distribution else nothing),
        ("Stream health", "health", tables.health(run) if measured else nothing),
        ("Worst two seconds", "worst", _worst(content) if content.windows else nothing),
        ("In 3-D", "look", _look(content)),
        (
            "Every metric",
            "metrics",
            _every_metric(run) if measured else nothing,
        ),
        ("Manifest", "manifest", _manifest(run)),
        ("Reproduce", "reproduce", _reproduce(run)),
    ]


def _worst(content: Content) -> Markup:
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
            place = joined(clips[window.key], tag("br"), _span(window))
            cells.append(joined(_mean(window), tag("span", place, class_="spread under")))
        rows.append([series, *cells])
    head = ["method", *metrics]
    caption = "The two seconds with the largest mean of each metric, and where they are."
    summary = table(caption, head, rows, label="worst two seconds")
    key = tag("p", "The leading method, where it was worst. ", _key())
    strips = [_strip(strip) for strip in content.strips if strip.picture.is_file()]
    links = [tag("li", tag("a", path.name, href=path.name)) for path in content.movies]
    movies = joined(tag("h3", "Movies"), tag("ul", *links)) if links else None
    return joined(summary, key if strips else None, *strips, movies)


def _strip(strip: Strip) -> Markup:
    alt = f"Truth and estimate at {len(strip.instants_s)} instants of {strip.title}"
    times = tag("div", *(tag("span", f"{t:.2f} s") for t in strip.instants_s), class_="times")
    image = tag("img", src=embedded(strip.picture.read_bytes(), "image/png"), alt=alt)
    means = [f"{window.metric} {_mean(window)} ({_span(window)})" for window in strip.windows]
    caption = joined(tag("b", f"{strip.title}. "), f"Means: {', '.join(means)}.")
    return tag("figure", scrolling(joined(image, times), strip.title), tag("figcaption", caption), class_="strip")


def _key() -> Markup:
    truth, estimate = (tag("span", class_=f"chip {name}") for name in ("truth", "estimate"))
    return joined(truth, "truth, pale and full; ", estimate, "estimate, slimmer: where it is right it lies inside.")


def _look(content: Content) -> Markup:
    if not content.scrubber:
        return Markup()
    text = "The worst two seconds of every method. Drag to turn; the camera follows the true root."
    return joined(tag("p", text, " ", _key()), content.scrubber)


def _every_metric(run: Run) -> Markup:
    return folded("All metrics, all methods", tables.everything(run))


def _manifest(run: Run) -> Markup:
    text = json.dumps(plain(run.manifest.as_dict()), indent=2, ensure_ascii=False)
    notes = list(dict.fromkeys(f"{trace.clip}: {note}" for trace in run.traces for note in trace.notes))
    listed = folded("Notes on the motion", tag("ul", *(tag("li", note) for note in notes))) if notes else None
    return joined(folded("Inputs, metric versions, circumstances", tag("pre", text)), listed)


def _reproduce(run: Run) -> Markup:
    command = run.manifest.circumstances.get("command")
    again = shlex.join(["harness", "report", str(run.out)])
    if not command:
        return tag("p", "The run was started from a program: no command was recorded.")
    return joined(tag("pre", tag("code", str(command))), tag("p", f"{_WHERE} This page alone: ", tag("code", again)))


def _mean(window: Window) -> str:
    unit = DEFINITIONS[window.metric].unit
    return f"{tables.number(window.mean, unit)} {unit}"


def _span(window: Window) -> str:
    return f"{window.start_s:.1f}–{window.end_s:.1f} s"
