"""The page of a constellation: emitters heard and dilution of precision, by place and by station."""

from harness.core.number_format import format_fixed
from harness.report.coverage.content import CoverageContent, format_dilution, place_table, station_table
from harness.report.kit.document import Section, chart_figure, document
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.table import html_table

_DILUTION_NOTE = (
    "The dilution of precision (DOP) is the standard deviation of the position over that of a range: it tells how the "
    "directions of the emitters that are heard turn errors of ranges into errors of a position."
)


def coverage_page(content: CoverageContent) -> str:
    """The HTML of the page."""
    facts = {
        "Emitters": content.emitters,
        "Reach": content.reach,
        "Turn": content.turn,
        "Clip": content.clip,
        "Made by": content.command,
    }
    sections: list[Section] = [
        ("By place", "place", _by_place(content)),
        ("By station", "station", _by_station(content)),
    ]
    return document(
        title=f"{content.name}: harness inspect",
        kicker=f"harness inspect · {content.name}",
        heading=heading(content),
        facts={title: text for title, text in facts.items() if text},
        sections=sections,
    )


def heading(content: CoverageContent) -> str:
    """The coverage of the cube in one sentence, and the station that hears least."""
    volume = content.rows[0]
    text = (
        f"{len(content.emitter_m)} emitters: three or more are heard in {format_fixed(100.0 * volume.share, 0)} % of "
        f"the cube below them, at a median DOP of {format_dilution(volume.dilution)}"
    )
    if content.stations:
        least = min(content.stations, key=lambda row: row.shares[3])
        text += f"; {least.station} hears three for {format_fixed(100.0 * least.shares[3], 0)} % of {content.clip}"
    return text


def _by_place(content: CoverageContent) -> Markup:
    from harness.report.coverage.charts import dilution_chart, heard_chart

    charts = [chart_figure(chart(content), 3) for chart in (heard_chart, dilution_chart)]
    caption = f"A cube of {2 * content.half_m:g} m on the floor below the middle of the emitters, and squares in it."
    table = html_table(place_table(content.rows), caption, label="Coverage by height")
    return join(tag("p", _DILUTION_NOTE), *charts, table)


def _by_station(content: CoverageContent) -> Markup:
    from harness.report.coverage.charts import station_chart

    if not content.stations:
        return Markup()
    caption = (
        f"Shares of the time of {content.clip}, below the middle of its path: direct sound only, past the body, loud "
        "enough for the direction in which the station faces."
    )
    return join(
        chart_figure(station_chart(content), 3),
        html_table(station_table(content.stations), caption, label="Coverage by station"),
    )
