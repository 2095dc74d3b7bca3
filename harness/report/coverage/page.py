"""The page of a constellation: emitters heard and dilution of precision, by place and by station."""

from collections.abc import Sequence
from functools import partial

from harness.core.number_format import format_fixed
from harness.report.coverage.charts import dilution_chart, heard_chart, station_chart
from harness.report.coverage.content import CoverageContent, CoverageRow, StationRow, format_dilution
from harness.report.kit.page import Block, BrowserOnly, DataTable, Drawing, Page, Prose, Section

_DILUTION_NOTE = (
    "The dilution of precision (DOP) is the standard deviation of the position over that of a range: it tells how the "
    "directions of the emitters that are heard turn errors of ranges into errors of a position."
)


def coverage_page(content: CoverageContent) -> Page:
    """The page of a constellation."""
    by_place = [Drawing(partial(draw, content)) for draw in (heard_chart, dilution_chart)]
    by_station: list[Block] = [Drawing(partial(station_chart, content)), station_table(content.stations, content.clip)]
    return Page(
        verb="inspect",
        name=content.name,
        headline=coverage_sentence(content),
        facts={
            "Emitters": content.emitters,
            "Reach": content.reach,
            "Turn": content.turn,
            "Clip": content.clip,
            "Made by": content.command,
        },
        sections=[
            Section(
                "By place",
                "place",
                [BrowserOnly([Prose(_DILUTION_NOTE)]), *by_place, place_table(content.rows, content.half_m)],
            ),
            Section("By station", "station", by_station if content.stations else []),
        ],
    )


def coverage_sentence(content: CoverageContent) -> str:
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


def place_table(rows: Sequence[CoverageRow], half_m: float) -> DataTable:
    """Coverage by height."""
    head = ["height above the floor", "3 or more [%]", "DOP up to 10 [%]", "median heard", "median DOP"]
    cells = [
        [r.place, _percent(r.share), _percent(r.fixed), format_fixed(r.heard, 0), format_dilution(r.dilution)]
        for r in rows
    ]
    caption = f"A cube of {2 * half_m:g} m on the floor below the middle of the emitters, and squares in it."
    return DataTable(head, cells, caption=caption, label="Coverage by height")


def station_table(rows: Sequence[StationRow], clip: str) -> DataTable:
    """Coverage by station."""
    head = ["station", "0 heard [%]", "1 [%]", "2 [%]", "3 or more [%]", "DOP up to 10 [%]", "median DOP"]
    cells = [[r.station, *map(_percent, (*r.shares, r.fixed)), format_dilution(r.dilution)] for r in rows]
    caption = (
        f"Shares of the time of {clip}, below the middle of its path: direct sound only, past the body, loud enough "
        "for the direction in which the station faces."
    )
    return DataTable(head, cells, caption=caption, label="Coverage by station")


def _percent(share: float) -> str:
    return format_fixed(100.0 * share, 1)
