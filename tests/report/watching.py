"""Opens a page in a browser and records what it does."""

from pathlib import Path
from typing import Any


def is_whole_and_quiet(browser: Any, page_file: Path, width: int) -> tuple[int, str]:
    """Opens the page: nothing may leave it, fail, or scroll it sideways. Number of pictures, and what is first read."""
    seen: list[str] = []
    opened = browser.new_page(viewport={"width": width, "height": 844})
    opened.on("request", lambda r: None if r.url.startswith(("data:", page_file.as_uri())) else seen.append(r.url))
    opened.on("console", lambda message: seen.append(message.text))
    opened.on("pageerror", lambda error: seen.append(str(error)))
    opened.goto(page_file.as_uri())
    opened.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    assert opened.evaluate("document.documentElement.scrollWidth") <= width, "the page scrolls sideways"
    opened.evaluate("Promise.all([...document.images].map((image) => image.decode()))")
    sizes = opened.evaluate("[...document.images].map((image) => [image.naturalWidth, image.naturalHeight, image.alt])")
    assert all(w > 0 and h > 0 and alt for w, h, alt in sizes)
    assert seen == []
    first = str(opened.inner_text("h1"))
    opened.close()
    return len(sizes), first
