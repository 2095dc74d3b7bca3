"""The page of a live session: status, body and stations in 3-D, charts of the line, and commands with a token.

The page carries no token. A reader has it from the part of the address behind `#`, which only the starter of the
session knows; without it the page shows everything and offers no command.
"""

import json
from collections.abc import Sequence
from importlib.resources import files
from itertools import cycle

from harness.core.skeleton import Skeleton
from harness.report.kit import Markup, describe_body, page_style, player_element, player_script, tag
from harness.view.page import viewer_page
from harness.view.server import Resource

STATUS_COLOURS = {"OK": "#00795c", "HELD": "#f2c200", "LOST": "#c8321e"}
STATION_COLOURS = ("#248bf2", "#8c4d82", "#6262b2", "#b28695", "#8b24f2", "#978fbf")
"""Colours of the stations, in turn. No two of them or of a status are alike, also for colour-blind readers. Their
contrast is about 3 or more to a light and to a dark page."""
_CALIBRATIONS = {
    "tpose": ("Calibrate: T-pose", "mounts and room; this session uses them"),
    "poses": ("Calibrate: eight poses", "bones, mounts and room; the next session uses them, by --calibration"),
}
"""Kind of a calibration -> text and explanation of its button."""


class LiveContent:
    """What the server answers for a live session besides its events."""

    def __init__(
        self, title: str, skeleton: Skeleton, stations: Sequence[str], calibrations: Sequence[str] = ()
    ) -> None:
        """`calibrations` are the kinds that the page offers: `tpose` and `poses`."""
        body = {**describe_body(skeleton), "stations": list(stations)}
        self._resources = {
            "/": Resource("text/html; charset=utf-8", _page(title, stations, calibrations)),
            "/viewer.css": Resource("text/css; charset=utf-8", page_style().encode()),
            "/live.js": Resource("text/javascript; charset=utf-8", f"{player_script()}\n{_text('live.js')}".encode()),
            "/body.json": Resource("application/json", json.dumps(body).encode()),
        }

    def find(self, path: str) -> Resource | None:
        """The content of an address; None if there is none."""
        return self._resources.get(path)


def _page(title: str, stations: Sequence[str], calibrations: Sequence[str]) -> bytes:
    rows = [
        tag(
            "li",
            tag("span", tag("i", style=f"background: var({colour})"), name),
            tag("b", "LOST", class_="word", data_word="LOST"),
            tag("output", "–"),
            _plot(),
            data_colour=colour,
        )
        for name, colour in zip(stations, cycle(f"--station-{n}" for n in range(len(STATION_COLOURS))), strict=False)
    ]
    charts = [
        tag("figure", tag("figcaption", text, " ", tag("output")), _plot(), _TIME_AXIS, id_=name)
        for name, text in (
            ("rate", "Poses:"),
            ("loss", "Readings lost:"),
            ("latency", "Latency p50, p99 (dashed):"),
        )
    ]
    offered = {kind: _CALIBRATIONS[kind] for kind in calibrations}
    buttons = [
        tag("button", "Reset heading", id_="heading", type_="button", title="key H"),
        *(tag("button", text, type_="button", data_kind=kind, title=title) for kind, (text, title) in offered.items()),
        tag("button", "Record", id_="record", type_="button", title="key R"),
    ]
    reader = "You can look and not command. Commands need the address that the terminal of the session shows."
    calibration = tag(
        "section",
        tag("h2"),
        tag("p", class_="instruction"),
        tag("progress", max=1, value=0),
        tag("ul"),
        tag("details", tag("summary", "Report"), tag("pre")),
        id_="calibration",
        hidden=True,
    )
    uncertainty = tag("p", tag("i", hidden=True), tag("output"), id_="uncertainty")
    return viewer_page(
        title,
        "harness live",
        _style(),
        tag("p", tag("b", "LOST"), tag("span", "no pose yet"), id_="session", role="status", data_word="LOST"),
        tag("p", *buttons, tag("output", id_="said"), class_="controls"),
        tag("p", reader, id_="reader", hidden=True),
        tag(
            "main",
            tag("div", calibration, player_element("The body and its stations in 3-D; drag to turn"), uncertainty),
            tag(
                "section",
                tag("h2", "Stations and their quality"),
                tag("ul", *rows, id_="stations"),
                _TIME_AXIS,
                tag("div", *charts, id_="charts"),
            ),
        ),
        script="/live.js",
        token="",  # a reader has it from the address
    )


def _plot() -> Markup:
    """A chart without lines: labels of its axis and a place for the lines."""
    labels = tag("span", class_="top"), tag("span", "0", class_="zero")
    return tag("div", *labels, Markup('<svg viewBox="0 0 300 100" preserveAspectRatio="none"></svg>'), class_="plot")


_TIME_AXIS = tag("p", tag("span", "60 s ago"), tag("span", "30 s"), tag("span", "now"), class_="time")


def _style() -> str:
    colours = [f"--{word.lower()}: {colour};" for word, colour in STATUS_COLOURS.items()]
    colours += [f"--station-{n}: {colour};" for n, colour in enumerate(STATION_COLOURS)]
    return f":root {{ {' '.join(colours)} }}\n{_text('live.css')}"


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
