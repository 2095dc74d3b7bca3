"""An SVG of matplotlib as a part of a page: without ids that nothing refers to, with data attributes and titles.

matplotlib numbers its elements anew in each chart, so several charts on one page would share ids.
"""

import html
import re
from collections.abc import Mapping

from harness.report.kit.markup import Markup

_REFERENCES = re.compile(r'(?:href="#|url\(#)([^")]+)')
_IDS = re.compile(r' id="([^"]*)"')
_PATHS = re.compile(r'\bd="[^"]*"')
_DECIMALS = re.compile(r"(\.\d\d)\d+")
_METADATA = re.compile(r"<metadata>.*?</metadata>|<style type=\"text/css\">\*\{[^}]*\}</style>", re.DOTALL)
DATA_PREFIX = "data:"
"""Elements whose gid begins so get data attributes: "data:series=3,plot=0" becomes data-series and data-plot."""


def inline_svg(svg: str, alt: str, titles: Mapping[str, str]) -> Markup:
    """The `<svg>` element with an alternative text, and a title for the elements of some gids, shown on hover.

    Coordinates of paths are rounded to 0.01 pt.
    """
    text = _METADATA.sub("", svg[svg.index("<svg") :])
    text = _PATHS.sub(lambda match: _DECIMALS.sub(r"\1", match[0]), text)
    for gid, title in titles.items():
        text = text.replace(f'<g id="{gid}">', f"<g><title>{html.escape(title)}</title>", 1)
    kept = set(_REFERENCES.findall(text))
    text = _IDS.sub(lambda match: _attributes(match[1], kept), text)
    return Markup(text.replace("<svg", f'<svg role="group" aria-label="{html.escape(alt)}"', 1))


def _attributes(gid: str, kept: set[str]) -> str:
    if gid.startswith(DATA_PREFIX):
        pairs = (pair.split("=") for pair in gid.removeprefix(DATA_PREFIX).split(","))
        return "".join(f' data-{name}="{value}"' for name, value in pairs)
    return f' id="{gid}"' if gid in kept else ""
