"""The page of a live session: body and stations in 3-D, and charts of the line, from events of the server."""

import json
from collections.abc import Sequence
from importlib.resources import files

from harness.core.skeleton import Skeleton
from harness.report.kit import describe_body, page_style, player_element, player_script, tag
from harness.view.page import viewer_page
from harness.view.server import Resource


class LiveContent:
    """What the server answers for a live session besides its events."""

    def __init__(self, title: str, skeleton: Skeleton, stations: Sequence[str], token: str) -> None:
        script = files(__package__).joinpath("live.js").read_text(encoding="utf-8")
        body = {**describe_body(skeleton), "stations": list(stations)}
        self._resources = {
            "/": Resource("text/html; charset=utf-8", _page(title, token)),
            "/viewer.css": Resource("text/css; charset=utf-8", page_style().encode()),
            "/live.js": Resource("text/javascript; charset=utf-8", f"{player_script()}\n{script}".encode()),
            "/body.json": Resource("application/json", json.dumps(body).encode()),
        }

    def find(self, path: str) -> Resource | None:
        """The content of an address; None if there is none."""
        return self._resources.get(path)


def _page(title: str, token: str) -> bytes:
    charts = [
        tag("figure", tag("figcaption", text), id_=name, class_="line-chart")
        for name, text in (
            ("rate", "frames per second"),
            ("loss", "lost readings [%]"),
            ("latency", "latency, p50 and p99 [ms]"),
            ("quality", "quality of each station"),
        )
    ]
    return viewer_page(
        title,
        "harness live",
        _STYLE,
        player_element("The body and its stations in 3-D; drag to turn"),
        tag("p", tag("button", "Record", id_="record", type_="button"), tag("output", id_="said"), class_="controls"),
        tag("ul", id_="stations"),
        tag("div", *charts, id_="charts"),
        script="/live.js",
        token=token,
        header=tag("p", id_="alarm", role="status"),
    )


_STYLE = """
h1 { margin: 0; font-size: 1.2rem; }
#alarm { min-height: 1.6em; margin: 0; color: #c2182b; font-weight: 600; }
.motion-player .stage { height: max(19rem, calc(100vh - 21rem)); }
#stations { display: flex; flex-wrap: wrap; gap: 0.3rem 1.2rem; margin: 0.4rem 0; padding: 0; list-style: none; }
#stations i { display: inline-block; width: 0.8em; height: 0.8em; margin-right: 0.35em; border-radius: 50%; }
#charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(14rem, 1fr)); gap: 0.6rem 1.2rem; }
.line-chart { margin: 0; }
.line-chart svg { display: block; width: 100%; height: 4.5rem; background: var(--raised); }
"""
