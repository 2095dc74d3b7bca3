"""HTML from nested calls. Text is escaped by default, so no name of a clip or file can become markup."""

import html
import re
from collections.abc import Sequence
from typing import Any

from harness.report.kit.text import to_file_name


class Markup(str):
    """Text that is HTML already and is not escaped again."""

    __slots__ = ()


VOID_ELEMENTS = frozenset({"br", "col", "img", "input", "link", "meta"})
"""Elements without an end tag."""
_CODE = re.compile(r"`([^`]+)`")


def tag(name: str, /, *children: Any, **attributes: Any) -> Markup:
    """An HTML element. Children are escaped unless they are Markup; None is left out.

    Attributes of None or False are left out. Trailing underscores of their names are dropped (`class_`), others become
    hyphens.
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
    """Several pieces as one; each is escaped unless it is Markup, and None is left out."""
    return Markup("".join(p if isinstance(p, Markup) else html.escape(str(p)) for p in parts if p is not None))


def scroll_box(content: Any, label: str) -> Markup:
    """A box whose content scrolls sideways, by keyboard too, when it is wider than the page."""
    return tag("div", content, class_="wide", tabindex="0", role="region", aria_label=label)


def details(title: Any, *content: Any, id_: str | None = None) -> Markup:
    """A section that is folded until the reader opens it."""
    return tag("details", tag("summary", title), *content, id_=id_)


def bullet_list(items: Sequence[Any]) -> Markup:
    """A bulleted list; nothing without items."""
    return tag("ul", *(tag("li", item) for item in items), class_="notes") if items else Markup()


def inline_code(text: str) -> Markup:
    """The text with everything between backticks set as code."""
    return join(*(tag("code", part) if n % 2 else part for n, part in enumerate(_CODE.split(text))))


def verdict_badge(verdict: str, mark: str) -> Markup:
    """A verdict as a mark and a word, so that it does not depend on colour alone."""
    sign = tag("span", mark, aria_hidden="true", class_="mark")
    return tag("span", sign, verdict, class_=f"verdict {to_file_name(verdict)}")


def _attribute(key: str) -> str:
    return key.rstrip("_").replace("_", "-")
