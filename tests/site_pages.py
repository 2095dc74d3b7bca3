"""Pages of the documentation site in a browser, their heights and faults: `python -m tests.site_pages [SITE]`.

`make docs` writes the site. The command needs playwright and chromium; HARNESS_CHROMIUM names another browser.
"""

import os
import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from tests.test_prose import ROOT

MOST_HEIGHT_PX = 30_000
"""At a width of 1400 px."""
VIEWS = ((1400, "light"), (700, "dark"))
"""Width [px] and colour scheme of the system."""
LOOK = """() => {
  const formulas = [...document.querySelectorAll('math')].map((m) => m.getBoundingClientRect().width);
  const size = [document.body.scrollHeight, document.documentElement.scrollWidth];
  const ground = getComputedStyle(document.body).backgroundColor;
  document.querySelectorAll('code, pre, math').forEach((e) => e.remove());
  const text = document.querySelector('[role=main]')?.innerText ?? '';
  return [...size, ground, formulas, text.match(/\\\\[a-z]{3,}|\\$/g) ?? []];
}"""


@dataclass
class SitePage:
    """What a browser shows of a page; lengths in px."""

    name: str
    height: int
    width: int
    ground: str
    formulas: list[float]
    """Widths of the formulas."""
    latex: list[str]
    """What is left of LaTeX in the text."""
    wrong: list[str] = field(default_factory=list)
    """Requests to other places, failed requests, and errors of scripts."""


class _Handler(SimpleHTTPRequestHandler):
    def log_message(self, *_: Any) -> None:
        pass


class _Server(ThreadingHTTPServer):
    def handle_error(self, *_: Any) -> None:
        """A browser that leaves a page closes its connections."""


@contextmanager
def served(site: Path) -> Iterator[str]:
    """The address at which this computer alone reads the site; the search of the theme needs one."""
    server = _Server(("127.0.0.1", 0), partial(_Handler, directory=str(site)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def look_at_pages(browser: Any, site: Path, width_px: int, scheme: str) -> list[SitePage]:
    """Every page of a site in a view of a width."""
    wrong: list[str] = []
    view = browser.new_page(viewport={"width": width_px, "height": 900}, color_scheme=scheme)
    view.set_default_timeout(240_000)  # as a busy machine needs
    seen = []
    with served(site) as address:
        view.on("request", lambda r: None if r.url.startswith((address, "data:")) else wrong.append(r.url))
        view.on("response", lambda r: wrong.append(r.url) if r.status >= 400 else None)
        view.on("pageerror", lambda error: wrong.append(str(error)))
        names = sorted(file.relative_to(site).as_posix() for file in site.rglob("*.html"))
        for name in (name for name in names if not name.startswith("gallery/")):  # those are pages of studies
            view.goto(f"{address}/{name}")
            height, width, ground, formulas, latex = view.evaluate(LOOK)
            seen.append(SitePage(name, height, width, ground, formulas, latex, list(wrong)))
            wrong.clear()
        view.close()
    return seen


def main() -> None:
    from playwright.sync_api import sync_playwright

    site = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "site"
    chromium = os.environ.get("HARNESS_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for width_px, scheme in VIEWS:
            for page in sorted(look_at_pages(browser, site, width_px, scheme), key=lambda each: each.height):
                faults = [*page.latex, *page.wrong, *(["scrolls sideways"] if page.width > width_px else [])]
                print(f"{width_px:5} {page.height:7,} {len(page.formulas):4} {page.name}  {', '.join(faults)}")


if __name__ == "__main__":
    main()
