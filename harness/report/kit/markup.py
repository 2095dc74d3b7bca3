"""HTML from nested calls, escaped by default: text stays text, whatever a clip is called."""

import html
from typing import Any


class Markup(str):
    """Text that is HTML already."""

    __slots__ = ()


VOID_ELEMENTS = frozenset({"br", "col", "img", "input", "meta"})


def tag(name: str, /, *children: Any, **attributes: Any) -> Markup:
    """An element; children are escaped unless Markup, None ones and attributes of None or False are left out.

    Trailing underscores of attribute names are dropped (`class_`), others become hyphens.
    """
    words = [name]
    for key, value in attributes.items():
        if value is True:
            words.append(_attribute(key))
        elif value is not None and value is not False:
            words.append(f'{_attribute(key)}="{html.escape(str(value))}"')
    start = f"<{' '.join(words)}>"
    return Markup(start if name in VOID_ELEMENTS else f"{start}{join(*children)}</{name}>")


def join(*parts: Any) -> Markup:
    """Several pieces as one, each escaped unless it is Markup."""
    return Markup("".join(p if isinstance(p, Markup) else html.escape(str(p)) for p in parts if p is not None))


def table(caption: Any, head: list[Any], rows: list[list[Any]], *, label: str) -> Markup:
    """A table whose first column names the rows; it scrolls in itself when it is wider than the page."""
    top = tag("tr", *(tag("th", cell, scope="col") for cell in head))
    body = [tag("tr", tag("th", row[0], scope="row"), *(tag("td", cell) for cell in row[1:])) for row in rows]
    content = tag("table", tag("thead", top), tag("tbody", *body), aria_label=label)
    return join(tag("p", caption, class_="caption"), scroll_box(content, label))


def scroll_box(content: Any, label: str) -> Markup:
    """Wider than a phone: scrolls sideways in its own box, by keyboard too."""
    return tag("div", content, class_="wide", tabindex="0", role="region", aria_label=label)


def details(title: Any, *content: Any, id_: str | None = None) -> Markup:
    """Closed until asked for."""
    return tag("details", tag("summary", title), *content, id_=id_)


def _attribute(key: str) -> str:
    return key.rstrip("_").replace("_", "-")
