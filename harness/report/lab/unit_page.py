"""The page of a measured unit: its faults first, what it is like, then every number with its interval."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from harness.core.files import write_text
from harness.core.number_format import count_noun
from harness.report.kit.document import Section, chart_figure, document
from harness.report.kit.markup import Markup, bullet_list, details, join, tag
from harness.report.kit.style import Chart
from harness.report.kit.table import html_table
from harness.report.lab.check_table import departures_table
from harness.report.lab.departure_wording import condense_departures, departure_text
from harness.report.lab.stacked_intervals import stack_intervals
from harness.report.lab.unit_charts import charts
from harness.report.lab.unit_content import ParameterRow, UnitReport
from harness.report.lab.unit_tables import (
    allan_table,
    capture_text,
    episodes_table,
    pair_table,
    parameters_table,
    quality_table,
    reasons,
    spectrum_table,
    stations_page_table,
    stretches_table,
)
from harness.report.lab.unit_wording import advice_text, answer, description

_INTERVALS = (
    "Below the numbers: intervals that hold the true value in 95 of 100 captures. From: the number of events or of "
    "independent samples."
)
_DEPARTURES = (
    "A departure is a number that differs from the expected one by more than chance explains: p after Holm's "
    "correction over all checks is at most 0.05."
)


def write_unit_page(path: Path, report: UnitReport) -> Path:
    """Write the page to `path` and return it; its folder is created."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, unit_page(report, charts(report)))
    return path


def unit_page(report: UnitReport, drawn: Mapping[str, Chart]) -> str:
    """The HTML of the page, with the charts of `unit_charts.charts`; a section without its chart has its table open."""
    facts = {
        "Capture": capture_text(report.capture),
        "Damage": " ".join(report.capture.damage),
        "Unit file": report.unit_file,
        "Expected": f"numbers of {report.expected_from}",
    }
    sections: list[Section] = [
        ("Checks", "checks", _checks(report, drawn)),
        ("Error model", "parameters", _parameters(report.parameters, "Error model")),
        ("Clock and records", "timing", _parameters(report.timing, "Clock and records")),
        ("Stations", "stations", _stations(report)),
        ("Allan deviation", "allan", _allan(report, drawn)),
        ("Spectrum", "spectrum", _with_chart(drawn, "spectrum", _spectrum_numbers(report))),
        ("Episodes", "episodes", _with_chart(drawn, "episodes", _episode_numbers(report))),
        ("Quality", "quality", _with_chart(drawn, "quality", _quality_numbers(report))),
        ("Stations on a bar", "bar", _pairs(report, drawn)),
        ("How long to record", "advice", bullet_list([advice_text(one) for one in report.advice])),
        ("Capture", "capture", _capture(report)),
        ("Made by", "command", tag("pre", tag("code", report.command))),
    ]
    return document(
        title=f"{report.name}: harness characterize",
        kicker="harness characterize",
        heading=answer(report),
        facts={title: text for title, text in facts.items() if text},
        sections=sections,
        lead=_lead(report),
    )


def _lead(report: UnitReport) -> Markup:
    """The departures, then what the unit is like."""
    described = " ".join(description(report))
    return join(
        bullet_list([departure_text(check) for check in condense_departures(report.checks)]),
        tag("p", described) if described else None,
    )


def _checks(report: UnitReport, drawn: Mapping[str, Chart]) -> Markup:
    if not report.checks:
        return Markup()
    table = html_table(
        stack_intervals(departures_table(report.checks)),
        "The least likely first. Below the numbers: 95 % intervals.",
        label="checks",
    )
    unfolded = details(f"All {count_noun(len(report.checks), 'check')}", table) if "checks" in drawn else table
    chart = chart_figure(drawn["checks"]) if "checks" in drawn else None
    return join(tag("p", _DEPARTURES), chart, unfolded)


def _parameters(rows: Sequence[ParameterRow], label: str) -> Markup:
    if not rows:
        return Markup()
    why = bullet_list(reasons(rows))
    return join(
        html_table(stack_intervals(parameters_table(rows)), _INTERVALS, label=label),
        tag("p", "Not measured, and why:", class_="caption") if why else None,
        why,
    )


def _stations(report: UnitReport) -> Markup:
    if not report.stations:
        return Markup()
    caption = (
        "Spread: standard deviation at rest, of the position in space and of the orientation. White noise and drift "
        "are its parts on each axis. Lost readings have quality 0; lost records never came. Below: 95 % intervals."
    )
    return html_table(stations_page_table(report.stations), caption, label="stations")


def _allan(report: UnitReport, drawn: Mapping[str, Chart]) -> Markup:
    tables = [
        html_table(allan_table(curves, factor, unit), caption, label=caption)
        for curves, factor, unit, caption in (
            (report.allan_position, 1e3, "mm", "Allan deviation of the position"),
            (report.allan_orientation, math.degrees(1.0), "deg", "Allan deviation of the orientation"),
        )
        if curves
    ]
    return _with_chart(drawn, "allan", join(*tables) if tables else Markup())


def _spectrum_numbers(report: UnitReport) -> Markup:
    return (
        html_table(spectrum_table(report.spectra), "Density near these frequencies.", label="spectrum")
        if report.spectra
        else Markup()
    )


def _episode_numbers(report: UnitReport) -> Markup:
    if not report.episodes:
        return Markup()
    caption = (
        "Excursion: a displacement of seconds. Echo: a burst of outliers. Gap: a loss. Coast: falling quality before "
        "a loss."
    )
    return html_table(episodes_table(report.episodes), caption, label="episodes")


def _quality_numbers(report: UnitReport) -> Markup:
    return (
        html_table(quality_table(report.quality), "A class includes its upper end.", label="quality")
        if report.quality
        else Markup()
    )


def _pairs(report: UnitReport, drawn: Mapping[str, Chart]) -> Markup:
    parts = []
    for n, pair in enumerate(report.rigid_pairs):
        names = " and ".join(pair.stations)
        table = html_table(
            stack_intervals(pair_table(pair)),
            "Errors of both stations together. Below the numbers: 95 % intervals.",
            label=f"bar of {names}",
        )
        parts.append(_with_chart(drawn, f"pair_{n}", table))
    return join(*parts) if parts else Markup()


def _capture(report: UnitReport) -> Markup:
    stretches = (
        html_table(stretches_table(report.capture), "Parts of the capture.", label="stretches")
        if report.capture.stretches
        else Markup()
    )
    return join(stretches, bullet_list([*report.capture.damage, *report.notes]))


def _with_chart(drawn: Mapping[str, Chart], name: str, table: Markup) -> Markup:
    """A chart with its numbers folded, or the numbers alone."""
    if not table or name not in drawn:
        return table
    return join(chart_figure(drawn[name]), details("Numbers of this chart", table))
