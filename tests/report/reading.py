"""Parses a page: its text, its elements, and whether each element is closed."""

import re
from html.parser import HTMLParser
from pathlib import Path


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
