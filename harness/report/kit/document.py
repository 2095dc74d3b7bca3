"""The frame of every page: one HTML file that loads nothing from elsewhere, with a heading, facts and sections."""

import base64
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.report.kit.inline_svg import inline_svg
from harness.report.kit.markup import Markup, join, scroll_box, tag
from harness.report.kit.style import Chart

PAGE_BEGIN = b'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy"'
"""First bytes of a page, by which one is told from another file."""
_CONTENT_SECURITY_POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
    "base-uri 'none'; form-action 'none'"
)
Section = tuple[str, str, Markup]
"""Title, name for links, content; a section without content is left out."""


def html_document(
    *,
    title: str,
    kicker: str,
    heading: str,
    facts: Mapping[str, str],
    missing: Sequence[str] = (),
    sections: Sequence[Section],
    lead: Markup | None = None,
    picture: Markup | None = None,
    tables: Markup | None = None,
) -> str:
    """The HTML of a page: heading, `lead`, facts, what is missing, links to the sections, then the sections.

    The picture stands beside the lead and the facts, and the tables below them.
    """
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=_CONTENT_SECURITY_POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Markup(page_style())),
    )
    shown = [(title, name, content) for title, name, content in sections if content]
    about = facts_list(facts, missing)
    links = tag("ul", *(tag("li", tag("a", title, href=f"#{name}")) for title, name, _ in shown))
    content = join(
        tag(
            "header",
            tag("p", kicker, class_="kicker"),
            tag("h1", heading),
            tag("div", tag("div", lead, about), picture, class_="pictured") if picture else join(lead, about),
            tables,
            tag("nav", links, aria_label="sections"),
        ),
        tag("main", *(tag("section", tag("h2", title), content, id_=name) for title, name, content in shown)),
    )
    scripts = [_script("scroll_hint.js"), *([_script("hover_chart.js")] if "data-hover=" in content else [])]
    return f"<!doctype html>\n{tag('html', head, tag('body', content, *scripts), lang='en')}\n"


def facts_list(facts: Mapping[str, str], missing: Sequence[str] = ()) -> Markup:
    """Facts with their titles, and what is missing on the page; nothing without any."""
    rows = [join(tag("dt", title), tag("dd", text)) for title, text in facts.items()]
    if missing:
        texts = [tag("span", text, tag("br")) for text in missing]
        rows.append(join(tag("dt", "Missing"), tag("dd", *texts, class_="missing")))
    return tag("dl", *rows, class_="facts") if rows else Markup()


def _script(name: str) -> Markup:
    return tag("script", Markup(Path(__file__).with_name(name).read_text(encoding="utf-8")))


def page_style() -> str:
    """The style sheet of every page."""
    return Path(__file__).with_name("page.css").read_text(encoding="utf-8")


def chart_figure(chart: Chart, level: int = 0) -> Markup:
    """A chart under a heading of `level`; with level 0 the title stands in the caption."""
    title = tag(f"h{level}", chart.title) if level else None
    caption: Any = chart.caption if level else join(tag("b", f"{chart.title}. "), chart.caption)
    content = scroll_box(chart_image(chart), chart.title), tag("figcaption", caption)
    lines = json.dumps(chart.lines, separators=(",", ":")) if chart.lines else None
    return join(title, tag("figure", *content, class_="chart", data_hover=lines))


def chart_panel(chart: Chart, heading: Markup | None = None) -> Markup:
    """A small chart with a heading, by default its title, and its caption, for a grid of charts."""
    caption = tag("figcaption", chart.caption) if chart.caption else None
    return tag("figure", heading or tag("h3", chart.title), chart_image(chart), caption, class_="panel")


def chart_image(chart: Chart) -> Markup:
    """The chart as a picture that follows the reader's light or dark screen; inline if it answers to the pointer."""
    if chart.lines or chart.titles:
        return inline_svg(chart.for_screen(), chart.alt, chart.titles)
    return tag("img", src=data_uri(chart.for_screen().encode(), "image/svg+xml"), alt=chart.alt)


def picture_uri(picture: Path) -> str:
    """A data URI of a PNG file as WebP, which needs a tenth of the bytes."""
    from PIL import Image

    file = io.BytesIO()
    with Image.open(picture) as image:
        image.save(file, "WEBP", quality=82, method=6)
    return data_uri(file.getvalue(), "image/webp")


def data_uri(content: bytes, kind: str) -> str:
    """A data URI that holds the content of a file of this MIME type."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
