"""Sets of stations as small bodies from the front: the sets that are tied with the recommended one, and two methods."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from harness.core.number_format import Interval, count_noun
from harness.report.kit.chart import draw_chart
from harness.report.kit.page import Block, DataTable, Drawing
from harness.report.kit.style import COLOURS, FAINT, INK, Chart, Figure
from harness.report.placement.body_view import draw_outline, draw_station, locate_places
from harness.report.placement.wording import set_error, set_name
from harness.results.findings import PlacementFindings, StationNames

MOST_BODIES = 8
_COLUMNS, _WIDTH_IN, _BODY_IN, _LINE_IN, _LETTERS = 4, 7.4, 1.9, 0.165, 25


@dataclass(frozen=True)
class SetBody:
    """A set to draw, with a line or two about it."""

    stations: StationNames
    note: str
    """Such as its error; line breaks are kept."""
    title: str = ""
    """What stands above the body."""


def draw_set_bodies(
    findings: PlacementFindings, bodies: Sequence[SetBody], name: str, title: str, caption: str
) -> Chart:
    """The first of these sets as bodies with their stations; the caption says how many more there are."""
    shown = bodies[:MOST_BODIES]
    more = f" And {len(bodies) - len(shown):,} more." if len(bodies) > len(shown) else ""
    texts = ["\n".join([*textwrap.wrap(set_name(body.stations), _LETTERS), body.note]) for body in shown]
    columns = min(_COLUMNS, len(shown))
    rows, lines = math.ceil(len(shown) / columns), max(1 + text.count("\n") for text in texts)
    row_in, head_in = _BODY_IN + _LINE_IN * (lines + 2), _LINE_IN * any(body.title for body in shown)
    places = {place.name: place for place in findings.candidates}

    def draw(figure: Figure) -> None:
        for n, (body, text) in enumerate(zip(shown, texts, strict=True)):
            column, row = n % columns, n // columns
            bottom = 1.0 - (row * row_in + head_in + _BODY_IN) / (rows * row_in)
            axes = figure.add_axes((column / _COLUMNS, bottom, 1.0 / _COLUMNS, _BODY_IN / (rows * row_in)))
            draw_outline(axes)
            at_m, outward = locate_places([places[station] for station in body.stations])
            for (_, across, up), behind in zip(at_m, outward[:, 0] < -0.5, strict=True):
                draw_station(axes, (float(across), float(up)), COLOURS[1], hollow=bool(behind), scale=1.5)
            if body.title:
                axes.annotate(body.title, (0.5, 1.0), xycoords="axes fraction", ha="center", va="bottom", color=FAINT)
            axes.annotate(text, (0.5, 0.0), xycoords="axes fraction", ha="center", va="top", color=INK)

    return draw_chart(
        name,
        title,
        f"{caption} Rings: stations on the back.{more}",
        f"{title}: {'; '.join(f'{set_name(body.stations)}, {body.note}' for body in shown)}.{more}",
        draw,
        rows * row_in,
        width_in=_WIDTH_IN,
        layout=None,
    )


def tied_sets_blocks(findings: PlacementFindings, recommended: StationNames) -> list[Block]:
    """The best set of the recommended size and those tied with it, as bodies and as a table; nothing without ties."""
    first, ties = recommended, next((best.ties for best in findings.best if best.stations == recommended), ())
    if findings.advice:
        first, ties = findings.advice.best.stations, findings.advice.ties
    if not ties:
        return []
    sets = [first, *ties]
    errors = [set_error(findings, findings.of(stations)) for stations in sets]
    bodies = [
        SetBody(stations, error.number, "recommended" if stations == recommended else "")
        for stations, error in zip(sets, errors, strict=True)
    ]
    caption = "The best set of this size and those that are not significantly worse, the best first."
    rows = [[set_name(stations), error] for stations, error in zip(sets, errors, strict=True)]
    table = DataTable(["tied sets, the best first", "error"], rows, label="tied sets", most_printed=MOST_BODIES)
    return [Drawing(partial(draw_set_bodies, findings, bodies, "tied_sets", "Tied sets", caption), table)]


def second_method_blocks(findings: PlacementFindings) -> list[Block]:
    """For each number of stations the set of either method, as two bodies and as a row; nothing without a second."""
    second = findings.second
    if second is None:
        return []
    first = ", ".join(findings.methods)
    bodies = [
        SetBody(stations, count_noun(len(stations), "station"), f"best by {method}")
        for choice in second.choices
        if choice.worse
        for stations, method in ((choice.chosen, first), (choice.best, second.method))
    ]
    rows = [
        [
            len(choice.chosen),
            set_name(choice.chosen),
            set_name(choice.best),
            Interval.of(choice.difference, choice.low, choice.high, signed=True),
            "yes" if choice.worse else "no",
            set_name(choice.shared.stations) if choice.shared else "none" if choice.worse else "",
            choice.units,
        ]
        for choice in second.choices
    ]
    head = ["stations", f"best under {first}", f"best under {second.method}"]
    head += [f"gain under {second.method} [{findings.unit}]", "methods disagree", "good under both", "units"]
    caption = (
        f"Gain: how much less its own best set errs under {second.method} than the set that {first} chose, paired over "
        "units. The methods disagree where the gain is significant. Good under both: tied with the best set under "
        f"{first}, and not significantly worse than any under {second.method}."
    )
    where = "The best sets of either method, where they disagree significantly."
    table = DataTable(head, rows, caption=caption, label="second method")
    draw = partial(draw_set_bodies, findings, bodies, "second_method", "Two methods, two answers", where)
    return [Drawing(draw), table] if bodies else [table]
