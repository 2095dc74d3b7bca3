"""Parses a page: its text, its elements, and whether each element is closed."""

import re
from collections.abc import Iterable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any


class Reader(HTMLParser):
    """Collects text and attributes; fails if elements are not closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []
        self.found: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        if tag not in ("meta", "br", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] != ["style"]:
            self.text.append(data)


def read(page: Path) -> Reader:
    reader = Reader()
    reader.feed(page.read_text(encoding="utf-8"))
    assert reader.open == []
    return reader


def text_of(page: Path) -> str:
    """The text of a page with every run of white space replaced by one blank."""
    return re.sub(r"\s+", " ", " ".join(read(page).text))


def section_ids(page: Path) -> list[str]:
    return [str(attributes["id"]) for name, attributes in read(page).found if name == "section"]


def count_pictures(page: Path) -> int:
    """Number of pictures, each of which has a text in its place."""
    pictures = [attributes for name, attributes in read(page).found if name in ("img", "svg")]
    return sum(bool(each.get("alt") or each.get("aria-label")) for each in pictures)


def numbers_in_order(text: str, *numbers: object) -> bool:
    """Whether the texts follow each other; a 95 % interval stands below its number, without brackets."""
    place = 0
    for number in numbers:
        for part in re.split(r"[()]", str(number)):
            place = text.find(part.strip(), place) + 1
            if not place:
                return False
    return True


def emptied(names: Iterable[str], value: object = ()) -> dict[str, Any]:
    """These fields of a record without content, for `dataclasses.replace`."""
    return dict.fromkeys(names, value)
